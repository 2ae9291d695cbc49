//! Ray-cast drives with truth: the embedded default data and the tests' fixture.
//!
//! A [`Drive`] is a sensor, a scene and a seed. Its frames are made one by one in any order, the
//! same bytes each time: the scene is tiled along the way, and every tile and every column of a
//! frame has its own stream of random numbers.
//!
//! Frames: the world has x along the drive, y to the left and z up; a sensor's frame has x ahead, y
//! left and z along the normal of the ground that the ego vehicle stands on, but for a mount that
//! turns it. A sweep is taken at the instant of its stamp, as if motion had been compensated
//! already; `time_offset_ns` says when each beam fires. A [`Rig`] is several sensors on one
//! vehicle, whose sweeps become one cloud in the vehicle's frame.

mod ego_vehicle;
mod ground;
mod material;
mod mount;
mod objects;
mod random;
mod render;
mod rig;
mod scene;
mod sensor;
mod shapes;

#[cfg(test)]
mod tests;

use nalgebra::Isometry3;

use divmerge_core::cloud::{PointCloud, PointColumns};
pub use ego_vehicle::EGO_INSTANCE;
pub use mount::{Clutter, Mount};
use render::{Return, View};
pub use rig::Rig;
pub use scene::Scene;
use scene::World;
pub use sensor::Sensor;

/// Stamp of frame 0, nanoseconds since 1970: 1 January 2024, 12:00 UTC.
const EPOCH_NS: u64 = 1_704_110_400_000_000_000;

/// A drive of a sensor through a scene, without end, at ten frames a second.
///
/// ```
/// use divmerge_simulate::{Drive, Scene, Sensor};
///
/// let frame = Drive::new(Sensor::Vlp16, Scene::Parking, 1).frame(3);
/// assert_eq!(frame.cloud.len(), frame.true_instance.len());
/// assert!(frame.true_instance.iter().any(|&instance| instance != 0));
/// ```
#[derive(Debug, Clone)]
pub struct Drive {
    /// The sensor on the ego vehicle's roof.
    pub sensor: Sensor,
    /// Where it drives.
    pub scene: Scene,
    /// Chooses the scene's objects and all noise.
    pub seed: u64,
    /// How the sensor sits on the ego vehicle: level and at [`Sensor::height`] unless changed.
    pub mount: Mount,
    /// Rain and mirroring ground: none unless changed.
    pub clutter: Clutter,
    /// Whether the sensor sees the vehicle that carries it, a saloon: not unless changed.
    pub sees_vehicle: bool,
    /// Which of the sensors of a [`Rig`] this is: all have noise of their own. 0 alone.
    noise: u64,
    world: World,
}

/// One sweep with its truth. Columns have one entry for each point of the cloud.
#[derive(Debug, Clone, PartialEq)]
pub struct SimulatedFrame {
    /// Points in the sensor's frame, metres, with beam numbers and SemanticKITTI's raw class ids. A
    /// pixel of an organised cloud without a return is the origin with class 0.
    pub cloud: PointCloud,
    /// Strength of the return, 0 to 1, by material and incidence.
    pub intensity: Vec<f32>,
    /// The object that a point belongs to, the same in all frames of the drive; 0 for stuff. A
    /// driver belongs to the car, a rider and the bicycle are one. [`EGO_INSTANCE`] is the vehicle
    /// that carries the sensor.
    pub true_instance: Vec<u16>,
    /// Time of the return after the stamp, nanoseconds.
    pub time_offset_ns: Vec<u32>,
    /// Time of the sweep's start, nanoseconds since 1970.
    pub stamp_ns: u64,
    /// The sensor in the world's frame, metres.
    pub pose: Isometry3<f64>,
}

impl Drive {
    /// The drive of a sensor, a scene and a seed.
    pub fn new(sensor: Sensor, scene: Scene, seed: u64) -> Self {
        Drive {
            sensor,
            scene,
            seed,
            mount: Mount::level(sensor.height()),
            clutter: Clutter::default(),
            sees_vehicle: false,
            noise: 0,
            world: World::new(scene, seed),
        }
    }

    /// The same with the ego vehicle at rest where the drive begins, while the others move.
    pub fn standing(mut self) -> Self {
        self.world.stand();
        self
    }

    /// Frame `number`, 100 ms after the one before; independent of which frames were made earlier.
    pub fn frame(&self, number: usize) -> SimulatedFrame {
        let view = self.view(number);
        let returns = view.cast();
        let stamp_ns = EPOCH_NS + number as u64 * sensor::TURN_NS;
        store(self.sensor, &returns, stamp_ns, view.world_from_sensor)
    }

    /// What surrounds the sensor in frame `number`.
    fn view(&self, number: usize) -> View<'_> {
        let time = seconds(number);
        let world_from_vehicle = self.world.ego(time);
        let world_from_sensor = world_from_vehicle * self.mount.vehicle_from_sensor();
        let mut objects = self.world.objects(time, self.sensor.max_range());
        if self.sees_vehicle {
            objects.push(ego_vehicle::placed(world_from_vehicle));
        }
        let ground = &self.world.ground;
        let key = (self.seed ^ (self.noise << 48), number);
        let mut view = View::new(self.sensor, ground, world_from_sensor, key, objects);
        (view.mount, view.clutter) = (self.mount, self.clutter);
        view
    }
}

/// Time of a frame after the start of the drive, seconds.
fn seconds(number: usize) -> f64 {
    number as f64 * sensor::TURN_NS as f64 * 1e-9
}

/// The returns as the sensor's driver would store them: of two returns of a shot the farther first.
fn store(
    sensor: Sensor,
    returns: &[[Option<Return>; 2]],
    stamp_ns: u64,
    pose: Isometry3<f64>,
) -> SimulatedFrame {
    let is_organised = sensor.is_organised();
    let mut frame = SimulatedFrame::empty(stamp_ns, pose);
    let mut columns = PointColumns::default();
    let (mut ring, mut class) = (Vec::new(), Vec::new());
    for (row, column) in sensor.storage_order() {
        let [nearer, farther] = &returns[row * sensor.columns() + column];
        let found = [farther, nearer].into_iter().filter(|found| found.is_some());
        let nothing = is_organised && nearer.is_none();
        for found in found.chain(nothing.then_some(&None)) {
            let position = found.map_or(nalgebra::Vector3::zeros(), |found| found.position);
            columns.x.push(position.x as f32);
            columns.y.push(position.y as f32);
            columns.z.push(position.z as f32);
            ring.push(sensor.ring(row, column));
            class.push(found.map_or(0, |found| found.class));
            frame.intensity.push(found.map_or(0.0, |found| found.intensity as f32));
            frame.true_instance.push(found.map_or(0, |found| found.id));
            frame.time_offset_ns.push(sensor.time_offset_ns(row, column));
        }
    }
    let count = ring.len();
    (columns.ring, columns.class) = (sensor.has_ring().then_some(ring), Some(class));
    (columns.height, columns.width) =
        if is_organised { (sensor.beams(), sensor.columns()) } else { (1, count) };
    frame.cloud = columns.checked().expect("as many of each");
    frame
}

impl SimulatedFrame {
    /// The same sweep as an unorganised cloud whose points are stored in another order: `order`
    /// has the number of each of them.
    ///
    /// # Panics
    /// If it names a point that there is not.
    pub fn reordered(self, order: &[usize]) -> SimulatedFrame {
        let floats = |column: &[f32]| order.iter().map(|&p| column[p]).collect::<Vec<f32>>();
        let words = |column: &[u16]| order.iter().map(|&p| column[p]).collect::<Vec<u16>>();
        let columns = PointColumns {
            x: floats(&self.cloud.x),
            y: floats(&self.cloud.y),
            z: floats(&self.cloud.z),
            ring: self.cloud.ring.as_deref().map(words),
            class: self.cloud.class.as_deref().map(words),
            height: 1,
            width: order.len(),
            ..PointColumns::default()
        };
        SimulatedFrame {
            cloud: columns.checked().expect("as many of each"),
            intensity: floats(&self.intensity),
            true_instance: words(&self.true_instance),
            time_offset_ns: order.iter().map(|&p| self.time_offset_ns[p]).collect(),
            ..self
        }
    }

    fn empty(stamp_ns: u64, pose: Isometry3<f64>) -> Self {
        SimulatedFrame {
            cloud: PointCloud::default(),
            intensity: Vec::new(),
            true_instance: Vec::new(),
            time_offset_ns: Vec::new(),
            stamp_ns,
            pose,
        }
    }
}
