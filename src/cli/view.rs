//! `divmerge view`

use std::path::PathBuf;
use std::time::{Duration, Instant};

use anyhow::Result;
use clap::Args;

use crate::annotate::{RunEvent, for_each_frame};
use crate::cli::arguments::method::MethodArguments;
use crate::cli::arguments::selection::SelectionArguments;
use crate::cli::exit::Outcome;
use crate::cli::output::{Outputs, rrd};
use crate::cli::progress::RecordingProgress;
use crate::cli::text::counted;
use crate::cli::{interrupt, viewer};
use crate::view::Target;

/// Show every step of the clustering in the Rerun viewer
///
/// For each frame: the cloud by class, component and instance, boxes, votes between components,
/// points without an instance and why, the range image, and the time of each stage. Needs a
/// divmerge built with `--features rerun`; without it, a stock Rerun opens the output of `divmerge
/// annotate`.
#[derive(Args)]
pub struct Arguments {
    /// The recording (MCAP)
    input: PathBuf,

    /// Write to a file for `rerun F.rrd`
    #[arg(long, value_name = "F.rrd", value_parser = rrd)]
    #[arg(conflicts_with_all = ["connect", "spawn"])]
    save: Option<PathBuf>,

    /// Send to a running viewer, as in rerun+http://127.0.0.1:9876/proxy
    #[arg(long, value_name = "URL", conflicts_with = "spawn")]
    connect: Option<String>,

    /// Use the viewer running on this machine, or start one [default]
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
        let inputs = std::iter::once(arguments.input.as_path()).chain(arguments.method.files());
        Outputs::new(inputs, *force).file(path)?;
    }
    let selection = arguments.selection.selection(&arguments.input)?;
    let method = arguments.method.config_with_warnings(&arguments.input, &selection.topics)?;
    // Before a viewer is started.
    selection.check(&arguments.input)?;
    let mut stream = viewer::open(&target, &arguments.input, &method)?;
    let progress = RecordingProgress::new("showing", &arguments.input);
    let output = PathBuf::from(target.to_string());
    let mut streaming = Duration::ZERO;
    let visited = for_each_frame(&arguments.input, &selection, &method, &mut |event: RunEvent| {
        progress.show(&event);
        match event {
            RunEvent::Progress { .. } => interrupt::check_for(&output),
            RunEvent::Warning(warning) => stream.warn(warning),
            RunEvent::Frame(frame) => {
                let started = Instant::now();
                let logged = stream.log(&frame);
                streaming += started.elapsed();
                logged
            }
        }
    })?;
    drop(progress);
    let started = Instant::now();
    stream.finish()?;
    streaming += started.elapsed();
    println!(
        "{} to {target} ({:.1} frames per second without clustering)",
        counted(visited.frames, "frame"),
        visited.frames as f64 / streaming.as_secs_f64(),
    );
    if let Target::Save { path, .. } = &target {
        println!("open it with: rerun {}", path.display());
    }
    Ok(Outcome::of(visited.unreadable == 0 && !visited.is_cut_off))
}

fn target(arguments: &Arguments) -> Target {
    match (&arguments.save, &arguments.connect) {
        (Some(path), _) => Target::Save { path: path.clone(), force: arguments.force },
        (_, Some(url)) => Target::Connect(url.clone()),
        _ => Target::Spawn,
    }
}
