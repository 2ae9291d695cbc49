//! The frames of a recording's clouds: how they stand, and where the sensors stand in them.

use std::fmt;
use std::str::FromStr;

use super::point_cloud::PointCloud;
use super::sensor_frame::SensorFrame;
use super::transforms::Transforms;
use crate::error::CloudError;

/// What is known of the frames of a recording's clouds.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct CloudFrames {
    /// How they stand.
    pub sensor_frame: SensorFrame,
    /// What the recording says of frames.
    pub transforms: Transforms,
    /// Where sensors stand by the user's word; the one of a topic goes before that of all topics.
    pub sensor_origins: Vec<SensorOrigin>,
}

/// Where the sensor of a topic stands in its clouds' frame.
#[derive(Debug, Clone, PartialEq)]
pub struct SensorOrigin {
    /// The topic; `None` for all.
    pub topic: Option<String>,
    /// x, y and z, metres, in the recording's frame.
    pub origin: [f64; 3],
}

impl CloudFrames {
    /// Turns a cloud of a topic upright, and gives it what is known of its frame at the time of its
    /// stamp, nanoseconds since 1970.
    ///
    /// # Errors
    /// Those of [`SensorFrame::place`].
    pub fn place(
        &self,
        cloud: &mut PointCloud,
        topic: &str,
        (frame_id, stamp_ns): (&str, i64),
    ) -> Result<(), CloudError> {
        self.sensor_frame.place(cloud, frame_id, &self.transforms.at(stamp_ns))?;
        if let Some(origin) = self.sensor_origin(topic) {
            cloud.set_sensor_origin(origin);
        }
        Ok(())
    }

    /// Where the sensor of a topic stands by the user's word.
    pub fn sensor_origin(&self, topic: &str) -> Option<[f64; 3]> {
        let of = |wanted: Option<&str>| {
            self.sensor_origins.iter().find(|of| of.topic.as_deref() == wanted)
        };
        of(Some(topic)).or_else(|| of(None)).map(|of| of.origin)
    }
}

/// `X,Y,Z` or `TOPIC=X,Y,Z` in metres.
impl FromStr for SensorOrigin {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let (topic, numbers) = match text.rsplit_once('=') {
            Some((topic, numbers)) => (Some(topic.to_owned()), numbers),
            None => (None, text),
        };
        let numbers: Result<Vec<f64>, _> =
            numbers.split(',').map(|number| number.trim().parse::<f64>()).collect();
        match numbers.as_deref() {
            Ok(&[x, y, z]) if [x, y, z].iter().all(|along| along.is_finite()) => {
                Ok(SensorOrigin { topic, origin: [x, y, z] })
            }
            _ => Err(format!(
                "`{text}` is no place: use X,Y,Z or TOPIC=X,Y,Z in metres, as in 0.9,0,1.8"
            )),
        }
    }
}

impl fmt::Display for SensorOrigin {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let [x, y, z] = self.origin;
        match &self.topic {
            Some(topic) => write!(f, "{topic}={x},{y},{z}"),
            None => write!(f, "{x},{y},{z}"),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_origin_of_a_topic_goes_before_that_of_all() {
        let sensor_origins = ["0,0,1.8", "/front=2.5, -0.4,0.7"].map(|text| text.parse().unwrap());
        let frames =
            CloudFrames { sensor_origins: sensor_origins.into(), ..CloudFrames::default() };
        assert_eq!(frames.sensor_origin("/front"), Some([2.5, -0.4, 0.7]));
        assert_eq!(frames.sensor_origin("/rear"), Some([0.0, 0.0, 1.8]));
        assert_eq!(frames.sensor_origins[1].to_string(), "/front=2.5,-0.4,0.7");
        for wrong in ["", "1,2", "1,2,x", "/t=", "nan,0,0"] {
            assert!(wrong.parse::<SensorOrigin>().unwrap_err().contains("in metres"), "{wrong}");
        }
    }

    #[test]
    fn an_origin_is_turned_with_its_cloud() {
        let sensor_frame = "rfu".parse().unwrap();
        let sensor_origins = vec!["1,2,3".parse().unwrap()];
        let frames = CloudFrames { sensor_frame, sensor_origins, ..CloudFrames::default() };
        let mut cloud = PointCloud::default();
        frames.place(&mut cloud, "/points", ("lidar", 0)).unwrap();
        let origin = cloud.sensor_origin.unwrap();
        assert!((origin - nalgebra::Vector3::new(2.0, -1.0, 3.0)).norm() < 1e-12, "{origin}");
    }
}
