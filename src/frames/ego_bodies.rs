//! The vehicles' own bodies in the clouds of a recording's topics.

use std::collections::BTreeMap;
use std::path::Path;

use super::clouds::EncodedClouds;
use super::selection::Selection;
use super::topics::{CloudTopic, choose_topics, message_count};
use crate::error::Result;
use divmerge_core::ParameterError;
use divmerge_core::cloud::{CloudFrames, LengthUnit, PointCloud};
use divmerge_core::range_image::ProjectionParams;
use divmerge_core::semantics::ego::{EgoFinding, EgoSearch, EgoUnknown};
use divmerge_recording::{Overview, is_stream};

/// What is odd about a cloud: a word for the kind, and a sentence.
pub type Remark = (&'static str, String);

/// The body of the vehicle that carries the sensor, for each topic where it was looked for.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct EgoBodies {
    found: BTreeMap<String, EgoFinding>,
}

impl EgoBodies {
    /// Looks for the vehicle in [`EgoSearch::CLOUDS`] clouds of each topic, spread over the
    /// recording. By its index only their chunks are read, without one all of it. What cannot be
    /// read is passed over; whoever reads the clouds reports it.
    ///
    /// # Errors
    /// [`Error::Parameter`](crate::error::Error::Parameter) if the recording is a stream, which is
    /// read only once; those of [`Overview::read`] and [`choose_topics`].
    pub fn find(
        recording: &Path,
        unit: LengthUnit,
        frames: &CloudFrames,
        projection: &ProjectionParams,
    ) -> Result<Self> {
        if is_stream(recording) {
            let problem = "a stream is read once, and its clouds cannot be compared beforehand: \
                           give a block, or annotate a file";
            return Err(ParameterError::new("ego", problem).into());
        }
        let overview = Overview::read(recording)?;
        let clouds = choose_topics(&overview, &[], None)?;
        let mut searches: BTreeMap<String, EgoSearch> = BTreeMap::new();
        for_each_sample(&overview, clouds, |topic, cloud, key| {
            let mut cloud = cloud.from_unit(unit);
            if frames.place(&mut cloud, topic, key).is_ok() {
                let search = searches.entry(topic.to_owned()).or_default();
                search.take(&cloud, projection);
            }
        })?;
        let found = searches.into_iter().map(|(topic, search)| (topic, search.finding()));
        Ok(EgoBodies { found: found.collect() })
    }

    /// Whether a vehicle was looked for.
    pub fn is_empty(&self) -> bool {
        self.found.is_empty()
    }

    /// What was found on each topic, in words for a metadata record.
    pub(crate) fn describe(&self) -> String {
        let of = |(topic, finding): (&String, &EgoFinding)| match &finding.body {
            Ok(body) => {
                let block = body.bounds().map_or("nowhere".to_owned(), |block| block.to_string());
                format!("{topic}: {} cells in {block}", body.cell_count())
            }
            Err(unknown) => format!("{topic}: {}", why(*unknown)),
        };
        self.found.iter().map(of).collect::<Vec<_>>().join("; ")
    }

    /// The topics in which the vehicle cannot be told, and why, as warnings.
    pub fn unknown(&self) -> impl Iterator<Item = String> {
        let of = |(topic, finding): (&String, &EgoFinding)| {
            let unknown = finding.body.as_ref().err()?;
            Some(format!("{topic}: {}", untold(*unknown, finding.clouds)))
        };
        self.found.iter().filter_map(of)
    }

    /// A recorded cloud in metres without the vehicle's own body, and what is to be said of that.
    pub(crate) fn leave_out(&self, cloud: PointCloud, topic: &str) -> (PointCloud, Option<Remark>) {
        let Some(EgoFinding { clouds, body }) = self.found.get(topic) else {
            return (cloud, None);
        };
        let body = match body {
            Ok(body) => body,
            Err(unknown) => {
                let problem = untold(*unknown, *clouds);
                return (cloud, Some(("whose vehicle cannot be told", problem)));
            }
        };
        let Some(bounds) = body.bounds() else {
            let problem = format!(
                "the vehicle's own body is not seen: nothing near the sensor stays put in the \
                 {clouds} clouds compared"
            );
            return (cloud, Some(("without the vehicle's own body", problem)));
        };
        let (cloud, count) = cloud.without_body(body);
        let problem = format!(
            "{count} returns are the vehicle's own body and left out: within {bounds} m they stay \
             put in the {clouds} clouds compared"
        );
        (cloud, (count > 0).then_some(("with the vehicle's own body left out", problem)))
    }
}

fn untold(unknown: EgoUnknown, clouds: usize) -> String {
    format!(
        "the vehicle's own body cannot be told from what is around it: {} ({clouds} clouds \
         compared). Nothing is left out as the vehicle; `--ego X0..X1,Y0..Y1,Z0..Z1` leaves out a \
         block",
        why(unknown)
    )
}

fn why(unknown: EgoUnknown) -> &'static str {
    match unknown {
        EgoUnknown::FewClouds => "there are too few clouds",
        EgoUnknown::NoGround => "too few clouds show the ground that a body stands above",
        EgoUnknown::Sparse => "the clouds have too few returns to be compared",
        EgoUnknown::NothingMoves => {
            "nothing moves in the clouds' frame, as where the vehicle stands still"
        }
    }
}

/// Calls `take` for clouds spread over each topic, with the topic, frame and stamp.
fn for_each_sample(
    overview: &Overview,
    clouds: BTreeMap<u16, CloudTopic>,
    mut take: impl FnMut(&str, PointCloud, (&str, i64)),
) -> Result<()> {
    let mut counts: BTreeMap<&str, u64> = BTreeMap::new();
    for (&id, cloud) in &clouds {
        *counts.entry(&cloud.topic).or_default() += message_count(overview, id);
    }
    let samples: BTreeMap<String, Vec<u64>> =
        counts.into_iter().map(|(topic, count)| (topic.to_owned(), spread(count))).collect();
    let mut read = |clouds: &BTreeMap<u16, CloudTopic>, selection: &Selection| -> Result<()> {
        for encoded in EncodedClouds::of_channels(overview, clouds.clone(), selection)? {
            let Ok(encoded) = encoded else { break };
            let is_sample = samples[&*encoded.topic].binary_search(&encoded.number).is_ok();
            let Some(wire) = encoded.decode().ok().filter(|_| is_sample) else { continue };
            if let Ok(cloud) = wire.to_cloud(None) {
                take(&encoded.topic, cloud, (&wire.frame_id, wire.stamp_ns()));
            }
        }
        Ok(())
    };
    if !overview.from_summary {
        return read(&clouds, &Selection::default());
    }
    for (topic, numbers) in &samples {
        let of_topic = clouds.iter().filter(|(_, cloud)| *cloud.topic == **topic);
        let of_topic = of_topic.map(|(&id, cloud)| (id, cloud.clone())).collect();
        for &number in numbers {
            read(&of_topic, &Selection::of_frames(number..=number))?;
        }
    }
    Ok(())
}

/// As many numbers below `count` as clouds are compared, evenly spread; all of few.
fn spread(count: u64) -> Vec<u64> {
    let wanted = (EgoSearch::CLOUDS as u64).min(count);
    (0..wanted).map(|i| i * (count - 1) / (wanted - 1).max(1)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn clouds_are_compared_from_the_first_to_the_last() {
        assert!(spread(0).is_empty());
        assert_eq!(spread(1), [0]);
        assert_eq!(spread(3), [0, 1, 2]);
        let many = spread(1000);
        assert_eq!((many.len(), many[0], many[1], many[23]), (24, 0, 43, 999));
    }
}
