//! Figures show what summaries say, and files hold what figures show.

mod synthetic;

use crate::figures::{self, Runs};
use crate::scene::{Figure, Mark, Panel, Sample};
use crate::style::{self, PALETTE};
use crate::write::{ReportedRun, write_report};
use std::collections::BTreeSet;
use std::fs;
use std::path::Path;
use synthetic::{DURATION_S, Kind, STAND, START_S, WALK, run};

/// How long after its start the hybrid law is judged.
const JUDGED_AFTER_S: f64 = 3.0;
/// Half a tick.
const SLACK_S: f64 = 0.0025;

fn figure(runs: &[ReportedRun], number: u32) -> Figure {
    let (drawn, left_out) = figures::all(&Runs(runs));
    let found = drawn.into_iter().find(|(found, _)| *found == number);
    found.map(|(_, figure)| figure).unwrap_or_else(|| panic!("figure {number} is left out: {left_out:?}"))
}

/// The lines of a panel that are no reference, each as (t, value).
fn lines(panel: &Panel) -> Vec<&[(f64, f64)]> {
    let lines = panel.marks.iter().filter_map(|mark| match mark {
        Mark::Series { points, stroke } if stroke.width_px == style::LINE_PX => Some(points.as_slice()),
        _ => None,
    });
    lines.collect()
}

/// Norm of the vector whose components are a panel's lines, from `from_s` on.
fn largest_norm(panel: &Panel, from_s: f64, to_s: f64) -> f64 {
    let components = lines(panel);
    assert_eq!(components.len(), 3, "{}", panel.title);
    let norm = |tick: usize| components.iter().map(|line| line[tick].1.powi(2)).sum::<f64>().sqrt();
    let is_meant = |tick: &usize| (from_s - SLACK_S..to_s).contains(&components[0][*tick].0);
    (0..components[0].len()).filter(is_meant).map(norm).fold(0.0, f64::max)
}

#[track_caller]
fn assert_close(drawn: f64, summary: f64) {
    assert!((drawn - summary).abs() <= 1e-9 * summary.abs(), "drawn {drawn}, in the summary {summary}");
    assert!(summary != 0.0, "this shows nothing");
}

#[test]
fn the_internal_forces_drawn_are_those_of_the_summary() {
    for (kind, number) in [(STAND, 14), (WALK, 18)] {
        let runs = [run("a", kind)];
        let figure = figure(&runs, number);
        assert_eq!(figure.panels.len(), 2 * runs[0].summary.internal.len());
        for (panels, row) in figure.panels.chunks(2).zip(&runs[0].summary.internal) {
            let [force, moment] = panels else { panic!("force and moment") };
            assert_eq!((&force.title, &moment.title), (&row.name, &row.name));
            let judged_s = START_S + JUDGED_AFTER_S;
            assert_close(largest_norm(force, judged_s, DURATION_S), row.peak_n);
            assert_close(largest_norm(moment, judged_s, DURATION_S), row.peak_nm);
            assert_close(largest_norm(force, START_S, START_S + SLACK_S), row.start_n);
            assert_close(largest_norm(moment, DURATION_S - 0.2, DURATION_S), row.end_nm);
            let first = if number == 14 {
                format!("start {:.2}", row.start_n)
            } else {
                format!("peak {:.2}", row.peak_n)
            };
            assert_eq!(force.note, format!("{first}, end {:.2} N", row.end_n));
        }
    }
}

#[test]
fn the_errors_drawn_are_those_of_the_summary() {
    let runs = [run("a", WALK)];
    let (figure, object) = (figure(&runs, 15), &runs[0].summary.object);
    let rows = [
        (1, object.position_rms_m, object.position_peak_m),
        (3, object.attitude_rms_rad, object.attitude_peak_rad),
    ];
    for (row, rms, peak) in rows {
        for (axis, panel) in figure.panels[3 * row..3 * row + 3].iter().enumerate() {
            let errors = || lines(panel)[0].iter().map(|point| point.1).filter(|error| error.is_finite());
            let mean_square = errors().map(|error| error * error).sum::<f64>() / errors().count() as f64;
            let unit = if row == 1 { "mm" } else { "mrad" };
            let (rms, peak) = (1e3 * rms[axis], 1e3 * peak[axis]);
            assert_eq!(panel.note, format!("RMS {rms:.2}, peak {peak:.2} {unit}"));
            if peak > 0.0 {
                assert_close(mean_square.sqrt(), rms);
                assert_close(errors().map(f64::abs).fold(0.0, f64::max), peak);
            }
        }
    }
}

#[test]
fn a_reference_lies_under_what_follows_it() {
    let runs = [run("a", WALK)];
    let x = &figure(&runs, 15).panels[0];
    let [Mark::Series { points: reference, .. }, Mark::Series { points: actual, .. }] = &x.marks[..] else {
        panic!("{:?}", x.marks.len());
    };
    let ((_, reference_m), (t, actual_m)) = (reference[1500], actual[1500]);
    // As the formulas of the run have it: Σa is fixed where the reference was at the start.
    assert!((reference_m - 0.1 * (t - START_S)).abs() < 1e-12);
    assert!((actual_m - reference_m).abs() < 3e-3 && actual_m != reference_m);
}

#[test]
fn where_nothing_is_controlled_nothing_is_followed() {
    let figure = figure(&[run("a", Kind { is_controlled: false, ..STAND })], 12);
    assert_eq!(figure.legend.len(), 1, "{:?}", figure.legend);
    for panel in &figure.panels {
        assert_eq!(panel.note, "");
        let [Mark::Series { points: reference, .. }, Mark::Series { points: actual, .. }] = &panel.marks[..]
        else {
            panic!("{:?}", panel.marks.len());
        };
        assert!(
            reference.iter().all(|point| point.1.is_nan()) && actual.iter().all(|point| point.1.is_finite())
        );
    }
}

#[test]
fn every_step_of_the_summary_leaves_its_sole_on_the_map() {
    let runs = [run("a", WALK)];
    let figure = figure(&runs, 16);
    for (robot, summary) in runs[0].summary.robots.iter().enumerate() {
        let colour = style::colour(robot);
        let soles = figure.panels[0]
            .marks
            .iter()
            .filter(|mark| matches!(mark, Mark::Outline { stroke, .. } if stroke.colour == colour));
        assert!(summary.steps >= 10, "{} steps", summary.steps);
        assert_eq!(soles.count() as u64, 2 + summary.steps);
    }
    // One outline of the object every two seconds, from 0 to 8.
    let outlines =
        |mark: &&Mark| matches!(mark, Mark::Outline { stroke, .. } if stroke.colour == style::FAINT_INK);
    assert_eq!(figure.panels[0].marks.iter().filter(outlines).count(), 5);
}

#[test]
fn the_zero_moment_point_is_seen_from_where_its_robot_started() {
    let runs = [run("a", WALK)];
    let figure = figure(&runs, 9);
    assert_eq!(figure.panels.len(), 4);
    for (robot, sign) in [(0, 1.0), (1, -1.0)] {
        // B faces A, so that what is ahead of the one is behind the other.
        let ahead = &figure.panels[2 * robot];
        let (t, last_m) = *lines(ahead)[0].last().expect("it is drawn");
        assert!((last_m - sign * 0.1 * (t - START_S)).abs() < 1e-12, "{last_m}");
        let margin_mm = 1e3 * runs[0].summary.robots[robot].zmp_margin_min_m;
        assert_eq!(ahead.note, format!("smallest margin {margin_mm:.2} mm"));
        let Mark::Band { lower, upper, .. } = &ahead.marks[0] else {
            panic!("the support region lies below")
        };
        // The soles of HRP-2 reach 0.1356 m ahead of its ankles and 0.1056 m behind them.
        assert!(
            (upper[0] - 0.1356).abs() < 1e-12 && (lower[0] + 0.1056).abs() < 1e-12,
            "{} {}",
            lower[0],
            upper[0]
        );
    }
}

#[test]
fn a_run_gets_the_figures_it_has_data_for_and_hears_why_the_others_are_left_out() {
    let numbers = |kind: Kind| {
        let (drawn, left_out) = figures::all(&Runs(&[run("a", kind)]));
        let reasons: Vec<_> = left_out.into_iter().map(|left| (left.number, left.reason)).collect();
        (drawn.iter().map(|(number, _)| *number).collect::<Vec<_>>(), reasons)
    };
    let (drawn, left_out) = numbers(STAND);
    assert_eq!(drawn, [9, 12, 14, 16]);
    assert_eq!(left_out[0], (15, "no robot takes a step: figure 12 shows the object".to_owned()));
    let (drawn, left_out) = numbers(WALK);
    assert_eq!(drawn, [9, 15, 16, 18]);
    assert_eq!(left_out[1], (14, "robots walk: figure 18 shows the internal forces".to_owned()));
    let (drawn, left_out) = numbers(Kind { ticks: 0, ..STAND });
    assert!(drawn.is_empty() && left_out.iter().all(|(_, reason)| reason == "the log holds no tick"));
}

#[test]
fn everything_drawn_lies_within_its_axes() {
    for runs in [vec![run("a", WALK)], vec![run("a", STAND), run("b", Kind { strength: 3.0, ..STAND })]] {
        for (number, figure) in figures::all(&Runs(&runs)).0 {
            for panel in &figure.panels {
                for value in panel.values().filter(|value| value.is_finite()) {
                    assert!(panel.y.range.contains(&value), "figure {number}, {}: {value}", panel.title);
                }
            }
        }
    }
}

#[test]
fn two_runs_lie_over_each_other_and_the_second_is_dashed() {
    let runs = [run("with", WALK), run("without", Kind { strength: 2.0, ..WALK })];
    for number in [9, 15, 16, 18] {
        let (one, two) = (figure(&runs[..1], number), figure(&runs, number));
        assert_eq!(one.panels.len(), two.panels.len(), "figure {number}");
        let dashed = |figure: &Figure| {
            let strokes = figure.panels.iter().flat_map(|panel| &panel.marks).filter(|mark| match mark {
                Mark::Series { stroke, .. } | Mark::Path { stroke, .. } => stroke.is_dashed,
                _ => false,
            });
            strokes.count()
        };
        assert_eq!(dashed(&one), 0);
        assert!(dashed(&two) >= two.panels.len(), "figure {number}");
        let named = |name: &str, is_dashed: bool| {
            two.legend.iter().any(|entry| {
                entry.text.ends_with(name)
                    && matches!(entry.sample, Sample::Line(stroke) if stroke.is_dashed == is_dashed)
            })
        };
        assert!(named("with", false) && named("without", true), "{:?}", two.legend);
    }
    let row = &figure(&runs, 18).panels[0];
    let [with, without] = [0, 1].map(|run| &runs[run].summary.internal[0]);
    assert_eq!(
        row.note,
        format!(
            "peak {:.2} | {:.2}, end {:.2} | {:.2} N",
            with.peak_n, without.peak_n, with.end_n, without.end_n
        )
    );
}

#[test]
fn every_limit_stands_beside_what_was_measured() {
    let folder = tempfile::tempdir().expect("a folder");
    let page = write_report(&[run("a", STAND)], folder.path()).expect("there is room");
    let html = fs::read_to_string(page).expect("it was written");
    for row in [
        "<tr><td>largest force</td><td>4.321 N</td><td>at most 5 N</td></tr>",
        "<tr><td>last force</td><td>5.432 N ✗</td><td>at most 5 N</td></tr>",
    ] {
        assert!(html.contains(row), "no {row}");
    }
}

/// The files of a report, by their names.
fn files(folder: &Path) -> BTreeSet<String> {
    let names = fs::read_dir(folder).expect("it was written").map(|entry| entry.expect("a file").file_name());
    names.map(|name| name.to_string_lossy().into_owned()).collect()
}

fn parse(text: &str) -> roxmltree::Document<'_> {
    let options = roxmltree::ParsingOptions { allow_dtd: true, ..roxmltree::ParsingOptions::default() };
    roxmltree::Document::parse_with_options(text, options)
        .unwrap_or_else(|error| panic!("{error}:\n{text:.200}"))
}

#[test]
fn a_report_is_a_page_and_two_files_for_each_figure() {
    let folder = tempfile::tempdir().expect("a folder");
    let out = folder.path().join("deep/report");
    let page = write_report(&[run("a", STAND)], &out).expect("there is room");
    let figures = ["figure-12", "figure-14", "figure-16", "figure-9"];
    let expected = figures.iter().flat_map(|name| [format!("{name}.png"), format!("{name}.svg")]);
    assert_eq!(files(&out), expected.chain(["index.html".to_owned()]).collect());

    let html = fs::read_to_string(page).expect("it was written");
    let page = parse(&html);
    let count = |name: &str| page.descendants().filter(|node| node.has_tag_name(name)).count();
    assert_eq!(count("figcaption"), figures.len());
    let svgs = page.descendants().filter(|node| node.tag_name().name() == "svg").count();
    assert_eq!(svgs, figures.len(), "they are in the page itself");
    for text in
        ["hold, seed 0", "Passed", "largest force", "A.right|A.left", "Figure 18: no robot takes a step"]
    {
        assert!(html.contains(text), "no {text:?}");
    }
}

#[test]
fn an_svg_is_well_formed_and_a_png_shows_the_same_figure() {
    let folder = tempfile::tempdir().expect("a folder");
    write_report(&[run("a", WALK)], folder.path()).expect("there is room");
    for number in [9, 15, 16, 18] {
        let svg =
            fs::read_to_string(folder.path().join(format!("figure-{number}.svg"))).expect("it is there");
        let svg = parse(&svg);
        assert_eq!(svg.root_element().attribute("width"), Some("1600"));
        let title: String = svg.descendants().filter_map(|node| node.text()).collect();
        assert!(title.contains(&format!("Figure {number}. ")));

        let png = fs::read(folder.path().join(format!("figure-{number}.png"))).expect("it is there");
        let mut reader = png::Decoder::new(std::io::Cursor::new(png)).read_info().expect("a PNG");
        let mut pixels = vec![0; reader.output_buffer_size().expect("of a known size")];
        let info = reader.next_frame(&mut pixels).expect("it is whole");
        assert_eq!(info.width, 1600);
        assert_eq!(Some(info.height.to_string().as_str()), svg.root_element().attribute("height"));
        let is_like = |pixel: &[u8]| pixel == [PALETTE[0].0, PALETTE[0].1, PALETTE[0].2];
        let (mut blue, mut white) = (0, 0);
        for pixel in pixels.chunks_exact(3) {
            blue += usize::from(is_like(pixel));
            white += usize::from(pixel == [255; 3]);
        }
        assert!(blue > 100, "figure {number}: {blue} pixels of its first colour");
        assert!(white > pixels.len() / 3 / 4, "figure {number}: {white} white pixels");
    }
}

#[test]
fn words_from_outside_stay_words() {
    let mut runs = [run("<b>&", WALK), run("b", WALK)];
    runs[0].summary.failures = vec!["a < b & \"c\"".to_owned()];
    runs[0].summary.passed = false;
    runs[1].damage = Some("the file ends <here>".to_owned());
    let folder = tempfile::tempdir().expect("a folder");
    let page = write_report(&runs, folder.path()).expect("there is room");
    let html = fs::read_to_string(page).expect("it was written");
    let page = parse(&html);
    let words: String = page.descendants().filter_map(|node| node.text()).collect();
    for text in ["<b>&", "a < b & \"c\"", "the figures end after 10.00 s: the file ends <here>."] {
        assert!(words.contains(text), "no {text:?}");
    }
}
