//! Pictures as an MP4 file: H.264, which every player shows.

use crate::Size;
use crate::error::PictureError;
use bytes::Bytes;
use mp4::{AvcConfig, MediaConfig, Mp4Config, Mp4Sample, Mp4Writer, TrackConfig, TrackType};
use openh264::OpenH264API;
use openh264::encoder::{Encoder, EncoderConfig, FrameRate, FrameType, IntraFramePeriod, RateControlMode};
use openh264::formats::{RgbSliceU8, YUVBuffer};
use std::fs::File;
use std::io::BufWriter;
use std::path::{Path, PathBuf};

/// A player can begin at one picture a second.
const ENTRY_S: f64 = 1.0;
/// Parts of a millisecond, so that every usual rate has whole durations.
const TIMESCALE: u32 = 90_000;
/// Kinds of units in a stream, by the lowest five bits of their first byte.
const SEQUENCE_PARAMETERS: u8 = 7;
const PICTURE_PARAMETERS: u8 = 8;

pub struct Film {
    path: PathBuf,
    size: Size,
    encoder: Encoder,
    writer: Mp4Writer<BufWriter<File>>,
    has_track: bool,
    pictures: u64,
    /// How long a picture is seen, in parts of the timescale.
    duration: u32,
}

impl Film {
    /// Width and height are even.
    pub fn create(path: &Path, size: Size, pictures_hz: f64) -> Result<Self, PictureError> {
        // Off: every picture gets the bits that it needs.
        let config = EncoderConfig::new()
            .rate_control_mode(RateControlMode::Off)
            .max_frame_rate(FrameRate::from_hz(pictures_hz as f32))
            .intra_frame_period(IntraFramePeriod::from_num_frames((ENTRY_S * pictures_hz).ceil() as u32))
            .skip_frames(false);
        let encoder = Encoder::with_api_config(OpenH264API::from_source(), config);
        let failed = |source| PictureError::WriteFile { path: path.to_owned(), source };
        let file = BufWriter::new(File::create(path).map_err(failed)?);
        let container = Mp4Config {
            major_brand: (*b"isom").into(),
            minor_version: 512,
            compatible_brands: [*b"isom", *b"iso2", *b"avc1", *b"mp41"].map(Into::into).to_vec(),
            timescale: TIMESCALE,
        };
        Ok(Self {
            path: path.to_owned(),
            size,
            encoder: encoder.map_err(|error| PictureError::Encode(error.to_string()))?,
            writer: Mp4Writer::write_start(file, &container).map_err(|error| cant_write(path, error))?,
            has_track: false,
            pictures: 0,
            duration: (f64::from(TIMESCALE) / pictures_hz).round() as u32,
        })
    }

    /// Adds a picture: rows of red, green and blue.
    pub fn add(&mut self, rgb: &[u8]) -> Result<(), PictureError> {
        let size = (self.size.width as usize, self.size.height as usize);
        let picture = YUVBuffer::from_rgb8_source(RgbSliceU8::new(rgb, size));
        let stream =
            self.encoder.encode(&picture).map_err(|error| PictureError::Encode(error.to_string()))?;
        let is_entry = matches!(stream.frame_type(), FrameType::IDR | FrameType::I);
        let (mut bytes, mut parameters) = (vec![], (None, None));
        for layer in (0..stream.num_layers()).filter_map(|index| stream.layer(index)) {
            for unit in (0..layer.nal_count()).filter_map(|index| layer.nal_unit(index)) {
                let unit = without_start_code(unit);
                match unit.first().map(|head| head & 0x1f) {
                    Some(SEQUENCE_PARAMETERS) => parameters.0 = Some(unit.to_vec()),
                    Some(PICTURE_PARAMETERS) => parameters.1 = Some(unit.to_vec()),
                    _ => {
                        // A file has lengths where a stream has start codes.
                        bytes.extend_from_slice(&(unit.len() as u32).to_be_bytes());
                        bytes.extend_from_slice(unit);
                    }
                }
            }
        }
        if let ((Some(sequence), Some(picture)), false) = (parameters, self.has_track) {
            self.add_track(sequence, picture)?;
        }
        let sample = Mp4Sample {
            start_time: self.pictures * u64::from(self.duration),
            duration: self.duration,
            rendering_offset: 0,
            is_sync: is_entry,
            bytes: Bytes::from(bytes),
        };
        self.pictures += 1;
        self.writer.write_sample(1, &sample).map_err(|error| cant_write(&self.path, error))
    }

    fn add_track(&mut self, seq_param_set: Vec<u8>, pic_param_set: Vec<u8>) -> Result<(), PictureError> {
        let too_large = |_| PictureError::Encode("a picture of more than 65535 pixels".to_owned());
        let width = u16::try_from(self.size.width).map_err(too_large)?;
        let height = u16::try_from(self.size.height).map_err(too_large)?;
        let track = TrackConfig {
            track_type: TrackType::Video,
            timescale: TIMESCALE,
            language: "und".to_owned(),
            media_conf: MediaConfig::AvcConfig(AvcConfig { width, height, seq_param_set, pic_param_set }),
        };
        self.has_track = true;
        self.writer.add_track(&track).map_err(|error| cant_write(&self.path, error))
    }

    /// Closes the file.
    pub fn finish(mut self) -> Result<(), PictureError> {
        if self.pictures == 0 {
            return Err(PictureError::Empty);
        }
        self.writer.write_end().map_err(|error| cant_write(&self.path, error))?;
        let flushed = self.writer.into_writer().into_inner().map(|_| ());
        flushed.map_err(|error| PictureError::WriteFile { path: self.path, source: error.into_error() })
    }
}

fn cant_write(path: &Path, error: mp4::Error) -> PictureError {
    PictureError::WriteFile { path: path.to_owned(), source: std::io::Error::other(error) }
}

/// Streams open each unit by zeros and a one.
fn without_start_code(unit: &[u8]) -> &[u8] {
    let start = unit.iter().position(|byte| *byte != 0).unwrap_or_default();
    unit.get(start + 1..).unwrap_or_default()
}
