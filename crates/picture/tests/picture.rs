//! Pictures show what is there, and films hold every one of them. Wherever OpenGL is: in software, as a rule.

use mikoshi_config::{RunSpec, load_scenario};
use mikoshi_observation::Observation;
use mikoshi_picture::{Size, Snapshot, View, draw, film};
use mp4::{Mp4Reader, TrackType};
use std::fs::File;
use std::io::BufReader;
use std::path::Path;

const SIZE: Size = Size { width: 320, height: 240 };

fn run() -> RunSpec {
    let scenario = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../config/scenarios/hold.toml");
    let two = [("team".to_owned(), "two".to_owned())];
    let loaded = load_scenario(&scenario, &two, None).expect("it is one of the project's");
    mikoshi_resolution::resolve(&loaded).expect("it is in reach")
}

/// The beginning of the run, with the object moved along x.
fn moment(run: &RunSpec, ahead_m: f64) -> Snapshot {
    let mut observation = Observation::for_team(run.robots.len());
    let [x, y, z] = run.scenario.object.position_m;
    observation.object_truth.payload.pose = [x + ahead_m, y, z, 1.0, 0.0, 0.0, 0.0];
    for (frame, robot) in observation.robot_truth.iter_mut().zip(&run.robots) {
        frame.payload.base_pose = robot.initial_base_pose;
        let joints = frame.payload.joint_position_rad.iter_mut().zip(&robot.initial_posture_rad);
        joints.for_each(|(joint, angle)| *joint = *angle);
    }
    Snapshot::of(&observation, 0.005)
}

/// Red, green and blue of every pixel, row by row.
fn pixels_of(path: &Path) -> Vec<[u8; 3]> {
    let file = BufReader::new(File::open(path).expect("it was drawn"));
    let mut reader = png::Decoder::new(file).read_info().expect("a PNG file");
    let mut bytes = vec![0; reader.output_buffer_size().expect("it fits into memory")];
    let info = reader.next_frame(&mut bytes).expect("it is whole");
    assert_eq!((info.width, info.height), (SIZE.width, SIZE.height));
    bytes.chunks_exact(3).map(|pixel| [pixel[0], pixel[1], pixel[2]]).collect()
}

/// The object alone is red.
fn is_red([red, green, blue]: [u8; 3]) -> bool {
    red > 100 && u32::from(red) > 2 * u32::from(green.max(blue))
}

/// Columns between which the object is seen.
fn columns_of_object(pixels: &[[u8; 3]]) -> (usize, usize) {
    let columns = || (0..pixels.len()).filter(|&index| is_red(pixels[index])).map(|index| index % 320);
    (columns().min().expect("it is seen"), columns().max().expect("it is seen"))
}

#[test]
fn every_view_shows_the_object_and_every_robot() {
    let (run, folder) = (run(), tempfile::tempdir().expect("a folder"));
    let out = folder.path().join("picture.png");
    let moment = moment(&run, 0.0);
    for view in [View::Top, View::Side, View::Follow] {
        draw(&run, core::slice::from_ref(&moment), &moment, view, SIZE, &out).expect("there is OpenGL");
        let pixels = pixels_of(&out);
        let count = |is: fn([u8; 3]) -> bool| pixels.iter().filter(|pixel| is(**pixel)).count();
        // The first robot is blue, the second orange; floor and sky are nearly grey.
        let blue = count(|[red, _, blue]| blue > 80 && 3 * u32::from(blue) > 5 * u32::from(red));
        let orange =
            count(|[red, _, blue]| red > 80 && 3 * u32::from(red) > 5 * u32::from(blue)) - count(is_red);
        let red = count(is_red);
        assert!(red > 300 && blue > 300 && orange > 300, "{view:?}: {red} {blue} {orange}");
    }
}

#[test]
fn a_fixed_view_holds_all_of_the_way_and_does_not_move() {
    let (run, folder) = (run(), tempfile::tempdir().expect("a folder"));
    let out = folder.path().join("picture.png");
    let course = [moment(&run, 0.0), moment(&run, 2.0)];
    let seen = [View::Side, View::Follow].map(|view| {
        [0, 1].map(|index: usize| {
            draw(&run, &course, &course[index], view, SIZE, &out).expect("there is OpenGL");
            columns_of_object(&pixels_of(&out))
        })
    });
    let [[first, last], [followed, followed_on]] = seen;
    assert!(first.0 > 0 && last.1 < 319, "{first:?} {last:?}");
    assert!(last.0 > first.0 + 40, "{first:?} {last:?}");
    assert!(followed.0.abs_diff(followed_on.0) < 5, "{followed:?} {followed_on:?}");
}

#[test]
fn a_film_holds_every_picture_at_its_rate() {
    let (run, folder) = (run(), tempfile::tempdir().expect("a folder"));
    let out = folder.path().join("film.mp4");
    let course: Vec<_> = (0..12).map(|k| moment(&run, 0.02 * f64::from(k))).collect();
    film(&run, &course, View::Follow, SIZE, 25.0, &out).expect("there is OpenGL");
    let file = File::open(&out).expect("it was written");
    let length = file.metadata().expect("it is there").len();
    let mut reader = Mp4Reader::read_header(BufReader::new(file), length).expect("an MP4 file");
    let track = reader.tracks().values().next().expect("a track");
    assert_eq!(track.track_type().ok(), Some(TrackType::Video));
    assert_eq!((track.width(), track.height(), track.sample_count()), (320, 240, 12));
    assert!((track.frame_rate() - 25.0).abs() < 1e-9);
    let mut decoder = openh264::decoder::Decoder::new().expect("a decoder");
    let start = [0, 0, 0, 1];
    let (sequence, picture) =
        (track.sequence_parameter_set().expect("it is H.264"), track.picture_parameter_set().expect("it is"));
    let mut stream = [&start, sequence, &start, picture].concat();
    for index in 1..=12 {
        let sample = reader.read_sample(1, index).expect("it is there").expect("it is there");
        assert_eq!(sample.is_sync, index == 1);
        // A file has lengths where a stream has start codes.
        let mut rest = sample.bytes.as_ref();
        while let Some((length, tail)) = rest.split_first_chunk() {
            let (unit, tail) = tail.split_at(u32::from_be_bytes(*length) as usize);
            stream.extend_from_slice(&[&start, unit].concat());
            rest = tail;
        }
        let decoded = decoder.decode(&stream).expect("it is whole").expect("a picture");
        let mut bytes = vec![0; 3 * 320 * 240];
        decoded.write_rgb8(&mut bytes);
        let red = bytes.chunks_exact(3).filter(|pixel| is_red([pixel[0], pixel[1], pixel[2]])).count();
        assert!(red > 300, "picture {index}: {red} red pixels");
        stream.clear();
    }
}
