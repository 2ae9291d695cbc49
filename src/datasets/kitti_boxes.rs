//! Boxes in the files of KITTI's object benchmark (Geiger, Lenz and Urtasun 2012).
//!
//! A label file has a line for each object: type, truncated, occluded, alpha, four numbers of the
//! box in the image, height, width and length in metres, the place x y z in metres, rotation_y in
//! radians and, of a detector, a score. The place is the centre of the bottom in the rectified
//! frame of camera 0 (x right, y down, z forward); rotation_y turns the length, which lies along x,
//! about y. The calibration of the object benchmark leads there from the LiDAR by `R0_rect` and
//! `Tr_velo_to_cam`, that of odometry by `Tr` alone.
//!
//! The camera's y is taken for the vertical of the LiDAR: a box keeps its height and the direction
//! of its length on the LiDAR's plane. In KITTI's cars the two differ by less than a degree.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use nalgebra::{Matrix3, Vector3};

use crate::error::{Error, Result};
use divmerge_core::cloud::taxonomy::Taxonomy;
use divmerge_core::cloud::{Detection, UprightBox};

/// KITTI's types and the names of the class that a taxonomy may have for them; SemanticKITTI labels
/// vans as cars.
const TYPES: [(&str, &[&str]); 8] = [
    ("Car", &["car"]),
    ("Van", &["car"]),
    ("Truck", &["truck"]),
    ("Pedestrian", &["person", "pedestrian", "people"]),
    ("Person_sitting", &["person", "pedestrian", "people"]),
    ("Cyclist", &["bicyclist", "cyclist"]),
    ("Tram", &["other-vehicle"]),
    ("Misc", &["other-vehicle"]),
];

/// Type of regions that were not labelled.
const NOT_LABELLED: &str = "DontCare";

/// Score of a box that has none.
const CERTAIN: f64 = 1.0;

/// The label files of a folder and their calibration; each is read when its cloud is.
#[derive(Debug, Clone, PartialEq)]
pub struct KittiBoxes {
    labels: PathBuf,
    calibration: Calibrations,
    /// By the places of [`TYPES`]: class number; `None` (any class) where the taxonomy has none of
    /// the names.
    classes: [Option<u16>; TYPES.len()],
}

#[derive(Debug, Clone, PartialEq)]
enum Calibrations {
    /// One for all clouds.
    One(ObjectCalibration),
    /// A folder with one for each cloud.
    Folder(PathBuf),
}

impl KittiBoxes {
    /// Opens a folder of label files with one calibration, or with a folder of one for each.
    ///
    /// # Errors
    /// [`Error::Boxes`] if there is no label file at all, or the one calibration cannot be used.
    pub fn open(labels: &Path, calibration: &Path, taxonomy: &Taxonomy) -> Result<Self> {
        let unlisted = |error: std::io::Error| problem(labels, error.to_string());
        let mut names = std::fs::read_dir(labels).map_err(unlisted)?;
        if !names.any(|name| name.is_ok_and(|name| is_numbered(&name.path()))) {
            return Err(problem(labels, "no label file `NNNNNN.txt` is in it".into()));
        }
        let calibration = match calibration.is_dir() {
            true => Calibrations::Folder(calibration.to_owned()),
            false => Calibrations::One(ObjectCalibration::read(calibration)?),
        };
        let class = |names: &[&str]| names.iter().find_map(|name| taxonomy.class_called(name));
        let classes = TYPES.map(|(_, names)| class(names));
        Ok(KittiBoxes { labels: labels.to_owned(), calibration, classes })
    }

    /// The label file of the cloud of a number, whether it is there or not: KITTI writes empty
    /// files for frames without objects.
    pub fn label_file(&self, number: u64) -> PathBuf {
        numbered(&self.labels, number)
    }

    /// The boxes of the cloud of a number; `None` without a label file.
    ///
    /// # Errors
    /// [`Error::Boxes`] if the label file or its calibration cannot be read or used.
    pub fn of(&self, number: u64) -> Result<Option<Vec<Detection>>> {
        let path = self.label_file(number);
        if !path.exists() {
            return Ok(None);
        }
        let text = read(&path)?;
        let calibration = match &self.calibration {
            Calibrations::One(calibration) => *calibration,
            Calibrations::Folder(folder) => ObjectCalibration::read(&numbered(folder, number))?,
        };
        let mut detections = Vec::new();
        for (number, line) in (1..).zip(text.lines()).filter(|(_, line)| !line.trim().is_empty()) {
            let found = self.detection(line, &calibration);
            let found = found.map_err(|what| problem(&path, format!("line {number}: {what}")))?;
            detections.extend(found);
        }
        Ok(Some(detections))
    }

    /// The object of a line; `None` for a region that was not labelled.
    fn detection(
        &self,
        line: &str,
        calibration: &ObjectCalibration,
    ) -> std::result::Result<Option<Detection>, String> {
        let (name, values) = line.trim().split_once(char::is_whitespace).unwrap_or((line, ""));
        if name == NOT_LABELLED {
            return Ok(None);
        }
        let Some(known) = TYPES.iter().position(|(known, _)| *known == name) else {
            let known: Vec<&str> = TYPES.iter().map(|(name, _)| *name).collect();
            return Err(format!(
                "unknown type `{name}`; there are {} and {NOT_LABELLED}",
                known.join(", ")
            ));
        };
        let values = numbers(values)?;
        // Truncated, occluded, alpha and the box in the image are not asked.
        let (size, place, rotation_y, score) = match values[..] {
            [_, _, _, _, _, _, _, h, w, l, x, y, z, rotation_y] => {
                ([h, w, l], [x, y, z], rotation_y, CERTAIN)
            }
            [_, _, _, _, _, _, _, h, w, l, x, y, z, rotation_y, score] => {
                ([h, w, l], [x, y, z], rotation_y, score)
            }
            _ => {
                return Err(format!(
                    "{} numbers behind the type; 14 are needed, or 15 with a score",
                    values.len()
                ));
            }
        };
        if size.into_iter().any(|side| side <= 0.0) {
            return Err(format!("an object of {size:?} m (height, width, length)"));
        }
        let bounds = calibration.to_lidar(size, place, rotation_y);
        Ok(Some(Detection { bounds, class: self.classes[known], score }))
    }
}

/// From the LiDAR to the rectified frame of camera 0, and back.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ObjectCalibration {
    /// Rotation, and rectification, of the way back.
    back: Matrix3<f64>,
    /// The LiDAR's origin in the rectified frame, metres.
    origin: Vector3<f64>,
}

impl ObjectCalibration {
    /// Reads a calibration of the object benchmark (`R0_rect` and `Tr_velo_to_cam`; `R_rect` and
    /// `Tr_velo_cam` in tracking) or of odometry (`Tr`).
    ///
    /// # Errors
    /// [`Error::Boxes`] if it cannot be read, has none of these, or they are not as many numbers as
    /// they should be or cannot be turned round.
    pub fn read(path: &Path) -> Result<Self> {
        Self::parse(&read(path)?).map_err(|what| problem(path, what))
    }

    fn parse(text: &str) -> std::result::Result<Self, String> {
        let lines = text.lines().filter_map(|line| line.trim().split_once(char::is_whitespace));
        let lines: BTreeMap<&str, &str> =
            lines.map(|(name, values)| (name.trim_end_matches(':'), values)).collect();
        let first =
            |names: &[&'static str]| names.iter().find_map(|&name| Some((name, *lines.get(name)?)));
        let to_camera = first(&["Tr_velo_to_cam", "Tr_velo_cam"]);
        let rectification = first(&["R0_rect", "R_rect"]);
        let (rectification, to_camera) = match (to_camera, rectification, first(&["Tr"])) {
            (Some(to_camera), Some((name, values)), _) => {
                (Matrix3::from_row_slice(&exactly::<9>(name, values)?), to_camera)
            }
            (None, _, Some(to_rectified)) => (Matrix3::identity(), to_rectified),
            _ => {
                let names: Vec<&str> = lines.into_keys().collect();
                return Err(format!(
                    "neither R0_rect and Tr_velo_to_cam nor Tr is in it; it has {}",
                    names.join(", ")
                ));
            }
        };
        let [a, b, c, x, d, e, f, y, g, h, i, z] = exactly::<12>(to_camera.0, to_camera.1)?;
        let to_rectified = rectification * Matrix3::new(a, b, c, d, e, f, g, h, i);
        let back = to_rectified.try_inverse();
        let back = back.ok_or_else(|| format!("{} cannot be turned round", to_camera.0))?;
        Ok(ObjectCalibration { back, origin: rectification * Vector3::new(x, y, z) })
    }

    /// The box of an object: height, width and length, centre of the bottom in metres in the
    /// rectified frame, and rotation_y in radians.
    fn to_lidar(
        self,
        [height, width, length]: [f64; 3],
        [x, y, z]: [f64; 3],
        rotation_y: f64,
    ) -> UprightBox {
        let centre = self.back * (Vector3::new(x, y - height / 2.0, z) - self.origin);
        let (sin, cos) = rotation_y.sin_cos();
        let along = self.back * Vector3::new(cos, 0.0, -sin);
        UprightBox::new(centre.into(), [length, width, height], along.y.atan2(along.x))
    }
}

fn exactly<const N: usize>(name: &str, text: &str) -> std::result::Result<[f64; N], String> {
    let wrong = |found: Vec<f64>| format!("{name} has {} numbers; {N} are needed", found.len());
    numbers(text)?.try_into().map_err(wrong)
}

fn numbers(text: &str) -> std::result::Result<Vec<f64>, String> {
    let number = |word: &str| match word.parse::<f64>() {
        Ok(number) if number.is_finite() => Ok(number),
        _ => Err(format!("`{word}` is no number")),
    };
    text.split_whitespace().map(number).collect()
}

fn numbered(folder: &Path, number: u64) -> PathBuf {
    folder.join(format!("{number:06}.txt"))
}

fn is_numbered(path: &Path) -> bool {
    let stem = path.file_stem().and_then(|stem| stem.to_str()).unwrap_or_default();
    let is_number = stem.len() >= 6 && stem.bytes().all(|byte| byte.is_ascii_digit());
    is_number && path.extension().is_some_and(|end| end == "txt")
}

fn read(path: &Path) -> Result<String> {
    std::fs::read_to_string(path).map_err(|error| problem(path, error.to_string()))
}

fn problem(path: &Path, problem: String) -> Error {
    Error::Boxes { source_name: path.display().to_string(), problem }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::FRAC_PI_2;

    /// The camera's axes out of the LiDAR's (x right is -y, y down is -z, z forward is x), 0.1 m
    /// ahead of it, 0.2 m below and 0.3 m to its left: the LiDAR's origin lies at (0.3, -0.2, -0.1)
    /// before rectification.
    const VELO_TO_CAM: &str = "0 -1 0 0.3  0 0 -1 -0.2  1 0 0 -0.1";

    fn object_calibration() -> ObjectCalibration {
        // Rectification: a quarter turn about the camera's z, so that its order and its inverse
        // show.
        let text = format!(
            "P0: 1 0 0 0 0 1 0 0 0 0 1 0\nR0_rect: 0 -1 0 1 0 0 0 0 1\n\
             Tr_velo_to_cam: {VELO_TO_CAM}\n\
             Tr_imu_to_velo: 1 0 0 0 0 1 0 0 0 0 1 0\n\n"
        );
        ObjectCalibration::parse(&text).unwrap()
    }

    fn odometry_calibration() -> ObjectCalibration {
        ObjectCalibration::parse(&format!("P0: 1 2 3\nTr: {VELO_TO_CAM}\n")).unwrap()
    }

    fn near(found: UprightBox, centre: [f64; 3], size: [f64; 3], yaw: f64) {
        let same = |a: f64, b: f64| (a - b).abs() < 1e-9;
        let centres = found.centre.into_iter().zip(centre).all(|(a, b)| same(a, b));
        assert!(centres && found.size == size && same(found.yaw, yaw), "{found:?}");
    }

    #[test]
    fn odometry_by_hand() {
        // Bottom at 10 m ahead of the camera, 2 m to its right and 1.6 m below it; the centre is
        // 0.75 m higher. In the LiDAR's frame: x = 10 + 0.1, y = -(2 - 0.3), z = -(0.85 + 0.2).
        let found = odometry_calibration().to_lidar([1.5, 1.8, 4.0], [2.0, 1.6, 10.0], -FRAC_PI_2);
        near(found, [10.1, -1.7, -1.05], [4.0, 1.8, 1.5], 0.0); // -90 degrees: away from the camera
        // 0: the length lies along the camera's x, which is the LiDAR's -y.
        let across = odometry_calibration().to_lidar([1.5, 1.8, 4.0], [2.0, 1.6, 10.0], 0.0);
        near(across, [10.1, -1.7, -1.05], [4.0, 1.8, 1.5], FRAC_PI_2);
        // rotation_y turns from the camera's x towards -z: yaw = -rotation_y - 90 degrees.
        let turned = odometry_calibration().to_lidar([1.5, 1.8, 4.0], [2.0, 1.6, 10.0], -1.2);
        near(turned, [10.1, -1.7, -1.05], [4.0, 1.8, 1.5], 1.2 - FRAC_PI_2);
    }

    #[test]
    fn object_by_hand() {
        // Rectified (X, Y, Z) is camera (-y, x, z), so camera x = Y, y = -X. The centre is 1 m
        // above the bottom along rectified y: (-1, 3, 8) - (0, 1, 0) = (-1, 2, 8), in the camera
        // (2, 1, 8), in the LiDAR x = 8 + 0.1, y = -(2 - 0.3), z = -(1 + 0.2).
        let calibration = object_calibration();
        let found = calibration.to_lidar([2.0, 1.0, 4.0], [-1.0, 3.0, 8.0], -FRAC_PI_2);
        near(found, [8.1, -1.7, -1.2], [4.0, 1.0, 2.0], 0.0);
    }

    fn boxes(lines: &str) -> Result<Option<Vec<Detection>>> {
        let folder = tempfile::tempdir().unwrap();
        let labels = folder.path().join("labels");
        std::fs::create_dir(&labels).unwrap();
        std::fs::write(labels.join("000003.txt"), lines).unwrap();
        let calibration = folder.path().join("calib.txt");
        std::fs::write(&calibration, format!("Tr: {VELO_TO_CAM}\n")).unwrap();
        KittiBoxes::open(&labels, &calibration, &Taxonomy::semantic_kitti())?.of(3)
    }

    #[test]
    fn lines_of_a_label_file() {
        let object = "0.00 0 -1.5 100 200 300 400 1.5 1.8 4.0 2.0 1.6 10.0 -1.2";
        let names = ["Van", "Person_sitting", "Cyclist", "Tram", "Truck"];
        let mut lines: String = names.iter().map(|name| format!("{name} {object}\n")).collect();
        lines += &format!(
            "Car {object} 0.25\nDontCare -1 -1 -10 1 2 3 4 -1 -1 -1 -1000 -1000 -1000 -10\n"
        );
        let found = boxes(&lines).unwrap().unwrap();
        let taxonomy = Taxonomy::semantic_kitti();
        let classes = ["car", "person", "bicyclist", "other-vehicle", "truck", "car"];
        let classes = classes.map(|name| taxonomy.class_named(name));
        assert_eq!(found.iter().map(|found| found.class).collect::<Vec<_>>(), classes);
        assert_eq!((found[0].score, found[5].score), (1.0, 0.25));
        near(found[0].bounds, [10.1, -1.7, -1.05], [4.0, 1.8, 1.5], 1.2 - FRAC_PI_2);
        assert_eq!(boxes("").unwrap(), Some(vec![]));
    }

    #[test]
    fn what_cannot_be_used_is_named() {
        let refused = |lines: &str, words: &[&str]| {
            let error = boxes(lines).unwrap_err().to_string();
            assert!(words.iter().all(|word| error.contains(word)), "{error}");
        };
        let object = "0 0 0 1 2 3 4 1.5 1.8 4.0 2.0 1.6 10.0 -1.2";
        refused(&format!("Car {object}\nBus {object}\n"), &["000003.txt", "line 2", "`Bus`"]);
        refused("Car 0 0 0 1 2 3 4 1.5", &["line 1", "8 numbers"]);
        refused(&format!("Car {object} sure"), &["line 1", "`sure`"]);
        refused("Car 0 0 0 1 2 3 4 0 1 4 2 1.6 10 -1", &["line 1", "0.0"]);
        for (text, word) in [
            ("P0: 1 2 3", "P0"),
            ("Tr: 1 2 3", "Tr has 3"),
            ("Tr: 0 0 0 0 0 0 0 0 0 0 0 0", "turned round"),
            ("Tr_velo_to_cam: 1 0 0 0 0 1 0 0 0 0 1 0", "R0_rect"),
        ] {
            let error = ObjectCalibration::parse(text).unwrap_err();
            assert!(error.contains(word), "{error}");
        }
    }

    #[test]
    fn a_missing_label_file_is_told_and_a_missing_calibration_an_error() {
        let folder = tempfile::tempdir().unwrap();
        let taxonomy = Taxonomy::semantic_kitti();
        let open = || KittiBoxes::open(folder.path(), folder.path(), &taxonomy);
        assert!(open().unwrap_err().to_string().contains("NNNNNN.txt"));
        std::fs::write(folder.path().join("000001.txt"), "").unwrap();
        assert_eq!(open().unwrap().of(2).unwrap(), None);
        assert!(open().unwrap().label_file(2).ends_with("000002.txt"));
        // The empty file stands for the calibration too, and has none.
        assert!(open().unwrap().of(1).unwrap_err().to_string().contains("000001.txt"));
    }
}
