//! The layout in which the viewer opens. The SDK's own blueprint has no setter for the eye, the
//! background or the grid.

use std::collections::BTreeMap;

use rerun::external::re_log_types::BlueprintActivationCommand;
use rerun::external::re_sdk_types::blueprint::components::ContainerKind::{
    self, Horizontal, Tabs, Vertical,
};
use rerun::external::re_sdk_types::blueprint::datatypes::{TextLogColumn, TextLogColumnKind};
use rerun::external::re_sdk_types::blueprint::{archetypes, components};
use rerun::log::LogMsg;
use rerun::{
    AsComponents, EntityPath, RecordingStream, RecordingStreamBuilder, RecordingStreamResult,
};

use super::names::{APPLICATION, rgb, topic_path};

/// Sends a layout with a page for each topic; `topics` gives the coordinate frame of each.
pub fn send_blueprint(
    recording: &RecordingStream,
    topics: &BTreeMap<String, String>,
) -> RecordingStreamResult<()> {
    let (stream, storage) = RecordingStreamBuilder::new(APPLICATION).blueprint().memory()?;
    stream.set_time_sequence("blueprint", 0);
    let mut layout = Layout { stream, last: 0 };
    let mut pages = Vec::new();
    for (topic, frame_id) in topics {
        pages.push(layout.page(topic, frame_id)?);
    }
    if pages.len() > 1 {
        layout.container(Tabs, &pages, None)?;
    }
    // The last container holds all others.
    let root = layout.uuid();
    let viewport = archetypes::ViewportBlueprint::new()
        .with_root_container(rerun::datatypes::Uuid { bytes: root.to_be_bytes() })
        .with_auto_layout(false)
        .with_auto_views(false);
    let collapsed = archetypes::PanelBlueprint::new().with_state(components::PanelState::Collapsed);
    let time = archetypes::TimePanelBlueprint::new()
        .with_state(components::PanelState::Collapsed)
        .with_timeline("frame");
    layout.stream.log("viewport", &viewport)?;
    layout.stream.log("blueprint_panel", &collapsed)?;
    layout.stream.log("selection_panel", &collapsed)?;
    layout.stream.log("time_panel", &time)?;
    let messages = storage.take();
    if let Some(LogMsg::SetStoreInfo(info)) = messages.first() {
        let blueprint_id = info.info.store_id.clone();
        let activation =
            BlueprintActivationCommand { blueprint_id, make_active: true, make_default: true };
        recording.send_blueprint(messages, activation);
    }
    Ok(())
}

/// A blueprint in the making: views and containers, each with a number of its own.
struct Layout {
    stream: RecordingStream,
    /// The last number given.
    last: u64,
}

impl Layout {
    /// A topic: instances, components or classes, and numbers side by side, the images below.
    fn page(&mut self, topic: &str, frame_id: &str) -> RecordingStreamResult<String> {
        const INSTANCES: [&str; 4] = ["cloud/instance", "boxes", "dropped/**", "explanation/**"];
        const COMPONENTS: [&str; 4] =
            ["cloud/component", "votes/**", "dropped/**", "explanation/**"];
        let path = topic_path(topic);
        let instances = self.view_3d("Instances", &path, &INSTANCES, frame_id)?;
        let components = self.view_3d("Components and votes", &path, &COMPONENTS, frame_id)?;
        let classes = self.view_3d("Classes", &path, &["cloud/class"], frame_id)?;
        let others = self.container(Tabs, &[components, classes], None)?;
        let numbers = self.numbers(&path)?;
        let upper =
            self.container(Horizontal, &[instances, others, numbers], Some(&[4.0, 4.0, 2.8]))?;
        let mut rows = vec![upper];
        for (name, below) in [
            ("Range", "image/range"),
            ("Components", "image/component"),
            ("Instances", "image/instance"),
        ] {
            rows.push(self.view("2D", name, &path.join(&below.into()), &[], &[])?);
        }
        let page = self.container(Vertical, &rows, Some(&[13.0, 1.8, 1.8, 1.8]))?;
        let named = archetypes::ContainerBlueprint::update_fields().with_display_name(topic);
        self.stream.log(page.as_str(), &named)?;
        Ok(page)
    }

    /// The series of a topic and its log, one below the other.
    fn numbers(&mut self, topic: &EntityPath) -> RecordingStreamResult<String> {
        let corner = archetypes::PlotLegend::new().with_corner(components::Corner2D::LeftTop);
        let series = |layout: &mut Self, name: &str, below: &str| {
            let origin = topic.join(&below.into());
            layout.view("TimeSeries", name, &origin, &[], &[("PlotLegend", &corner)])
        };
        let times = series(self, "Milliseconds per stage", "series/milliseconds")?;
        let counts = series(self, "Number of instances", "series/instances")?;
        let suspicion = series(self, "Suspicion, %", "series/suspicion")?;
        let counts = self.container(Tabs, &[counts, suspicion], None)?;
        let kinds = [TextLogColumnKind::LogLevel, TextLogColumnKind::Body];
        let columns = kinds
            .map(|kind| components::TextLogColumn(TextLogColumn { visible: true.into(), kind }));
        let columns = archetypes::TextLogColumns::new().with_text_log_columns(columns);
        let columns: [(&str, &dyn AsComponents); 1] = [("TextLogColumns", &columns)];
        let log = topic.join(&"log".into());
        let words = self.view("TextLog", "Dropped, and why", &log, &["/log"], &columns)?;
        self.container(Vertical, &[times, counts, words], Some(&[3.0, 2.0, 3.5]))
    }

    /// A view of the scene from above and behind, without a grid.
    fn view_3d(
        &mut self,
        name: &str,
        topic: &EntityPath,
        below: &[&str],
        frame_id: &str,
    ) -> RecordingStreamResult<String> {
        let eye = archetypes::EyeControls3D::new()
            .with_position([-24.0, -10.0, 19.0])
            .with_look_target([3.0, 0.0, -2.0])
            .with_eye_up([0.0, 0.0, 1.0]);
        let background = archetypes::Background::new(components::BackgroundKind::SolidColor)
            .with_color(rgb([16, 18, 22]));
        let grid = archetypes::LineGrid3D::new().with_visible(false);
        let space = archetypes::SpatialInformation::new(frame_id);
        let mut properties: Vec<(&str, &dyn AsComponents)> =
            vec![("EyeControls3D", &eye), ("Background", &background), ("LineGrid3D", &grid)];
        if !frame_id.is_empty() {
            properties.push(("SpatialInformation", &space));
        }
        self.view("3D", name, topic, below, &properties)
    }

    /// Logs a view of the entities `below` its origin, or of the origin itself; returns its path.
    /// An entity that starts with a slash is taken as it stands.
    fn view(
        &mut self,
        class: &str,
        name: &str,
        origin: &EntityPath,
        below: &[&str],
        properties: &[(&str, &dyn AsComponents)],
    ) -> RecordingStreamResult<String> {
        let path = format!("view/{}", self.next_id());
        let mut contents: Vec<String> = below
            .iter()
            .map(|below| match below.starts_with('/') {
                true => (*below).to_owned(),
                false => format!("{origin}/{below}"),
            })
            .collect();
        if below.iter().all(|below| below.starts_with('/')) {
            contents.push(origin.to_string());
        }
        let view = archetypes::ViewBlueprint::new(class)
            .with_display_name(name)
            .with_space_origin(origin.to_string());
        self.stream.log(path.as_str(), &view)?;
        self.stream
            .log(format!("{path}/ViewContents"), &archetypes::ViewContents::new(contents))?;
        for (property, archetype) in properties {
            self.stream.log(format!("{path}/{property}"), *archetype)?;
        }
        Ok(path)
    }

    /// Logs a container and returns its path; shares are widths in a row and heights in a column.
    fn container(
        &mut self,
        kind: ContainerKind,
        contents: &[String],
        shares: Option<&[f32]>,
    ) -> RecordingStreamResult<String> {
        let path = format!("container/{}", self.next_id());
        let mut container = archetypes::ContainerBlueprint::new(kind)
            .with_contents(contents.iter().map(String::as_str));
        if let Some(shares) = shares {
            let shares = shares.iter().copied();
            container = match kind {
                Horizontal => container.with_col_shares(shares),
                _ => container.with_row_shares(shares),
            };
        }
        if let (Tabs, Some(first)) = (kind, contents.first()) {
            container = container.with_active_tab(first.as_str());
        }
        self.stream.log(path.as_str(), &container)?;
        Ok(path)
    }

    /// The last number given, as a UUID.
    fn uuid(&self) -> u128 {
        const OURS: u128 = 0x6469_766d_6572_4765_8000 << 48;
        OURS | u128::from(self.last)
    }

    fn next_id(&mut self) -> String {
        self.last += 1;
        let hex = format!("{:032x}", self.uuid());
        let parts = [&hex[..8], &hex[8..12], &hex[12..16], &hex[16..20], &hex[20..]];
        parts.join("-")
    }
}
