//! Colours that stay with an object from frame to frame.

use divmerge_core::cloud::Instance;

/// Gives each instance the colour number of the same object one frame before, which is the nearest
/// box of its class. Only the last frame is kept.
#[derive(Debug, Clone, Default)]
pub struct ColourTracker {
    last: Vec<(Instance, u32)>,
    next: u32,
}

/// How far an object's centre moves between two frames at most, metres, beside half its length.
const MAX_STEP: f64 = 1.5;

impl ColourTracker {
    /// Colour number of instance k at k - 1, for the next frame of a series. In the first frame
    /// these are the instances' ids.
    pub fn colour_numbers(&mut self, instances: &[Instance]) -> Vec<u32> {
        let mut pairs: Vec<(f64, usize, usize)> = Vec::new();
        for (now, instance) in instances.iter().enumerate() {
            for (before, (last, _)) in self.last.iter().enumerate() {
                let away = distance(instance, last);
                if last.semantic == instance.semantic && away <= reach(instance, last) {
                    pairs.push((away, now, before));
                }
            }
        }
        pairs.sort_by(|a, b| a.0.total_cmp(&b.0).then((a.1, a.2).cmp(&(b.1, b.2))));
        let mut number = vec![0; instances.len()];
        let mut is_taken = vec![false; self.last.len()];
        for (_, now, before) in pairs {
            if number[now] == 0 && !is_taken[before] {
                number[now] = self.last[before].1;
                is_taken[before] = true;
            }
        }
        for number in number.iter_mut().filter(|number| **number == 0) {
            self.next += 1;
            *number = self.next;
        }
        self.last = instances.iter().cloned().zip(number.iter().copied()).collect();
        let last_id = instances.iter().map(|instance| instance.id).max().unwrap_or(0);
        let mut by_id = vec![0; last_id as usize];
        for (instance, number) in instances.iter().zip(number) {
            by_id[instance.id as usize - 1] = number;
        }
        by_id
    }
}

fn distance(a: &Instance, b: &Instance) -> f64 {
    let [p, q] = [a, b].map(|instance| instance.bounds.centre);
    (p[0] - q[0]).hypot(p[1] - q[1])
}

fn reach(a: &Instance, b: &Instance) -> f64 {
    MAX_STEP + a.bounds.size[0].max(b.bounds.size[0]) / 2.0
}

#[cfg(test)]
mod tests {
    use super::*;
    use divmerge_core::cloud::UprightBox;

    fn instance(id: u32, semantic: u16, x: f64) -> Instance {
        Instance {
            id,
            semantic,
            class_name: String::new(),
            confidence: None,
            coarse_class: None,
            points: 1,
            pixels: 1,
            components: 1,
            bounds: UprightBox { centre: [x, 0.0, 0.0], size: [1.0; 3], yaw: 0.0 },
        }
    }

    #[test]
    fn an_object_keeps_its_number_and_a_new_one_gets_a_new_one() {
        let mut tracker = ColourTracker::default();
        let first = [instance(1, 10, 0.0), instance(2, 10, 3.0), instance(3, 30, 3.1)];
        assert_eq!(tracker.colour_numbers(&first), [1, 2, 3]);
        // In another order, moved, one gone, one of another class at its place.
        let second = [instance(1, 30, 3.0), instance(2, 30, 0.1), instance(3, 10, 3.6)];
        assert_eq!(tracker.colour_numbers(&second), [3, 4, 2]);
        assert_eq!(tracker.colour_numbers(&[]), [0_u32; 0]);
        assert_eq!(tracker.colour_numbers(&second[..1]), [5]);
    }
}
