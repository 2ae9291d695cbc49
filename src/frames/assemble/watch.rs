//! Whether the messages of a topic look like parts of a turn.

use std::collections::{BTreeMap, BTreeSet};
use std::f64::consts::TAU;
use std::path::Path;
use std::sync::Arc;

use super::part::{Part, step};
use crate::error::Result;
use crate::frames::encoded::EncodedCloud;
use crate::frames::selection::Selection;
use crate::frames::topics::choose_topics;
use crate::frames::walk::Walk;
use divmerge_core::cloud::PointCloud;
use divmerge_core::geometry::statistics;
use divmerge_recording::{Overview, is_remote, is_stream};

/// Messages of a topic that are looked at.
const MOST: usize = 64;
/// Fewer do not tell.
const FEWEST: usize = 3;
/// A part of a turn has a narrower sector, radians: a third of the circle.
const NARROW: f64 = TAU / 3.0;
/// How far messages must have gone around, radians.
const LEAST_WAY: f64 = TAU / 2.0;
/// Share of their steps that must go the same way.
const SAME_WAY: f64 = 0.8;
/// Frames that are whole come no faster, nanoseconds apart.
const FAST_NS: i64 = 30_000_000;
/// A frame that is whole has more returns.
const FEW_RETURNS: usize = 3_000;

/// Messages of a topic that are looked at before a command that reads single messages.
const FIRST: u64 = 16;
/// Bytes of a recording within which they are looked for.
const LOOKED_THROUGH: u64 = 64 << 20;

/// What is said of the cloud topics of a recording whose messages look like parts of a turn: of the
/// named ones, or without names of all. For commands that read single messages.
///
/// The first messages of a topic are read, or one where that is a whole turn. Of a
/// stream, which is read once, of an object in a store, where each look costs requests, and of what
/// cannot be read, nothing is said.
pub fn sweeps_in_parts(recording: &Path, topics: &[String]) -> Vec<String> {
    if is_stream(recording) || is_remote(recording) {
        return Vec::new();
    }
    first_parts(recording, topics).map_or(Vec::new(), PartWatch::warnings)
}

fn first_parts(recording: &Path, topics: &[String]) -> Result<PartWatch> {
    let overview = Overview::read(recording)?;
    let clouds = choose_topics(&overview, topics, None)?;
    let names: BTreeMap<u16, Arc<str>> =
        clouds.iter().map(|(&id, cloud)| (id, Arc::clone(&cloud.topic))).collect();
    let mut undecided: BTreeSet<Arc<str>> = names.values().cloned().collect();
    let mut walk = Walk::open(&overview, names, &Selection::of_frames(0..FIRST))?;
    let mut watch = PartWatch::default();
    while !undecided.is_empty() && walk.progress().0 < LOOKED_THROUGH {
        let Some(step) = walk.next()? else { break };
        let Some(encoded) = EncodedCloud::of_step(step, &clouds) else { continue };
        let Ok(message) = encoded.decode() else { continue };
        let Ok(cloud) = message.to_cloud(None) else { continue };
        watch.take(&encoded.topic, &cloud, message.stamp_ns());
        if watch.is_whole(&encoded.topic) {
            undecided.remove(&encoded.topic);
        }
    }
    Ok(watch)
}

/// The first messages of each topic.
#[derive(Debug, Default)]
pub(crate) struct PartWatch(BTreeMap<Arc<str>, Vec<Part>>);

impl PartWatch {
    /// Takes the next cloud of a topic.
    pub(crate) fn take(&mut self, topic: &Arc<str>, cloud: &PointCloud, stamp_ns: i64) {
        let parts = self.0.entry(Arc::clone(topic)).or_default();
        if parts.len() < MOST {
            parts.push(Part::of(cloud, stamp_ns));
        }
    }

    /// Whether the last cloud of a topic was a whole turn or frame.
    fn is_whole(&self, topic: &Arc<str>) -> bool {
        let last = self.0.get(topic).and_then(|parts| parts.last());
        last.is_some_and(|part| part.returns >= FEW_RETURNS && part.width >= NARROW)
    }

    /// What is said of the topics whose messages look like parts of a turn.
    pub(crate) fn warnings(self) -> Vec<String> {
        self.0.iter().filter_map(|(topic, parts)| warning(topic, parts)).collect()
    }
}

fn warning(topic: &str, parts: &[Part]) -> Option<String> {
    if parts.len() < FEWEST {
        return None;
    }
    let degrees = median(parts.iter().map(|part| part.width))?.to_degrees();
    let returns = median(parts.iter().map(|part| part.returns as f64))? as usize;
    let apart = parts.windows(2).map(|two| (two[1].stamp_ns - two[0].stamp_ns) as f64);
    let apart_ns = median(apart)?;
    let is_fast = apart_ns > 0.0 && (apart_ns as i64) < FAST_NS && returns < FEW_RETURNS;
    if !is_fast && !goes_around(parts, degrees.to_radians()) {
        return None;
    }
    Some(format!(
        "{topic}: each message holds a part of a turn ({returns} returns in {degrees:.0} degrees, \
         {:.1} ms apart), and is taken by itself: --assemble auto clusters whole turns",
        apart_ns * 1e-6
    ))
}

/// Whether messages of this sector follow each other around the sensor.
fn goes_around(parts: &[Part], width: f64) -> bool {
    let directions: Vec<f64> = parts.iter().filter_map(|part| part.direction).collect();
    let steps: Vec<f64> = directions.windows(2).map(|two| step(two[0], two[1])).collect();
    let way = steps.iter().sum::<f64>().abs();
    let far: f64 = steps.iter().map(|step| step.abs()).sum();
    width < NARROW && way >= LEAST_WAY && way >= SAME_WAY * far
}

fn median(values: impl Iterator<Item = f64>) -> Option<f64> {
    statistics::median(&mut values.collect::<Vec<f64>>())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn parts(count: i64, ms: i64, turn: f64, width: f64, returns: usize) -> Vec<Part> {
        let part = |i: i64| Part {
            stamp_ns: i * ms * 1_000_000,
            returns,
            direction: Some(step(0.0, (i as f64 * turn).to_radians())),
            width: width.to_radians(),
        };
        (0..count).map(part).collect()
    }

    #[test]
    fn parts_of_a_turn_are_told_from_frames() {
        for (name, parts, is_part) in [
            ("packets", parts(60, 1, 2.0, 2.0, 300), true),
            ("tenths of a turn", parts(10, 10, 36.0, 36.0, 20_000), true),
            ("frames of a solid state at a high rate", parts(20, 5, 0.0, 70.0, 500), true),
            ("turns", parts(20, 100, 0.1, 359.0, 60_000), false),
            ("frames of a solid state", parts(20, 100, 0.0, 70.0, 40_000), false),
            ("frames of a depth camera", parts(20, 33, 0.0, 60.0, 200_000), false),
            ("few points now and then", parts(20, 100, 0.0, 70.0, 500), false),
            ("two", parts(2, 1, 2.0, 2.0, 300), false),
        ] {
            assert_eq!(warning("/points", &parts).is_some(), is_part, "{name}");
        }
    }
}
