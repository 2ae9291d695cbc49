//! Fuzzing without a nightly compiler: inputs are seeds changed at random, structure kept where a
//! checksum would stop random bytes, and inputs that end as none before them are changed further.
//! Each execution is watched for panics, for what it allocates, and for wrong answers.
//!
//! ```sh
//! # All targets, by their shares.
//! cargo run --profile fuzz --example fuzz -- --executions 1000000
//! cargo run --profile fuzz --example fuzz -- --target npy --seed 7
//! cargo run --profile fuzz --example fuzz -- --target npy \
//!     --input target/fuzz-failures/npy-7-0-12345.bin
//! ```
//!
//! The same seed gives the same inputs. Targets run in processes of their own, so that one that
//! dies (out of memory, out of stack) is a failure like any other. Inputs that fail are kept in
//! `target/fuzz-failures`.

mod clouds;
mod mutate;
mod recordings;
mod seeds;
mod targets;
mod watch;

use std::collections::HashSet;
use std::path::{Path, PathBuf};
use std::process::{Command, ExitCode, Stdio};
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::Duration;

use anyhow::{Context, Result, bail};
use clap::Parser;
use serde::{Deserialize, Serialize};

use mutate::Mutator;
use targets::{TARGETS, Target};

/// Inputs kept because they ended as none before.
const MOST_KEPT: usize = 2000;

/// Failures told of each target.
const MOST_FAILURES: usize = 5;

/// An execution that takes longer is a failure: inputs are at most 64 KiB.
const SLOW: Duration = Duration::from_secs(10);

/// Feeds changed messages, files and recordings to everything that reads them.
#[derive(Parser)]
struct Arguments {
    /// Executions, all targets together, by their shares
    #[arg(long, default_value_t = 100_000)]
    executions: u64,

    /// Only this target, with all the executions; may be given several times
    #[arg(long = "target", value_name = "NAME")]
    targets: Vec<String>,

    /// Which inputs: other seeds, other inputs
    #[arg(long, default_value_t = 1)]
    seed: u64,

    /// Processes at a time
    #[arg(long, default_value_t = 2)]
    processes: usize,

    /// Run a target on this file alone, and say how it ends
    #[arg(long, value_name = "FILE")]
    input: Option<PathBuf>,

    /// Be the process of one target, and print what it found
    #[arg(long, hide = true)]
    worker: bool,

    /// Write each input before it runs, to have it when the process dies
    #[arg(long, hide = true, value_name = "FILE")]
    keep_last: Option<PathBuf>,
}

/// What was found in a target.
#[derive(Debug, Default, Serialize, Deserialize)]
struct Found {
    executions: u64,
    /// Inputs that ended as none before.
    endings: usize,
    failures: Vec<String>,
    failed: u64,
    slowest_ms: f64,
    most_bytes: usize,
}

fn main() -> Result<ExitCode> {
    let arguments = Arguments::parse();
    let chosen = chosen(&arguments.targets)?;
    if let Some(input) = &arguments.input {
        let [target] = chosen.as_slice() else { bail!("--input needs one --target") };
        return replay(target, input);
    }
    if arguments.worker {
        let found = work(chosen[0], &arguments)?;
        println!("{}", serde_json::to_string(&found)?);
        return Ok(ExitCode::SUCCESS);
    }
    let found = run_all(&chosen, &arguments)?;
    print(&chosen, &found, arguments.seed);
    let is_clean = found.iter().all(|found| found.failed == 0);
    Ok(if is_clean { ExitCode::SUCCESS } else { ExitCode::FAILURE })
}

fn chosen(names: &[String]) -> Result<Vec<&'static Target>> {
    if names.is_empty() {
        return Ok(TARGETS.iter().collect());
    }
    let find = |name: &String| TARGETS.iter().find(|target| target.name == *name);
    let known = || TARGETS.map(|target| target.name).join(", ");
    names
        .iter()
        .map(|name| find(name).with_context(|| format!("targets are: {}", known())))
        .collect()
}

fn replay(target: &Target, input: &Path) -> Result<ExitCode> {
    let bytes = std::fs::read(input).with_context(|| input.display().to_string())?;
    watch::listen();
    let outcome = watch::run(target.run, &bytes, target.bound);
    println!("{} ({} bytes allocated, {:?})", outcome.words, outcome.bytes, outcome.time);
    let _ = std::fs::remove_dir_all(scratch(std::process::id()));
    match outcome.failure {
        None => Ok(ExitCode::SUCCESS),
        Some(failure) => {
            println!("FAILED: {failure}");
            Ok(ExitCode::FAILURE)
        }
    }
}

/// All executions of one target, in this process.
fn work(target: &Target, arguments: &Arguments) -> Result<Found> {
    watch::listen();
    let mut mutator = Mutator::new(arguments.seed ^ crc32fast::hash(target.name.as_bytes()) as u64);
    let mut corpus = (target.seeds)();
    let (mut endings, mut failures) = (HashSet::new(), HashSet::new());
    let mut found = Found::default();
    for number in 0..arguments.executions {
        let input = next_input(target, number, &corpus, &mut mutator);
        if let Some(path) = &arguments.keep_last {
            std::fs::write(path, &input)?;
        }
        let outcome = watch::run(target.run, &input, target.bound);
        found.executions += 1;
        found.most_bytes = found.most_bytes.max(outcome.bytes);
        found.slowest_ms = found.slowest_ms.max(outcome.time.as_secs_f64() * 1e3);
        let slow = (outcome.time > SLOW).then(|| format!("took {:?}", outcome.time));
        let is_new = endings.len() < MOST_KEPT && endings.insert(without_numbers(&outcome.words));
        if let Some(failure) = outcome.failure.or(slow) {
            found.failed += 1;
            let is_new = failures.insert(without_numbers(&failure));
            if is_new && found.failures.len() < MOST_FAILURES {
                let path = keep(target, arguments.seed, number, &input)?;
                found.failures.push(format!("{}: {failure}", path.display()));
            }
        } else if is_new {
            corpus.push(input);
        }
    }
    found.endings = endings.len();
    Ok(found)
}

/// The seeds as they are first, then made ones and changed ones.
fn next_input(target: &Target, number: u64, corpus: &[Vec<u8>], mutator: &mut Mutator) -> Vec<u8> {
    let seed = usize::try_from(number).ok().and_then(|number| corpus.get(number));
    match (target.make, seed) {
        (Some(make), _) if corpus.is_empty() || !mutator.once_in(4) => make(mutator),
        (None, Some(seed)) => seed.clone(),
        _ => {
            let mut input = mutator.pick(corpus).clone();
            mutator.mutate(&mut input, corpus, target.words);
            input
        }
    }
}

/// Words that differ in numbers alone are the same ending.
fn without_numbers(words: &str) -> String {
    let mut kept: String = words.chars().filter(|letter| !letter.is_ascii_digit()).collect();
    let end = kept.char_indices().nth(300).map_or(kept.len(), |(at, _)| at);
    kept.truncate(end);
    kept
}

fn keep(target: &Target, seed: u64, number: u64, input: &[u8]) -> Result<PathBuf> {
    let folder = Path::new("target/fuzz-failures");
    std::fs::create_dir_all(folder)?;
    let path = folder.join(format!("{}-{seed}-{number}.bin", target.name));
    std::fs::write(&path, input)?;
    Ok(path)
}

/// Every target in a process of its own, a few at a time.
fn run_all(chosen: &[&Target], arguments: &Arguments) -> Result<Vec<Found>> {
    let shares: u64 = chosen.iter().map(|target| target.share).sum();
    let next = AtomicUsize::new(0);
    let found = Mutex::new(Vec::new());
    let take = || {
        loop {
            let number = next.fetch_add(1, Ordering::Relaxed);
            let Some(target) = chosen.get(number) else { return Ok(()) };
            let executions = arguments.executions * target.share / shares;
            let one = run_process(target, executions, arguments.seed)?;
            eprintln!("{}: {} executions, {} failed", target.name, one.executions, one.failed);
            found.lock().expect("no panic").push((number, one));
        }
    };
    std::thread::scope(|scope| -> Result<()> {
        let threads: Vec<_> = (0..arguments.processes.max(1)).map(|_| scope.spawn(take)).collect();
        threads.into_iter().try_for_each(|thread| thread.join().expect("no panic"))
    })?;
    let mut found = found.into_inner()?;
    found.sort_by_key(|(number, _)| *number);
    Ok(found.into_iter().map(|(_, found)| found).collect())
}

fn run_process(target: &Target, executions: u64, seed: u64) -> Result<Found> {
    let run = |keep_last: Option<&Path>| -> Result<(Option<Found>, String)> {
        let mut command = Command::new(std::env::current_exe()?);
        command.args(["--worker", "--target", target.name]);
        command.args(["--executions", &executions.to_string(), "--seed", &seed.to_string()]);
        if let Some(path) = keep_last {
            command.arg("--keep-last").arg(path);
        }
        let child = command.stdout(Stdio::piped()).stderr(Stdio::inherit()).spawn()?;
        let id = child.id();
        let output = child.wait_with_output()?;
        let _ = std::fs::remove_dir_all(scratch(id));
        let found = output.status.success().then(|| serde_json::from_slice(&output.stdout));
        Ok((found.transpose()?, output.status.to_string()))
    };
    if let (Some(found), _) = run(None)? {
        return Ok(found);
    }
    // It died. The same again, with every input on the disk before it runs.
    let path = keep(target, seed, u64::MAX, &[])?;
    let (_, status) = run(Some(&path))?;
    let failures = vec![format!("{}: the process died: {status}", path.display())];
    Ok(Found { failures, failed: 1, ..Found::default() })
}

/// Folder of a process's files, in memory where the system has such a place.
fn scratch(id: u32) -> PathBuf {
    let memory = Path::new("/dev/shm");
    let base = if memory.is_dir() { memory.to_owned() } else { std::env::temp_dir() };
    base.join(format!("divmerge-fuzz-{id}"))
}

fn print(chosen: &[&Target], found: &[Found], seed: u64) {
    println!("| target | what runs | executions | endings | failures | most allocated | slowest |");
    println!("| --- | --- | ---: | ---: | ---: | ---: | ---: |");
    for (target, found) in chosen.iter().zip(found) {
        println!(
            "| {} | {} | {} | {} | {} | {:.1} MB | {:.0} ms |",
            target.name,
            target.what,
            grouped(found.executions),
            found.endings,
            found.failed,
            found.most_bytes as f64 / 1e6,
            found.slowest_ms
        );
    }
    let all: u64 = found.iter().map(|found| found.executions).sum();
    let failed: u64 = found.iter().map(|found| found.failed).sum();
    println!("\nseed {seed}: {} executions, {failed} failed", grouped(all));
    for failure in found.iter().flat_map(|found| &found.failures) {
        println!("FAILED {failure}");
    }
}

fn grouped(number: u64) -> String {
    let digits = number.to_string();
    let groups: Vec<&str> = digits
        .as_bytes()
        .rchunks(3)
        .rev()
        .map(|group| std::str::from_utf8(group).unwrap_or_default())
        .collect();
    groups.join(",")
}
