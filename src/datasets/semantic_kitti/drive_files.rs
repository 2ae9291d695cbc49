//! `times.txt`, `calib.txt` and `poses.txt` of a sequence, as KITTI's odometry benchmark defines
//! them.

use nalgebra::{Isometry3, Matrix3, Matrix3x4, Rotation3, Translation3, UnitQuaternion, Vector3};

/// A value, or what is wrong.
type Parsed<T> = std::result::Result<T, String>;

/// A line of `calib.txt` for each camera, and how the scanner stands to the first.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct OdometryCalibration {
    /// Cameras with their P, 3 x 4 and row by row: takes metres in the frame of camera 0 to pixels
    /// of this one.
    pub projections: Vec<(u8, [f64; 12])>,
    /// `Tr`: takes coordinates of the scanner to coordinates of camera 0, metres.
    pub camera_from_scanner: Option<Isometry3<f64>>,
}

impl OdometryCalibration {
    /// Reads lines of a key, a colon and twelve numbers. Keys other than P0 to P3 and Tr are passed
    /// over.
    pub fn parse(text: &str) -> Parsed<Self> {
        let mut calibration = OdometryCalibration::default();
        for (number, line) in lines(text) {
            let Some((key, numbers)) = line.split_once(':') else {
                return Err(format!("line {number} has no colon"));
            };
            let in_line = |problem| format!("line {number}: {problem}");
            match key.trim() {
                "Tr" => {
                    let pose = rigid(numbers).map_err(in_line)?;
                    calibration.camera_from_scanner = Some(pose);
                }
                key @ ("P0" | "P1" | "P2" | "P3") => {
                    let projection = twelve(numbers).map_err(in_line)?;
                    calibration.projections.push((key.as_bytes()[1] - b'0', projection));
                }
                _ => {}
            }
        }
        Ok(calibration)
    }
}

/// Seconds since the start, a line each, as nanoseconds; they must ascend.
pub fn times(text: &str) -> Parsed<Vec<u64>> {
    /// A year, which no drive takes.
    const MOST: f64 = 3e7;
    let mut times: Vec<u64> = Vec::new();
    for (number, line) in lines(text) {
        let seconds = line.trim().parse().ok().filter(|seconds| (0.0..MOST).contains(seconds));
        let seconds: f64 =
            seconds.ok_or_else(|| format!("line {number}: `{line}` is no time in seconds"))?;
        let time = (seconds * 1e9).round() as u64;
        if times.last().is_some_and(|&last| last >= time) {
            return Err(format!("line {number}: {line} s is not after the time before"));
        }
        times.push(time);
    }
    Ok(times)
}

/// Poses of camera 0, a line of twelve numbers each: take its coordinates to those that it had at
/// first, metres.
pub fn poses(text: &str) -> Parsed<Vec<Isometry3<f64>>> {
    let pose = |(number, line)| rigid(line).map_err(|problem| format!("line {number}: {problem}"));
    lines(text).map(pose).collect()
}

/// Lines with their numbers from 1, those at the end that are empty left out.
fn lines(text: &str) -> impl Iterator<Item = (usize, &str)> {
    text.trim_end().lines().enumerate().map(|(number, line)| (number + 1, line))
}

/// The upper three rows of a matrix that turns and moves, row by row.
fn rigid(text: &str) -> Parsed<Isometry3<f64>> {
    /// How far the columns may be from upright unit vectors: files have six digits.
    const TOLERANCE: f64 = 1e-3;
    let matrix = Matrix3x4::from_row_slice(&twelve(text)?);
    let rotation: Matrix3<f64> = matrix.fixed_view::<3, 3>(0, 0).into();
    let skew = (rotation * rotation.transpose() - Matrix3::identity()).amax();
    if skew > TOLERANCE || rotation.determinant() < 0.0 {
        return Err("not a rotation and a translation".into());
    }
    let translation: Vector3<f64> = matrix.column(3).into();
    let rotation = Rotation3::from_matrix_unchecked(rotation);
    // The digits of a file make no exact rotation, and what they make no exact unit quaternion.
    let nearly = UnitQuaternion::from_rotation_matrix(&rotation).into_inner();
    let rotation = UnitQuaternion::new_normalize(nearly);
    Ok(Isometry3::from_parts(Translation3::from(translation), rotation))
}

fn twelve(text: &str) -> Parsed<[f64; 12]> {
    let numbers = text.split_ascii_whitespace().map(str::parse::<f64>);
    let numbers: Vec<f64> = numbers
        .collect::<std::result::Result<_, _>>()
        .map_err(|_| "a word that is no number".to_owned())?;
    if numbers.iter().any(|number| !number.is_finite()) {
        return Err("a number that is not finite".into());
    }
    let count = numbers.len();
    numbers.try_into().map_err(|_| format!("{count} numbers where 12 belong"))
}

#[cfg(test)]
mod tests {
    use super::*;

    const QUARTER: &str = "0 -1 0 1  1 0 0 2  0 0 1 3";

    #[test]
    fn a_quarter_turn() {
        let poses = poses(&format!("1 0 0 0 0 1 0 0 0 0 1 0\n{QUARTER}\n\n")).unwrap();
        assert_eq!(poses[0], Isometry3::identity());
        let moved = poses[1] * nalgebra::Point3::new(1.0, 0.0, 0.0);
        assert!((moved - nalgebra::Point3::new(1.0, 3.0, 3.0)).norm() < 1e-12, "{moved}");
        let mirror = "1 0 0 0 0 1 0 0 0 0 -1 0";
        for (line, problem) in [
            (mirror, "not a rotation"),
            ("2 0 0 0 0 2 0 0 0 0 2 0", "not a rotation"),
            ("1 0 0 0 0 1 0 0 0 0 1", "11 numbers"),
            ("1 0 0 0 0 1 0 0 0 0 1 x", "no number"),
            ("1 0 0 0 0 1 0 0 0 0 1 nan", "not finite"),
            ("", "0 numbers"),
        ] {
            let error = super::poses(&format!("{QUARTER}\n{line}\n{QUARTER}")).unwrap_err();
            assert!(error.contains("line 2") && error.contains(problem), "{error}");
        }
    }

    #[test]
    fn calibration_with_and_without_the_scanner() {
        let text = format!("P0: {QUARTER}\nP2: {QUARTER}\nother: 1 2\nTr: {QUARTER}\n");
        let calibration = OdometryCalibration::parse(&text).unwrap();
        assert_eq!(calibration.projections.iter().map(|(n, _)| *n).collect::<Vec<_>>(), [0, 2]);
        assert_eq!(calibration.projections[1].1[4..8], [1.0, 0.0, 0.0, 2.0]);
        assert!(calibration.camera_from_scanner.is_some());
        let without = OdometryCalibration::parse(&format!("P0: {QUARTER}")).unwrap();
        assert_eq!(without.camera_from_scanner, None);
        assert!(OdometryCalibration::parse("P0: 1 2").unwrap_err().contains("line 1: 2 numbers"));
        assert!(OdometryCalibration::parse("P0").unwrap_err().contains("no colon"));
    }

    #[test]
    fn times_ascend() {
        assert_eq!(times("0.000000e+00\n1.037359e-01\n").unwrap(), [0, 103_735_900]);
        assert!(times("0\n0.1\n0.1\n").unwrap_err().contains("line 3"));
        assert!(times("0\nx\n").unwrap_err().contains("line 2: `x`"));
        assert!(times("-1").is_err() && times("nan").is_err() && times("1e300").is_err());
        assert!(times("").unwrap().is_empty());
    }
}
