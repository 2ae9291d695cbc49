//! `divmerge simulate`

use std::path::PathBuf;

use anyhow::Result;
use clap::Args;
use divmerge::io::WriteOptions;
use divmerge::io::drive::{CLOUD_TOPIC, write_drive};
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
    let bytes = write_drive(&drive, arguments.frames, &arguments.output, &options, |_| {
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
