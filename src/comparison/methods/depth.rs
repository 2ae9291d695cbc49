//! Depth clustering (Bogoslavskyi and Stachniss 2016).

use std::f64::consts::FRAC_PI_2;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use divmerge_core::cluster::{Method, MethodInput, Segmentation};

use super::shared::{object_pixels, to_points};
use divmerge_core::geometry::disjoint_sets::DisjointSets;
use divmerge_core::range_image::NO_NEIGHBOUR;

/// Connected components of the 4-connected range image under the angle condition beta > theta.
///
/// Theirs works on all that is not ground; here on the pixels of one class after the other. Theirs
/// fills holes in the depth image first; this does not.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct DepthClustering {
    /// Least angle beta between neighbours of one object, radians. Default 0.15 (Zhao, Zhang and
    /// Huang's survey, arXiv 2108.09522; the paper's examples have 10 degrees).
    #[schemars(range(min = 0.0))]
    #[schemars(extend("exclusiveMaximum" = FRAC_PI_2, "unit" = "rad", "slider" = [0.0, 0.7]))]
    #[schemars(extend("source" = "Zhao, Zhang and Huang 2021, arXiv 2108.09522"))]
    pub angle: f64,
}

impl Default for DepthClustering {
    fn default() -> Self {
        DepthClustering { angle: 0.15 }
    }
}

impl Method for DepthClustering {
    fn name(&self) -> &'static str {
        "depth-clustering"
    }

    parameters_are_fields!();

    fn segment(&self, input: &MethodInput) -> Segmentation {
        let objects = object_pixels(input, self.angle);
        let mut sets = DisjointSets::new(objects.len());
        for (pixel, neighbours) in objects.neighbours.iter().enumerate() {
            for (&other, connected) in neighbours.iter().zip(objects.connected[pixel]) {
                if other != NO_NEIGHBOUR && connected {
                    sets.join(pixel, other as usize);
                }
            }
        }
        to_points(input, &objects, &sets.numbered())
    }
}

#[cfg(test)]
mod tests {
    use super::super::test_frames::{CAR, PERSON, instances_of_a_beam};
    use super::*;

    #[test]
    fn a_step_in_depth_parts_and_a_slant_does_not() {
        // One beam, 0.4 degrees between columns: at 10 m 0.07 m apart. A step of 2 m is 2 degrees.
        let at = |column: usize, range: f32, class| {
            let (sin, cos) = (column as f32 * 0.4_f32.to_radians()).sin_cos();
            ([range * cos, range * sin, 0.0], class)
        };
        let points = [
            at(0, 10.0, CAR),
            at(1, 10.1, CAR),
            at(2, 12.1, CAR),
            at(3, 12.1, PERSON),
            at(4, 12.1, CAR),
        ];
        assert_eq!(instances_of_a_beam(&DepthClustering::default(), &points), [1, 1, 2, 3, 4]);
    }
}
