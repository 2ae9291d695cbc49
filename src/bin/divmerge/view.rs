//! `divmerge view`

use std::ops::ControlFlow;
use std::path::PathBuf;
use std::time::{Duration, Instant};

use anyhow::Result;
use clap::Args;
use divmerge::Error;
use divmerge::annotate::Event;
use divmerge::replay::replay;
use divmerge::view::Target;

use crate::arguments::{MethodArguments, SelectionArguments};
use crate::terminal::{byte_bar, grouped};
use crate::{Outcome, interrupt, viewer};

/// Show every step of a recording's frames in the Rerun viewer
///
/// Per frame: the cloud by class, component and instance, boxes, votes between components, points that
/// were dropped and why, the range image, and milliseconds per stage. Needs a divmerge built with
/// `--features rerun`; the output of `divmerge annotate` opens in a stock Rerun without it.
#[derive(Args)]
pub struct Arguments {
    /// The recording (MCAP)
    input: PathBuf,

    /// Write into a file that `rerun F.rrd` opens
    #[arg(long, value_name = "F.rrd", value_parser = viewer::rrd, conflicts_with_all = ["connect", "spawn"])]
    save: Option<PathBuf>,

    /// Send to a viewer that is running, as in rerun+http://127.0.0.1:9876/proxy
    #[arg(long, value_name = "URL", conflicts_with = "spawn")]
    connect: Option<String>,

    /// Start a viewer, or use the one that is running on this machine [default]
    #[arg(long)]
    spawn: bool,

    #[command(flatten)]
    selection: SelectionArguments,

    #[command(flatten)]
    method: MethodArguments,

    /// Replace an existing file
    #[arg(long)]
    force: bool,
}

pub fn run(arguments: &Arguments) -> Result<Outcome> {
    viewer::require_built()?;
    interrupt::listen();
    let target = target(arguments);
    if let Target::Save { path, force } = &target {
        crate::refuse_existing(path, *force)?;
    }
    let selection = arguments.selection.selection(&arguments.input)?;
    let method = arguments.method.method(&arguments.input)?;
    // Before anything is opened or started for it.
    selection.check(&arguments.input)?;
    let mut stream = viewer::open(&target, &arguments.input, &method)?;
    let bar = byte_bar("showing");
    let mut streaming = Duration::ZERO;
    let replayed = replay(&arguments.input, &selection, &method, &mut |event| match event {
        Event::Progress { bytes, total } => {
            bar.set_length(total);
            bar.set_position(bytes);
            match interrupt::wish() {
                ControlFlow::Continue(()) => Ok(()),
                ControlFlow::Break(()) => {
                    Err(Error::Interrupted { path: target.to_string().into() })
                }
            }
        }
        Event::Warning(warning) => {
            bar.suspend(|| eprintln!("warning: {}: {warning}", arguments.input.display()));
            stream.warn(warning)
        }
        Event::Frame(frame) => {
            let started = Instant::now();
            let logged = stream.log(&frame);
            streaming += started.elapsed();
            logged
        }
    });
    bar.finish_and_clear();
    let replayed = replayed?;
    let started = Instant::now();
    stream.finish()?;
    streaming += started.elapsed();
    println!(
        "{} frames to {target} ({:.1} frames per second, clustering aside)",
        grouped(replayed.frames),
        replayed.frames as f64 / streaming.as_secs_f64(),
    );
    if let Target::Save { path, .. } = &target {
        println!("open it with: rerun {}", path.display());
    }
    let is_complete = replayed.unreadable == 0 && !replayed.is_cut_off;
    Ok(if is_complete { Outcome::Done } else { Outcome::Incomplete })
}

fn target(arguments: &Arguments) -> Target {
    match (&arguments.save, &arguments.connect) {
        (Some(path), _) => Target::Save { path: path.clone(), force: arguments.force },
        (_, Some(url)) => Target::Connect(url.clone()),
        _ => Target::Spawn,
    }
}
