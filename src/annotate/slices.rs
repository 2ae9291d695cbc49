//! Recordings cut into slices that are annotated by themselves, on any machine, and joined again
//! (`join`).
//!
//! A slice is a stretch of a recording's bytes that begins and ends where chunks do. Its clouds
//! have the numbers that they have in the recording, since the index counts those before it; so
//! whatever becomes of a cloud becomes of it in a slice, too.

use std::collections::BTreeMap;
use std::path::{Component, Path, PathBuf};

use serde::de::Error as _;
use serde::{Deserialize, Deserializer, Serialize};

use crate::datasets::bag::{Bag, METADATA_FILE};
use crate::error::{Conflict, Error, NoCloud, Result, SliceProblem};
use crate::frames::choose_topics;
use divmerge_recording::{ChunkPlace, Overview, is_remote, is_stream};

/// A slice of a recording.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
pub struct Slice {
    /// The recording.
    pub input: PathBuf,
    /// Its bytes.
    pub input_bytes: u64,
    /// Where what is made of the recording goes, below a folder.
    #[serde(deserialize_with = "below_a_folder")]
    pub name: PathBuf,
    /// Number of the slice among those of the recording, from 0.
    pub number: usize,
    /// Slices of the recording.
    pub count: usize,
    /// Byte of the recording from which on its chunks belong to the slice.
    pub start: u64,
    /// Byte from which on they do not any more.
    pub end: u64,
    /// Clouds in it, as the index counts them.
    pub clouds: u64,
    /// Earliest log time of its chunks in nanoseconds since 1970, if they have messages.
    pub from_ns: Option<u64>,
    /// Latest log time of its chunks.
    pub to_ns: Option<u64>,
}

/// Reads a path that does not lead out of the folder that it is taken below.
fn below_a_folder<'de, D: Deserializer<'de>>(from: D) -> std::result::Result<PathBuf, D::Error> {
    let path = PathBuf::deserialize(from)?;
    let is_below = path.components().all(|part| matches!(part, Component::Normal(_)));
    match is_below && path.file_name().is_some() {
        true => Ok(path),
        false => Err(D::Error::custom(format!("`{}` is no name below a folder", path.display()))),
    }
}

impl Slice {
    /// Where the annotated slice goes, below a folder: `NAME.slice-0003-of-0012.mcap`.
    pub fn file_name(&self) -> PathBuf {
        let mut name = self.name.file_stem().unwrap_or_default().to_owned();
        name.push(format!(".slice-{:04}-of-{:04}.mcap", self.number, self.count));
        self.name.with_file_name(name)
    }

    /// Whether messages of a chunk that begins at a byte belong to it.
    pub(super) fn contains(&self, offset: u64) -> bool {
        (self.start..self.end).contains(&offset)
    }

    /// Refuses a recording that is not the one that was planned, as far as its length tells.
    pub(super) fn check(&self, overview: &Overview) -> Result<()> {
        if overview.file_size == self.input_bytes {
            return Ok(());
        }
        let (bytes, planned_bytes) = (overview.file_size, self.input_bytes);
        let problem = Conflict::Changed { bytes, planned_bytes };
        Err(Error::Conflict { path: overview.path.clone(), problem })
    }
}

/// A recording to be cut, and where what is made of it goes below a folder.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Planned {
    /// The recording.
    pub input: PathBuf,
    /// Where it goes.
    pub name: PathBuf,
}

/// The recordings that some inputs stand for: files, folders of rosbag2, and other folders, of
/// which every `.mcap` file is meant, however deep. What is made of those of a folder keeps its
/// place below the folder, and if there are other inputs stands in one of the folder's name.
///
/// # Errors
/// [`Error::Io`]; [`Error::NoCloud`] for a folder without recordings; [`Error::Conflict`] if two go
/// to the same place; those of [`Bag::open`].
pub fn recordings(inputs: &[PathBuf]) -> Result<Vec<Planned>> {
    let mut found = Vec::new();
    for input in inputs {
        if !input.is_dir() {
            let name = input.file_name().unwrap_or(input.as_os_str());
            found.push(Planned { input: absolute(input)?, name: name.into() });
            continue;
        }
        let below = match (inputs.len(), input.file_name()) {
            (2.., Some(name)) => PathBuf::from(name),
            _ => PathBuf::new(),
        };
        let files = files_of(input)?;
        if files.is_empty() {
            return Err(Error::NoCloud { path: input.clone(), problem: NoCloud::NoRecording });
        }
        for file in files {
            let (input, name) = (absolute(&input.join(&file))?, below.join(file));
            found.push(Planned { input, name });
        }
    }
    let mut names: BTreeMap<&Path, &Planned> = BTreeMap::new();
    for planned in &found {
        if let Some(other) = names.insert(&planned.name, planned) {
            let (other, name) = (other.input.clone(), planned.name.clone());
            let problem = Conflict::SameName { other, name };
            return Err(Error::Conflict { path: planned.input.clone(), problem });
        }
    }
    Ok(found)
}

/// The path of a file from the root on; an address of an object store is one, and a stream has
/// none.
fn absolute(path: &Path) -> Result<PathBuf> {
    if is_remote(path) || is_stream(path) {
        return Ok(path.to_owned());
    }
    std::path::absolute(path).map_err(|source| Error::Io { path: path.to_owned(), source })
}

/// The recordings in a folder, by their paths below it: those of a bag in its order, else by name.
///
/// # Errors
/// [`Error::Io`], those of [`Bag::open`].
pub fn files_of(folder: &Path) -> Result<Vec<PathBuf>> {
    if folder.join(METADATA_FILE).is_file() {
        return Ok(Bag::open(folder)?.files.into_iter().map(PathBuf::from).collect());
    }
    let io = |source| Error::Io { path: folder.to_owned(), source };
    let mut files = Vec::new();
    for entry in std::fs::read_dir(folder).map_err(io)? {
        let entry = entry.map_err(io)?;
        let (name, path) = (PathBuf::from(entry.file_name()), entry.path());
        let is_hidden = entry.file_name().to_string_lossy().starts_with('.');
        if is_hidden {
            continue;
        } else if path.is_dir() {
            files.extend(files_of(&path)?.into_iter().map(|file| name.join(file)));
        } else if path.extension().is_some_and(|end| end == "mcap") {
            files.push(name);
        }
    }
    files.sort();
    Ok(files)
}

/// What is known of a recording that is to be cut.
struct Counted<'a> {
    planned: &'a Planned,
    overview: Overview,
    /// Clouds of all.
    clouds: u64,
    /// Its chunks, if the index tells where they are and what they hold.
    chunks: Vec<ChunkPlace>,
}

/// Cuts recordings into about so many slices in all, with as many clouds each as can be: at least
/// one of each recording, and one of a recording whose index does not tell where its chunks are.
/// Only the indexes are read; of a recording without one all is.
///
/// # Errors
/// [`Error::Folder`] with all the recordings that cannot be cut, and why: they cannot be read or
/// have no cloud of these topics (none: of any).
pub fn plan(recordings: &[Planned], shards: usize, topics: &[String]) -> Result<Vec<Slice>> {
    let counted = recordings.iter().map(|planned| count(planned, topics));
    let (mut recordings, mut problems) = (Vec::new(), Vec::new());
    for counted in counted {
        match counted {
            Ok(counted) => recordings.push(counted),
            Err(error) => problems.push(error),
        }
    }
    if problems.len() == 1 && recordings.is_empty() {
        return Err(problems.remove(0));
    }
    if !problems.is_empty() {
        let count = problems.len();
        let problems = problems.iter().map(Error::to_string).collect();
        return Err(Error::Folder { path: "nothing planned".into(), problems, count });
    }
    let clouds: Vec<u64> = recordings.iter().map(|recording| recording.clouds).collect();
    let shares = apportion(&clouds, shards);
    Ok(recordings.iter().zip(shares).flat_map(|(recording, share)| cut(recording, share)).collect())
}

fn count<'a>(planned: &'a Planned, topics: &[String]) -> Result<Counted<'a>> {
    let overview = Overview::read(&planned.input)?;
    let channels = choose_topics(&overview, topics, None)?;
    let is_cloud = |channel: u16| channels.contains_key(&channel);
    // Chunks without message indexes may hold anything.
    let tells = |chunks: &Vec<ChunkPlace>| chunks.iter().any(|chunk| chunk.messages > 0);
    let chunks = ChunkPlace::all(&overview, &is_cloud).filter(tells).unwrap_or_default();
    let counts = overview.message_counts.iter().filter(|(channel, _)| is_cloud(**channel));
    let clouds = counts.map(|(_, count)| count).sum();
    Ok(Counted { planned, overview, clouds, chunks })
}

/// Slices of each recording: in proportion to its clouds, by largest remainders, and at least one.
fn apportion(clouds: &[u64], shards: usize) -> Vec<usize> {
    let all = clouds.iter().sum::<u64>().max(1) as f64;
    let quotas: Vec<f64> =
        clouds.iter().map(|&clouds| shards as f64 * clouds as f64 / all).collect();
    let mut shares: Vec<usize> =
        quotas.iter().map(|quota| (quota.floor() as usize).max(1)).collect();
    let mut order: Vec<usize> = (0..clouds.len()).collect();
    let rest = |index: usize| quotas[index] - quotas[index].floor();
    order.sort_by(|&a, &b| rest(b).total_cmp(&rest(a)).then(a.cmp(&b)));
    let missing = shards.saturating_sub(shares.iter().sum());
    for index in order.into_iter().filter(|&index| quotas[index] >= 1.0).take(missing) {
        shares[index] += 1;
    }
    shares
}

/// Cuts a recording into at most so many slices, each with a cloud.
fn cut(recording: &Counted, shares: usize) -> Vec<Slice> {
    let Counted { planned, overview, clouds, chunks } = recording;
    // Where a slice could begin, and how many clouds are before that.
    let mut before = 0;
    let mut places = Vec::new();
    for chunk in chunks {
        if before > 0 && chunk.messages > 0 {
            places.push((chunk.start, before));
        }
        before += chunk.messages;
    }
    let mut cuts: Vec<u64> = (1..shares as u64)
        .filter_map(|k| {
            let wanted = clouds * k / shares as u64;
            places.iter().min_by_key(|(_, before)| before.abs_diff(wanted)).map(|&(start, _)| start)
        })
        .collect();
    cuts.dedup();
    let starts: Vec<u64> = std::iter::once(0).chain(cuts.iter().copied()).collect();
    let ends = cuts.iter().copied().chain([overview.file_size]);
    let slice = |(number, (&start, end)): (usize, (&u64, u64))| {
        let is_in = |chunk: &&ChunkPlace| (start..end).contains(&chunk.start);
        let with_times = chunks.iter().filter(is_in).filter(|chunk| chunk.has_messages);
        let (from_ns, to_ns) = match chunks.is_empty() {
            true => (overview.start_ns, overview.end_ns),
            false => (
                with_times.clone().map(|chunk| chunk.times.0).min(),
                with_times.map(|chunk| chunk.times.1).max(),
            ),
        };
        Slice {
            input: planned.input.clone(),
            input_bytes: overview.file_size,
            name: planned.name.clone(),
            number,
            count: starts.len(),
            start,
            end,
            clouds: match chunks.is_empty() {
                true => *clouds,
                false => chunks.iter().filter(is_in).map(|chunk| chunk.messages).sum(),
            },
            from_ns,
            to_ns,
        }
    };
    starts.iter().zip(ends).enumerate().map(slice).collect()
}

/// Slices of recordings, as they are written down.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Plan {
    /// Version of this library.
    pub version: String,
    /// The slices of one recording after the other.
    pub slices: Vec<Slice>,
}

impl Plan {
    /// A plan of these slices.
    pub fn new(slices: Vec<Slice>) -> Self {
        Plan { version: env!("CARGO_PKG_VERSION").to_owned(), slices }
    }

    /// Reads a plan.
    ///
    /// # Errors
    /// [`Error::Io`]; [`Error::Slices`] if the file is no plan.
    pub fn read(path: &Path) -> Result<Self> {
        let text =
            std::fs::read(path).map_err(|source| Error::Io { path: path.to_owned(), source })?;
        serde_json::from_slice(&text).map_err(|error| Error::Slices {
            of: path.to_owned(),
            problem: SliceProblem::NoPlan { reason: error.to_string() },
        })
    }

    /// The plan as JSON.
    pub fn to_json(&self) -> String {
        serde_json::to_string_pretty(self).expect("a plan is plain data") + "\n"
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn slices_go_where_clouds_are() {
        assert_eq!(apportion(&[10, 10], 4), [2, 2]);
        assert_eq!(apportion(&[30, 10], 4), [3, 1]);
        assert_eq!(apportion(&[1000, 1, 1], 8), [7, 1, 1]);
        assert_eq!(apportion(&[1, 1, 1], 2), [1, 1, 1]);
        assert_eq!(apportion(&[0, 0], 4), [1, 1]);
        assert_eq!(apportion(&[5, 3, 2], 7), [4, 2, 1]);
        assert_eq!(apportion(&[], 3), Vec::<usize>::new());
    }

    fn counted<'a>(planned: &'a Planned, messages: &[u64]) -> Counted<'a> {
        let place = |(i, &messages): (usize, &u64)| ChunkPlace {
            start: 100 + 10 * i as u64,
            times: (i as u64, i as u64 + 1),
            messages,
            has_messages: true,
        };
        let chunks: Vec<ChunkPlace> = messages.iter().enumerate().map(place).collect();
        let overview = Overview { file_size: 1000, ..Overview::default() };
        Counted { planned, overview, clouds: messages.iter().sum(), chunks }
    }

    #[test]
    fn slices_cover_every_byte_once_and_have_clouds() {
        let planned = Planned { input: "in.mcap".into(), name: "a/in.mcap".into() };
        for (messages, shares, expected) in [
            (vec![1, 1, 1, 1], 2, vec![2, 2]),
            (vec![1, 1, 1, 1], 9, vec![1, 1, 1, 1]),
            (vec![0, 0, 4, 0, 4], 2, vec![4, 4]),
            (vec![9, 1, 1, 1], 2, vec![9, 3]),
            (vec![1, 1, 1, 9], 3, vec![3, 9]),
            (vec![0, 0], 3, vec![0]),
            (vec![], 3, vec![0]),
        ] {
            let slices = cut(&counted(&planned, &messages), shares);
            let clouds: Vec<u64> = slices.iter().map(|slice| slice.clouds).collect();
            assert_eq!(clouds, expected, "{messages:?} in {shares}");
            assert_eq!((slices[0].start, slices[slices.len() - 1].end), (0, 1000));
            assert!(slices.windows(2).all(|two| two[0].end == two[1].start));
            assert!(slices.iter().all(|slice| slice.count == slices.len()));
        }
        let [first, _] = cut(&counted(&planned, &[1, 1]), 2).try_into().expect("two");
        let read = |name: &str| {
            let slice = Slice { name: name.into(), ..first.clone() };
            serde_json::from_value::<Slice>(serde_json::json!(slice))
        };
        assert_eq!(read("a/in.mcap").expect("below a folder"), first);
        for name in ["../in.mcap", "/in.mcap", "a/../../in.mcap", ""] {
            assert!(read(name).is_err(), "{name}");
        }
        let slices = cut(&counted(&planned, &[1, 1]), 2);
        assert_eq!(slices[1].file_name(), Path::new("a/in.slice-0001-of-0002.mcap"));
        assert_eq!((slices[1].from_ns, slices[1].to_ns), (Some(1), Some(2)));
    }
}
