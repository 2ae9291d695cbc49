//! Objects followed over the clouds of a recording.

use std::collections::{BTreeMap, BTreeSet};
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};

use divmerge::Taxonomy;
use divmerge::annotate::{
    AnnotateConfig, AnnotateOptions, Semantics, TRACKS_METADATA_NAME, TrackMode, TrackOptions,
    annotate, follow_drive,
};
use divmerge::datasets::cloud_recording::CloudRecording;
use divmerge::datasets::drive::{CLOUD_TOPIC, cloud_message, write_drive};
use divmerge::diagnose::frame_links::{FrameExplanation, FrameLink};
use divmerge::frames::EncodedClouds;
use divmerge::messages::boxes::marker_boxes;
use divmerge::messages::clouds::CloudFormat;
use divmerge::messages::ros::RosReader;
use divmerge::pipeline::Config;
use divmerge::recording::Overview;
use divmerge::recording::{
    MessageHeader, Metadata, Record, RecordingReader, RecordingWriter, WriteOptions,
};
use divmerge::simulate::{Drive, Scene, Sensor};
use tempfile::TempDir;

/// Enough for objects to be followed, and more than the lag of a second.
const FRAMES: usize = 14;

fn drive() -> Drive {
    Drive::new(Sensor::Vlp16, Scene::Street, 5)
}

fn recorded(frames: usize) -> (TempDir, PathBuf) {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("drive.mcap");
    let options = WriteOptions::default();
    write_drive(&drive(), frames, &path, &options, |_| ControlFlow::Continue(())).expect("written");
    (folder, path)
}

fn annotated(input: &Path, options: &AnnotateOptions) -> PathBuf {
    let output = input.with_extension("annotated.mcap");
    let options = AnnotateOptions { force: true, ..options.clone() };
    annotate(input, &output, &options, &mut |_| ControlFlow::Continue(())).expect("annotated");
    output
}

fn with(mode: TrackMode, pipeline: Config) -> AnnotateOptions {
    let tracks = TrackOptions { mode, ..TrackOptions::default() };
    let config = AnnotateConfig { pipeline, ..AnnotateConfig::default() };
    AnnotateOptions { config, tracks, ..AnnotateOptions::default() }
}

/// Of each cloud the columns of these fields; nothing of fields that it does not have.
fn columns<const N: usize>(path: &Path, names: [&str; N]) -> Vec<[Vec<u32>; N]> {
    let topic = format!("{CLOUD_TOPIC}/instances");
    let clouds = EncodedClouds::open(path, Some(&topic), ..).expect("annotated clouds");
    let of_cloud = |cloud: divmerge::Result<divmerge::frames::EncodedCloud>| {
        let cloud = cloud.expect("a cloud");
        let message = cloud.decode().expect("decoded");
        names.map(|name| message.column_u32(name).unwrap_or_default())
    };
    clouds.map(of_cloud).collect()
}

#[test]
fn objects_keep_their_number_from_frame_to_frame() {
    let (_folder, input) = recorded(FRAMES);
    let output = annotated(&input, &AnnotateOptions::default());
    // Of objects of 30 points or more: the tracks of most of their points, frame by frame.
    let mut tracks: BTreeMap<(u32, u32), Vec<u32>> = BTreeMap::new();
    for [class, object, track] in columns(&output, ["label", "true_instance", "track"]) {
        let mut votes: BTreeMap<(u32, u32), BTreeMap<u32, usize>> = BTreeMap::new();
        for (point, &track) in track.iter().enumerate().filter(|(_, track)| **track != 0) {
            let object = (class[point], object[point]);
            *votes.entry(object).or_default().entry(track).or_default() += 1;
        }
        for (object, votes) in votes {
            let (&track, _) = votes.iter().max_by_key(|(_, count)| **count).expect("a track");
            if votes.values().sum::<usize>() >= 30 {
                tracks.entry(object).or_default().push(track);
            }
        }
    }
    tracks.retain(|_, tracks| tracks.len() >= FRAMES / 2);
    assert!(tracks.len() >= 10, "{tracks:?}");
    let kept = |tracks: &&Vec<u32>| tracks.iter().all(|track| *track == tracks[0]);
    let kept = tracks.values().filter(kept).count();
    assert!(kept * 10 >= tracks.len() * 9, "{kept} of {}: {tracks:?}", tracks.len());
    let different: BTreeSet<u32> = tracks.values().map(|tracks| tracks[0]).collect();
    assert!(different.len() * 10 >= tracks.len() * 9, "{tracks:?}");
}

#[test]
fn each_instance_of_a_frame_is_explained() {
    let (_folder, input) = recorded(FRAMES);
    let (config, tracks) = (AnnotateConfig::default(), TrackOptions::default());
    let drive = follow_drive(&input, (None, ..), (&config, &tracks), &mut |_| Ok(()));
    let drive = drive.expect("followed");
    let explained = |number| FrameExplanation::of(&drive, number, &tracks.params);
    assert_eq!(explained(FRAMES as u64), None);
    // In the first frame all begin; later most were in the frame before.
    let first = explained(0).expect("a frame");
    assert!(first.links.iter().all(|link| link.before.is_none()), "{first:?}");
    let later = explained(9).expect("a frame");
    let ids: BTreeSet<u32> = later.links.iter().map(|link| link.link.instance).collect();
    assert_eq!(ids, drive.clouds[9].instances.iter().map(|instance| instance.id).collect());
    let was_before = |link: &&FrameLink| link.before.is_some_and(|seen| seen.cloud == 8);
    let followed: Vec<&FrameLink> = later.links.iter().filter(was_before).collect();
    assert!(followed.len() * 2 > later.links.len(), "{later:?}");
    for FrameLink { track, before, .. } in followed {
        let seen = before.expect("in frame 8");
        let of_eight = explained(8).expect("a frame").links.into_iter();
        let mut of_track = of_eight.filter(|link| link.track == *track);
        assert!(of_track.any(|link| link.link.instance == seen.instance), "{track}");
    }
    let text = later.to_string();
    let lines = text.lines().filter(|line| line.contains("affinity")).count();
    assert!(text.starts_with("frame 9 of ") && lines * 2 > later.links.len(), "{text}");
}

#[test]
fn every_point_of_an_instance_has_a_track_and_no_other_point() {
    let (_folder, input) = recorded(FRAMES);
    for semantics in [Semantics::Auto, Semantics::Ground] {
        let config = AnnotateConfig { semantics, ..AnnotateConfig::default() };
        let options = AnnotateOptions { config, ..AnnotateOptions::default() };
        let clouds = columns(&annotated(&input, &options), ["instance", "track"]);
        assert_eq!(clouds.len(), FRAMES);
        for [instance, track] in clouds {
            assert_eq!(instance.len(), track.len());
            let differs = |(instance, track): (&u32, &u32)| (*instance == 0) != (*track == 0);
            assert!(!instance.iter().zip(&track).any(differs));
        }
    }
}

#[test]
fn a_box_for_each_track_of_the_frame() {
    let (_folder, input) = recorded(FRAMES);
    let output = annotated(&input, &AnnotateOptions::default());
    let tracks = columns(&output, ["track"]).into_iter();
    let tracks = tracks.map(|[track]| track.into_iter().filter(|&t| t != 0).collect());
    let tracks: Vec<BTreeSet<u32>> = tracks.collect();
    let overview = Overview::read(&output).expect("an overview");
    let boxes = overview.channels_of(&format!("{CLOUD_TOPIC}/objects")).next().expect("boxes").id;
    let taxonomy = Taxonomy::semantic_kitti();
    let mut reader = RecordingReader::open(&output).expect("opened");
    let mut found = Vec::new();
    while let Some(record) = reader.next_record().expect("a record") {
        let Record::Message { header, data, .. } = record else { continue };
        if header.channel_id == boxes {
            let message = marker_boxes(&data, true, &taxonomy).expect("markers");
            found.push(message.map_or(0, |message| message.detections.len()));
        }
    }
    assert_eq!(found, tracks.iter().map(BTreeSet::len).collect::<Vec<usize>>());
}

#[test]
fn presets_that_are_others_and_single_clouds_have_no_tracks() {
    let (_folder, input) = recorded(2);
    let has_tracks = |input: &Path, options: &AnnotateOptions| {
        let clouds = columns(&annotated(input, options), ["track"]);
        clouds.iter().all(|[track]| !track.is_empty())
    };
    assert!(has_tracks(&input, &with(TrackMode::Auto, Config::best())));
    assert!(!has_tracks(&input, &with(TrackMode::Auto, Config::paper())));
    assert!(has_tracks(&input, &with(TrackMode::On, Config::authors())));
    assert!(!has_tracks(&input, &with(TrackMode::Off, Config::best())));
    let (_folder, input) = recorded(1);
    assert!(!has_tracks(&input, &with(TrackMode::On, Config::best())));
}

/// A topic that ends does not hold up the others until the end.
#[test]
fn clouds_do_not_wait_for_a_topic_that_has_ended() {
    let folder = tempfile::tempdir().expect("a folder");
    let input = folder.path().join("two.mcap");
    let options = WriteOptions::default();
    let mut writer = RecordingWriter::create(&input, &options).expect("begun");
    let channels = ["/short", "/long"].map(|topic| {
        let schema = CloudFormat::Ros2.schema();
        let definition = (schema.name, schema.encoding, &*schema.data);
        let metadata = BTreeMap::new();
        writer.declare_channel(topic, definition, "cdr", &metadata).expect("declared")
    });
    let mut message = Vec::new();
    cloud_message(&drive().frame(0), &mut message).expect("encoded");
    for number in 0..80_u64 {
        for &channel_id in channels.iter().skip(usize::from(number >= 3)) {
            let log_time = 1_000_000_000 + number * 100_000_000;
            // Seconds and nanoseconds of the stamp stand behind the header of CDR.
            message[4..8].copy_from_slice(&((log_time / 1_000_000_000) as u32).to_le_bytes());
            message[8..12].copy_from_slice(&((log_time % 1_000_000_000) as u32).to_le_bytes());
            let header =
                MessageHeader { channel_id, sequence: 0, log_time, publish_time: log_time };
            writer.write_message(&header, &message).expect("written");
        }
    }
    writer.finish().expect("complete");
    let output = folder.path().join("out.mcap");
    let options = AnnotateOptions { threads: 1, ..AnnotateOptions::default() };
    let report = annotate(&input, &output, &options, &mut |_| ControlFlow::Continue(()));
    let report = report.expect("annotated");
    assert_eq!(report.topics["/long"].frames, 80);
    // The two seconds that the short topic is waited for.
    let most = report.profile.most_clouds_in_flight;
    assert!((3..=24).contains(&most), "{most}");
}

/// The same drive twice, one behind the other: stamps go back.
#[test]
fn tracks_end_where_time_goes_back() {
    let folder = tempfile::tempdir().expect("a folder");
    let input = folder.path().join("twice.mcap");
    let options = WriteOptions::default();
    let mut recording =
        CloudRecording::create(CloudFormat::Ros2, &input, CLOUD_TOPIC, &options).expect("begun");
    for number in [0, 1, 2, 0, 1, 2] {
        let frame = drive().frame(number);
        let mut message = Vec::new();
        cloud_message(&frame, &mut message).expect("encoded");
        recording.write_cloud(frame.stamp_ns, &message).expect("written");
    }
    recording.finish().expect("complete");
    let clouds = columns(&annotated(&input, &AnnotateOptions::default()), ["track"]);
    let of = |clouds: &[[Vec<u32>; 1]]| {
        let tracks = clouds.iter().flat_map(|[track]| track.iter().copied());
        tracks.filter(|&track| track != 0).collect::<BTreeSet<u32>>()
    };
    let (first, second) = (of(&clouds[..3]), of(&clouds[3..]));
    assert!(!first.is_empty() && first.len() == second.len());
    assert!(first.is_disjoint(&second), "{first:?} {second:?}");
}

/// The boxes of each cloud by their number: length, width and height.
fn box_sizes(path: &Path) -> Vec<BTreeMap<u32, [f64; 3]>> {
    let overview = Overview::read(path).expect("an overview");
    let boxes = overview.channels_of(&format!("{CLOUD_TOPIC}/objects")).next().expect("boxes").id;
    let mut reader = RecordingReader::open(path).expect("opened");
    let mut sizes = Vec::new();
    while let Some(record) = reader.next_record().expect("a record") {
        let Record::Message { header, data, .. } = record else { continue };
        if header.channel_id == boxes {
            sizes.push(marker_sizes(&data));
        }
    }
    sizes
}

/// Reads the cubes of a MarkerArray of ROS 2.
fn marker_sizes(message: &[u8]) -> BTreeMap<u32, [f64; 3]> {
    let mut reader = RosReader::cdr("MarkerArray", message).expect("CDR");
    let r = &mut reader;
    let mut sizes = BTreeMap::new();
    for _ in 0..r.u32().expect("a count") {
        r.header().expect("a header");
        let namespace = r.string().expect("a namespace");
        let [id, _, _] = [(); 3].map(|()| r.i32().expect("a code"));
        let [.., length, width, height] = [(); 10].map(|()| r.f64().expect("a number"));
        let _colour = [(); 4].map(|()| r.f32().expect("a colour"));
        let _lifetime = (r.i32().expect("seconds"), r.u32().expect("nanoseconds"));
        let _is_locked = r.bool().expect("a flag");
        let _lists = (r.u32().expect("points"), r.u32().expect("colours"));
        let _texture = (r.string(), r.header(), r.string(), r.u32(), r.u32());
        let _texts = (r.string(), r.string(), r.string(), r.u32(), r.bool());
        if namespace == "boxes" {
            sizes.insert(id as u32, [length, width, height]);
        }
    }
    sizes
}

/// How much the length of a box changes from cloud to cloud, metres, in the mean.
fn flicker(path: &Path, tracks: &BTreeSet<u32>) -> f64 {
    let sizes = box_sizes(path);
    let changes: Vec<f64> = sizes
        .windows(2)
        .flat_map(|pair| {
            let both = pair[0].iter().filter(|(track, _)| tracks.contains(track));
            both.filter_map(|(track, before)| Some((before[0] - pair[1].get(track)?[0]).abs()))
        })
        .collect();
    assert!(changes.len() > 50, "{}", changes.len());
    changes.iter().sum::<f64>() / changes.len() as f64
}

#[test]
fn the_box_of_a_track_keeps_its_size() {
    let (_folder, input) = recorded(FRAMES);
    let output = annotated(&input, &AnnotateOptions::default());
    let tracks: BTreeSet<u32> = summaries(&output).iter().map(|track| track.track).collect();
    let steady = flicker(&output, &tracks);
    assert!(steady < 0.1, "{steady} m");
}

#[derive(serde::Deserialize)]
struct Summary {
    track: u32,
    body: String,
    class: Option<u16>,
    first_ns: i64,
    last_ns: i64,
    clouds: u64,
    size: [f32; 3],
    moving: bool,
    speed: Option<[f32; 2]>,
}

fn summaries(path: &Path) -> Vec<Summary> {
    let mut reader = RecordingReader::open(path).expect("opened");
    while let Some(record) = reader.next_record().expect("a record") {
        if let Record::Metadata(Metadata { name, metadata: table }) = record
            && name == TRACKS_METADATA_NAME
        {
            assert_eq!(table["topic"], CLOUD_TOPIC);
            return serde_json::from_str(&table["tracks"]).expect("a list");
        }
    }
    panic!("no summary");
}

#[test]
fn the_summary_says_what_each_object_is_and_how_it_moved() {
    let (_folder, input) = recorded(FRAMES);
    let output = annotated(&input, &AnnotateOptions::default());
    let clouds = columns(&output, ["track", "label"]);
    let mut times = Vec::new();
    for cloud in EncodedClouds::open(&input, Some(CLOUD_TOPIC), ..).expect("clouds") {
        times.push(cloud.expect("a cloud").decode().expect("decoded").stamp_ns());
    }
    let tracks = summaries(&output);
    assert!(tracks.len() >= 10, "{}", tracks.len());
    assert!(tracks.iter().any(|track| track.moving) && tracks.iter().any(|track| !track.moving));
    for track in tracks {
        let has = |cloud: &&[Vec<u32>; 2]| cloud[0].contains(&track.track);
        assert_eq!(clouds.iter().filter(has).count() as u64, track.clouds);
        let first = clouds.iter().position(|cloud| has(&cloud)).expect("a cloud");
        assert_eq!(times[first], track.first_ns);
        assert!(track.last_ns >= track.first_ns && track.size.iter().all(|&side| side >= 0.0));
        assert_eq!(track.moving, track.speed.is_some());
        assert!(track.speed.is_none_or(|[speed, error]| speed > 0.5 && error < speed / 3.0));
        let people = [30, 254];
        let is_person = track.class.is_some_and(|class| people.contains(&class));
        assert_eq!(is_person, track.body == "person", "{:?}", track.class);
    }
}
