//! Registration follows what a vehicle does in a simulated drive.

use divmerge_core::cloud::taxonomy::Taxonomy;
use divmerge_core::over_time::ego_motion::{
    EgoMotion, EgoMotionParams, RegistrationScan, ScanParams,
};

use crate::{Drive, Scene, Sensor};

/// The vehicle of scene `traffic` stands, and drives off with a jerk: 4 m/s within a tenth of a
/// second, so that its last motion leads to a wrong place that fits well enough.
#[test]
fn a_start_with_a_jerk_is_searched() {
    let (drive, taxonomy) =
        (Drive::new(Sensor::Hdl64e, Scene::Traffic, 21), Taxonomy::semantic_kitti());
    let mut estimator = EgoMotion::new(EgoMotionParams::default());
    let mut before = None;
    let mut longest = 0.0_f64;
    for number in 110..170 {
        let frame = drive.frame(number);
        let class = taxonomy.class_numbers(frame.cloud.class.as_deref().expect("true classes"));
        let is_thing = |point: usize| taxonomy.classes()[usize::from(class[point])].is_thing;
        let scan = RegistrationScan::from_points(&frame.cloud, &ScanParams::default(), is_thing);
        let found = estimator.push(&scan, 0.1);
        if let Some(before) = before.replace(frame.pose) {
            let step = before.inv_mul(&frame.pose);
            let error = step.inv_mul(&found.previous_from_current).translation.vector.norm();
            assert!(found.is_tracked() && error < 0.05, "frame {number}: {error} m, {found:?}");
            longest = longest.max(step.translation.vector.norm());
        }
    }
    assert!(longest > 0.3, "nothing moved: {longest} m");
}
