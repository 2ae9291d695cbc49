//! No clustering at all: what the classes alone are worth.

use divmerge_core::cluster::{Method, MethodInput, Segmentation};

use super::shared::per_class;

/// All points of a class are one instance.
#[derive(Debug, Clone, Copy, PartialEq, Default, serde::Serialize)]
pub struct OnePerClass;

impl Method for OnePerClass {
    fn name(&self) -> &'static str {
        "one-per-class"
    }

    fn parameters(&self) -> serde_json::Value {
        serde_json::json!(self)
    }

    fn segment(&self, input: &MethodInput) -> Segmentation {
        per_class(input, |_, points| vec![1; points.len()])
    }
}

#[cfg(test)]
mod tests {
    use super::super::test_frames::{CAR, PERSON, ROAD, instances};
    use super::*;

    #[test]
    fn one_per_class() {
        let at = |x: f32, class| ([x, 1.0, 0.0], class);
        let points = [at(5.0, PERSON), at(9.0, CAR), at(7.0, ROAD), at(60.0, CAR)];
        assert_eq!(instances(&OnePerClass, 4, &points), [2, 1, 0, 1]);
    }
}
