//! Keys whose values are all tried, each with each.

use super::{leaves, text};
use crate::document::{Node, Value};
use crate::error::LoadConfigError;
use serde::{Deserialize, Serialize};

/// One axis of a grid: a key of the scenario and the values that it takes, with all that changes along.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct GridAxis {
    /// The key's full path.
    pub key: String,
    /// Its values.
    pub values: Vec<f64>,
    /// Keys that change with it: for each an array of as many values.
    #[serde(default)]
    pub with: toml::Table,
}

/// How many points a grid has: one without axes.
pub(crate) fn size(axes: &[GridAxis]) -> u64 {
    axes.iter().fold(1, |size: u64, axis| size.saturating_mul(axis.values.len().max(1) as u64))
}

/// The keys that change with an axis, and for each what was written as its values.
pub(crate) fn followers(document: &Node, axis: usize) -> Vec<(String, Vec<Node>)> {
    let mut found = Vec::new();
    if let Some(node) = document.get(&format!("grid.{axis}.with")) {
        leaves(node, "", &mut found);
    }
    let elements = |node: Node| match node.value {
        Value::Array(elements) => elements,
        // Found wrong by its length.
        _ => vec![],
    };
    found.into_iter().map(|(key, node)| (key, elements(node))).collect()
}

/// The axes with all that was written of them, to lie over a scenario.
#[derive(Clone, Debug)]
pub(super) struct Grid {
    axes: Vec<Axis>,
}

#[derive(Clone, Debug)]
struct Axis {
    values: Vec<f64>,
    /// The axis' own key first, with its values as they were written and as `--set` takes them.
    keys: Vec<(String, Vec<(Node, String)>)>,
}

impl Grid {
    /// Of a sweep that has been found good.
    pub(super) fn of(document: &Node, axes: &[GridAxis]) -> Result<Self, LoadConfigError> {
        let axis = |(index, axis): (usize, &GridAxis)| {
            let node = |value: usize| document.get(&format!("grid.{index}.values.{value}")).cloned();
            let own = (axis.key.clone(), (0..axis.values.len()).filter_map(node).collect());
            let with_text = |(key, nodes): (String, Vec<Node>)| {
                let pairs = nodes.into_iter().map(|node| text(&node).map(|text| (node, text)));
                Ok((key, pairs.collect::<Result<_, LoadConfigError>>()?))
            };
            let keys = core::iter::once(own).chain(followers(document, index)).map(with_text);
            Ok(Axis { values: axis.values.clone(), keys: keys.collect::<Result<_, LoadConfigError>>()? })
        };
        let axes = axes.iter().enumerate().map(axis);
        Ok(Self { axes: axes.collect::<Result<_, LoadConfigError>>()? })
    }

    /// Points in which every value of every axis occurs: the first one, and each of an axis' others with
    /// the first of all other axes.
    pub(super) fn samples(&self) -> Vec<Vec<(String, Node)>> {
        let first = vec![0; self.axes.len()];
        let along = self.axes.iter().enumerate().flat_map(|(axis, Axis { values, .. })| {
            let first = &first;
            (1..values.len()).map(move |value| {
                let mut place = first.clone();
                place[axis] = value;
                place
            })
        });
        core::iter::once(first.clone())
            .chain(along)
            .map(|place| self.entries(&place).map(|(key, (node, _))| (key.clone(), node.clone())).collect())
            .collect()
    }

    /// The axes' own values at a point, and all that lies over the scenario there. The last axis changes
    /// from point to point, the first one least often.
    pub(super) fn point(&self, index: u64) -> GridPoint {
        let mut rest = index;
        let mut place = vec![0; self.axes.len()];
        for (place, axis) in place.iter_mut().zip(&self.axes).rev() {
            let count = axis.values.len().max(1) as u64;
            *place = (rest % count) as usize;
            rest /= count;
        }
        let own = self.axes.iter().zip(&place);
        let parameters =
            own.filter_map(|(axis, &at)| Some((axis.keys.first()?.0.clone(), *axis.values.get(at)?)));
        let overrides = self.entries(&place).map(|(key, (_, text))| (key.clone(), text.clone()));
        GridPoint { parameters: parameters.collect(), overrides: overrides.collect() }
    }

    /// Every key with its value at a place, axis by axis.
    fn entries<'a>(&'a self, place: &'a [usize]) -> impl Iterator<Item = (&'a String, &'a (Node, String))> {
        let axes = self.axes.iter().zip(place);
        axes.flat_map(|(axis, &at)| {
            axis.keys.iter().filter_map(move |(key, values)| Some((key, values.get(at)?)))
        })
    }
}

/// One point of a grid.
#[derive(Clone, Debug)]
pub(super) struct GridPoint {
    pub parameters: Vec<(String, f64)>,
    pub overrides: Vec<(String, String)>,
}
