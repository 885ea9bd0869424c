//! A document whose every value knows where it was written: parsed, merged, overridden.

use crate::error::{KeyError, LoadConfigError};
use crate::origin::Origin;
use std::collections::BTreeMap;
use std::fs;
use std::path::Path;
use std::sync::Arc;
use toml::Spanned;
use toml::de::{DeString, DeTable, DeValue};

/// A value and its place.
#[derive(Clone, Debug)]
pub(crate) struct Node {
    pub origin: Origin,
    pub value: Value,
}

/// TOML's values. Dates have no use here, but must be named when they are found.
#[derive(Clone, Debug)]
pub(crate) enum Value {
    String(String),
    Integer(i128),
    Float(f64),
    Boolean(bool),
    Datetime(String),
    Array(Vec<Node>),
    Table(BTreeMap<String, Node>),
}

impl Node {
    /// Reads and parses a file.
    pub fn read(path: &Path) -> Result<Self, LoadConfigError> {
        let text = fs::read_to_string(path)
            .map_err(|source| LoadConfigError::ReadFile { path: path.to_owned(), source })?;
        let path: Arc<Path> = path.into();
        let line_at = |offset: usize| {
            let before = &text.as_bytes()[..offset.min(text.len())];
            Origin::Line(path.clone(), 1 + before.iter().filter(|byte| **byte == b'\n').count())
        };
        let table = DeTable::parse(&text).map_err(|error| LoadConfigError::ParseToml {
            origin: error.span().map_or(Origin::File(path.clone()), |span| line_at(span.start)),
            message: error.message().to_owned(),
        })?;
        let origin = Origin::File(path.clone());
        Ok(Self { origin, value: Value::from_table(table.get_ref(), &|span| line_at(span)) })
    }

    /// The value of an option: TOML if it is TOML, otherwise a string, so that `team=two` needs no
    /// quotes within quotes.
    pub fn from_option(typed: &str, value: &str) -> Self {
        let origin = Origin::Option(typed.into());
        let value = match DeValue::parse(value) {
            Ok(parsed) => Value::from_toml(parsed.get_ref(), &|_| origin.clone()),
            Err(_) => Value::String(value.to_owned()),
        };
        Self { origin, value }
    }

    /// This document with `under` beneath it: tables are joined key by key, and anything else of
    /// `under` is hidden by what lies above it.
    pub fn over(self, under: Self) -> Self {
        match (self, under.value) {
            (Self { origin, value: Value::Table(mut above) }, Value::Table(below)) => {
                for (key, node) in below {
                    let joined = match above.remove(&key) {
                        Some(higher) => higher.over(node),
                        None => node,
                    };
                    above.insert(key, joined);
                }
                Self { origin, value: Value::Table(above) }
            }
            (above, _) => above,
        }
    }

    /// Puts `node` at `path`, creating the tables on the way. Array elements must exist.
    pub fn set(&mut self, path: &str, node: Self) -> Result<(), KeyError> {
        let origin = node.origin.clone();
        let place = path.split('.').try_fold(self, |parent, segment| parent.child(segment, &origin));
        match place {
            Ok(place) => {
                *place = node;
                Ok(())
            }
            Err(problem) => Err(KeyError { origin, key: path.to_owned(), problem }),
        }
    }

    /// Takes the key at `path` away, as if nobody had written it.
    pub fn unset(&mut self, path: &str, origin: Origin) -> Result<(), KeyError> {
        let (parents, last) = path.rsplit_once('.').map_or((None, path), |(head, last)| (Some(head), last));
        let parent = match parents {
            Some(parents) => parents.split('.').try_fold(self, |node, segment| node.child(segment, &origin)),
            None => Ok(self),
        };
        let problem = match parent.map(|node| &mut node.value) {
            Ok(Value::Table(table)) => {
                table.remove(last);
                return Ok(());
            }
            Ok(other) => format!("found no value for a part of {}, expected one", other.describe()),
            Err(problem) => problem,
        };
        Err(KeyError { origin, key: path.to_owned(), problem })
    }

    /// The node below this one; a table that lacks it gets an empty table there.
    fn child(&mut self, segment: &str, origin: &Origin) -> Result<&mut Self, String> {
        if segment.is_empty() {
            return Err("found an empty part, expected names joined by single dots".to_owned());
        }
        match &mut self.value {
            Value::Table(table) => Ok(table
                .entry(segment.to_owned())
                .or_insert_with(|| Self { origin: origin.clone(), value: Value::Table(BTreeMap::new()) })),
            Value::Array(elements) => {
                let count = elements.len();
                let element = segment.parse::<usize>().ok().and_then(|index| elements.get_mut(index));
                element.ok_or_else(|| {
                    format!("found {segment:?}, expected the index of one of {count} elements")
                })
            }
            other => Err(format!("found a part of {}, expected a table there", other.describe())),
        }
    }

    /// The node at `path`.
    pub fn get(&self, path: &str) -> Option<&Self> {
        path.split('.').try_fold(self, |node, segment| match &node.value {
            Value::Table(table) => table.get(segment),
            Value::Array(elements) => elements.get(segment.parse::<usize>().ok()?),
            _ => None,
        })
    }

    /// Where `path` was written; if it was not, where the nearest table around it was.
    pub fn locate(&self, path: &str) -> Origin {
        let mut path = path;
        loop {
            if let Some(node) = self.get(path) {
                return node.origin.clone();
            }
            match path.rfind('.') {
                Some(end) => path = &path[..end],
                None => return self.origin.clone(),
            }
        }
    }

    /// An error about the value at `key`.
    pub fn key_error(&self, key: &str, problem: impl Into<String>) -> KeyError {
        KeyError { origin: self.locate(key), key: key.to_owned(), problem: problem.into() }
    }
}

impl Value {
    /// The value as an error shows it.
    pub fn describe(&self) -> String {
        match self {
            Self::String(text) => format!("{text:?}"),
            Self::Integer(number) => number.to_string(),
            Self::Float(number) => number.to_string(),
            Self::Boolean(truth) => truth.to_string(),
            Self::Datetime(date) => format!("the date {date}"),
            Self::Array(elements) => format!("an array of length {}", elements.len()),
            Self::Table(_) => "a table".to_owned(),
        }
    }

    fn from_table(table: &DeTable<'_>, at: &dyn Fn(usize) -> Origin) -> Self {
        let entry = |(key, value): (&Spanned<DeString<'_>>, &Spanned<DeValue<'_>>)| {
            let node = Node { origin: at(key.span().start), value: Self::from_toml(value.get_ref(), at) };
            (key.get_ref().to_string(), node)
        };
        Self::Table(table.iter().map(entry).collect())
    }

    fn from_toml(value: &DeValue<'_>, at: &dyn Fn(usize) -> Origin) -> Self {
        match value {
            DeValue::String(text) => Self::String(text.to_string()),
            DeValue::Integer(digits) => match i128::from_str_radix(digits.as_str(), digits.radix()) {
                Ok(number) => Self::Integer(number),
                Err(_) => Self::Float(f64::INFINITY), // more than 38 digits: refused as not finite
            },
            DeValue::Float(digits) => Self::Float(digits.as_str().parse().unwrap_or(f64::NAN)),
            DeValue::Boolean(truth) => Self::Boolean(*truth),
            DeValue::Datetime(date) => Self::Datetime(date.to_string()),
            DeValue::Array(elements) => Self::Array(
                elements
                    .iter()
                    .map(|element| Node {
                        origin: at(element.span().start),
                        value: Self::from_toml(element.get_ref(), at),
                    })
                    .collect(),
            ),
            DeValue::Table(table) => Self::from_table(table, at),
        }
    }
}
