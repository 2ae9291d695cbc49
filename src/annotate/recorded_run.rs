//! A run as its output records it: parameters and options, as TOML, from which the run can be
//! repeated.

use std::path::Path;
use std::str::FromStr;

use super::config::{AnnotateConfig, Semantics};
use super::form::Form;
use super::metadata::METADATA_NAME;
use super::options::AnnotateOptions;
use super::tracking::{EgoMotionSource, TrackMode};
use super::types::{BoxedInstances, Flavor};
use crate::error::{Error, Result};
use crate::frames::{Assemble, FrameBoxes, TOLERANCE_NS, find_metadata};
use crate::messages::objects::ObjectKind;
use crate::parameter_file::{ParameterFile, RunOptions, plain_toml};
use crate::text::log_seconds;
use divmerge_core::cloud::SensorOrigin;
use divmerge_core::cloud::sensor_frame::SensorFrame;
use divmerge_core::cloud::taxonomy::Taxonomy;
use divmerge_core::parameters::ParameterSet;
use divmerge_recording::Compression;
use divmerge_recording::address::is_remote;

/// Key of the TOML in the metadata record [`METADATA_NAME`].
pub(super) const CONFIG_KEY: &str = "config";

impl AnnotateOptions {
    /// Every parameter of the run.
    pub fn parameters(&self) -> ParameterSet {
        ParameterSet {
            tracks: self.tracks.params,
            registration: self.tracks.registration,
            ego_motion: self.tracks.estimation.clone(),
            ..self.config.parameters()
        }
    }
}

/// The parameters of a run: of a TOML file, or of the run that wrote an annotated recording.
///
/// # Errors
/// Those of [`ParameterFile::read`]; [`Error::ParameterFile`] for a recording that no run of this
/// version annotated; those of [`find_metadata`].
pub fn read_run(path: &Path) -> Result<ParameterFile> {
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    if !name.contains(".mcap") && !is_remote(path) {
        return ParameterFile::read(path);
    }
    let wrong = |problem: String| Error::ParameterFile { path: path.to_owned(), problem };
    let metadata = find_metadata(path, |metadata| {
        metadata.name == METADATA_NAME && metadata.metadata.contains_key(CONFIG_KEY)
    })?;
    match metadata.as_ref().and_then(|metadata| metadata.metadata.get(CONFIG_KEY)) {
        Some(text) => ParameterFile::parse(text).map_err(wrong),
        None => Err(wrong(
            "holds no parameters: name a recording that `divmerge annotate` wrote, or a TOML file \
             (`divmerge params` prints one)"
                .to_owned(),
        )),
    }
}

/// The run as TOML.
pub(super) fn recorded_run(options: &AnnotateOptions) -> String {
    let mut run = Recorder::default();
    run.objects(&options.config);
    run.geometry(&options.config);
    run.output(options);
    plain_toml(&options.parameters(), &run.0)
}

/// Collects the options of a run.
#[derive(Default)]
struct Recorder(RunOptions);

impl Recorder {
    /// Notes an option with a value.
    fn give(&mut self, name: &str, value: impl ToString) {
        self.0.given.entry(name.to_owned()).or_default().push(value.to_string());
    }

    /// Notes an option without a value.
    fn switch(&mut self, name: &str, is_on: bool) {
        if is_on {
            self.0.given.insert(name.to_owned(), Vec::new());
        }
    }

    /// Notes an option that names a file.
    fn need(&mut self, name: &str, what: &str) {
        self.0.needs.insert(name.to_owned(), what.to_owned());
    }

    fn objects(&mut self, config: &AnnotateConfig) {
        match &config.semantics {
            Semantics::Auto => {}
            Semantics::Field(name) => self.give("semantics", format!("field:{name}")),
            Semantics::Ground => self.give("semantics", "ground"),
            Semantics::All => self.give("semantics", "all"),
            Semantics::Network(_) => {
                self.need("semantics", "onnx:MODEL.onnx, with the options of its network");
            }
            Semantics::Given(given) => match (given.topic(), given.tolerance_ns()) {
                (Some(topic), Some(tolerance_ns)) => {
                    self.give("semantics", format!("topic:{topic}"));
                    if tolerance_ns != TOLERANCE_NS {
                        self.give("tolerance", tolerance_ns as f64 * 1e-9);
                    }
                }
                _ => self.need("semantics", "labels:DIR"),
            },
        }
        let known = Taxonomy::named(&config.taxonomy.name) == Some(&config.taxonomy);
        match (config.is_taxonomy_given, known) {
            (false, _) => {}
            (true, true) => self.give("taxonomy", &config.taxonomy.name),
            (true, false) => self.need("taxonomy", "FILE"),
        }
        match &config.boxes {
            FrameBoxes::Nothing => {}
            FrameBoxes::Topic(boxes) => self.give("boxes", format!("topic:{}", boxes.topic())),
            FrameBoxes::Kitti(_) => self.need("boxes", "kitti:DIR, with --boxes-calibration PATH"),
        }
    }

    fn geometry(&mut self, config: &AnnotateConfig) {
        match (config.frames.sensor_frame, exact(&config.frames.sensor_frame)) {
            (SensorFrame::Auto, _) => {}
            (_, Some(text)) => self.give("sensor-frame", text),
            (frame, None) => self.need("sensor-frame", &format!("{frame}, rounded here")),
        }
        for origin in &config.frames.sensor_origins {
            // The shortest digits that are read back as the same number.
            debug_assert_eq!(SensorOrigin::from_str(&origin.to_string()).as_ref(), Ok(origin));
            self.give("sensor-origin", origin);
        }
        let crop = &config.crop;
        for (name, value) in [("min-range", crop.min_range), ("max-range", crop.max_range)] {
            value.into_iter().for_each(|metres| self.give(name, metres));
        }
        config.unit.iter().for_each(|unit| self.give("units", unit));
        crop.region.iter().for_each(|region| self.give("crop", region));
        match (crop.ego, config.ego.is_empty()) {
            (Some(block), _) => self.give("ego", block),
            (None, false) => self.give("ego", "auto"),
            (None, true) => {}
        }
    }

    fn output(&mut self, options: &AnnotateOptions) {
        options.topics.iter().for_each(|topic| self.give("topic", topic));
        for (name, ns) in [("from", options.from_ns), ("to", options.to_ns)] {
            ns.into_iter().for_each(|ns| self.give(name, format!("@{}", log_seconds(ns))));
        }
        match options.tracks.mode {
            TrackMode::Auto => {}
            TrackMode::On => self.give("track", "on"),
            TrackMode::Off => self.give("track", "off"),
        }
        if options.tracks.ego_motion != EgoMotionSource::Auto {
            self.give("ego-motion", &options.tracks.ego_motion);
        }
        match options.types.objects {
            Some(ObjectKind::Markers) => self.give("objects", "markers"),
            Some(ObjectKind::Detection3d) => self.give("objects", "detection3d"),
            Some(ObjectKind::Autoware) => self.give("objects", "autoware"),
            // What viewers draw beside Foxglove's clouds, and of no name.
            Some(ObjectKind::Scene) | None => {}
        }
        if options.types.boxed == BoxedInstances::All {
            self.give("objects", "all");
        }
        if options.types.flavor == Flavor::Foxglove {
            self.give("flavor", "foxglove");
        }
        if let Some(compression) = options.compression {
            let name = match compression {
                Compression::Zstd => "zstd",
                Compression::Lz4 => "lz4",
                Compression::None => "none",
            };
            self.give("compression", name);
        }
        match options.config.assemble {
            None => {}
            Some(Assemble::Auto) => self.give("assemble", "auto"),
            Some(Assemble::Messages(count)) => self.give("assemble", count),
            Some(Assemble::Span(ns)) => self.give("assemble", format!("{}s", ns as f64 * 1e-9)),
        }
        self.switch("unchecked", options.unchecked);
        self.switch("only", options.form == Form::Only);
        self.switch("in-place-fields", options.form == Form::InPlace);
    }
}

/// The frame of a sensor as a text that is read back as the very same; angles may need more digits
/// than [`SensorFrame`] shows, axes are none.
fn exact(frame: &SensorFrame) -> Option<String> {
    let is_same = |text: &String| SensorFrame::from_str(text).as_ref() == Ok(frame);
    const LETTERS: &str = "fblrud";
    let pairs = LETTERS.chars().flat_map(|x| LETTERS.chars().map(move |y| [x, y]));
    let axes = pairs.flat_map(|[x, y]| LETTERS.chars().map(move |z| format!("{x}{y}{z}")));
    let shown = frame.to_string();
    std::iter::once(shown).chain(axes).find(is_same).or_else(|| {
        let SensorFrame::Turned(turn) = frame else { return None };
        let (roll, pitch, yaw) = turn.euler_angles();
        let [roll, pitch, yaw] = [roll, pitch, yaw].map(f64::to_degrees);
        Some(format!("{roll},{pitch},{yaw}")).filter(is_same)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sensor_frames_are_recorded_to_the_last_bit_or_not_at_all() {
        for text in ["rfu", "flu", "frd", "tf", "none", "180,0,0", "0,1.5,-90", "0.1,0,0"] {
            let frame: SensorFrame = text.parse().unwrap();
            if let Some(exact) = exact(&frame) {
                assert_eq!(exact.parse::<SensorFrame>(), Ok(frame), "{text}");
            }
        }
        for text in ["rfu", "tf", "none", "180,0,0"] {
            assert!(exact(&text.parse().unwrap()).is_some(), "{text}");
        }
    }
}
