//! A live run as a page, as a browser shows it.

#![allow(missing_docs)]

mod browser;

use browser::{Browser, Picture};
use mikoshi_tests::programs::mikoshi;
use mikoshi_tests::run::Results;
use mikoshi_tests::scenarios::of_project;
use std::io::{BufRead, BufReader};
use std::process::{Child, Stdio};
use std::{env, fs};

const WIDTH: u32 = 1600;
const HEIGHT: u32 = 900;
/// Where the scene is on the page: left, right, upper and lower edge.
const SCENE: [usize; 4] = [0, 998, 52, 750];
/// Where the plots are.
const PLOTS: [usize; 4] = [1004, 1596, 52, 860];
/// The eye's angle of view from its lower to its upper edge, as Rerun has it.
const VIEW_RAD: f64 = 55.0 * core::f64::consts::PI / 180.0;
/// As in the layout, seen from the object at first.
const OBJECT_M: [f64; 3] = [0.0, 0.0, 0.96];
const EYE_M: [f64; 3] = [1.95, -2.6, 1.3];
const TARGET_M: [f64; 3] = [0.05, 0.05, -0.3];
/// Chest of each robot while the team has not got far, and its colour.
const ROBOTS: [([f64; 3], [u8; 3]); 4] = [
    ([-0.65, 0.45, 0.9], [70, 130, 255]),
    ([-0.65, -0.45, 0.9], [255, 120, 60]),
    ([0.65, -0.45, 0.9], [60, 200, 90]),
    ([0.65, 0.45, 0.9], [225, 80, 215]),
];

/// A run that shows itself.
struct Shown {
    run: Child,
    page: String,
}

impl Shown {
    /// Four robots who carry, slowly, for as long as anybody looks.
    fn start(results: &Results) -> Self {
        let mut run = mikoshi()
            .args(["run", "--quiet", "--no-log", "--viewer", "--force", "--out"])
            .arg(results.path())
            .arg(of_project("transport"))
            .args(["--set", "duration_s=3600", "--set", "motion.random.duration_s=3498"])
            .env_remove("DISPLAY")
            .env_remove("WAYLAND_DISPLAY")
            .stdin(Stdio::null())
            .stdout(Stdio::null())
            .stderr(Stdio::piped())
            .spawn()
            .expect("it can be started");
        let mut said = BufReader::new(run.stderr.take().expect("it was asked for"));
        let mut line = String::new();
        said.read_line(&mut line).expect("it says where the page is");
        let page = line.strip_prefix("viewer: ").unwrap_or_else(|| panic!("{line}"));
        Self { page: page.trim().to_owned(), run }
    }
}

impl Drop for Shown {
    fn drop(&mut self) {
        // The viewer ends with it, and services with nobody to serve do.
        let _ = rustix::process::kill_process(
            rustix::process::Pid::from_child(&self.run),
            rustix::process::Signal::TERM,
        );
        let _ = self.run.wait();
    }
}

/// Where a point of the world is in the picture.
fn projected(point: [f64; 3]) -> [f64; 2] {
    let [eye, target] =
        [EYE_M, TARGET_M].map(|at| core::array::from_fn::<f64, 3, _>(|i| OBJECT_M[i] + at[i]));
    let minus = |a: [f64; 3], b: [f64; 3]| core::array::from_fn::<f64, 3, _>(|i| a[i] - b[i]);
    let dot = |a: [f64; 3], b: [f64; 3]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
    let cross = |a: [f64; 3], b: [f64; 3]| {
        [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
    };
    let unit = |a: [f64; 3]| a.map(|part| part / dot(a, a).sqrt());
    let ahead = unit(minus(target, eye));
    let right = unit(cross(ahead, [0.0, 0.0, 1.0]));
    let up = cross(right, ahead);
    let seen = minus(point, eye);
    let [left_px, right_px, upper_px, lower_px] = SCENE.map(|edge| edge as f64);
    let focal_px = 0.5 * (lower_px - upper_px) / (0.5 * VIEW_RAD).tan();
    let [x, y] = [right, up].map(|axis| focal_px * dot(seen, axis) / dot(seen, ahead));
    [0.5 * (left_px + right_px) + x, 0.5 * (upper_px + lower_px) - y]
}

fn is_in([left, right, upper, lower]: [usize; 4], (x, y): (usize, usize)) -> bool {
    (left..right).contains(&x) && (upper..lower).contains(&y)
}

/// How alike two colours are but for their brightness: the cosine of the angle between them.
fn likeness(a: [u8; 3], b: [u8; 3]) -> f64 {
    // Grey is no colour: what is left without it counts.
    let hue = |color: [u8; 3]| {
        let color = color.map(f64::from);
        let grey = color.iter().sum::<f64>() / 3.0;
        color.map(|part| part - grey)
    };
    let (a, b) = (hue(a), hue(b));
    let dot = |a: &[f64; 3], b: &[f64; 3]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
    let size = |a: &[f64; 3]| dot(a, a).sqrt();
    if size(&a) < 25.0 { 0.0 } else { dot(&a, &b) / (size(&a) * size(&b)) }
}

/// The middle of all that has this colour in the scene, and how much of it there is.
fn found(picture: &Picture, color: [u8; 3]) -> ([f64; 2], usize) {
    let pixels = picture.pixels().filter(|(at, pixel)| is_in(SCENE, *at) && likeness(*pixel, color) > 0.985);
    let (mut sum, mut count) = ([0.0; 2], 0);
    for ((x, y), _) in pixels {
        sum = [sum[0] + x as f64, sum[1] + y as f64];
        count += 1;
    }
    (sum.map(|sum| sum / f64::max(1.0, count as f64)), count)
}

/// Every robot that is not where it should be.
fn missing(picture: &Picture) -> Vec<String> {
    let mut missing = vec![];
    for (index, (chest, color)) in ROBOTS.into_iter().enumerate() {
        let (expected, (at, count)) = (projected(chest), found(picture, color));
        let off = (at[0] - expected[0]).hypot(at[1] - expected[1]);
        if count < 1000 || off > 70.0 {
            missing
                .push(format!("robot {index}: {count} pixels about {at:.0?}, expected about {expected:.0?}"));
        }
    }
    missing
}

fn share_that_differs(one: &Picture, other: &Picture, area: [usize; 4]) -> f64 {
    let differs = |(a, b): (((usize, usize), [u8; 3]), ((usize, usize), [u8; 3]))| {
        is_in(area, a.0).then(|| a.1.iter().zip(b.1).any(|(a, b)| a.abs_diff(b) > 24))
    };
    let (mut differing, mut all) = (0, 0);
    for differs in one.pixels().zip(other.pixels()).filter_map(differs) {
        differing += usize::from(differs);
        all += 1;
    }
    f64::from(differing as u32) / f64::from(all as u32)
}

/// Leaves a picture where somebody wants to look at it.
fn keep(picture: &Picture, name: &str) {
    if let Some(folder) = env::var_os("MIKOSHI_PICTURES") {
        let folder = std::path::PathBuf::from(folder);
        fs::create_dir_all(&folder).expect("a folder");
        fs::write(folder.join(name), &picture.png).expect("it can be written");
    }
}

#[test]
fn a_page_shows_four_robots_where_they_are_and_plots_that_move_and_asks_nobody_else() {
    let results = Results::new();
    let shown = Shown::start(&results);
    let mut browser = Browser::open(&format!("{}?renderer=webgl", shown.page), WIDTH, HEIGHT);
    let mut first = browser.picture();
    // Each picture takes the browser a moment; this many, and it is broken.
    for _ in 0..300 {
        if missing(&first).is_empty() {
            break;
        }
        first = browser.picture();
    }
    keep(&first, "first.png");
    let missing_first = missing(&first);
    assert!(missing_first.is_empty(), "{missing_first:#?}\n{:#?}", browser.complaints);
    let mut second = browser.picture();
    for _ in 0..300 {
        if share_that_differs(&first, &second, PLOTS) > 0.005 {
            break;
        }
        second = browser.picture();
    }
    keep(&second, "second.png");
    let moved = share_that_differs(&first, &second, PLOTS);
    assert!(moved > 0.005, "plots stand still: {moved}");
    let missing_second = missing(&second);
    assert!(missing_second.is_empty(), "{missing_second:#?}");
    let is_ours = |address: &String| {
        ["http://127.0.0.1:", "data:", "blob:"].iter().any(|ours| address.starts_with(ours))
    };
    let others: Vec<_> = browser.requests.iter().filter(|address| !is_ours(address)).collect();
    assert!(others.is_empty(), "the page asks {others:#?}");
    assert!(browser.requests.iter().any(|address| address.ends_with(".wasm")), "{:#?}", browser.requests);
}
