//! How many frames the recorder can write, beside how many a run has.

use crate::recording::Recording;
use crate::rounds::{Spread, time_us};
use mikoshi_observation::LogWriter;
use serde::Serialize;

/// As often the whole recording is written.
const REPETITIONS: usize = 7;

/// What the recorder can do.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct Throughput {
    /// Frames that it can write \[1/s\], in the median of all times.
    pub frames_per_s: f64,
    /// Payloads that it can write \[MB/s\].
    pub megabytes_per_s: f64,
    /// Frames that this team has in a second of its time \[1/s\].
    pub needed_frames_per_s: f64,
    /// Payloads that this team has in a second of its time \[MB/s\].
    pub needed_megabytes_per_s: f64,
    /// Size of the file over that of the payloads in it.
    pub packed_to: f64,
    /// Time to write all frames of a tick \[µs\].
    pub tick_us: Spread,
}

/// Writes the recording into a file again.
pub fn measure(recording: &Recording) -> Throughput {
    let (mut frames, mut bytes) = (0, 0);
    for tick in &recording.ticks {
        tick.for_each_payload(|payload| {
            frames += 1;
            bytes += payload.bytes.len();
        });
    }
    let folder = tempfile::tempdir().expect("a folder");
    let (mut wholes, mut ticks) = (vec![], vec![]);
    for repetition in 0..REPETITIONS {
        let path = folder.path().join(format!("{repetition}.mcap"));
        let mut log = LogWriter::create(&path, &recording.run).expect("a new file");
        let whole_us = time_us(|| {
            for tick in &recording.ticks {
                ticks.push(time_us(|| log.write(tick).expect("there is room")));
            }
            log.finish().expect("there is room");
        });
        wholes.push(whole_us * 1e-6);
    }
    let whole_s = Spread::of(wholes).median;
    let run_s = recording.ticks.len() as f64 * recording.run.scenario.control_period_s;
    let (frames, megabytes) = (f64::from(frames), bytes as f64 * 1e-6);
    Throughput {
        frames_per_s: frames / whole_s,
        megabytes_per_s: megabytes / whole_s,
        needed_frames_per_s: frames / run_s,
        needed_megabytes_per_s: megabytes / run_s,
        packed_to: recording.file_bytes as f64 * 1e-6 / megabytes,
        tick_us: Spread::of(ticks),
    }
}
