//! How a cloud's frame stands to one whose x looks ahead, y to the left and z up.
//!
//! Everything that looks for the ground, for what stands on it and for upright boxes reads clouds
//! with z up. A recording may hold them otherwise: other axes, a sensor hung upside down or tilted.
//! The points are then turned before anything else looks at them, and what is found is turned back.

use std::fmt;
use std::str::FromStr;

use nalgebra::{Matrix3, Rotation3, UnitQuaternion, Vector3};

use super::point_cloud::PointCloud;
use super::transforms::{Transforms, VEHICLE_FRAMES};
use super::up::{Axis, ground_area};
use crate::error::CloudError;

/// How the frame of a cloud stands.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub enum SensorFrame {
    /// As the recording's static transforms have it where they lead from the cloud's frame to a
    /// frame of the vehicle ([`VEHICLE_FRAMES`]); else with z up.
    #[default]
    Auto,
    /// With z up.
    AsIs,
    /// As the recording's static transforms have it.
    Recorded,
    /// Turned so: from the cloud's frame to the upright one.
    Turned(UnitQuaternion<f64>),
}

/// Names of frames that stand still while the vehicle moves, in ROS's and others' customs.
const MAP_FRAMES: [&str; 9] =
    ["map", "odom", "world", "earth", "utm", "global", "local", "enu", "camera_init"];

impl SensorFrame {
    /// Turns a cloud upright, and gives it what is known of its frame: whether z is up for certain,
    /// and where the recording has sensors.
    ///
    /// Of recorded transforms only the direction of up is taken, and only where it leans from z by
    /// more than a degree: which way ahead is makes no difference, and below a degree upright boxes
    /// lean by less than 2 cm in a metre. An optical frame is known by its name, unless the points
    /// clearly say otherwise.
    ///
    /// # Errors
    /// [`CloudError::MissingTransform`] if the recording's are asked for and do not lead to the
    /// vehicle.
    pub fn place(
        &self,
        cloud: &mut PointCloud,
        frame_id: &str,
        transforms: &Transforms,
    ) -> Result<(), CloudError> {
        const LEAST_LEAN: f64 = 1.0 / 180.0 * std::f64::consts::PI;
        let recorded = transforms.up_in(frame_id);
        let up = match self {
            SensorFrame::AsIs => Some(Vector3::z()),
            SensorFrame::Turned(turn) => {
                cloud.turn(*turn);
                Some(Vector3::z())
            }
            SensorFrame::Auto => recorded.or_else(|| optical_up(frame_id, cloud)),
            SensorFrame::Recorded => {
                Some(recorded.ok_or_else(|| CloudError::MissingTransform {
                    frame: frame_id.to_owned(),
                    present: transforms.describe(),
                })?)
            }
        };
        if let Some(leaning) = up.filter(|up| up.angle(&Vector3::z()) > LEAST_LEAN) {
            cloud.turn(upright(&leaning));
        }
        cloud.set_frame(up.is_some(), &transforms.sensors_in(frame_id), is_elsewhere(frame_id));
        Ok(())
    }
}

/// The direction of up in a frame whose name says that it is a camera's: x to the right, y down, z
/// ahead. `None` of other names, and where much more ground lies under z.
fn optical_up(frame_id: &str, cloud: &PointCloud) -> Option<Vector3<f64>> {
    const TIMES: f32 = 3.0;
    if !frame_id.to_lowercase().contains("optical") {
        return None;
    }
    let [usual, optical] = [Axis::Z, Axis::MinusY].map(|up| ground_area(cloud, up));
    (usual <= TIMES * optical.max(1.0)).then(|| Axis::MinusY.direction())
}

/// The least turn that brings a direction to z; half a turn about x of the one that points down. A
/// frame with y down is taken for a camera's, whose z looks ahead.
fn upright(up: &Vector3<f64>) -> UnitQuaternion<f64> {
    const CAMERA: f64 = std::f64::consts::FRAC_PI_4;
    if up.angle(&-Vector3::y()) < CAMERA {
        let level = UnitQuaternion::rotation_between(up, &-Vector3::y());
        return axes("rdf").expect("axes of a camera") * level.unwrap_or_default();
    }
    UnitQuaternion::rotation_between(up, &Vector3::z()).unwrap_or_else(|| {
        UnitQuaternion::from_axis_angle(&Vector3::x_axis(), std::f64::consts::PI)
    })
}

/// Which way a frame's x, y and z look, as in `flu`, `right-forward-up` or
/// `x-right,y-forward,z-up`; or roll, pitch and yaw in degrees of the sensor on the vehicle, as in
/// `180,0,0`; or `auto`, `none` or `tf`.
impl FromStr for SensorFrame {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        match text {
            "auto" => return Ok(SensorFrame::Auto),
            "none" => return Ok(SensorFrame::AsIs),
            "tf" => return Ok(SensorFrame::Recorded),
            _ => {}
        }
        let numbers: Result<Vec<f64>, _> =
            text.split(',').map(|part| part.trim().parse::<f64>()).collect();
        match numbers.as_deref() {
            Ok(&[roll, pitch, yaw]) if [roll, pitch, yaw].iter().all(|n| n.is_finite()) => {
                let [roll, pitch, yaw] = [roll, pitch, yaw].map(f64::to_radians);
                Ok(SensorFrame::Turned(UnitQuaternion::from_euler_angles(roll, pitch, yaw)))
            }
            Ok(_) => Err("three angles are wanted, roll, pitch and yaw in degrees: 180,0,0".into()),
            Err(_) => axes(text).map(SensorFrame::Turned),
        }
    }
}

fn axes(text: &str) -> Result<UnitQuaternion<f64>, String> {
    let usage = || {
        format!(
            "`{text}` is no sensor frame: use auto, none, tf, three letters that say where x, y \
             and z look (of forward, back, left, right, up, down, as in rfu), or roll,pitch,yaw in \
             degrees"
        )
    };
    let letters: Vec<char> = match text.len() {
        3 => text.chars().collect(),
        _ => {
            let words = text.split([',', '-']).map(str::trim);
            let words = words.filter(|word| !word.is_empty() && !["x", "y", "z"].contains(word));
            words.filter_map(|word| WORDS.iter().find(|w| w.0 == word).map(|w| w.1)).collect()
        }
    };
    let letters: [char; 3] = letters.try_into().map_err(|_| usage())?;
    let mut matrix = Matrix3::zeros();
    for (axis, letter) in letters.iter().enumerate() {
        let direction = WORDS.iter().find(|word| word.1 == *letter).ok_or_else(usage)?.2;
        matrix.set_column(axis, &Vector3::from(direction));
    }
    match matrix.determinant() {
        d if d > 0.5 => {
            let rotation = Rotation3::from_matrix_unchecked(matrix);
            Ok(UnitQuaternion::from_rotation_matrix(&rotation))
        }
        d if d < -0.5 => {
            Err(format!("the axes `{text}` are left-handed; one of them looks the other way"))
        }
        _ => Err(format!("two of the axes `{text}` look along one line")),
    }
}

/// Names of directions, their letters, and what they are ahead, to the left and upwards.
const WORDS: [(&str, char, [f64; 3]); 6] = [
    ("forward", 'f', [1.0, 0.0, 0.0]),
    ("back", 'b', [-1.0, 0.0, 0.0]),
    ("left", 'l', [0.0, 1.0, 0.0]),
    ("right", 'r', [0.0, -1.0, 0.0]),
    ("up", 'u', [0.0, 0.0, 1.0]),
    ("down", 'd', [0.0, 0.0, -1.0]),
];

impl fmt::Display for SensorFrame {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            SensorFrame::Auto => f.write_str("auto"),
            SensorFrame::AsIs => f.write_str("none"),
            SensorFrame::Recorded => f.write_str("tf"),
            SensorFrame::Turned(turn) => {
                let (roll, pitch, yaw) = turn.euler_angles();
                let degrees =
                    [roll, pitch, yaw].map(|angle| (angle.to_degrees() * 1e6).round() / 1e6);
                let [roll, pitch, yaw] = degrees.map(|angle| angle + 0.0);
                write!(f, "{roll},{pitch},{yaw}")
            }
        }
    }
}

/// Whether a frame is a vehicle's or a map's by its name, where no sensor stands at the origin.
fn is_elsewhere(frame: &str) -> bool {
    let name = frame.trim_start_matches('/');
    VEHICLE_FRAMES.contains(&name) || MAP_FRAMES.contains(&name)
}

#[cfg(test)]
mod tests {
    use std::f64::consts::PI;

    use nalgebra::Isometry3;

    use super::*;

    fn turned(text: &str, v: [f64; 3]) -> [f64; 3] {
        let Ok(SensorFrame::Turned(turn)) = text.parse() else { panic!("{text}") };
        (turn * Vector3::from(v)).map(|x| (x * 1e9).round() / 1e9 + 0.0).into()
    }

    #[test]
    fn axes_are_named_by_where_they_look() {
        for text in ["rfu", "right-forward-up", "x-right,y-forward,z-up"] {
            assert_eq!(turned(text, [1.0, 2.0, 3.0]), [2.0, -1.0, 3.0], "{text}");
        }
        assert_eq!(turned("flu", [1.0, 2.0, 3.0]), [1.0, 2.0, 3.0]);
        assert_eq!(turned("frd", [1.0, 2.0, 3.0]), [1.0, -2.0, -3.0]);
        assert_eq!(turned("rdf", [1.0, 2.0, 3.0]), [3.0, -1.0, -2.0]);
        for (text, problem) in [
            ("lfu", "left-handed"),
            ("ffu", "along one line"),
            ("abc", "no sensor frame"),
            ("left-up", "no sensor frame"),
            ("1,2", "three angles"),
            ("nan,0,0", "three angles"),
            ("", "no sensor frame"),
        ] {
            let error = text.parse::<SensorFrame>().unwrap_err();
            assert!(error.contains(problem), "{text}: {error}");
        }
    }

    #[test]
    fn angles_are_the_sensor_s_on_the_vehicle() {
        assert_eq!(turned("180,0,0", [1.0, 2.0, 3.0]), [1.0, -2.0, -3.0]);
        assert_eq!(turned("0,90,0", [1.0, 0.0, 0.0]), [0.0, 0.0, -1.0], "the front looks down");
        assert_eq!(turned("0,0,90", [1.0, 0.0, 0.0]), [0.0, 1.0, 0.0]);
        assert_eq!("180,0,-90".parse::<SensorFrame>().unwrap().to_string(), "180,0,-90");
    }

    #[test]
    fn a_camera_looks_ahead_along_its_z() {
        let turned = |up: Vector3<f64>, v: Vector3<f64>| (upright(&up) * v).map(|x| x + 0.0);
        let ahead = turned(-Vector3::y(), Vector3::new(1.0, 2.0, 3.0));
        assert!((ahead - Vector3::new(3.0, -1.0, -2.0)).norm() < 1e-12, "{ahead}");
        let lowered = Vector3::new(0.0, -1.0, -0.4).normalize();
        assert!((turned(lowered, lowered) - Vector3::z()).norm() < 1e-12);
        assert!(turned(lowered, Vector3::z()).x > 0.9, "still about ahead");
    }

    #[test]
    fn transforms_lead_to_the_vehicle_in_either_direction() {
        let mut transforms = Transforms::default();
        let roll = |degrees: f64| Isometry3::rotation(Vector3::x() * degrees.to_radians());
        transforms.insert("base_link", "mast", roll(90.0));
        transforms.insert("/mast", "/lidar", roll(90.0));
        transforms.insert("lidar", "imu", roll(0.0));
        for frame in ["lidar", "/lidar", "imu"] {
            let up = transforms.up_in(frame).unwrap();
            assert!(up.angle(&-Vector3::z()) < 1e-9, "{up}");
            let mut cloud = PointCloud::default();
            SensorFrame::Auto.place(&mut cloud, frame, &transforms).unwrap();
            assert!((cloud.turned.angle() - PI).abs() < 1e-9);
        }
        assert_eq!(transforms.up_in("elsewhere"), None);
        let mut cloud = PointCloud::default();
        SensorFrame::Auto.place(&mut cloud, "elsewhere", &transforms).unwrap();
        assert_eq!((cloud.turned, cloud.is_z_up), (UnitQuaternion::identity(), false));
        let placed = SensorFrame::Recorded.place(&mut cloud, "elsewhere", &transforms);
        let error = placed.unwrap_err().to_string();
        assert!(error.contains("`elsewhere`") && error.contains("base_link <- mast"), "{error}");
    }

    #[test]
    fn a_turn_about_the_vertical_and_a_lean_of_half_a_degree_are_left_alone() {
        let mut transforms = Transforms::default();
        let lean = UnitQuaternion::from_euler_angles(0.5_f64.to_radians(), 0.0, 1.2);
        transforms.insert("base_link", "lidar", nalgebra::convert(lean));
        let mut cloud = PointCloud::default();
        SensorFrame::Auto.place(&mut cloud, "lidar", &transforms).unwrap();
        assert_eq!((cloud.turned, cloud.is_z_up), (UnitQuaternion::identity(), true));
    }

    #[test]
    fn sensors_are_known_by_the_names_of_their_frames() {
        let mut transforms = Transforms::default();
        let roof = Isometry3::translation(1.0, 0.0, 1.8);
        transforms.insert("base_link", "roof", roof);
        transforms.insert("roof", "os_sensor", Isometry3::translation(0.1, 0.0, 0.2));
        transforms.insert("os_sensor", "os_imu", Isometry3::identity());
        transforms.insert("roof", "front_camera_optical_frame", Isometry3::identity());
        assert_eq!(transforms.sensors_in("base_link"), [Vector3::new(1.1, 0.0, 2.0)]);
        assert!(transforms.sensors_in("os_sensor").is_empty());
        let mut cloud = PointCloud::default();
        SensorFrame::AsIs.place(&mut cloud, "/base_link", &transforms).unwrap();
        assert_eq!(cloud.recorded_sensors, [Vector3::new(1.1, 0.0, 2.0)]);
    }
}
