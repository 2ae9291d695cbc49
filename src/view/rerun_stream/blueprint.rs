//! The layouts in which the viewer opens.

use std::collections::BTreeMap;

use rerun::external::re_sdk_types::blueprint::components::ContainerKind::{
    Horizontal, Tabs, Vertical,
};
use rerun::external::re_sdk_types::blueprint::datatypes::{TextLogColumn, TextLogColumnKind};
use rerun::external::re_sdk_types::blueprint::{archetypes, components};
use rerun::{AsComponents, EntityPath, RecordingStream, RecordingStreamResult};

use super::eye::Eye;
use super::layout::{Layout, View};
use super::names::{APPLICATION, topic_path};

/// What there is to see of a topic, by its first cloud.
#[derive(Debug, Clone, PartialEq)]
pub struct TopicPage {
    /// Its coordinate frame.
    pub frame_id: String,
    /// Where it is seen from.
    pub eye: Eye,
    /// Where the colours of ranges end, metres.
    pub far: f64,
    /// Whether there are classes.
    pub has_classes: bool,
    /// Whether components are joined by votes.
    pub has_votes: bool,
    /// Whether the truth is known.
    pub has_truth: bool,
    /// Whether objects are followed.
    pub has_tracks: bool,
}

/// Two points or one of a topic that are explained.
#[derive(Debug, Clone, PartialEq)]
pub struct PairPage {
    /// The topic.
    pub topic: String,
    /// The coordinate frame of the cloud.
    pub frame_id: String,
    /// Where the points are seen from.
    pub eye: Eye,
    /// The part of the range image around them: from left to right and from top to bottom, in
    /// pixels as they are drawn.
    pub window: Option<[[f64; 2]; 2]>,
    /// Whether components are joined by votes.
    pub has_votes: bool,
}

/// Sends a layout with a page for each topic, behind that of an explanation.
pub fn send_blueprint(
    recording: &RecordingStream,
    topics: &BTreeMap<String, TopicPage>,
    pair: Option<&PairPage>,
) -> RecordingStreamResult<()> {
    let mut layout = Layout::new(APPLICATION)?;
    let mut pages = Vec::new();
    if let Some(pair) = pair {
        layout.begin("explanation");
        pages.push(layout.explanation(pair)?);
    }
    for (topic, shown) in topics {
        layout.begin(topic);
        pages.push(layout.topic(topic, shown)?);
    }
    let (messages, activation) = layout.finish(&pages, "frame")?;
    if let Some(activation) = activation {
        recording.send_blueprint(messages, activation);
    }
    Ok(())
}

impl Layout {
    /// A topic: instances and tracks, what led to them, and numbers side by side; below them the
    /// range image, as high as it takes to see it.
    fn topic(&mut self, topic: &str, shown: &TopicPage) -> RecordingStreamResult<String> {
        let path = topic_path(topic);
        let space = (shown.frame_id.as_str(), shown.eye);
        let scene = |layout: &mut Self, name: &str, below: &[&str]| {
            layout.view_3d(name, (&path, below), space)
        };
        const INSTANCES: [&str; 4] =
            ["cloud/instance", "boxes/objects", "boxes/names", "dropped/**"];
        let mut left = vec![scene(self, "Instances", &INSTANCES)?];
        if shown.has_tracks {
            left.push(scene(self, "Tracks", &["cloud/class", "tracks/**"])?);
        }
        let name = if shown.has_votes { "Components and votes" } else { "Components" };
        let mut others = vec![scene(self, name, &["cloud/component", "votes/**"])?];
        let name = if shown.has_classes { "Classes" } else { "Object mask" };
        others.push(scene(self, name, &["cloud/class"])?);
        others.push(scene(self, "Reasons", &["cloud/reason"])?);
        if shown.has_truth {
            others.push(scene(self, "Truth", &["cloud/truth"])?);
        }
        let upper = [
            self.container(Tabs, &left, None)?,
            self.container(Tabs, &others, None)?,
            self.numbers(&path)?,
        ];
        let upper = self.container(Horizontal, &upper, Some(&[4.4, 3.6, 2.4]))?;
        let images = path.join(&"image".into());
        let mut strips = Vec::new();
        for (name, image) in [
            ("Range image: instances", "instance"),
            ("Components", "component"),
            ("Range", "range"),
            ("Reasons", "reason"),
        ] {
            let contents = &[image];
            let (class, origin, properties) = ("2D", &images, &[]);
            strips.push(self.view(&View { class, name, origin, contents, properties })?);
        }
        let strips = self.container(Tabs, &strips, None)?;
        let page = self.container(Vertical, &[upper, strips], Some(&[13.0, 4.6]))?;
        self.name(&page, topic)?;
        Ok(page)
    }

    /// An explanation: the scene around the points, and beside it the words above the range image.
    fn explanation(&mut self, pair: &PairPage) -> RecordingStreamResult<String> {
        let path = topic_path(&pair.topic);
        let explained = path.join(&"explanation".into());
        let space = (pair.frame_id.as_str(), pair.eye);
        const MARKS: [&str; 3] = ["points", "votes/**", "boxes"];
        let mut scenes = Vec::new();
        let components = if pair.has_votes { "Components and votes" } else { "Components" };
        for (name, cloud) in [("Instances", "instance"), (components, "component")] {
            let contents = [[cloud].as_slice(), MARKS.as_slice()].concat();
            scenes.push(self.view_3d(name, (&explained, &contents), space)?);
        }
        let scenes = self.container(Tabs, &scenes, None)?;
        let text = self.view(&View {
            class: "TextDocument",
            name: "Why",
            origin: &explained.join(&"text".into()),
            contents: &[&format!("{}", explained.join(&"text".into()))],
            properties: &[],
        })?;
        let images = path.join(&"image".into());
        let range = |[from, to]: [f64; 2]| rerun::datatypes::Range1D([from, to]);
        let bounds = pair.window.map(|[x, y]| {
            archetypes::VisualBounds2D::new(components::VisualBounds2D(rerun::datatypes::Range2D {
                x_range: range(x),
                y_range: range(y),
            }))
        });
        let bounds = bounds.iter().map(|bounds| ("VisualBounds2D", bounds as &dyn AsComponents));
        let bounds: Vec<(&str, &dyn AsComponents)> = bounds.collect();
        let mut strips = Vec::new();
        for (name, image) in [("Range image: instances", "instance"), ("Components", "component")] {
            let contents = &[image, "explained/**"];
            let (class, origin, properties) = ("2D", &images, bounds.as_slice());
            strips.push(self.view(&View { class, name, origin, contents, properties })?);
        }
        let strips = self.container(Tabs, &strips, None)?;
        let right = self.container(Vertical, &[text, strips], Some(&[3.0, 2.0]))?;
        let page = self.container(Horizontal, &[scenes, right], Some(&[3.0, 2.2]))?;
        self.name(&page, "Explanation")?;
        Ok(page)
    }

    /// The series of a topic and its log, one below the other.
    fn numbers(&mut self, topic: &EntityPath) -> RecordingStreamResult<String> {
        let corner = archetypes::PlotLegend::new().with_corner(components::Corner2D::LeftTop);
        let legend: [(&str, &dyn AsComponents); 1] = [("PlotLegend", &corner)];
        let one = |layout: &mut Self, class: &str, name: &str, below: &str| {
            let origin = topic.join(&below.into());
            let contents = [format!("{origin}"), "/log".to_owned()];
            let is_log = class == "TextLog";
            let contents: Vec<&str> =
                contents.iter().take(1 + usize::from(is_log)).map(String::as_str).collect();
            let kinds = [TextLogColumnKind::LogLevel, TextLogColumnKind::Body];
            let columns = kinds.map(|kind| {
                components::TextLogColumn(TextLogColumn { visible: true.into(), kind })
            });
            let columns = archetypes::TextLogColumns::new().with_text_log_columns(columns);
            let columns: [(&str, &dyn AsComponents); 1] = [("TextLogColumns", &columns)];
            let properties = if is_log { &columns } else { &legend };
            layout.view(&View { class, name, origin: &origin, contents: &contents, properties })
        };
        let times = one(self, "TimeSeries", "Milliseconds per stage", "series/milliseconds")?;
        let counts = one(self, "TimeSeries", "Number of instances", "series/instances")?;
        let suspicion = one(self, "TimeSeries", "Suspicion, %", "series/suspicion")?;
        let words = one(self, "TextLog", "Dropped, and why", "log")?;
        let counts = self.container(Tabs, &[counts, suspicion], None)?;
        self.container(Vertical, &[times, counts, words], Some(&[3.0, 2.0, 3.5]))
    }
}
