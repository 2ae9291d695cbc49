//! How often objects keep their id through an occlusion.
//!
//! A case is told from the truth alone: a true object has no point in at least two frames, from
//! 1.5 to 2.5 s pass from the last frame before to the first frame after in which it has some, and
//! it has ten points or more in a frame of the second before and in one of the second after.
//!
//! An id is that of the found instance with which the object has an IoU above 0.5 in a frame in
//! which it has ten points or more. It is kept if the last one in the second before is the first
//! one in the second after.

use rustc_hash::FxHashMap;
use serde::Serialize;

use super::overlaps::{FrameOverlaps, TrueObject};

/// Least number of points of an object that is seen.
const POINTS: u64 = 10;
/// Least and largest time between two sights, nanoseconds.
const HIDDEN_NS: std::ops::RangeInclusive<u64> = 1_500_000_000..=2_500_000_000;
/// Least number of frames between two sights: fewer are a gap of the recording.
const FRAMES: u64 = 2;
/// Time before and after in which size and id count, nanoseconds.
const WINDOW_NS: u64 = 1_000_000_000;

/// Objects that are hidden for a while and come back.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize)]
pub struct OcclusionCases {
    /// Times that a true object was hidden.
    pub cases: u64,
    /// Of these: with an id before and after.
    pub found: u64,
    /// Of these: with the same.
    pub kept: u64,
}

/// Sums over any number of sequences.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Occlusions {
    sums: OcclusionCases,
    /// Frames of the current sequence so far.
    frames: u64,
    objects: FxHashMap<TrueObject, Sights>,
}

/// An object in a frame.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Sight {
    frame: u64,
    time_ns: u64,
    points: u64,
    /// Of an object that is large enough.
    id: Option<u32>,
}

/// What is known of an object.
#[derive(Debug, Clone, PartialEq, Default)]
struct Sights {
    /// Of the last second in which it was seen, ascending.
    recent: Vec<Sight>,
    case: Option<Case>,
}

/// An object that has come back.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Case {
    /// When the second after it is over, nanoseconds.
    until_ns: u64,
    is_large: bool,
    /// Ids before and after.
    ids: [Option<u32>; 2],
}

impl Occlusions {
    /// Adds the next frame of a sequence; times ascend.
    pub fn add(&mut self, time_ns: u64, overlaps: &FrameOverlaps) {
        let matches = overlaps.matches();
        for (&object, &points) in &overlaps.objects {
            let id = matches.get(&object).copied().filter(|_| points >= POINTS);
            let sight = Sight { frame: self.frames, time_ns, points, id };
            self.objects.entry(object).or_default().add(sight, &mut self.sums);
        }
        self.frames += 1;
    }

    /// Ends a sequence: later ids are those of other objects.
    pub fn end_sequence(&mut self) {
        for mut sights in std::mem::take(&mut self.objects).into_values() {
            sights.settle(&mut self.sums);
        }
        self.frames = 0;
    }

    /// The sums of all sequences that have ended.
    pub fn cases(&self) -> OcclusionCases {
        self.sums
    }
}

impl Sights {
    fn add(&mut self, sight: Sight, sums: &mut OcclusionCases) {
        if self.case.is_some_and(|case| case.until_ns < sight.time_ns) {
            self.settle(sums);
        }
        if self.recent.last().is_some_and(|last| last.hides_until(&sight)) {
            self.settle(sums);
            self.case = self.begins(&sight);
        }
        if let Some(case) = &mut self.case {
            case.is_large |= sight.points >= POINTS;
            case.ids[1] = case.ids[1].or(sight.id);
        }
        self.recent.retain(|seen| sight.time_ns.saturating_sub(seen.time_ns) <= WINDOW_NS);
        self.recent.push(sight);
    }

    /// The case of an object that comes back, if it was large enough before.
    fn begins(&self, sight: &Sight) -> Option<Case> {
        let before = self.recent.iter().rev().find_map(|seen| seen.id);
        let was_large = self.recent.iter().any(|seen| seen.points >= POINTS);
        let until_ns = sight.time_ns + WINDOW_NS;
        was_large.then_some(Case { until_ns, is_large: false, ids: [before, None] })
    }

    fn settle(&mut self, sums: &mut OcclusionCases) {
        let Some(Case { ids, .. }) = self.case.take().filter(|case| case.is_large) else { return };
        sums.cases += 1;
        sums.found += u64::from(ids.iter().all(Option::is_some));
        sums.kept += u64::from(ids[0].is_some() && ids[0] == ids[1]);
    }
}

impl Sight {
    /// Whether the object was hidden between this and the next sight.
    fn hides_until(&self, next: &Sight) -> bool {
        let hidden_ns = next.time_ns.saturating_sub(self.time_ns);
        next.frame - self.frame > FRAMES && HIDDEN_NS.contains(&hidden_ns)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// An object in frames a tenth of a second apart: a letter is the id of 20 points, `.` no
    /// point, `-` three points of id 1, `?` twenty of none.
    fn cases(drawn: &str) -> [u64; 3] {
        let mut occlusions = Occlusions::default();
        for (number, letter) in drawn.bytes().enumerate() {
            let (points, id) = match letter {
                b'.' => (0, 0),
                b'-' => (3, 1),
                b'?' => (20, 0),
                id => (20, u32::from(id)),
            };
            let overlaps = FrameOverlaps::new(&vec![id; points], &vec![Some((1, 7)); points]);
            occlusions.add(number as u64 * 100_000_000, &overlaps);
        }
        occlusions.end_sequence();
        let OcclusionCases { cases, found, kept } = occlusions.cases();
        [cases, found, kept]
    }

    fn hidden(before: &str, frames: usize, after: &str) -> [u64; 3] {
        cases(&format!("{before}{}{after}", ".".repeat(frames)))
    }

    #[test]
    fn kept_changed_and_lost() {
        assert_eq!(hidden("aa", 20, "aa"), [1, 1, 1]);
        assert_eq!(hidden("aa", 20, "ba"), [1, 1, 0]);
        assert_eq!(hidden("aa", 20, "??"), [1, 0, 0]);
        assert_eq!(hidden("??", 20, "aa"), [1, 0, 0]);
        // A few points at the edge of what hides it do not matter, and neither does what is more
        // than a second away.
        assert_eq!(hidden("aa-", 20, "--?a"), [1, 1, 1]);
        assert_eq!(hidden("a???????????", 20, "a"), [1, 0, 0]);
        assert_eq!(hidden("a", 20, "???????????a"), [1, 0, 0]);
    }

    #[test]
    fn neither_too_short_nor_too_long_nor_too_few_points() {
        let counted = [13, 14, 24, 25].map(|frames| hidden("a", frames, "a")[0]);
        assert_eq!(counted, [0, 1, 1, 0]);
        assert_eq!(hidden("--", 20, "aa")[0], 0);
        assert_eq!(hidden("aa", 20, "--")[0], 0);
        assert_eq!(cases("aaaa"), [0; 3]);
    }

    #[test]
    fn twice_in_a_row() {
        let gap = ".".repeat(15);
        assert_eq!(cases(&format!("a{gap}a{gap}b")), [2, 2, 1]);
    }

    #[test]
    fn a_gap_of_the_recording_hides_nothing() {
        let mut occlusions = Occlusions::default();
        let overlaps = FrameOverlaps::new(&[5; 20], &[Some((1, 7)); 20]);
        for second in [0, 2] {
            occlusions.add(second * 1_000_000_000, &overlaps);
        }
        occlusions.end_sequence();
        assert_eq!(occlusions.cases(), OcclusionCases::default());
    }
}
