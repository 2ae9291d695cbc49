//! What is fuzzed. A further decoder is one entry of [`TARGETS`]: where its mutation starts, what
//! it is fed, and how much it may allocate.

mod commands;
mod runs;

use divmerge::datasets::scans::ScanFormat;
use divmerge::messages::boxes::{detection_boxes, marker_boxes};
use divmerge::messages::classes::image_classes;
use divmerge::messages::clouds::CloudFormat;
use divmerge::network::NetworkConfig;

use crate::mutate::Mutator;
use crate::watch::Bound;
use crate::{clouds, seeds};

use runs::{
    Ends, annotate, bin, class_array, cluster, kitti, message, packed_cloud, place, read,
    recording, scan, taxonomy, whole_recordings, yaml,
};

/// One thing that is fuzzed.
pub struct Target {
    /// Name at the command line.
    pub name: &'static str,
    /// What is called with the bytes.
    pub what: &'static str,
    /// Share of all executions, in parts of the sum of all.
    pub share: u64,
    /// Inputs as they should be.
    pub seeds: fn() -> Vec<Vec<u8>>,
    /// What means something to the parser.
    pub words: &'static [&'static [u8]],
    /// Makes an input otherwise than by changing the bytes of another.
    pub make: Option<fn(&mut Mutator) -> Vec<u8>>,
    /// How it ended in words; an error too, unless it starts with `wrong:`.
    pub run: fn(&[u8]) -> Ended,
    /// What an execution may allocate.
    pub bound: Bound,
}

type Ended = Result<String, String>;

/// A decoder: what it makes is a few times larger than what it is made from.
const DECODER: Bound = Bound { times: 64, plus: 64 << 10 };

/// Clustering: tables for each point, and those of a range image, which a few points with wild ring
/// numbers make as large as the most beams that are believed (1024) times the paper's 2048 columns.
const CLUSTERING: Bound = Bound { times: 4096, plus: 96 << 20 };

/// Reading a recording: buffers of fixed size, a chunk and what is in it.
const READING: Bound = Bound { times: 256, plus: 4 << 20 };

/// All of it.
const ANNOTATING: Bound = Bound { times: 4096, plus: 104 << 20 };

/// Every target.
pub const TARGETS: [Target; 27] = [
    Target {
        name: "point-cloud2",
        what: "`CloudFormat::decode` of ROS 2, all its columns, `to_cloud`, and writing it again",
        share: 300,
        seeds: seeds::clouds,
        words: FIELD_NAMES,
        make: None,
        run: |bytes| packed_cloud(CloudFormat::Ros2, bytes),
        bound: DECODER,
    },
    Target {
        name: "point-cloud2-ros1",
        what: "the same of ROS 1",
        share: 100,
        seeds: || seeds::clouds_of(CloudFormat::Ros1),
        words: FIELD_NAMES,
        make: None,
        run: |bytes| packed_cloud(CloudFormat::Ros1, bytes),
        bound: DECODER,
    },
    Target {
        name: "foxglove-cdr",
        what: "the same of `foxglove_msgs/msg/PointCloud`",
        share: 100,
        seeds: || seeds::clouds_of(CloudFormat::FoxgloveRos2),
        words: FIELD_NAMES,
        make: None,
        run: |bytes| packed_cloud(CloudFormat::FoxgloveRos2, bytes),
        bound: DECODER,
    },
    Target {
        name: "foxglove-protobuf",
        what: "the same of `foxglove.PointCloud` in protocol buffers",
        share: 150,
        seeds: || seeds::clouds_of(CloudFormat::FoxgloveProtobuf),
        words: &[
            b"\x32\xff\xff\xff\xff\x0f",
            b"\x2a\x00",
            b"\x2d\x0c\x00\x00\x00",
            b"\xff\xff\xff\xff\xff\xff\xff\xff\xff\x01",
        ],
        make: None,
        run: |bytes| packed_cloud(CloudFormat::FoxgloveProtobuf, bytes),
        bound: DECODER,
    },
    Target {
        name: "foxglove-json",
        what: "the same of `foxglove.PointCloud` in JSON",
        share: 60,
        seeds: || seeds::clouds_of(CloudFormat::FoxgloveJson),
        words: &[
            b"\"FLOAT32\"",
            b"[[[[[[[[",
            b"{\"fields\":[",
            b"4294967296",
            b"-1",
            b"1e400",
            b"\"\\u0000\"",
            b"null",
            b"=",
        ],
        make: None,
        run: |bytes| packed_cloud(CloudFormat::FoxgloveJson, bytes),
        bound: DECODER,
    },
    Target {
        name: "annotate-message",
        what: "`annotate_message` on a message, classes from a field or from ground removal",
        share: 40,
        seeds: seeds::clouds,
        words: FIELD_NAMES,
        make: None,
        run: message,
        bound: CLUSTERING,
    },
    Target {
        name: "cluster",
        what: "range image and clustering of wild clouds, all presets",
        share: 60,
        seeds: clouds::seeds,
        words: &[],
        make: None,
        run: cluster,
        bound: CLUSTERING,
    },
    Target {
        name: "marker-array",
        what: "`marker_boxes` of both layouts",
        share: 150,
        seeds: seeds::markers,
        words: &[b"boxes\0", b"12 car\0"],
        make: None,
        run: |bytes| {
            marker_boxes(bytes, true, taxonomy())
                .or_else(|_| marker_boxes(bytes, false, taxonomy()))
                .ends()
        },
        bound: DECODER,
    },
    Target {
        name: "detection3d-array",
        what: "`detection_boxes`",
        share: 100,
        seeds: seeds::detections,
        words: &[b"car\0"],
        make: None,
        run: |bytes| detection_boxes(bytes, taxonomy()).ends(),
        bound: DECODER,
    },
    Target {
        name: "class-image",
        what: "`image_classes` of both ROS",
        share: 100,
        seeds: seeds::class_images,
        words: &[b"mono16\0", b"32SC1\0", b"8UC1", b"\xff\xff\xff\xff"],
        make: None,
        run: |bytes| image_classes(bytes, false).or_else(|_| image_classes(bytes, true)).ends(),
        bound: DECODER,
    },
    Target {
        name: "class-npy",
        what: "`ClassFiles` on a `.npy` file of classes or scores",
        share: 20,
        seeds: seeds::class_arrays,
        words: &[b"4294967295,", b"True", b"'<f4'", b"'>i8'", b"'|b1'", b"20)", b"0, "],
        make: None,
        run: class_array,
        bound: DECODER,
    },
    Target {
        name: "network-config",
        what: "`NetworkConfig::read`",
        share: 10,
        seeds: seeds::network_configs,
        words: &[b"True", b"&a [*a]", b"{{{{{{{{{{", b"img_stds: ", b".inf", b"65535", b"\n  "],
        make: None,
        run: |bytes| NetworkConfig::read(&[place("network.yaml", bytes)]).ends(),
        bound: Bound { times: 4096, plus: 16 << 20 },
    },
    Target {
        name: "pcd",
        what: "`Scan::parse` of `.pcd`, and its message",
        share: 100,
        seeds: seeds::pcd_files,
        words: &[b"DATA binary_compressed\n", b"COUNT 4294967295 ", b"POINTS ", b"\xff\xff\xff"],
        make: None,
        run: |bytes| scan(bytes, ScanFormat::Pcd),
        bound: DECODER,
    },
    Target {
        name: "npy",
        what: "`Scan::parse` of `.npy` with its header, and its message",
        share: 100,
        seeds: seeds::npy_files,
        words: &[b"(((((((((", b"[", b"4294967295,", b"True", b"'<f4'", b"'|V99999999'", b"0, "],
        make: None,
        run: |bytes| scan(bytes, ScanFormat::Npy),
        bound: DECODER,
    },
    Target {
        name: "bin",
        what: "`Scan::parse` of `.bin`, `read_scan`, `read_labels`",
        share: 20,
        seeds: clouds::seeds,
        words: &[],
        make: None,
        run: bin,
        bound: DECODER,
    },
    Target {
        name: "kitti-text",
        what: "boxes and calibrations of the object benchmark; calibration, poses and times of \
            odometry",
        share: 20,
        seeds: seeds::kitti_files,
        words: &[b"Tr_velo_to_cam:", b"R0_rect:", b"Tr:", b"Car ", b"\n"],
        make: None,
        run: kitti,
        bound: DECODER,
    },
    Target {
        name: "taxonomy",
        what: "`read_taxonomy`",
        share: 10,
        seeds: seeds::taxonomies,
        words: &[b"&a [*a]", b"{{{{{{{{{{", b"- - - - - -", b"!!map", b": ", b"\n  "],
        make: None,
        run: yaml,
        // A class number of 16 bits gives a list of that many classes.
        bound: Bound { times: 4096, plus: 16 << 20 },
    },
    Target {
        name: "records",
        what: "`RecordingReader` by records and by parts, both the same; `Overview`",
        share: 80,
        seeds: Vec::new,
        words: &[],
        make: Some(recording),
        run: read,
        bound: READING,
    },
    Target {
        name: "recording-bytes",
        what: "the same on recordings whose bytes are changed afterwards",
        share: 80,
        seeds: whole_recordings,
        words: &[b"\x06", b"\x05", b"zstd", b"lz4", b"\x89MCAP0\r\n"],
        make: None,
        run: read,
        bound: READING,
    },
    Target {
        name: "annotate",
        what: "`annotate` of a recording, file to file; the output has every record of the input",
        share: 20,
        seeds: Vec::new,
        words: &[],
        make: Some(recording),
        run: annotate,
        bound: ANNOTATING,
    },
    Target {
        name: "method",
        what: "every other method on wild clouds",
        share: 20,
        seeds: clouds::seeds,
        words: &[],
        make: None,
        run: commands::method,
        bound: CLUSTERING,
    },
    Target {
        name: "figure",
        what: "`figure` of wild clouds with one panel or two, as PNG, SVG and PDF",
        share: 10,
        seeds: clouds::seeds,
        words: &[],
        make: None,
        run: commands::figure,
        bound: ANNOTATING,
    },
    Target {
        name: "explain",
        what: "`explain` of two points of wild clouds, and of every fourth its figure",
        share: 10,
        seeds: clouds::seeds,
        words: &[],
        make: None,
        run: commands::explanation,
        bound: ANNOTATING,
    },
    Target {
        name: "triage",
        what: "`triage` of wild clouds",
        share: 20,
        seeds: clouds::seeds,
        words: &[],
        make: None,
        run: commands::suspects,
        bound: CLUSTERING,
    },
    Target {
        name: "evaluate",
        what: "all scores of wild clouds",
        share: 20,
        seeds: clouds::seeds,
        words: &[],
        make: None,
        run: commands::scores,
        bound: CLUSTERING,
    },
    Target {
        name: "export",
        what: "the label files of a recording's clouds",
        share: 20,
        seeds: Vec::new,
        words: &[],
        make: Some(recording),
        run: commands::labels,
        bound: READING,
    },
    Target {
        name: "convert",
        what: "a folder of one scan as a recording",
        share: 20,
        seeds: all_scans,
        words: &[],
        make: None,
        run: commands::scans,
        bound: ANNOTATING,
    },
];

const FIELD_NAMES: &[&[u8]] =
    &[b"x\0", b"y\0", b"z\0", b"ring\0", b"label\0", b"channel\0", b"instance\0", b"ground\0"];

/// Scans in files of every format.
fn all_scans() -> Vec<Vec<u8>> {
    [seeds::pcd_files(), seeds::npy_files(), clouds::seeds()].concat()
}
