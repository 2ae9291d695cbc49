//! Several sensors on one vehicle, and the one cloud that a driver makes of their sweeps.

use super::{Drive, Mount, Scene, Sensor, SimulatedFrame};
use divmerge_core::cloud::PointColumns;

/// Sensors that drive through a scene together.
#[derive(Debug, Clone)]
pub struct Rig {
    drives: Vec<Drive>,
}

impl Rig {
    /// Sensors with their mounts, a scene and a seed. The noise of each sensor is its own.
    pub fn new(scene: Scene, seed: u64, sensors: &[(Sensor, Mount)]) -> Self {
        let drive = |&(sensor, mount): &(Sensor, Mount)| {
            let mut drive = Drive::new(sensor, scene, seed);
            drive.mount = mount;
            drive
        };
        let mut drives: Vec<Drive> = sensors.iter().map(drive).collect();
        for (number, drive) in drives.iter_mut().enumerate() {
            drive.noise = number as u64;
        }
        Rig { drives }
    }

    /// Three as on many a robotaxi: one with 32 beams on the roof, two with 16 beams at the front
    /// corners, turned outwards and leaning a little.
    pub fn robotaxi(scene: Scene, seed: u64) -> Self {
        let corner = |left: f64| Mount {
            ahead: 2.0,
            left,
            yaw: 0.8 * left.signum(),
            pitch: 0.05,
            roll: -0.1 * left.signum(),
            ..Mount::level(1.0)
        };
        let roof = Mount { ahead: 0.3, ..Mount::level(2.0) };
        let sensors =
            [(Sensor::Hdl32e, roof), (Sensor::Vlp16, corner(0.9)), (Sensor::Vlp16, corner(-0.9))];
        Rig::new(scene, seed, &sensors)
    }

    /// All sweeps of frame `number` as one, in the frame of the vehicle's foot (z up from the
    /// ground), sensor after sensor; the source of a point is the number of its sensor. The pose is
    /// that of the vehicle's foot.
    pub fn frame(&self, number: usize) -> SimulatedFrame {
        let mut merged: Option<SimulatedFrame> = None;
        let mut columns = PointColumns::default();
        for (source, drive) in (0_u16..).zip(&self.drives) {
            let frame = drive.frame(number);
            let vehicle_from_sensor = drive.mount.vehicle_from_sensor();
            let pose = frame.pose * vehicle_from_sensor.inverse();
            let merged = merged.get_or_insert_with(|| SimulatedFrame::empty(frame.stamp_ns, pose));
            let count = frame.cloud.len();
            for point in 0..count {
                let position = frame.cloud.position(point).map(f64::from);
                let at = vehicle_from_sensor * nalgebra::Point3::from(position);
                columns.x.push(at.x as f32);
                columns.y.push(at.y as f32);
                columns.z.push(at.z as f32);
            }
            extend(&mut columns.ring, frame.cloud.ring.as_deref(), count);
            extend(&mut columns.class, frame.cloud.class.as_deref(), count);
            extend(&mut columns.source, Some(&vec![source; count]), count);
            merged.intensity.extend(frame.intensity);
            merged.true_instance.extend(frame.true_instance);
            merged.time_offset_ns.extend(frame.time_offset_ns);
        }
        let mut merged = merged.expect("a rig has a sensor");
        (columns.height, columns.width) = (1, columns.x.len());
        merged.cloud = columns.checked().expect("as many of each");
        merged
    }

    /// The same without what tells the sensors apart.
    pub fn anonymous(&self, number: usize) -> SimulatedFrame {
        let frame = self.frame(number);
        let cloud = frame.cloud.with(|columns| (columns.ring, columns.source) = (None, None));
        SimulatedFrame { cloud: cloud.expect("fewer columns"), ..frame }
    }
}

fn extend(column: &mut Option<Vec<u16>>, more: Option<&[u16]>, count: usize) {
    let column = column.get_or_insert_default();
    match more {
        Some(more) => column.extend(more),
        None => column.resize(column.len() + count, 0),
    }
}
