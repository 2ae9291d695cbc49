//! Which messages make up a turn.

use std::collections::BTreeMap;
use std::f64::consts::TAU;
use std::sync::Arc;

use super::part::{Part, step};
use super::setting::Assemble;
use crate::frames::encoded::EncodedCloud;
use crate::messages::clouds::{CloudFormat, CloudMessage, PointField};

/// Most messages of a turn: a sensor with a packet of one column a message has no more.
const MOST_PARTS: usize = 4096;
/// Most bytes of the messages of a turn: many times a usual one.
const MOST_BYTES: usize = 64 << 20;
/// How long a turn takes where messages do not go around: the frame of most sensors.
const USUAL_NS: i64 = 100_000_000;
/// Messages farther apart do not belong together.
const LONGEST_NS: i64 = 1_000_000_000;
/// Messages go around if they advance by this share of their own sectors; those that lie side by
/// side advance by all of them.
const LEAST_ADVANCE: f64 = 0.5;
/// A message with so wide a sector is a turn by itself, radians.
const WHOLE: f64 = TAU * 5.0 / 6.0;

/// Puts the messages of each topic together. A turn depends on the messages of its topic alone.
pub(super) struct Assembler {
    how: Assemble,
    open: BTreeMap<Arc<str>, OpenTurn>,
}

/// A turn that more messages may belong to.
struct OpenTurn {
    parts: Vec<EncodedCloud>,
    layout: Layout,
    bytes: usize,
    first: Part,
    last: Part,
    /// Where the last returns were, radians.
    direction: Option<f64>,
    /// How far the messages went around, radians.
    progress: f64,
    /// Their sectors behind the first one's, radians in all.
    sectors: f64,
}

/// What the messages of a turn must have in common to be one cloud.
#[derive(Debug, Clone, PartialEq)]
struct Layout {
    format: CloudFormat,
    frame_id: String,
    height: u32,
    fields: Vec<PointField>,
    is_bigendian: bool,
    point_step: u32,
    pose: Option<[u64; 7]>,
}

impl Layout {
    fn of(message: &CloudMessage) -> Self {
        let numbers = |pose: crate::messages::clouds::CloudPose| {
            let [x, y, z] = pose.position;
            let [i, j, k, w] = pose.orientation;
            [x, y, z, i, j, k, w].map(f64::to_bits)
        };
        Layout {
            format: message.format,
            frame_id: message.frame_id.clone(),
            height: message.height,
            fields: message.fields.clone(),
            is_bigendian: message.is_bigendian,
            point_step: message.point_step,
            pose: message.pose.map(numbers),
        }
    }
}

impl Assembler {
    pub(super) fn new(how: Assemble) -> Self {
        Assembler { how, open: BTreeMap::new() }
    }

    /// Takes the next message of a topic. If a turn begins with it, the one before is returned.
    pub(super) fn push(
        &mut self,
        encoded: EncodedCloud,
        message: &CloudMessage,
    ) -> Option<Vec<EncodedCloud>> {
        let part = match self.how {
            Assemble::Auto => {
                let cloud = message.to_cloud(None).unwrap_or_default();
                Part::of(&cloud, message.stamp_ns())
            }
            _ => Part {
                stamp_ns: message.stamp_ns(),
                returns: message.point_count(),
                direction: None,
                width: 0.0,
            },
        };
        let layout = Layout::of(message);
        let topic = Arc::clone(&encoded.topic);
        match self.open.get_mut(&topic) {
            Some(turn) if !turn.ends_before(&part, &layout, self.how) => {
                turn.add(encoded, part);
                None
            }
            _ => {
                let before = self.open.insert(topic, OpenTurn::new(encoded, part, layout));
                before.map(|turn| turn.parts)
            }
        }
    }

    /// The turns that no more messages come for, by topic.
    pub(super) fn finish(&mut self) -> impl Iterator<Item = Vec<EncodedCloud>> {
        std::mem::take(&mut self.open).into_values().map(|turn| turn.parts)
    }
}

impl OpenTurn {
    fn new(encoded: EncodedCloud, part: Part, layout: Layout) -> Self {
        OpenTurn {
            bytes: encoded.data.len(),
            parts: vec![encoded],
            layout,
            first: part,
            last: part,
            direction: part.direction,
            progress: 0.0,
            sectors: 0.0,
        }
    }

    fn add(&mut self, encoded: EncodedCloud, part: Part) {
        self.bytes += encoded.data.len();
        self.parts.push(encoded);
        self.progress += self.step_to(&part);
        self.direction = part.direction.or(self.direction);
        self.sectors += part.width;
        self.last = part;
    }

    fn step_to(&self, part: &Part) -> f64 {
        self.direction.zip(part.direction).map_or(0.0, |(from, to)| step(from, to))
    }

    fn ends_before(&self, part: &Part, layout: &Layout, how: Assemble) -> bool {
        let is_too_large = self.parts.len() >= MOST_PARTS || self.bytes >= MOST_BYTES;
        if is_too_large || *layout != self.layout {
            return true;
        }
        match how {
            Assemble::Messages(messages) => self.parts.len() >= messages,
            Assemble::Span(ns) => self.spans(part, ns),
            Assemble::Auto => self.is_whole_before(part),
        }
    }

    /// Whether a part is so much later than the first, to the nearest part, or earlier than the
    /// last.
    fn spans(&self, part: &Part, ns: i64) -> bool {
        let elapsed = part.stamp_ns.saturating_sub(self.first.stamp_ns);
        let interval = part.stamp_ns.saturating_sub(self.last.stamp_ns);
        interval < 0 || elapsed.saturating_add(interval / 2) >= ns
    }

    /// Whether the messages have come round, or stay where they are and have taken the usual time.
    fn is_whole_before(&self, part: &Part) -> bool {
        if self.last.width >= WHOLE || part.width >= WHOLE {
            return true;
        }
        let step = self.step_to(part);
        let is_round = (self.progress + step).abs() > TAU - step.abs() / 2.0;
        let (way, sectors) = ((self.progress + step).abs(), self.sectors + part.width);
        let stays = way < LEAST_ADVANCE * sectors && self.spans(part, USUAL_NS);
        let interval = part.stamp_ns.saturating_sub(self.last.stamp_ns);
        is_round || stays || !(0..LONGEST_NS).contains(&interval)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn part(ms: i64, degrees: f64, width: f64) -> Part {
        let direction = Some(step(0.0, degrees.to_radians()));
        Part { stamp_ns: ms * 1_000_000, returns: 100, direction, width: width.to_radians() }
    }

    /// Numbers of parts of the turns of these parts.
    fn turns(how: Assemble, parts: &[Part]) -> Vec<usize> {
        let layout = Layout::of(&CloudMessage::default());
        let encoded = || EncodedCloud::of_message(CloudFormat::Ros2, vec![0; 10]);
        let mut counts = Vec::new();
        let mut open: Option<OpenTurn> = None;
        for &part in parts {
            match &mut open {
                Some(turn) if !turn.ends_before(&part, &layout, how) => turn.add(encoded(), part),
                _ => {
                    let new = OpenTurn::new(encoded(), part, layout.clone());
                    counts.extend(open.replace(new).map(|turn| turn.parts.len()));
                }
            }
        }
        counts
    }

    #[test]
    fn a_turn_is_once_round_either_way() {
        for (sign, count) in [(1.0, 10), (-1.0, 10), (1.0, 180), (-1.0, 36)] {
            let degrees = 360.0 / count as f64;
            let at = |i: i64| part(i * 100 / count, sign * degrees * i as f64, degrees);
            let parts: Vec<Part> = (0..3 * count + 1).map(at).collect();
            assert_eq!(turns(Assemble::Auto, &parts), [count as usize; 3], "{sign} {count}");
        }
    }

    #[test]
    fn what_goes_nowhere_is_cut_by_time() {
        let parts: Vec<Part> = (0..41).map(|i| part(i * 10, i as f64 % 3.0, 70.0)).collect();
        assert_eq!(turns(Assemble::Auto, &parts), [10; 4]);
        // Messages at the rate of whole frames are frames.
        let parts: Vec<Part> = (0..4).map(|i| part(i * 100, 0.0, 70.0)).collect();
        assert_eq!(turns(Assemble::Auto, &parts), [1; 3]);
        let parts: Vec<Part> = (0..4).map(|i| part(i * 20, 0.0, 359.0)).collect();
        assert_eq!(turns(Assemble::Auto, &parts), [1; 3]);
    }

    #[test]
    fn a_turn_takes_as_long_as_it_takes() {
        for ms in [0, 1, 20, 300] {
            let parts: Vec<Part> = (0..25).map(|i| part(i * ms, 30.0 * i as f64, 30.0)).collect();
            assert_eq!(turns(Assemble::Auto, &parts), [12; 2], "{ms} ms apart");
        }
        // A pause ends it.
        let parts = [0, 10, 20, 5_000, 5_010].map(|ms| part(ms, ms as f64, 10.0));
        assert_eq!(turns(Assemble::Auto, &parts), [3]);
    }

    #[test]
    fn messages_and_seconds_are_counted() {
        let parts: Vec<Part> = (0..21).map(|i| part(i * 10, 0.0, 70.0)).collect();
        assert_eq!(turns(Assemble::Messages(7), &parts), [7, 7]);
        assert_eq!(turns(Assemble::Span(50_000_000), &parts), [5, 5, 5, 5]);
        let back = [part(0, 0.0, 70.0), part(10, 0.0, 70.0), part(5, 0.0, 70.0)];
        assert_eq!(turns(Assemble::Span(50_000_000), &back), [2]);
    }

    #[test]
    fn another_layout_begins_a_turn() {
        let layout = Layout::of(&CloudMessage::default());
        let other = Layout { frame_id: "other".to_owned(), ..layout.clone() };
        let encoded = EncodedCloud::of_message(CloudFormat::Ros2, Vec::new());
        let turn = OpenTurn::new(encoded, part(0, 0.0, 2.0), layout.clone());
        assert!(turn.ends_before(&part(1, 2.0, 2.0), &other, Assemble::Messages(9)));
        assert!(!turn.ends_before(&part(1, 2.0, 2.0), &layout, Assemble::Messages(9)));
    }
}
