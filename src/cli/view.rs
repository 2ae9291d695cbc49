//! `divmerge view`

use std::path::PathBuf;
use std::time::{Duration, Instant};

use anyhow::Result;
use clap::Args;

use crate::annotate::{FrameVisitor, RunEvent, TrackOptions, for_each_frame};
use crate::cli::arguments::method::MethodArguments;
use crate::cli::arguments::selection::SelectionArguments;
use crate::cli::arguments::tracks::TrackArguments;
use crate::cli::arguments::truth::SourceArguments;
use crate::cli::dry_run::{DryRun, DryRunArgument};
use crate::cli::exit::Outcome;
use crate::cli::interrupt;
use crate::cli::output::{Outputs, rrd};
use crate::cli::progress::RecordingProgress;
use crate::cli::text::counted;
use crate::cli::viewer::{self, RerunStream};
use crate::frames::TruthSource;
use crate::view::Target;

/// Show every step of the clustering in the Rerun viewer
///
/// For each frame: the cloud by instance, component, class and reason, boxes, votes between
/// components, the range image, and the time of each stage; the truth, where clouds carry it; and
/// the ways of objects over time. Needs a divmerge built with `--features rerun`; without it, a
/// stock Rerun opens what `divmerge annotate --only` writes.
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

    #[command(flatten)]
    truth: SourceArguments,

    #[command(flatten)]
    tracks: TrackArguments,

    #[command(flatten)]
    dry_run: DryRunArgument,

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
    if arguments.dry_run.dry_run {
        let (input, limits) = (&arguments.input, arguments.selection.limits());
        let mut plan = DryRun::of_clouds(input, &selection.topics, &method, &limits)?;
        match &target {
            Target::Save { path, .. } => plan.writes(path.display()),
            _ => plan.line(format_args!("and send to {target}")),
        }
        plan.print();
        return Ok(Outcome::Done);
    }
    let tracks = arguments.tracks.options(&arguments.method.parameters_over_time()?);
    let follows = tracks.applies_to(&method);
    let mut shown = Shown {
        stream: viewer::open(&target, &arguments.input, (&method, follows))?,
        progress: RecordingProgress::new("showing", &arguments.input),
        output: PathBuf::from(target.to_string()),
        streaming: Duration::ZERO,
        truth: (arguments.truth.source(), arguments.truth.is_said()),
        tracks,
    };
    let visited = for_each_frame(&arguments.input, &selection, &method, &mut shown)?;
    let Shown { stream, progress, mut streaming, .. } = shown;
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

/// A walk that is shown.
struct Shown<'a> {
    stream: RerunStream,
    progress: RecordingProgress<'a>,
    output: PathBuf,
    streaming: Duration,
    truth: (TruthSource, bool),
    tracks: TrackOptions,
}

impl FrameVisitor for Shown<'_> {
    fn truth(&self) -> Option<(&TruthSource, bool)> {
        Some((&self.truth.0, self.truth.1))
    }

    fn tracks(&self) -> Option<&TrackOptions> {
        Some(&self.tracks)
    }

    fn event(&mut self, event: RunEvent) -> crate::Result<()> {
        self.progress.show(&event);
        let started = Instant::now();
        let shown = match event {
            RunEvent::Progress { .. } => return interrupt::check_for(&self.output),
            RunEvent::Warning(warning) => return self.stream.warn(warning),
            RunEvent::Frame(frame) => self.stream.log(&frame),
            RunEvent::Tracked(frame) => self.stream.tracks(frame),
        };
        self.streaming += started.elapsed();
        shown
    }
}

fn target(arguments: &Arguments) -> Target {
    match (&arguments.save, &arguments.connect) {
        (Some(path), _) => Target::Save { path: path.clone(), force: arguments.force },
        (_, Some(url)) => Target::Connect(url.clone()),
        _ => Target::Spawn,
    }
}
