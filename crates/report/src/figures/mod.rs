//! The paper's figures, one file each.

mod internal_forces;
mod object_motion;
mod top_view;
mod zero_moment_point;

use crate::run_data::RunData;
use crate::scene::{Axis, Figure, LegendEntry, Mark, Stroke};
use crate::style;
use crate::write::ReportedRun;

/// Share of a colour in the lines of the second run.
const PALER: f64 = 0.65;

/// What a figure is made of: one run, or two laid over each other.
#[derive(Clone, Copy)]
pub struct Runs<'a>(pub &'a [ReportedRun]);

/// A figure that these runs have no data for.
#[derive(Clone, Debug)]
pub struct LeftOut {
    /// The paper's number.
    pub number: u32,
    /// Why.
    pub reason: String,
}

/// A figure, or why these runs have no data for it.
type MakeFigure = fn(&Runs<'_>) -> Result<Figure, String>;

/// Every figure that these runs have data for, by the paper's numbers, and why the others are left out.
pub fn all(runs: &Runs<'_>) -> (Vec<(u32, Figure)>, Vec<LeftOut>) {
    let (mut drawn, mut left_out) = (Vec::new(), Vec::new());
    let makers: [(u32, MakeFigure); 6] = [
        (9, zero_moment_point::figure),
        (12, object_motion::standing),
        (14, internal_forces::standing),
        (15, object_motion::walking),
        (16, top_view::figure),
        (18, internal_forces::walking),
    ];
    for (number, figure) in makers {
        match runs.check().and_then(|()| figure(runs)) {
            Ok(figure) => {
                let title = format!("Figure {number}. {}", figure.title);
                drawn.push((number, Figure { title, ..figure }));
            }
            Err(reason) => left_out.push(LeftOut { number, reason }),
        }
    }
    (drawn, left_out)
}

impl Runs<'_> {
    fn each(&self) -> impl Iterator<Item = (usize, &ReportedRun)> {
        self.0.iter().enumerate()
    }

    fn data(&self) -> impl Iterator<Item = &RunData> {
        self.0.iter().map(|run| &run.data)
    }

    /// Whether somebody takes a step, in any of them.
    fn walk(&self) -> bool {
        self.0.iter().any(|run| run.summary.robots.iter().any(|robot| robot.steps > 0))
    }

    /// Whether hybrid control starts, in any of them.
    fn are_controlled(&self) -> bool {
        self.data().any(RunData::is_controlled)
    }

    /// That there is something to draw.
    fn check(&self) -> Result<(), String> {
        let is_empty = self.data().any(|run| run.time_s.is_empty());
        if is_empty { Err("the log holds no tick".to_owned()) } else { Ok(()) }
    }

    /// `stroke` as the `index`-th run has it: the second is dashed, and paler.
    fn stroke(&self, index: usize, stroke: Stroke) -> Stroke {
        match index {
            0 => stroke,
            _ => Stroke { colour: style::tint(stroke.colour, PALER), is_dashed: true, ..stroke },
        }
    }

    /// The one line of the `index`-th run in a panel: colours tell runs apart.
    fn only_stroke(&self, index: usize) -> Stroke {
        Stroke { is_dashed: index > 0, ..Stroke::solid(style::colour(index)) }
    }

    /// The names that `name_of` finds in any of the runs, each once.
    fn names(&self, names_of: impl Fn(&RunData) -> Vec<&str>) -> Vec<String> {
        let mut names: Vec<String> = Vec::new();
        for name in self.data().flat_map(names_of) {
            if !names.iter().any(|known| known == name) {
                names.push(name.to_owned());
            }
        }
        names
    }

    /// A figure of each run's summary as a note: `peak 3.10 N`, or `peak 3.10 | 2.83 N`.
    fn note(&self, what: &str, figure: impl Fn(&ReportedRun) -> Option<f64>, unit: &str) -> String {
        let number = |run: &ReportedRun| {
            figure(run).map_or_else(|| "−".to_owned(), |value| format!("{value:.2}").replace('-', "−"))
        };
        let numbers: Vec<_> = self.0.iter().map(number).collect();
        format!("{what} {} {unit}", numbers.join(" | ")).trim_end().to_owned()
    }

    /// Which line is whose, where colours say something else; nothing of one run alone.
    fn legend(&self) -> Vec<LegendEntry> {
        if self.0.len() < 2 {
            return vec![];
        }
        let entry = |(index, run): (usize, &ReportedRun)| {
            LegendEntry::line(&run.label, self.stroke(index, Stroke::solid(style::INK)))
        };
        self.each().map(entry).collect()
    }

    /// Which line is whose, where each run has one: by the runs' names, or `what` of one run alone.
    fn legend_of_lines(&self, what: &str) -> Vec<LegendEntry> {
        let entry = |(index, run): (usize, &ReportedRun)| {
            let name = if self.0.len() < 2 { what.to_owned() } else { format!("{what}, {}", run.label) };
            LegendEntry::line(name, self.only_stroke(index))
        };
        self.each().map(entry).collect()
    }

    /// Time, from the start to the end of the longer run.
    fn time_axis(&self) -> Axis {
        let end_s = self.data().map(RunData::end_s).fold(0.0, f64::max);
        Axis { label: "time [s]".to_owned(), range: 0.0..end_s }
    }

    /// When the hybrid law starts, in each run where it does.
    fn starts(&self) -> Vec<Mark> {
        let start = |(index, run): (usize, &ReportedRun)| {
            let x = run.data.hybrid_start_s?;
            Some(Mark::Vertical { x, stroke: self.stroke(index, Stroke::thin(style::INK)) })
        };
        self.each().filter_map(start).collect()
    }

    /// Which runs these are.
    fn subtitle(&self) -> String {
        let mut titles: Vec<_> = self.data().map(RunData::title).collect();
        titles.dedup();
        titles.join(" | ")
    }

    /// What the captions end with.
    fn caption_end(&self) -> String {
        match self.0 {
            [first, second] => format!(" Solid: {}; dashed: {}.", first.label, second.label),
            _ => String::new(),
        }
    }
}

/// `A`, `A and B`, `A, B and C`.
fn list(names: &[String]) -> String {
    match names {
        [] => String::new(),
        [name] => name.clone(),
        [rest @ .., last] => format!("{} and {last}", rest.join(", ")),
    }
}
