//! Messages that say where an antenna is on the earth, by satellites.

use foxglove::Decode;
use foxglove::messages::LocationFix;
use nalgebra::{Matrix3, Vector3};

use super::poses::{Ros, foxglove_stamp};
use super::ros::RosReader;
use super::stamp::stamp_ns;
use crate::error::frame::Result;

/// A message that says where an antenna is on the earth.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum FixMessage {
    /// `sensor_msgs/NavSatFix`.
    NavSatFix(Ros),
    /// `foxglove.LocationFix` in protocol buffers.
    LocationFix,
}

/// Where an antenna is.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Fix {
    /// Nanoseconds since 1970.
    pub(crate) stamp_ns: i64,
    /// The frame of the antenna.
    pub(crate) frame_id: String,
    pub(crate) place: Geodetic,
    /// Standard deviation on the plane, the larger of east and north, metres; `None` if unknown.
    pub(crate) error: Option<f64>,
}

/// A place on the ellipsoid of WGS 84.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Geodetic {
    /// Radians, north positive.
    pub(crate) latitude: f64,
    /// Radians, east positive.
    pub(crate) longitude: f64,
    /// Metres above the ellipsoid; `None` if unknown.
    pub(crate) altitude: Option<f64>,
}

/// The plane that touches the ellipsoid below a place: x east, y north, z up, metres from there.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct TangentPlane {
    origin: Vector3<f64>,
    /// Takes directions of the earth to directions of the plane.
    turn: Matrix3<f64>,
}

impl FixMessage {
    /// The message of a type and an encoding; `None` where it says no place on the earth.
    pub(crate) fn named(type_name: &str, encoding: &str) -> Option<Self> {
        match (type_name.rsplit(['/', '.']).next()?, encoding) {
            ("NavSatFix", "ros1") => Some(FixMessage::NavSatFix(Ros::One)),
            ("NavSatFix", "cdr") => Some(FixMessage::NavSatFix(Ros::Two)),
            ("LocationFix", "protobuf") => Some(FixMessage::LocationFix),
            _ => None,
        }
    }

    /// The fix in a message; `None` where it has none: no satellites, or no numbers.
    ///
    /// # Errors
    /// [`FrameError::Malformed`](crate::error::FrameError::Malformed) where it ends too early.
    pub(crate) fn read(self, message: &[u8]) -> Result<Option<Fix>> {
        match self {
            FixMessage::NavSatFix(ros) => read_nav_sat_fix(ros, message),
            FixMessage::LocationFix => Ok(LocationFix::decode(message).ok().and_then(|fix| {
                let degrees = [fix.latitude, fix.longitude];
                let covariance = <[f64; 9]>::try_from(fix.position_covariance).ok();
                Some(Fix {
                    stamp_ns: foxglove_stamp(fix.timestamp),
                    frame_id: fix.frame_id,
                    place: Geodetic::new(degrees, fix.altitude)?,
                    error: error(fix.position_covariance_type, covariance.unwrap_or_default()),
                })
            })),
        }
    }
}

fn read_nav_sat_fix(ros: Ros, message: &[u8]) -> Result<Option<Fix>> {
    /// `NavSatStatus.STATUS_NO_FIX`; those that are higher are better.
    const NO_FIX: i8 = -1;
    let mut reader = RosReader::new("sensor_msgs/msg/NavSatFix", ros == Ros::One, message)?;
    let (sec, nanosec, frame_id) = reader.header()?;
    let status = reader.i8()?;
    let _service = reader.u16()?;
    let [latitude, longitude, altitude] = reader.f64s()?;
    let covariance = reader.f64s()?;
    let error = error(i32::from(reader.u8()?), covariance);
    let place = Geodetic::new([latitude, longitude], altitude).filter(|_| status > NO_FIX);
    let stamp_ns = stamp_ns(sec, nanosec);
    Ok(place.map(|place| Fix { stamp_ns, frame_id, place, error }))
}

/// The standard deviation on the plane by a covariance, row by row from east; type 0 is unknown.
fn error(covariance_type: i32, covariance: [f64; 9]) -> Option<f64> {
    (covariance_type != 0).then(|| covariance[0].max(covariance[4]).max(0.0).sqrt())
}

impl Geodetic {
    /// A place in degrees and metres; `None` where they are none. An altitude may be unknown.
    fn new([latitude, longitude]: [f64; 2], altitude: f64) -> Option<Self> {
        // NaN is in no range.
        let is_place = (-90.0..=90.0).contains(&latitude) && longitude.abs() <= 360.0;
        is_place.then(|| Geodetic {
            latitude: latitude.to_radians(),
            longitude: longitude.to_radians(),
            altitude: altitude.is_finite().then_some(altitude),
        })
    }

    /// Earth-centred coordinates at an altitude, metres: NIMA TR8350.2, "Department of Defense
    /// World Geodetic System 1984", third edition, equations 4-14 and 4-15.
    fn earth_centred(&self, altitude: f64) -> Vector3<f64> {
        /// Half the larger axis of the ellipsoid, metres, and its flattening: the same, table 3.1.
        const A: f64 = 6_378_137.0;
        const FLATTENING: f64 = 1.0 / 298.257_223_563;
        const E_SQUARED: f64 = FLATTENING * (2.0 - FLATTENING);
        let ((sin_lat, cos_lat), (sin_lon, cos_lon)) =
            (self.latitude.sin_cos(), self.longitude.sin_cos());
        let n = A / (1.0 - E_SQUARED * sin_lat * sin_lat).sqrt();
        let across = (n + altitude) * cos_lat;
        let along = (n * (1.0 - E_SQUARED) + altitude) * sin_lat;
        Vector3::new(across * cos_lon, across * sin_lon, along)
    }
}

impl TangentPlane {
    /// The plane below a place, at an altitude in metres.
    pub(crate) fn at(place: &Geodetic, altitude: f64) -> Self {
        let ((sin_lat, cos_lat), (sin_lon, cos_lon)) =
            (place.latitude.sin_cos(), place.longitude.sin_cos());
        let turn = Matrix3::new(
            -sin_lon,
            cos_lon,
            0.0,
            -sin_lat * cos_lon,
            -sin_lat * sin_lon,
            cos_lat,
            cos_lat * cos_lon,
            cos_lat * sin_lon,
            sin_lat,
        );
        TangentPlane { origin: place.earth_centred(altitude), turn }
    }

    /// Where a place lies, at an altitude in metres.
    pub(crate) fn local(&self, place: &Geodetic, altitude: f64) -> Vector3<f64> {
        self.turn * (place.earth_centred(altitude) - self.origin)
    }
}

#[cfg(test)]
mod tests {
    use foxglove::Encode;

    use super::*;
    use crate::messages::ros::{ByteOrder, Layout, RosWriter};

    fn nav_sat_fix(layout: Layout, status: i8, degrees: [f64; 3], variance: f64) -> Vec<u8> {
        let mut message = Vec::new();
        let mut writer = RosWriter::new(layout, &mut message);
        writer.header((5, 6, "gps"));
        writer.i8(status);
        writer.u16(1);
        writer.f64s(degrees);
        writer.f64s([variance, 0.0, 0.0, 0.0, 2.0 * variance, 0.0, 0.0, 0.0, 9.0]);
        writer.u8(2);
        message
    }

    #[test]
    fn fixes_come_back_in_all_encodings() {
        let degrees = [48.5, -9.25, 300.0];
        let mut of_foxglove = Vec::new();
        let fix = LocationFix {
            timestamp: Some(foxglove::messages::Timestamp::new(5, 6)),
            frame_id: "gps".to_owned(),
            latitude: degrees[0],
            longitude: degrees[1],
            altitude: degrees[2],
            position_covariance: vec![0.01, 0.0, 0.0, 0.0, 0.02, 0.0, 0.0, 0.0, 9.0],
            position_covariance_type: 2,
            ..LocationFix::default()
        };
        fix.encode(&mut of_foxglove).expect("encoded");
        let cdr = Layout::Cdr(ByteOrder::Little);
        for (name, encoding, message) in [
            ("sensor_msgs/msg/NavSatFix", "cdr", nav_sat_fix(cdr, 0, degrees, 0.01)),
            ("sensor_msgs/NavSatFix", "ros1", nav_sat_fix(Layout::Ros1, 0, degrees, 0.01)),
            ("foxglove.LocationFix", "protobuf", of_foxglove),
        ] {
            let kind = FixMessage::named(name, encoding).expect("a type");
            let found = kind.read(&message).expect("whole").expect("a fix");
            assert_eq!((found.stamp_ns, found.frame_id.as_str()), (5_000_000_006, "gps"));
            let expected = Geodetic::new([48.5, -9.25], 300.0).expect("a place");
            assert_eq!(found.place, expected, "{name}");
            assert!((found.error.expect("known") - 0.02_f64.sqrt()).abs() < 1e-12, "{name}");
        }
        assert_eq!(FixMessage::named("sensor_msgs/msg/NavSatStatus", "cdr"), None);
    }

    #[test]
    fn no_fix_and_no_numbers_are_none() {
        let kind = FixMessage::NavSatFix(Ros::One);
        let read = |status, degrees| {
            kind.read(&nav_sat_fix(Layout::Ros1, status, degrees, 0.01)).expect("whole")
        };
        assert_eq!(read(-1, [48.0, 9.0, 300.0]), None);
        assert_eq!(read(0, [f64::NAN, 9.0, 300.0]), None);
        assert_eq!(read(0, [48.0, f64::INFINITY, 300.0]), None);
        let flat = read(0, [48.0, 9.0, f64::NAN]).expect("a fix without an altitude");
        assert_eq!(flat.place.altitude, None);
        let message = nav_sat_fix(Layout::Ros1, 0, [48.0, 9.0, 300.0], 0.01);
        assert!(kind.read(&message[..message.len() - 1]).is_err());
    }

    /// A degree of latitude is 110,574 m at the equator and 111,694 m at a pole, one of longitude
    /// 111,319 m at the equator, the same at the poles none (Wikipedia, "Geographic coordinate
    /// system", from WGS 84).
    #[test]
    fn degrees_have_their_length() {
        let place = |degrees| Geodetic::new(degrees, 0.0).expect("a place");
        let between = |from, to| TangentPlane::at(&place(from), 0.0).local(&place(to), 0.0);
        let north = between([0.0, 20.0], [0.01, 20.0]);
        assert!((north - Vector3::new(0.0, 1105.74, 0.0)).norm() < 0.1, "{north}");
        let east = between([0.0, 20.0], [0.0, 20.01]);
        assert!((east - Vector3::new(1113.19, 0.0, 0.0)).norm() < 0.1, "{east}");
        let polar = between([89.99, 0.0], [90.0, 0.0]);
        assert!((polar.y - 1116.94).abs() < 0.1, "{polar}");
        let plane = TangentPlane::at(&place([48.0, 9.0]), 100.0);
        let above = plane.local(&place([48.0, 9.0]), 103.0);
        assert!((above - Vector3::new(0.0, 0.0, 3.0)).norm() < 1e-6, "{above}");
    }
}
