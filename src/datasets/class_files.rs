//! Classes in files, one for each cloud: SemanticKITTI's `.label`, or numpy's `.npy`.
//!
//! A file is named by the number of its cloud (`000012.label`) or by its stamp: nanoseconds since
//! 1970, at least 15 digits, or seconds and nanoseconds with a point or an underscore between
//! (`1317384506.400000000.npy`).

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::OnceLock;

use super::files::{file_name, read, read_labels};
use super::scans::npy::{Numbers, numbers};
use crate::error::{Error, FrameError, MissingClasses, Result};
use crate::network::distributions;
use divmerge_core::cloud::PointClasses;
use divmerge_core::cloud::taxonomy::Taxonomy;

/// Digits from which on a number is a stamp: microseconds of 2001 have fewer.
const STAMP_DIGITS: usize = 15;

/// The files of a folder.
#[derive(Debug, PartialEq)]
pub struct ClassFiles {
    folder: PathBuf,
    /// One file at least.
    by: Named,
    tolerance_ns: u64,
    /// The raw id of each class of the taxonomy, for files with a score for each.
    ids: Vec<Option<u16>>,
    /// The topic whose clouds they are: that of the first that asks.
    topic: OnceLock<String>,
}

/// What files are named by.
#[derive(Debug, PartialEq)]
enum Named {
    Number(BTreeMap<u64, PathBuf>),
    Stamp(BTreeMap<i64, PathBuf>),
}

/// What the name of one file says.
enum Name {
    Number(u64),
    Stamp(i64),
}

impl ClassFiles {
    /// Lists the files of a folder; each is read when its cloud comes.
    ///
    /// # Errors
    /// [`Error::Io`] if the folder cannot be listed; [`Error::Classes`] if it holds no such file,
    /// or two for one cloud.
    pub fn open(folder: &Path, taxonomy: &Taxonomy, tolerance_ns: u64) -> Result<Self> {
        let at = |source| Error::Io { path: folder.into(), source };
        let (mut numbers, mut stamps) = (BTreeMap::new(), BTreeMap::new());
        for entry in std::fs::read_dir(folder).map_err(at)? {
            let path = entry.map_err(at)?.path();
            let twice = match name(&path) {
                Some(Name::Number(number)) => numbers.insert(number, path.clone()),
                Some(Name::Stamp(stamp)) => stamps.insert(stamp, path.clone()),
                None => None,
            };
            if let Some(other) = twice {
                let mut names = [file_name(&other), file_name(&path)];
                names.sort();
                return Err(problem(folder, format!("{} are of one cloud", names.join(" and "))));
            }
        }
        let by = match (numbers.is_empty(), stamps.is_empty()) {
            (true, true) => {
                let names = "no .label or .npy file that is named by the number (000012.label) or \
                             the stamp (1317384506400000000.npy) of a cloud";
                return Err(problem(folder, names.to_owned()));
            }
            (false, false) => {
                let both = format!(
                    "{} files are named by a number and {} by a stamp: one or the other",
                    numbers.len(),
                    stamps.len()
                );
                return Err(problem(folder, both));
            }
            (false, true) => Named::Number(numbers),
            (true, false) => Named::Stamp(stamps),
        };
        let ids = (0..taxonomy.classes().len() as u16).map(|class| taxonomy.id_of(class)).collect();
        Ok(ClassFiles { folder: folder.into(), by, tolerance_ns, ids, topic: OnceLock::new() })
    }

    /// The classes of a cloud of so many points: its topic, its number there and its stamp in
    /// nanoseconds since 1970.
    ///
    /// # Errors
    /// [`FrameError::NoClasses`] if there is no file for it; [`Error::Classes`] if the file cannot
    /// be read or has classes of more or fewer points, or files were asked for by the clouds of two
    /// topics.
    pub fn of(
        &self,
        cloud_topic: &str,
        number: u64,
        stamp_ns: i64,
        points: usize,
    ) -> Result<PointClasses> {
        let topic = self.topic.get_or_init(|| cloud_topic.to_owned());
        if topic != cloud_topic {
            let problem = format!(
                "they are of the clouds of one topic, and both {topic} and {cloud_topic} have \
                 some: name one with --topic"
            );
            return Err(self.problem(problem));
        }
        let path = self
            .path(number, stamp_ns)
            .map_err(|problem| FrameError::NoClasses { number, problem })?;
        let classes = self.read(path)?;
        match classes.class.len() == points {
            true => Ok(classes),
            false => Err(problem(
                path,
                format!(
                    "{} classes for the {points} points of cloud {number} on {topic}",
                    classes.class.len()
                ),
            )),
        }
    }

    /// Where they are and how they are told apart.
    pub(crate) fn source(&self) -> String {
        format!("{}, within {} ns", self.folder.display(), self.tolerance_ns)
    }

    /// The file of a cloud; or what is there instead.
    fn path(&self, number: u64, stamp_ns: i64) -> std::result::Result<&Path, MissingClasses> {
        let folder = || self.folder.clone();
        match &self.by {
            Named::Number(files) => {
                let path = files.get(&number).map(PathBuf::as_path);
                path.ok_or_else(|| MissingClasses::FileOfNumber {
                    folder: folder(),
                    number,
                    files: files.len(),
                    first: files.keys().next().copied().unwrap_or_default(),
                    last: files.keys().next_back().copied().unwrap_or_default(),
                })
            }
            Named::Stamp(files) => {
                let before = files.range(..=stamp_ns).next_back();
                let behind = files.range(stamp_ns..).next();
                let away = |file: &(&i64, &PathBuf)| file.0.abs_diff(stamp_ns);
                let nearest = before.into_iter().chain(behind).min_by_key(away);
                let within = nearest.filter(|file| away(file) <= self.tolerance_ns);
                within.map(|(_, path)| path.as_path()).ok_or_else(|| {
                    let nearest_ns = nearest.map_or(i64::MAX, |file| away(&file) as i64);
                    MissingClasses::FileOfStamp { folder: folder(), stamp_ns, nearest_ns }
                })
            }
        }
    }

    fn read(&self, path: &Path) -> Result<PointClasses> {
        let unusable = |error: Error| self.problem(error.to_string());
        if path.extension().is_some_and(|end| end == "label") {
            let words = read_labels(path).map_err(unusable)?;
            let class = words.into_iter().map(|word| word as u16).collect();
            return Ok(PointClasses { class, ..PointClasses::default() });
        }
        let array =
            numbers(&read(path).map_err(unusable)?).map_err(|words| problem(path, words))?;
        match array {
            (sides, Numbers::Integers(values)) if matches!(sides[..], [_] | [_, 1] | [1, _]) => {
                // Words have the instance in their upper half.
                let class = values.into_iter().map(|value| value as u16).collect();
                Ok(PointClasses { class, ..PointClasses::default() })
            }
            (sides, Numbers::Floats(values)) if sides.len() == 2 && sides[1] > 1 => {
                self.soft(path, sides[1], &values)
            }
            (sides, numbers) => {
                let kind = match numbers {
                    Numbers::Integers(_) => "integers",
                    Numbers::Floats(_) => "floats",
                };
                let words = format!(
                    "{kind} of shape {sides:?}; an integer for each point or a float for each \
                     point and class is expected"
                );
                Err(problem(path, words))
            }
        }
    }

    /// Classes from a score for each point and class.
    fn soft(&self, path: &Path, classes: usize, scores: &[f32]) -> Result<PointClasses> {
        if classes != self.ids.len() {
            let known = self.ids.len();
            return Err(problem(
                path,
                format!(
                    "scores of {classes} classes; the taxonomy has {known}, \"no class\" among them"
                ),
            ));
        }
        let found = distributions(scores, classes)
            .map_err(|odd| problem(path, format!("scores that are no numbers ({odd})")))?;
        let class =
            found.class.iter().map(|&class| self.ids[usize::from(class)].unwrap_or(0)).collect();
        Ok(PointClasses { class, ..found })
    }

    fn problem(&self, words: String) -> Error {
        problem(&self.folder, words)
    }
}

/// What the name of a file says, if it is one of classes.
fn name(path: &Path) -> Option<Name> {
    let end = path.extension()?.to_str()?;
    if !matches!(end, "label" | "npy") {
        return None;
    }
    let stem = path.file_stem()?.to_str()?;
    let is_number = |text: &str| !text.is_empty() && text.bytes().all(|byte| byte.is_ascii_digit());
    if is_number(stem) {
        return Some(match stem.trim_start_matches('0').len() {
            STAMP_DIGITS.. => Name::Stamp(stem.parse().ok()?),
            _ => Name::Number(stem.parse().ok()?),
        });
    }
    let (whole, part) = stem.split_once(['.', '_'])?;
    if !is_number(whole) || !is_number(part) || part.len() > 9 {
        return None;
    }
    // Behind a point digits are of a fraction, behind an underscore they are nanoseconds.
    let digits = if stem.contains('.') { part.len() } else { 9 };
    let part = part.parse::<i64>().ok()? * 10_i64.pow(9 - digits as u32);
    Some(Name::Stamp(whole.parse::<i64>().ok()?.checked_mul(1_000_000_000)?.checked_add(part)?))
}

fn problem(path: &Path, problem: String) -> Error {
    Error::Classes { source_name: path.display().to_string(), problem }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::datasets::files::write_labels;

    fn of(files: &ClassFiles, number: u64, stamp_ns: i64, points: usize) -> Result<PointClasses> {
        files.of("/points", number, stamp_ns, points)
    }

    fn open(folder: &Path) -> Result<ClassFiles> {
        ClassFiles::open(folder, &Taxonomy::semantic_kitti(), 1_000_000)
    }

    fn npy(descr: &str, shape: &str, data: &[u8]) -> Vec<u8> {
        let header = format!("{{'descr': '{descr}', 'fortran_order': False, 'shape': {shape}, }}");
        let length = (header.len() as u16).to_le_bytes();
        [&b"\x93NUMPY\x01\x00"[..], &length, header.as_bytes(), data].concat()
    }

    #[test]
    fn files_by_number() {
        let folder = tempfile::tempdir().unwrap();
        write_labels(&folder.path().join("000003.label"), &[10 | 5 << 16, 40]).unwrap();
        let integers = npy("<i8", "(2,)", &[30_i64.to_le_bytes(), 70_i64.to_le_bytes()].concat());
        std::fs::write(folder.path().join("4.npy"), integers).unwrap();
        std::fs::write(folder.path().join("readme.txt"), "").unwrap();
        let files = open(folder.path()).unwrap();
        assert_eq!(of(&files, 3, 0, 2).unwrap().class, [10, 40]);
        assert_eq!(of(&files, 4, 0, 2).unwrap().class, [30, 70]);
        let counts = of(&files, 3, 0, 7).unwrap_err();
        assert!(counts.to_string().contains("2 classes for the 7 points of cloud 3"), "{counts}");
        assert!(matches!(counts, Error::Classes { .. }));
        let missing = of(&files, 5, 0, 2).unwrap_err();
        assert!(missing.to_string().contains("no file 000005; 2 files, 3 to 4"), "{missing}");
        assert!(matches!(missing, Error::Frame(FrameError::NoClasses { number: 5, .. })));
        std::fs::write(folder.path().join("000003.label"), [0; 7]).unwrap();
        let cut = of(&files, 3, 0, 2).unwrap_err();
        assert!(matches!(cut, Error::Classes { .. }), "{cut}");
        let other = files.of("/other", 3, 0, 2).unwrap_err().to_string();
        assert!(other.contains("/points") && other.contains("/other"), "{other}");
    }

    #[test]
    fn files_by_stamp() {
        let folder = tempfile::tempdir().unwrap();
        let names =
            ["1317384506400000000.label", "1317384506.5.label", "1317384506_600000001.label"];
        for (name, class) in names.iter().zip([10, 30, 40]) {
            write_labels(&folder.path().join(name), &[class]).unwrap();
        }
        let files = open(folder.path()).unwrap();
        let class = |ns: i64| of(&files, 0, 1_317_384_506_000_000_000 + ns, 1).map(|c| c.class[0]);
        assert_eq!(class(400_000_000).unwrap(), 10);
        assert_eq!(class(499_500_000).unwrap(), 30);
        assert_eq!(class(600_000_000).unwrap(), 40);
        let far = class(450_000_000).unwrap_err().to_string();
        assert!(
            far.contains("1317384506.450000000") && far.contains("0.050000000 s away"),
            "{far}"
        );
    }

    #[test]
    fn scores_for_each_class() {
        let folder = tempfile::tempdir().unwrap();
        let mut scores = [0.0_f32; 40];
        // Class 5 is other-vehicle, whose lowest id is that of a bus.
        (scores[5], scores[20 + 9]) = (50.0, 2.0);
        let data = scores.map(f32::to_le_bytes).concat();
        std::fs::write(folder.path().join("0.npy"), npy("<f4", "(2, 20)", &data)).unwrap();
        let files = open(folder.path()).unwrap();
        let classes = of(&files, 0, 0, 2).unwrap();
        assert_eq!(classes.class, [20, 40]);
        let (confidence, entropy) = (classes.confidence.unwrap(), classes.entropy.unwrap());
        assert!(
            confidence[0] > 0.99 && confidence[1] < 0.5 && entropy[0] < 0.01 && entropy[1] > 0.5
        );
        std::fs::write(folder.path().join("1.npy"), npy("<f4", "(1, 3)", &[0; 12])).unwrap();
        let wrong = of(&open(folder.path()).unwrap(), 1, 0, 1).unwrap_err().to_string();
        assert!(wrong.contains("3 classes"), "{wrong}");
    }

    #[test]
    fn folders_that_say_nothing_or_two_things() {
        let folder = tempfile::tempdir().unwrap();
        let problem = || open(folder.path()).unwrap_err().to_string();
        assert!(problem().contains("000012.label"));
        write_labels(&folder.path().join("1.label"), &[]).unwrap();
        write_labels(&folder.path().join("01.label"), &[]).unwrap();
        assert!(problem().contains("01.label and 1.label"), "{}", problem());
        std::fs::remove_file(folder.path().join("01.label")).unwrap();
        write_labels(&folder.path().join("1317384506400000000.label"), &[]).unwrap();
        assert!(problem().contains("one or the other"));
        assert!(matches!(open(&folder.path().join("none")), Err(Error::Io { .. })));
    }
}
