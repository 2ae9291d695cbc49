//! `divmerge simulate`

use std::path::PathBuf;

use anyhow::Result;
use clap::Args;

use crate::cli::arguments::values::{COMPRESSIONS, NamedValue, one_of};
use crate::cli::exit::Outcome;
use crate::cli::interrupt;
use crate::cli::output::Outputs;
use crate::cli::progress::frame_bar;
use crate::cli::text::{counted, grouped};
use crate::datasets::drive::{CLOUD_TOPIC, write_drive_in};
use crate::error::spelling::did_you_mean;
use crate::messages::clouds::CloudFormat;
use crate::recording::{Compression, WriteOptions};
use crate::simulate::{Drive, Scene, Sensor};

/// Write a simulated drive with truth as a recording
///
/// The drive is ray-cast at ten frames per second. Its clouds have the fields `label`
/// (SemanticKITTI's class) and `true_instance`. The same seed gives the same bytes.
#[derive(Args)]
pub struct Arguments {
    /// The recording to write
    #[arg(short, long, value_name = "OUT", default_value = "simulated.mcap")]
    output: PathBuf,

    /// The sensor
    #[arg(long, default_value = "hdl-64e", value_parser = sensor)]
    #[arg(help = format!("The sensor: {}", Sensor::names()))]
    sensor: Sensor,

    /// The scene
    #[arg(long, default_value = "street", value_parser = scene)]
    #[arg(help = format!("The scene: {}", Scene::names()))]
    scene: Scene,

    /// Message types of the recording
    #[arg(long, default_value = "ros2", value_parser = one_of(ENCODINGS))]
    encoding: CloudFormat,

    /// Number of frames, a tenth of a second each
    #[arg(long, default_value_t = 50)]
    frames: usize,

    /// Random seed of objects and noise
    #[arg(long, default_value_t = 1)]
    seed: u64,

    /// Compression of the recording
    #[arg(long, default_value = "zstd", value_parser = one_of(COMPRESSIONS))]
    compression: Compression,

    /// Replace an existing file
    #[arg(long)]
    force: bool,
}

fn sensor(text: &str) -> Result<Sensor, String> {
    let names = Sensor::ALL.map(|sensor| sensor.to_string());
    text.parse().map_err(|problem: String| problem + &did_you_mean(text, &names))
}

fn scene(text: &str) -> Result<Scene, String> {
    let names = Scene::ALL.map(|scene| scene.to_string());
    text.parse().map_err(|problem: String| problem + &did_you_mean(text, &names))
}

/// Message types of clouds and of the poses that go with them.
const ENCODINGS: &[NamedValue<CloudFormat>] = &[
    ("ros2", "sensor_msgs/msg/PointCloud2 in CDR", CloudFormat::Ros2),
    ("ros1", "sensor_msgs/PointCloud2 of ROS 1", CloudFormat::Ros1),
    ("foxglove-protobuf", "foxglove.PointCloud in protobuf", CloudFormat::FoxgloveProtobuf),
    ("foxglove-json", "foxglove.PointCloud in JSON", CloudFormat::FoxgloveJson),
    ("foxglove-ros2", "foxglove_msgs/msg/PointCloud in CDR", CloudFormat::FoxgloveRos2),
];

pub fn run(arguments: &Arguments) -> Result<Outcome> {
    interrupt::listen();
    let output = Outputs::new([], arguments.force).recording(&arguments.output)?;
    let drive = Drive::new(arguments.sensor, arguments.scene, arguments.seed);
    let options = WriteOptions {
        compression: arguments.compression,
        force: output.force(),
        ..WriteOptions::default()
    };
    let bar = frame_bar("simulating", arguments.frames as u64);
    let (format, frames) = (arguments.encoding, arguments.frames);
    let bytes = write_drive_in(&drive, (format, frames), output.path(), &options, |_| {
        bar.inc(1);
        interrupt::check()
    })?;
    bar.finish_and_clear();
    println!(
        "wrote {} ({} bytes, {} of {} in scene {} on {CLOUD_TOPIC})",
        output.path().display(),
        grouped(bytes),
        counted(arguments.frames as u64, "cloud"),
        arguments.sensor,
        arguments.scene,
    );
    Ok(Outcome::Done)
}
