//! `divmerge simulate`

use std::path::PathBuf;

use anyhow::Result;
use clap::{Args, ValueEnum};
use divmerge::io::drive::{CLOUD_TOPIC, write_drive_in};
use divmerge::io::{CloudFormat, WriteOptions};
use divmerge::simulate::{Drive, Scene, Sensor};

use crate::annotate::Compress;
use crate::terminal::{frame_bar, grouped};
use crate::{Outcome, interrupt};

/// Write a simulated drive with truth as a recording
///
/// A ray-cast drive at ten frames a second. Its clouds carry `label` (SemanticKITTI's class) and
/// `true_instance`. The same seed gives the same bytes.
#[derive(Args)]
pub struct Arguments {
    /// The recording to write
    #[arg(short, long, value_name = "OUT", default_value = "simulated.mcap")]
    output: PathBuf,

    /// The sensor
    #[arg(long, default_value = "hdl-64e", help = format!("The sensor: {}", Sensor::names()))]
    sensor: Sensor,

    /// Where it drives: street, parking, crowd, hills or yard
    #[arg(long, default_value = "street")]
    scene: Scene,

    /// Messages of the recording
    #[arg(long, value_enum, default_value_t = Encoding::Ros2)]
    encoding: Encoding,

    /// Number of frames, a tenth of a second each
    #[arg(long, default_value_t = 50)]
    frames: usize,

    /// Chooses the objects and all noise
    #[arg(long, default_value_t = 1)]
    seed: u64,

    /// Compression of the recording
    #[arg(long, value_enum, default_value_t = Compress::Zstd)]
    compression: Compress,

    /// Replace an existing file
    #[arg(long)]
    force: bool,
}

/// Messages of clouds, and of the poses that go with them.
#[derive(Clone, Copy, ValueEnum)]
enum Encoding {
    /// sensor_msgs/msg/PointCloud2 in CDR
    Ros2,
    /// sensor_msgs/PointCloud2 of ROS 1
    Ros1,
    /// foxglove.PointCloud in protobuf
    FoxgloveProtobuf,
    /// foxglove.PointCloud in JSON
    FoxgloveJson,
    /// foxglove_msgs/msg/PointCloud in CDR
    FoxgloveRos2,
}

impl From<Encoding> for CloudFormat {
    fn from(encoding: Encoding) -> Self {
        match encoding {
            Encoding::Ros2 => CloudFormat::Ros2,
            Encoding::Ros1 => CloudFormat::Ros1,
            Encoding::FoxgloveProtobuf => CloudFormat::FoxgloveProtobuf,
            Encoding::FoxgloveJson => CloudFormat::FoxgloveJson,
            Encoding::FoxgloveRos2 => CloudFormat::FoxgloveRos2,
        }
    }
}

pub fn run(arguments: &Arguments) -> Result<Outcome> {
    interrupt::listen();
    crate::refuse_existing(&arguments.output, arguments.force)?;
    let drive = Drive::new(arguments.sensor, arguments.scene, arguments.seed);
    let options = WriteOptions {
        compression: arguments.compression.into(),
        force: arguments.force,
        ..WriteOptions::default()
    };
    let bar = frame_bar("simulating", arguments.frames as u64);
    let (format, frames) = (arguments.encoding.into(), arguments.frames);
    let bytes = write_drive_in(format, &drive, frames, &arguments.output, &options, |_| {
        bar.inc(1);
        interrupt::wish()
    })?;
    bar.finish_and_clear();
    println!(
        "wrote {} ({} bytes, {} clouds of {} in scene {} on {CLOUD_TOPIC})",
        arguments.output.display(),
        grouped(bytes),
        arguments.frames,
        arguments.sensor,
        arguments.scene,
    );
    Ok(Outcome::Done)
}
