//! From message to message.

use std::hint::black_box;

use divmerge::PointCloud;
use divmerge::annotate::{
    AnnotateConfig, Annotated, FrameTimes, MessageTypes, Semantics, annotate_message,
};
use divmerge::frames::EncodedCloud;
use divmerge::messages::clouds::{CloudFormat, CloudMessage, Datatype, PointField};
use divmerge::pipeline::Config;

use super::{best_ms, print_head, verdict};

/// The most from message to message, median scan and heaviest, in milliseconds.
const MESSAGE_GOALS_MS: [(&str, [f64; 2]); 2] = [("best", [4.0, 8.0]), ("paper", [3.5, 5.0])];

pub(super) fn messages(clouds: &[PointCloud], rounds: usize) {
    println!(
        "message to message, {} scans with classes, ms, best of {rounds} rounds each\n",
        clouds.len()
    );
    print_head(
        "preset, scan",
        &[
            "decode", "project", "mask", "divide", "merge", "label", "encode", "total", "/copy",
            "goal", "",
        ],
    );
    let messages: Vec<Vec<u8>> = clouds.iter().map(message).collect();
    for (pipeline, (_, goals)) in
        [Config::best(), Config::paper()].into_iter().zip(MESSAGE_GOALS_MS)
    {
        let method =
            AnnotateConfig { semantics: Semantics::Auto, pipeline, ..AnnotateConfig::default() };
        let mut found: Vec<(FrameTimes, f64)> =
            messages.iter().map(|message| fastest(message, &method, rounds)).collect();
        found.sort_by(|a, b| a.0.total_ms().total_cmp(&b.0.total_ms()));
        let places = [("median", found.len() / 2), ("heaviest", found.len() - 1)];
        for ((which, place), goal) in places.into_iter().zip(goals) {
            let (times, copy_ms) = &found[place];
            let stages = times.stages;
            println!(
                "| {:<36} | {:.2} | {:.2} | {:.2} | {:.2} | {:.2} | {:.2} | {:.2} | {:.2} | {:.1} \
                 | {goal:.1} | {} |",
                format!("{}, {which}", method.pipeline.preset),
                times.decode_ms,
                stages.projection_ms,
                stages.mask_ms,
                stages.divide_ms,
                stages.merge_ms,
                stages.labels_ms,
                times.encode_ms,
                times.total_ms(),
                times.total_ms() / copy_ms,
                verdict(times.total_ms() <= goal),
            );
        }
    }
    println!();
}

/// The cloud as a message of `x`, `y`, `z`, `intensity` and `label`, 18 bytes a point.
fn message(cloud: &PointCloud) -> Vec<u8> {
    let classes = cloud.class.as_ref().expect("classes");
    let mut data = Vec::with_capacity(18 * cloud.len());
    for (point, class) in classes.iter().enumerate() {
        for value in [cloud.x[point], cloud.y[point], cloud.z[point], 0.5] {
            data.extend(value.to_le_bytes());
        }
        data.extend(class.to_le_bytes());
    }
    let float = Datatype::Float32;
    let fields = [("x", 0, float), ("y", 4, float), ("z", 8, float), ("intensity", 12, float)];
    let fields = fields.into_iter().chain([("label", 16, Datatype::UInt16)]);
    let field = |(name, offset, datatype): (&str, u32, Datatype)| PointField {
        name: name.into(),
        offset,
        datatype,
        count: 1,
    };
    let wire = CloudMessage {
        frame_id: "lidar".into(),
        width: cloud.len() as u32,
        fields: fields.map(field).collect(),
        point_step: 18,
        row_step: 18 * cloud.len() as u32,
        data: data.as_slice().into(),
        is_dense: true,
        ..CloudMessage::default()
    };
    let mut message = Vec::new();
    wire.encode(&mut message).expect("sizes that agree");
    message
}

/// The times of the fastest round and the fastest copy of what it wrote.
fn fastest(message: &[u8], method: &AnnotateConfig, rounds: usize) -> (FrameTimes, f64) {
    let encoded = EncodedCloud::of_message(CloudFormat::Ros2, message.to_vec());
    let mut annotated = Annotated::default();
    let (mut times, mut copy_ms) = (None::<FrameTimes>, f64::INFINITY);
    for _ in 0..rounds {
        annotate_message(&encoded, method, &MessageTypes::default(), &mut annotated)
            .expect("annotated");
        copy_ms = copy_ms.min(best_ms(1, || black_box(&annotated.cloud).to_vec()));
        let is_faster = times.is_none_or(|best| annotated.times.total_ms() < best.total_ms());
        times = if is_faster { Some(annotated.times) } else { times };
    }
    (times.expect("a round"), copy_ms)
}
