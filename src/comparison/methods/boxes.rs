//! Instances cut out of the mask by 3-D detection boxes: what the paper calls hybrids of semantic
//! segmentation and 3-D object detection, made as in Behley, Milioto and Stachniss 2020 (arXiv
//! 2003.02371).

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use divmerge_core::cluster::{Method, MethodInput, Segmentation};

use divmerge_core::cloud::point_cloud::wide;
use divmerge_core::cloud::{Detection, UprightBox};

/// An object point belongs to the detection of its class in whose box it lies, of several to the
/// one in which it lies deepest by the boxes' sizes, and of those to the surer one. Points in no
/// box have no instance. Where the points have no classes every detection may have them.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Boxes {
    /// How far outside a box a point may lie, metres: boxes are drawn closely, and detectors err.
    /// Default 0.1.
    #[schemars(range(min = 0.0), extend("unit" = "m", "slider" = [0.0, 1.0]))]
    pub margin: f64,
    /// Detections less sure than this are left out. Default 0: none.
    #[schemars(extend("slider" = [0.0, 1.0]))]
    pub least_score: f64,
}

impl Default for Boxes {
    fn default() -> Self {
        Boxes { margin: 0.1, least_score: 0.0 }
    }
}

impl Method for Boxes {
    fn name(&self) -> &'static str {
        "boxes"
    }

    parameters_are_fields!();

    fn segment(&self, input: &MethodInput) -> Segmentation {
        let known = input.detections.iter().filter(|found| found.score >= self.least_score);
        let mut found: Vec<&Detection> = known.collect();
        found.sort_by(|a, b| b.score.total_cmp(&a.score)); // stable: the surer first
        let any_class = !input.mask.has_classes();
        let instance_of = |point: usize| {
            if !input.mask.is_object[point] {
                return 0;
            }
            let (at, class) = (wide(input.cloud.position(point)), input.mask.class[point]);
            let in_box = found.iter().zip(1_u32..).filter_map(|(detection, number)| {
                let is_of_class = any_class || detection.class.is_none_or(|own| own == class);
                let depth =
                    is_of_class.then(|| share_of_box(&detection.bounds, at, self.margin))?;
                (depth <= 1.0).then_some((depth, number))
            });
            in_box.min_by(|a, b| a.0.total_cmp(&b.0)).map_or(0, |(_, number)| number)
        };
        Segmentation::of_points((0..input.cloud.len()).map(instance_of).collect(), input)
    }
}

/// How far from the centre a place lies towards the side that is nearest by the box's size: 0 in
/// the centre, 1 on a side, more outside.
fn share_of_box(bounds: &UprightBox, at: [f64; 3], margin: f64) -> f64 {
    let away: [f64; 3] = std::array::from_fn(|axis| at[axis] - bounds.centre[axis]);
    let (sin, cos) = bounds.yaw.sin_cos();
    let along = [away[0] * cos + away[1] * sin, away[1] * cos - away[0] * sin, away[2]];
    let share = |axis: usize| along[axis].abs() / (bounds.size[axis] / 2.0 + margin);
    (0..3).map(share).fold(0.0, f64::max)
}

#[cfg(test)]
mod tests {
    use super::super::test_frames::{CAR, PERSON, frame};
    use super::*;

    fn detection(x: f64, length: f64, class: u16, score: f64) -> Detection {
        let bounds = UprightBox { centre: [x, 5.0, 0.0], size: [length, 2.0, 2.0], yaw: 0.0 };
        Detection { bounds, class: Some(class), score }
    }

    #[test]
    fn deepest_box_of_the_class() {
        let at = |x: f32, class| ([x, 5.0, 0.0], class);
        let points = [
            at(0.0, CAR),
            at(1.9, CAR),
            at(2.5, CAR),
            at(2.05, PERSON),
            at(2.05, CAR),
            at(9.0, CAR),
        ];
        let [car, person] = [1, 6]; // class numbers
        // The surer detection is number 1 wherever it stands.
        let found = [detection(0.0, 4.0, car, 0.5), detection(3.0, 4.0, car, 0.9)];
        let frame = frame(6, &points);
        let instances = |found: &[Detection]| frame.instances(&Boxes::default(), found);
        assert_eq!(instances(&found), [2, 1, 1, 0, 1, 0]);
        assert_eq!(instances(&[found[0]]), [1, 1, 0, 0, 1, 0]);
        assert_eq!(instances(&[detection(2.0, 1.0, person, 0.1)]), [0, 0, 0, 1, 0, 0]);
        assert_eq!(instances(&[]), [0; 6]);
    }

    #[test]
    fn points_without_classes_belong_to_boxes_of_any() {
        let mut frame = frame(2, &[([0.0, 5.0, 0.0], CAR), ([9.0, 5.0, 0.0], CAR)]);
        let person = [detection(0.0, 4.0, 6, 0.5)];
        assert_eq!(frame.instances(&Boxes::default(), &person), [0, 0]);
        frame.mask = super::super::without_classes(&frame.mask);
        assert_eq!(frame.instances(&Boxes::default(), &person), [1, 0]);
    }

    #[test]
    fn a_turned_box() {
        let turned = UprightBox {
            centre: [0.0; 3],
            size: [4.0, 2.0, 2.0],
            yaw: std::f64::consts::FRAC_PI_2,
        };
        assert!(share_of_box(&turned, [0.0, 1.9, 0.0], 0.0) < 1.0);
        assert!(share_of_box(&turned, [1.9, 0.0, 0.0], 0.0) > 1.0);
        assert!((share_of_box(&turned, [0.5, 0.0, 0.9], 0.0) - 0.9).abs() < 1e-12);
    }
}
