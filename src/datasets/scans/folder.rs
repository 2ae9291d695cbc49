//! A folder of scans, a file each.

use std::cmp::Ordering;
use std::collections::{BTreeMap, BTreeSet};
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};

use divmerge_recording::WriteOptions;

use super::columns::Columns;
use super::read::ScanFormat;
use super::scan::Scan;
use super::write::{EPOCH_NS, TimedScan, WriteSummary, write_scans};
use crate::datasets::cloud_recording::CloudRecording;
use crate::datasets::files::{names, read_labels, unreadable};
use crate::datasets::problems::Problems;
use crate::error::Result;
use crate::messages::clouds::CloudFormat;

/// How to read a folder's files.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct FolderOptions {
    /// Names of the columns where the files do not say them. Default: those of [`Scan::read`].
    pub columns: Option<Columns>,
    /// Scans per second. Default: times from the names of the files if they are stamps, else
    /// [`USUAL_RATE`].
    pub rate: Option<f64>,
    /// Stamp of the first scan in nanoseconds since 1970, where times are not from names. Default:
    /// [`EPOCH_NS`].
    pub start_ns: Option<u64>,
    /// Folder of `.label` files with the names of the scans. Default: no labels.
    pub labels: Option<PathBuf>,
}

/// Scans per second where nothing else is known: most LiDARs turn ten times a second.
pub const USUAL_RATE: f64 = 10.0;

/// Where stamps come from.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum StampSource {
    /// The names of the files are times.
    Names,
    /// Evenly spaced, so many per second.
    Rate(f64),
}

/// A folder of scans of one format, listed but not read.
#[derive(Debug, Clone, PartialEq)]
pub struct ScanFolder {
    /// The folder.
    pub path: PathBuf,
    /// Format of its scans.
    pub format: ScanFormat,
    /// Where their stamps come from.
    pub stamps: StampSource,
    /// Names of the other files in the folder, without hidden ones.
    pub left_aside: Vec<String>,
    columns: Option<Columns>,
    files: Vec<ScanFile>,
}

#[derive(Debug, Clone, PartialEq)]
struct ScanFile {
    path: PathBuf,
    stamp_ns: u64,
    labels: Option<PathBuf>,
}

impl ScanFolder {
    /// Looks through a folder. Scans are in the order of their times, if their names are times,
    /// else of their names, numbers in them by value: `2` before `10`.
    ///
    /// # Errors
    /// [`Error::Folder`](crate::error::Error::Folder) if there is no scan, scans of more than one
    /// format, two of one time, or labels that do not go with the scans;
    /// [`Error::Io`](crate::error::Error::Io).
    pub fn open(folder: &Path, options: &FolderOptions) -> Result<Self> {
        let mut of_format: BTreeMap<ScanFormat, Vec<String>> = BTreeMap::new();
        let mut left_aside = Vec::new();
        for name in names(folder)? {
            match ScanFormat::of(Path::new(&name)).filter(|_| !folder.join(&name).is_dir()) {
                Some(format) => of_format.entry(format).or_default().push(name),
                None => left_aside.push(name),
            }
        }
        let format = one_format(folder, &of_format)?;
        let names = of_format.remove(&format).unwrap_or_default();
        let (stamped, stamps) = stamped(folder, names, options)?;
        let labels = options.labels.as_deref().map(|labels| label_files(labels, &stamped));
        let labels = labels.transpose()?.unwrap_or_default();
        if options.labels.as_deref() == Some(folder) {
            left_aside.retain(|name| !name.ends_with(".label"));
        }
        let files = stamped.iter().map(|(stamp_ns, name)| ScanFile {
            path: folder.join(name),
            stamp_ns: *stamp_ns,
            labels: labels.get(stem(name)).cloned(),
        });
        let (path, columns) = (folder.to_owned(), options.columns.clone());
        Ok(ScanFolder { files: files.collect(), path, format, stamps, left_aside, columns })
    }

    /// Number of scans.
    pub fn len(&self) -> usize {
        self.files.len()
    }

    /// Whether there is no scan, which no folder that was opened is.
    pub fn is_empty(&self) -> bool {
        self.files.is_empty()
    }

    /// Writes the scans as clouds of a ROS 2 recording, on one topic and in one coordinate frame;
    /// with labels they gain the fields `label` and `true_instance`. `on_frame` is called after
    /// each and may break off.
    ///
    /// # Errors
    /// Those of [`write_scans`].
    pub fn write(
        &self,
        output: &Path,
        topic: &str,
        frame_id: &str,
        options: &WriteOptions,
        on_frame: impl FnMut() -> ControlFlow<()>,
    ) -> Result<WriteSummary> {
        let mut recording = CloudRecording::create(CloudFormat::Ros2, output, topic, options)?;
        recording.write_metadata(SOURCE, &self.metadata())?;
        let frames = self.files.iter().map(|file| TimedScan {
            path: &file.path,
            stamp_ns: file.stamp_ns,
            pose: None,
            scan: self.scan(file),
        });
        write_scans(recording, frame_id, [&self.path, output], frames, on_frame)
    }

    fn scan(&self, file: &ScanFile) -> Result<Scan> {
        let mut scan = Scan::read(&file.path, self.format, self.columns.as_ref())?;
        if let Some(labels) = &file.labels {
            append_labels(&mut scan, labels, LABEL_FIELDS)?;
        }
        Ok(scan)
    }

    fn metadata(&self) -> BTreeMap<String, String> {
        let times = match self.stamps {
            StampSource::Names => "names of the files".to_owned(),
            StampSource::Rate(rate) => format!("{rate} Hz"),
        };
        let has_labels = self.files.iter().any(|file| file.labels.is_some());
        let entries = [
            ("source", format!("folder of {}", self.format.ending())),
            ("frames", self.len().to_string()),
            ("times", times),
            ("labels", if has_labels { "label, true_instance" } else { "none" }.to_owned()),
        ];
        entries.into_iter().map(|(key, value)| (key.to_owned(), value)).collect()
    }
}

/// Name of the metadata record that tells where a converted recording comes from.
pub const SOURCE: &str = "divmerge_convert";

/// Fields that hold the true class and instance.
pub const LABEL_FIELDS: [&str; 2] = ["label", "true_instance"];

/// Adds the words of a label file to a scan.
///
/// # Errors
/// Those of [`read_labels`]; [`Error::Unreadable`](crate::error::Error::Unreadable) if they do
/// not fit.
pub fn append_labels(scan: &mut Scan, labels: &Path, fields: [&str; 2]) -> Result<Vec<u32>> {
    let words = read_labels(labels)?;
    scan.append_labels(&words, fields).map_err(|problem| unreadable(labels, problem))?;
    Ok(words)
}

fn one_format(folder: &Path, of_format: &BTreeMap<ScanFormat, Vec<String>>) -> Result<ScanFormat> {
    let mut problems = Problems::default();
    let format = match of_format.len() {
        1 => of_format.keys().next(),
        0 => {
            problems.add("no .bin, .pcd or .npy file in it");
            None
        }
        _ => {
            for (format, names) in of_format {
                let (ending, count) = (format.ending(), names.len());
                problems
                    .add(format!("{count} {ending} beside other formats, such as {}", names[0]));
            }
            None
        }
    };
    problems.into_result(folder)?;
    Ok(*format.expect("one format where there is no problem"))
}

/// The scans with their stamps, in order.
fn stamped(
    folder: &Path,
    mut names: Vec<String>,
    options: &FolderOptions,
) -> Result<(Vec<(u64, String)>, StampSource)> {
    let times = match options.rate {
        None => times_of_names(&names),
        Some(_) => None,
    };
    if let Some(times) = times {
        let mut stamped: Vec<(u64, String)> = times.into_iter().zip(names).collect();
        stamped.sort();
        let mut problems = Problems::default();
        for pair in stamped.windows(2).filter(|pair| pair[0].0 == pair[1].0) {
            problems.add(format!("{} and {} are of one time", pair[0].1, pair[1].1));
        }
        problems.into_result(folder)?;
        return Ok((stamped, StampSource::Names));
    }
    let rate = options.rate.unwrap_or(USUAL_RATE);
    let start_ns = options.start_ns.unwrap_or(EPOCH_NS);
    names.sort_by(|a, b| natural_order(stem(a), stem(b)).then_with(|| a.cmp(b)));
    let stamp =
        |number: usize| start_ns.saturating_add((number as f64 * 1e9 / rate).round() as u64);
    let stamped = names.into_iter().enumerate().map(|(number, name)| (stamp(number), name));
    Ok((stamped.collect(), StampSource::Rate(rate)))
}

/// A file's name without its ending.
fn stem(name: &str) -> &str {
    name.rsplit_once('.').map_or(name, |(stem, _)| stem)
}

/// The stamps in nanoseconds since 1970, if all names are times of one unit.
fn times_of_names(names: &[String]) -> Option<Vec<u64>> {
    let mut unit = None;
    let time = |name: &String| {
        let (time, of) = time_of_name(stem(name))?;
        (*unit.get_or_insert(of) == of).then_some(time)
    };
    names.iter().map(time).collect()
}

/// Seconds (with or without a fraction), milli-, micro- or nanoseconds since 1970, told by the
/// number of digits: a time between 2001 and 2038 has 10, 13, 16 or 19. Returns nanoseconds, and
/// the digits.
fn time_of_name(stem: &str) -> Option<(u64, usize)> {
    /// 9 September 2001: ten digits from then on.
    const FIRST: u64 = 1_000_000_000_000_000_000;
    /// What a message's stamp can say.
    const LAST: u64 = i32::MAX as u64 * 1_000_000_000;
    let (whole, fraction) = stem.split_once('.').unwrap_or((stem, ""));
    let is_number = |text: &str| text.bytes().all(|byte| byte.is_ascii_digit());
    let is_time = matches!(whole.len(), 10 | 13 | 16 | 19)
        && (fraction.is_empty() || (whole.len() == 10 && fraction.len() <= 9));
    if !is_time || !is_number(whole) || !is_number(fraction) || stem.ends_with('.') {
        return None;
    }
    let digits: String = [whole, fraction].concat();
    let nanoseconds: u64 = format!("{digits:0<19}").parse().ok()?;
    (FIRST..=LAST).contains(&nanoseconds).then_some((nanoseconds, whole.len()))
}

/// The order of names in which numbers count by their value.
fn natural_order(a: &str, b: &str) -> Ordering {
    let (mut a, mut b) = (a, b);
    while !a.is_empty() && !b.is_empty() {
        let ((x, rest_a), (y, rest_b)) = (run(a), run(b));
        let is_number = |text: &str| text.starts_with(|c: char| c.is_ascii_digit());
        let order = if is_number(x) && is_number(y) {
            let [x, y] = [x, y].map(|digits| digits.trim_start_matches('0'));
            x.len().cmp(&y.len()).then_with(|| x.cmp(y))
        } else {
            x.cmp(y)
        };
        if order != Ordering::Equal {
            return order;
        }
        (a, b) = (rest_a, rest_b);
    }
    a.len().cmp(&b.len())
}

/// The digits, or else what is no digit, at the beginning of a text, and the rest.
fn run(text: &str) -> (&str, &str) {
    let is_digit = |c: char| c.is_ascii_digit();
    let first = text.starts_with(is_digit);
    text.split_at(text.find(|c| is_digit(c) != first).unwrap_or(text.len()))
}

/// The label file of each scan, by stem.
fn label_files(folder: &Path, scans: &[(u64, String)]) -> Result<BTreeMap<String, PathBuf>> {
    let labels = names(folder)?.into_iter().filter(|name| name.ends_with(".label"));
    let labels: BTreeSet<String> = labels.map(|name| stem(&name).to_owned()).collect();
    let mut problems = Problems::default();
    let mut stems = BTreeSet::new();
    for (_, name) in scans {
        if !labels.contains(stem(name)) {
            problems.add(format!("no {}.label for {name}", stem(name)));
        }
        stems.insert(stem(name));
    }
    for label in labels.iter().filter(|label| !stems.contains(label.as_str())) {
        problems.add(format!("{label}.label without a scan"));
    }
    problems.into_result(folder)?;
    Ok(labels.into_iter().map(|stem| (stem.clone(), folder.join(stem + ".label"))).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_in_names_count_by_value() {
        let mut names = ["scan10", "scan2", "scan2b", "scan", "a9", "scan02", "7", "10"];
        names.sort_by(|a, b| natural_order(a, b).then_with(|| a.cmp(b)));
        assert_eq!(names, ["7", "10", "a9", "scan", "scan02", "scan2", "scan2b", "scan10"]);
    }

    #[test]
    fn times_are_told_from_numbers() {
        let second = 1_531_883_530_000_000_000;
        let time = |text| time_of_name(text).map(|(time, _)| time);
        assert_eq!(time("1531883530"), Some(second));
        assert_eq!(time("1531883530.25"), Some(second + 250_000_000));
        assert_eq!(time("1531883530949"), Some(second + 949_000_000));
        assert_eq!(time("1531883530949817"), Some(second + 949_817_000));
        assert_eq!(time("1531883530949817123"), Some(second + 949_817_123));
        for text in [
            "000001",
            "0000000001",
            "1531883530.",
            "1531883530949.5",
            "2018-07-18",
            "9999999999",
            "153188353094",
            "15318835309498171230",
            "+531883530",
            "١٥٣١٨٨٣٥٣٠",
            "",
        ] {
            assert_eq!(time(text), None, "{text}");
        }
        let names =
            |names: &[&str]| names.iter().map(|name| format!("{name}.bin")).collect::<Vec<_>>();
        assert!(times_of_names(&names(&["1531883530.5", "1531883531"])).is_some());
        assert!(times_of_names(&names(&["1531883530", "1531883530949"])).is_none());
    }
}
