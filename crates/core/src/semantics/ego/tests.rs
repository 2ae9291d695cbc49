use divmerge_simulate::{Drive, EGO_INSTANCE, Mount, Scene, Sensor};

use super::*;

/// A sweep of a drive, and whether each point belongs to the vehicle that carries the sensor.
fn swept(drive: &Drive, number: usize) -> (PointCloud, Vec<bool>) {
    let frame = drive.frame(number);
    let (x, y, z) = (frame.cloud.x.clone(), frame.cloud.y.clone(), frame.cloud.z.clone());
    let cloud = PointCloud::new(x, y, z).unwrap();
    let cloud = cloud.with(|columns| columns.ring = frame.cloud.ring.clone()).unwrap();
    let cloud = cloud.organised(frame.cloud.height, frame.cloud.width).unwrap();
    (cloud, frame.true_instance.iter().map(|&instance| instance == EGO_INSTANCE).collect())
}

/// A drive over a saloon, its sensor a bit behind the windscreen.
fn drive(sensor: Sensor, scene: Scene) -> Drive {
    let mut drive = Drive::new(sensor, scene, 3);
    (drive.sees_vehicle, drive.mount) = (true, Mount::level(1.9));
    drive
}

/// Every `step`-th sweep of a drive is compared.
fn compared(drive: &Drive, step: usize) -> EgoSearch {
    let mut search = EgoSearch::default();
    for number in 0..EgoSearch::CLOUDS {
        search.take(&swept(drive, number * step).0, &ProjectionParams::default());
    }
    search
}

#[test]
fn the_vehicle_is_found_while_it_moves_and_nothing_else_is() {
    for sensor in [Sensor::Vlp16, Sensor::Hdl32e] {
        for (scene, step) in [(Scene::Street, 5), (Scene::Parking, 5), (Scene::Yard, 1)] {
            let drive = drive(sensor, scene);
            let search = compared(&drive, step);
            let at_rest = search.share_at_rest().unwrap();
            let body = search.finding().body.unwrap();
            let (mut own, mut found, mut wrong) = (0, 0, 0);
            for number in [3, 52, 111] {
                let (cloud, is_own) = swept(&drive, number);
                for point in (0..cloud.len()).filter(|&point| cloud.is_return(point)) {
                    let is_found = body.contains(wide(cloud.position(point)));
                    own += usize::from(is_own[point]);
                    found += usize::from(is_own[point] && is_found);
                    wrong += usize::from(!is_own[point] && is_found);
                }
            }
            eprintln!("| {sensor} | {scene} | {at_rest:.2} | {found} of {own} | {wrong} |");
            assert!(own > 500 && 100 * found > 99 * own, "{sensor} in {scene}: {found} of {own}");
            assert_eq!(wrong, 0, "{sensor} in {scene}");
        }
    }
}

#[test]
fn a_vehicle_that_stands_cannot_be_told_from_its_surroundings() {
    for sensor in [Sensor::Vlp16, Sensor::Mid360] {
        for scene in [Scene::Street, Scene::Crowd] {
            let search = compared(&drive(sensor, scene).standing(), 5);
            let at_rest = search.share_at_rest().unwrap();
            eprintln!("| {sensor}, standing | {scene} | {at_rest:.2} | none | 0 |");
            assert_eq!(search.finding().body, Err(EgoUnknown::NothingMoves), "{sensor} in {scene}");
        }
    }
}

/// Opposite corners of a block, metres.
type Corners = [[f64; 3]; 2];

/// A bonnet before the sensor.
const BONNET: Corners = [[0.8, -0.6, -0.9], [1.8, 0.6, -0.7]];
/// A wall along the whole way, 2 m to the left.
const WALL: Corners = [[-200.0, 2.0, -1.8], [200.0, 2.3, 1.2]];

/// What 32 beams see of some blocks 1.8 m over level ground, and the number of the block that each
/// return lies on; that of the ground is `usize::MAX`.
fn cast(blocks: &[Corners], has_ground: bool) -> (PointCloud, Vec<usize>) {
    let (mut x, mut y, mut z, mut on) = (Vec::new(), Vec::new(), Vec::new(), Vec::new());
    for beam in 0..32 {
        let (up, out) = (0.1 - 0.02 * f64::from(beam)).sin_cos();
        for step in 0..900 {
            let (side, ahead) = (f64::from(step) * std::f64::consts::TAU / 900.0).sin_cos();
            let direction = [out * ahead, out * side, up];
            let ground = has_ground && up < 0.0;
            let hits = blocks.iter().map(|block| range(block, direction)).enumerate();
            let hits = hits.chain(ground.then_some((usize::MAX, -1.8 / up)));
            let (block, range) = hits.min_by(|a, b| a.1.total_cmp(&b.1)).unwrap();
            if range < 80.0 {
                x.push((range * direction[0]) as f32);
                y.push((range * direction[1]) as f32);
                z.push((range * direction[2]) as f32);
                on.push(block);
            }
        }
    }
    (PointCloud::new(x, y, z).unwrap(), on)
}

/// Range at which a ray from the origin meets a block.
fn range([low, high]: &Corners, direction: [f64; 3]) -> f64 {
    let (mut near, mut far) = (0.0_f64, f64::INFINITY);
    for axis in 0..3 {
        let [a, b] = [low[axis] / direction[axis], high[axis] / direction[axis]];
        (near, far) = (near.max(a.min(b)), far.min(a.max(b)));
    }
    if near <= far { near } else { f64::INFINITY }
}

/// Blocks by the way that have moved on by some metres.
fn passing(moved: f64) -> Vec<Corners> {
    let block = |number: i32| {
        let number = f64::from(number);
        let (x, y) = (11.0 * number - moved, -9.0 - (5.0 * number).rem_euclid(7.0));
        [[x, y, -1.8], [x + 3.0, y + 1.5, 0.5]]
    };
    (-8..40).map(block).collect()
}

fn finding(clouds: usize, speed: f64, has_ground: bool) -> EgoFinding {
    let mut search = EgoSearch::default();
    for number in 0..clouds {
        let blocks = [vec![BONNET, WALL], passing(speed * number as f64)].concat();
        search.take(&cast(&blocks, has_ground).0, &ProjectionParams::default());
    }
    search.finding()
}

#[test]
fn neither_a_wall_along_the_way_nor_level_ground_is_the_vehicle() {
    let body = finding(EgoSearch::CLOUDS, 3.7, true).body.unwrap();
    let (cloud, on) = cast(&[BONNET, WALL], true);
    let is_found = |point: usize| body.contains(wide(cloud.position(point)));
    let count = |block: usize| (0..cloud.len()).filter(|&point| on[point] == block).count();
    let found =
        |block: usize| (0..cloud.len()).filter(|&at| on[at] == block && is_found(at)).count();
    assert!(count(0) > 100 && count(1) > 1000 && count(usize::MAX) > 1000);
    assert_eq!((found(0), found(1), found(usize::MAX)), (count(0), 0, 0));
}

#[test]
fn what_cannot_be_known_is_said() {
    let unknown = |clouds, speed, has_ground| finding(clouds, speed, has_ground).body.unwrap_err();
    assert_eq!(unknown(EgoSearch::FEWEST - 1, 3.7, true), EgoUnknown::FewClouds);
    assert_eq!(unknown(EgoSearch::FEWEST, 3.7, false), EgoUnknown::NoGround);
    assert_eq!(unknown(EgoSearch::FEWEST, 0.0, true), EgoUnknown::NothingMoves);
}
