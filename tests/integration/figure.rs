//! `divmerge figure`: pictures that decode, the same bytes twice, axes and themes, and what it says
//! of bad input.

use std::collections::BTreeSet;
use std::path::Path;
use std::process::{Command, Output};

use divmerge::datasets::drive::{CLOUD_TOPIC, write_drive};
use divmerge::messages::palette::instance_colour;
use divmerge::recording::WriteOptions;
use divmerge::simulate::{Drive, Scene, Sensor};

use crate::recordings::drive;

fn figure(arguments: &[&str]) -> Output {
    let program = env!("CARGO_BIN_EXE_divmerge");
    Command::new(program).arg("figure").args(arguments).output().expect("the binary runs")
}

fn text(bytes: &[u8]) -> String {
    String::from_utf8_lossy(bytes).into_owned()
}

fn path(path: &Path) -> &str {
    path.to_str().expect("a path in UTF-8")
}

/// Draws and returns the bytes.
fn drawn(output: &Path, arguments: &[&str]) -> Vec<u8> {
    let done = figure(&[arguments, &["-o", path(output)]].concat());
    assert_eq!(done.status.code(), Some(0), "{arguments:?}: {}", text(&done.stderr));
    std::fs::read(output).expect("the figure")
}

/// Width, height and colours of a PNG.
fn decoded(bytes: &[u8]) -> (u32, u32, Vec<[u8; 3]>) {
    let mut reader = png::Decoder::new(std::io::Cursor::new(bytes)).read_info().expect("a PNG");
    let mut pixels = vec![0; reader.output_buffer_size().expect("a size")];
    let info = reader.next_frame(&mut pixels).expect("pixels");
    assert_eq!(info.color_type, png::ColorType::Rgb);
    let pixels = pixels.as_chunks::<3>().0.to_vec();
    (info.width, info.height, pixels)
}

/// The names of elements are opened and closed in order, and nothing else looks like one.
fn assert_well_formed(xml: &str) {
    let mut open = Vec::new();
    let mut rest = xml;
    while let Some(start) = rest.find('<') {
        let end = start + rest[start..].find('>').expect("an end");
        let tag = &rest[start + 1..end];
        let name = |tag: &str| tag.split_whitespace().next().expect("a name").to_owned();
        if let Some(closed) = tag.strip_prefix('/') {
            assert_eq!(open.pop().as_deref(), Some(closed), "closed in order");
        } else if let Some(alone) = tag.strip_suffix('/') {
            assert_eq!(alone.matches('"').count() % 2, 0, "{alone}");
        } else {
            assert_eq!(tag.matches('"').count() % 2, 0, "{tag}");
            open.push(name(tag));
        }
        rest = &rest[end + 1..];
        let words = &rest[..rest.find('<').unwrap_or(rest.len())];
        assert!(!words.contains('>'), "{words}");
    }
    assert!(open.is_empty() && xml.starts_with("<svg"), "{open:?}");
}

#[test]
fn png_has_its_size_and_the_instances_colours_and_is_the_same_twice() {
    let (folder, input) = drive(2);
    let make = |name: &str, more: &[&str]| {
        let arguments = [&[path(&input), "--frame", "1"], more].concat();
        drawn(&folder.path().join(name), &arguments)
    };
    let first = make("a.png", &["--dpi", "96"]);
    assert!(first == make("b.png", &["--dpi", "96"]), "the same bytes");
    let (width, height, pixels) = decoded(&first);
    assert!(width == 1000 && (600..2000).contains(&height), "{width} x {height}");
    let colours: BTreeSet<[u8; 3]> = pixels.into_iter().collect();
    let seen = (1..=10).filter(|&id| colours.contains(&instance_colour(id)));
    assert!(seen.count() >= 8, "instances in their colours");
    let (width, double, _) = decoded(&make("c.png", &["--dpi", "192"]));
    assert!(width == 2000 && double.abs_diff(2 * height) <= 1);
}

#[test]
fn every_panel_alone_and_all_together_as_svg() {
    let (folder, input) = drive(1);
    let output = folder.path().join("figure.svg");
    let all = ["range", "intensity", "mask", "components", "instances", "votes", "bev"];
    let joined = all.join(",");
    for panels in all.into_iter().chain([joined.as_str()]) {
        let bytes = drawn(&output, &[path(&input), "--panels", panels, "--force"]);
        assert_well_formed(&text(&bytes));
    }
    let svg = text(&std::fs::read(&output).expect("the figure"));
    for words in ["frame 0", "local components", "(m = ", "kept apart (", "thin margin", " m\""] {
        assert!(svg.contains(words), "{words}");
    }
    assert!(svg.contains("bird's-eye view") && !svg.contains("<text"));
    let crop =
        ["--window", "100..300/2..14", "--view", "-10..10/-5..5", "--aspect", "1:6", "--force"];
    let bytes = drawn(&output, &[&[path(&input)], &crop[..]].concat());
    assert_well_formed(&text(&bytes));
}

#[test]
fn a_pdf_has_one_page_of_the_figures_size_and_is_the_same_twice() {
    let (folder, input) = drive(1);
    let make = |name: &str| drawn(&folder.path().join(name), &[path(&input), "--dpi", "96"]);
    let first = make("a.pdf");
    assert!(first.starts_with(b"%PDF-") && first == make("b.pdf"), "the same bytes");
    let (_, height, _) = decoded(&make("a.png"));
    let words = text(&first);
    let size = format!("/MediaBox [0 0 750 {}]", f64::from(height) * 0.75);
    assert!(words.contains(&size), "{size}");
    assert_eq!(words.matches("/Type /Page\n").count(), 1);
    assert!(words.contains("/Title") && words.contains("/FontFile2"));
}

#[test]
fn light_panels_are_light_and_instances_keep_their_colours() {
    let (folder, input) = drive(1);
    let colours = |theme: &str| {
        let output = folder.path().join(format!("{theme}.png"));
        let panels = ["--panels", "instances,bev", "--dpi", "192", "--theme", theme];
        let (_, _, pixels) = decoded(&drawn(&output, &[&[path(&input)], &panels[..]].concat()));
        pixels
    };
    let is_dark = |pixel: &[u8; 3]| pixel.iter().all(|&part| part < 60);
    let share = |pixels: &[[u8; 3]]| {
        pixels.iter().filter(|pixel| is_dark(pixel)).count() as f64 / pixels.len() as f64
    };
    let (dark, light) = (colours("dark"), colours("light"));
    assert!(share(&dark) > 0.2 && share(&light) < 0.05, "{} {}", share(&dark), share(&light));
    let seen = |pixels: &[[u8; 3]]| -> Vec<u32> {
        (1..=10).filter(|&id| pixels.contains(&instance_colour(id))).collect()
    };
    assert!(seen(&dark).len() >= 8, "{:?}", seen(&dark));
    assert_eq!(seen(&dark), seen(&light));
}

#[test]
fn axes_have_degrees_with_the_left_side_positive() {
    let (folder, input) = drive(1);
    let output = folder.path().join("axes.svg");
    let svg = text(&drawn(&output, &[path(&input), "--panels", "range"]));
    // Where on the page the label of an azimuth is.
    let place = |label: &str| -> f64 {
        let found = svg.split("<g ").find(|path| path.contains(&format!("\"{label}\"")));
        let path = found.unwrap_or_else(|| panic!("no {label}"));
        let (_, rest) = path.split_once("translate(").expect("a place");
        rest.split(' ').next().and_then(|x| x.parse().ok()).expect("a number")
    };
    assert!(place("90°") < place("0°") && place("0°") < place("−90°"));
    // A part of the image in front of the sensor begins on its left.
    let window = [path(&input), "--panels", "range", "--window", "0..100", "--force"];
    let svg = text(&drawn(&output, &window));
    assert!(svg.contains("\"170°\"") && !svg.contains("\"−90°\""));
}

#[test]
fn without_classes_the_usual_panels_have_no_votes() {
    let (folder, input) = drive(1);
    let output = folder.path().join("ground.svg");
    let ground = [path(&input), "--semantics", "ground"];
    let svg = text(&drawn(&output, &ground));
    assert!(svg.contains("bird's-eye view") && !svg.contains("\"votes\""));
    let svg = text(&drawn(&output, &[&ground[..], &["--panels", "votes", "--force"]].concat()));
    assert!(svg.contains("\"votes\""));
}

#[test]
fn time_chooses_the_nearest_frame() {
    let (folder, input) = drive(3);
    let output = folder.path().join("figure.svg");
    let svg = text(&drawn(&output, &[path(&input), "--time", "0.19", "--panels", "mask"]));
    assert!(svg.contains("frame 2"), "{}", &svg[svg.len() - 2000..]);
}

#[test]
fn steps_and_video_are_numbered() {
    let (folder, input) = drive(3);
    let steps = folder.path().join("steps");
    let arguments = [path(&input), "--dpi", "48", "--window", "0..400"];
    let done = figure(&[&arguments[..], &["--steps", path(&steps)]].concat());
    assert_eq!(done.status.code(), Some(0), "{}", text(&done.stderr));
    let count = std::fs::read_dir(&steps).expect("steps").count();
    assert!(count > 0 && steps.join("step_00001.png").exists());
    let by = ["--steps", path(&steps), "--steps-by", "decision", "--force"];
    let done = figure(&[&arguments[..], &by[..]].concat());
    assert_eq!(done.status.code(), Some(0), "{}", text(&done.stderr));
    assert!(std::fs::read_dir(&steps).expect("steps").count() >= count);

    let video = folder.path().join("video");
    let arguments =
        [path(&input), "--dpi", "48", "--frames", "1..3", "--video", path(&video), "--panels"];
    let done = figure(&[&arguments[..], &["instances,bev"]].concat());
    assert_eq!(done.status.code(), Some(0), "{}", text(&done.stderr));
    let size = |number: u32| {
        let file = video.join(format!("frame_{number:06}.png"));
        let (width, height, _) = decoded(&std::fs::read(file).expect("a frame"));
        (width, height)
    };
    assert_eq!(size(1), size(2));
    assert!(!video.join("frame_000000.png").exists());
    let done = figure(&[&arguments[..], &["mask"]].concat());
    assert_eq!(done.status.code(), Some(2));
    assert!(text(&done.stderr).contains("--force"), "{}", text(&done.stderr));
}

/// Without classes there is a picture for each object that was cut from the tree.
#[test]
fn objects_of_a_tree_have_steps() {
    let (folder, input) = drive(1);
    let count = |name: &str, more: &[&str]| {
        let steps = folder.path().join(name);
        let arguments = [path(&input), "--dpi", "48", "--semantics", "ground"];
        let done = figure(&[&arguments[..], &["--steps", path(&steps)], more].concat());
        let said = text(&done.stdout);
        assert!(said.ends_with("one for each object\n"), "{said}{}", text(&done.stderr));
        let files = std::fs::read_dir(&steps).expect("steps").count();
        assert!(said.starts_with(&format!("wrote {files} pictures")), "{said}");
        let first = std::fs::read(steps.join("step_00001.png")).expect("a picture");
        let (width, height, colours) = decoded(&first);
        assert!(width == 500 && height > 150, "{width} x {height}");
        let distinct = colours.into_iter().collect::<BTreeSet<_>>().len();
        assert!(distinct > 20, "{distinct} colours");
        files
    };
    let all = count("all", &[]);
    let part = count("part", &["--window", "0..400"]);
    assert!(part > 1 && part < all, "{part} of {all}");
    let steps = folder.path().join("decisions");
    let by = ["--semantics", "ground", "--steps-by", "decision", "--steps", path(&steps)];
    let done = figure(&[&[path(&input)], &by[..]].concat());
    assert_eq!(done.status.code(), Some(2));
    assert!(text(&done.stderr).contains("merges by votes"), "{}", text(&done.stderr));
}

#[test]
fn an_empty_frame_can_be_drawn() {
    use divmerge::datasets::drive::cloud_message;
    use divmerge::messages::definitions::POINT_CLOUD2;
    use divmerge::recording::{MessageHeader, RecordingWriter};
    let folder = tempfile::tempdir().expect("a folder");
    let input = folder.path().join("empty.mcap");
    let mut frame = Drive::new(Sensor::Vlp16, Scene::Parking, 1).frame(0);
    frame.cloud = divmerge::PointCloud::new(vec![], vec![], vec![]).expect("a cloud");
    let mut message = Vec::new();
    cloud_message(&frame, &mut message).expect("a message");
    let mut writer = RecordingWriter::create(&input, &WriteOptions::default()).expect("a writer");
    let schema = POINT_CLOUD2.add_to(&mut writer).expect("a schema");
    let channel_id =
        writer.add_channel("/empty", schema, "cdr", &Default::default()).expect("a channel");
    let header = MessageHeader { channel_id, sequence: 0, log_time: 0, publish_time: 0 };
    writer.write_message(&header, &message).expect("written");
    writer.finish().expect("whole");
    let panels = "range,mask,components,instances,votes,bev";
    for name in ["empty.png", "empty.svg"] {
        let output = folder.path().join(name);
        assert!(!drawn(&output, &[path(&input), "--panels", panels]).is_empty());
    }
}

#[test]
fn bad_input_is_told() {
    let (folder, input) = drive(2);
    let output = folder.path().join("figure.png");
    let (input, output) = (path(&input), path(&output));
    let whole = [input, "-o", output];
    let file = folder.path().join("file");
    std::fs::write(&file, "").expect("written");
    let below_a_file = file.join("steps");
    let cases: &[(&[&str], i32, &[&str])] = &[
        (&["--frame", "2"], 2, &["2 clouds, numbered 0 to 1", "/lidar/points", "drive.mcap"]),
        (&["--topic", "/tf"], 2, &["`/tf`", CLOUD_TOPIC]),
        (&["--window", "5000..6000"], 2, &["columns 5000..6000", "16 x "]),
        (&["--semantics", "field:no"], 1, &["`no`", "label", "frame 0"]),
        (&["--steps", path(&below_a_file)], 1, &["file"]),
        (&["--panels", "mask,paint"], 2, &["mask, components"]),
        (&["--panels", ""], 2, &[]),
        (&["--aspect", "0:8"], 2, &["height:width"]),
        (&["--dpi", "0"], 2, &[]),
        (&["--window", "9..3"], 2, &["a below b"]),
        (&["--frame", "1", "--time", "0"], 2, &[]),
        (&["--video", "x"], 2, &[]),
        (&["--frames", "0..1"], 2, &[]),
    ];
    for (more, code, words) in cases {
        let done = figure(&[&whole[..], more].concat());
        let said = text(&done.stderr);
        assert_eq!(done.status.code(), Some(*code), "{more:?}: {said}");
        assert!(words.iter().all(|words| said.contains(words)), "{more:?}: {said}");
        assert!(!Path::new(output).exists(), "{more:?}");
    }
    for (arguments, code) in [
        (&[input][..], 2),
        (&[input, "-o", "figure.jpg"], 2),
        (&[input, "-o", "/no/such/folder/figure.png"], 2),
        (&[input, "--video", "/proc/no", "--frames", "0..1"], 1),
        (&[input, "--video", path(folder.path()), "--frames", "1..3"], 2),
        (&["/no/such.mcap", "-o", "x.png"], 1),
    ] {
        let done = figure(arguments);
        assert_eq!(done.status.code(), Some(code), "{arguments:?}: {}", text(&done.stderr));
    }
    std::fs::write(output, "mine").expect("written");
    let refused = figure(&whole);
    assert_eq!(refused.status.code(), Some(2));
    assert!(text(&refused.stderr).contains("--force"), "{}", text(&refused.stderr));
    assert_eq!(std::fs::read(output).expect("kept"), b"mine");
}

#[test]
fn an_object_keeps_its_colour_from_frame_to_frame() {
    use divmerge::Taxonomy;
    use divmerge::pipeline::{self, Config};
    use divmerge::semantics::MaskSource;
    use divmerge::view::ColourTracker;
    let taxonomy = Taxonomy::semantic_kitti();
    let drive = Drive::new(Sensor::Hdl64e, Scene::Parking, 2);
    let mut tracker = ColourTracker::default();
    // Colour number of most points of each true object.
    let mut last = std::collections::BTreeMap::new();
    let (mut kept, mut all) = (0, 0);
    for number in 0..3 {
        let frame = drive.frame(number);
        let stages =
            pipeline::run(&frame.cloud, MaskSource::Classes(&taxonomy), &Config::default());
        let numbers = tracker.colour_numbers(&stages.instances);
        let mut now = std::collections::BTreeMap::new();
        for instance in stages.instances.iter().filter(|instance| instance.points >= 200) {
            let points = stages.labels.instance.iter().zip(&frame.true_instance);
            let truth = points.filter(|&(&id, _)| id == instance.id).map(|(_, &truth)| truth).min();
            now.insert(truth, numbers[instance.id as usize - 1]);
        }
        for (truth, colour) in &now {
            if let Some(before) = last.get(truth) {
                all += 1;
                kept += usize::from(before == colour);
            }
        }
        last = now;
    }
    assert!(all >= 10 && kept * 10 >= all * 9, "{kept} of {all}");
}

#[test]
fn a_drive_of_no_frames_has_nothing_to_draw() {
    let folder = tempfile::tempdir().expect("a folder");
    let input = folder.path().join("none.mcap");
    let drive = Drive::new(Sensor::Vlp16, Scene::Parking, 1);
    write_drive(&drive, 0, &input, &WriteOptions::default(), |_| {
        std::ops::ControlFlow::Continue(())
    })
    .expect("a drive");
    let output = folder.path().join("x.png");
    let done = figure(&[path(&input), "-o", path(&output)]);
    assert_eq!(done.status.code(), Some(1));
    assert!(text(&done.stderr).contains("no cloud on `/lidar/points`"), "{}", text(&done.stderr));
}
