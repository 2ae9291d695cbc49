//! Views and containers of the viewer, one by one. The SDK's own blueprint has no setter for the
//! eye, the background or the grid.

use rerun::external::re_log_types::{ApplicationId, BlueprintActivationCommand};
use rerun::external::re_sdk_types::blueprint::components::ContainerKind::{self, Horizontal, Tabs};
use rerun::external::re_sdk_types::blueprint::{archetypes, components};
use rerun::log::LogMsg;
use rerun::sink::MemorySinkStorage;
use rerun::{
    AsComponents, EntityPath, RecordingStream, RecordingStreamBuilder, RecordingStreamResult,
};

use super::eye::Eye;
use super::names::rgb;
use crate::view::look;

/// A blueprint in the making: views and containers, each with a number of its own.
pub struct Layout {
    stream: RecordingStream,
    storage: MemorySinkStorage,
    /// Number of the page that is being made.
    page: u64,
    /// The last number given on it.
    last: u64,
}

/// A view of some entities.
pub struct View<'a> {
    /// Its class, as in `3D`.
    pub class: &'a str,
    /// What is written on its tab.
    pub name: &'a str,
    /// The entity in whose space it is.
    pub origin: &'a EntityPath,
    /// What it shows, below its origin, or from the root with a slash.
    pub contents: &'a [&'a str],
    /// What it is told, by the name of the archetype.
    pub properties: &'a [(&'a str, &'a dyn AsComponents)],
}

impl Layout {
    /// An empty layout for recordings of an application.
    pub fn new(application: &str) -> RecordingStreamResult<Self> {
        let application = ApplicationId::new_or_unknown(application);
        let (stream, storage) = RecordingStreamBuilder::new(application).blueprint().memory()?;
        stream.set_time_sequence("blueprint", 0);
        Ok(Layout { stream, storage, page: 0, last: 0 })
    }

    /// Begins a page. Its views have numbers of their own, the same in every layout: the viewer
    /// keeps by them how each was left.
    pub fn begin(&mut self, name: &str) {
        // FNV-1a.
        let step = |hash: u64, byte: u8| (hash ^ u64::from(byte)).wrapping_mul(0x100_0000_01b3);
        (self.page, self.last) = (name.bytes().fold(0xcbf2_9ce4_8422_2325, step), 0);
    }

    /// Ends it with its pages, each a tab, the first in front; gives what tells a viewer of it, and
    /// to switch to it.
    pub fn finish(
        mut self,
        pages: &[String],
        timeline: &str,
    ) -> RecordingStreamResult<(Vec<LogMsg>, Option<BlueprintActivationCommand>)> {
        self.begin("");
        self.container(Tabs, pages, None)?;
        let root = self.uuid();
        let viewport = archetypes::ViewportBlueprint::new()
            .with_root_container(rerun::datatypes::Uuid { bytes: root.to_be_bytes() })
            .with_auto_layout(false)
            .with_auto_views(false);
        let collapsed =
            archetypes::PanelBlueprint::new().with_state(components::PanelState::Collapsed);
        let time = archetypes::TimePanelBlueprint::new()
            .with_state(components::PanelState::Collapsed)
            .with_timeline(timeline);
        self.stream.log("viewport", &viewport)?;
        self.stream.log("blueprint_panel", &collapsed)?;
        self.stream.log("selection_panel", &collapsed)?;
        self.stream.log("time_panel", &time)?;
        let messages = self.storage.take();
        let activation = match messages.first() {
            Some(LogMsg::SetStoreInfo(info)) => Some(BlueprintActivationCommand {
                blueprint_id: info.info.store_id.clone(),
                make_active: true,
                make_default: true,
            }),
            _ => None,
        };
        Ok((messages, activation))
    }

    /// A view of a scene through an eye, without a grid.
    pub fn view_3d(
        &mut self,
        name: &str,
        (origin, contents): (&EntityPath, &[&str]),
        (frame_id, eye): (&str, Eye),
    ) -> RecordingStreamResult<String> {
        let place = |at: [f64; 3]| at.map(|value| value as f32);
        let eye = archetypes::EyeControls3D::new()
            .with_position(place(eye.position))
            .with_look_target(place(eye.target))
            .with_eye_up([0.0, 0.0, 1.0]);
        let background = archetypes::Background::new(components::BackgroundKind::SolidColor)
            .with_color(rgb(look::DARK.panel));
        let grid = archetypes::LineGrid3D::new().with_visible(false);
        let space = archetypes::SpatialInformation::new(frame_id);
        let mut properties: Vec<(&str, &dyn AsComponents)> =
            vec![("EyeControls3D", &eye), ("Background", &background), ("LineGrid3D", &grid)];
        if !frame_id.is_empty() {
            properties.push(("SpatialInformation", &space));
        }
        self.view(&View { class: "3D", name, origin, contents, properties: &properties })
    }

    /// Logs a view and returns its path.
    pub fn view(&mut self, view: &View) -> RecordingStreamResult<String> {
        let View { class, name, origin, contents, properties } = view;
        let path = format!("view/{}", self.next_id());
        let contents = contents.iter().map(|below| match below.starts_with('/') {
            true => (*below).to_owned(),
            false => format!("{origin}/{below}"),
        });
        let view = archetypes::ViewBlueprint::new(*class)
            .with_display_name(*name)
            .with_space_origin(origin.to_string());
        self.stream.log(path.as_str(), &view)?;
        self.stream
            .log(format!("{path}/ViewContents"), &archetypes::ViewContents::new(contents))?;
        for (property, archetype) in *properties {
            self.stream.log(format!("{path}/{property}"), *archetype)?;
        }
        Ok(path)
    }

    /// Logs a container and returns its path; shares are widths in a row and heights in a column.
    pub fn container(
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
        /// Version and variant of a UUID that is made as one likes.
        const FREE: u128 = 0x8000_8000 << 48;
        const ELSEWHERE: u128 = !(0xf000_c000 << 48);
        u128::from(self.page) << 64 & ELSEWHERE | FREE | u128::from(self.last)
    }

    /// Logs what a view takes where its entities say nothing.
    pub fn default_of(
        &mut self,
        view: &str,
        default: &dyn AsComponents,
    ) -> RecordingStreamResult<()> {
        self.stream.log(format!("{view}/defaults"), default)
    }

    /// Names a container.
    pub fn name(&mut self, container: &str, name: &str) -> RecordingStreamResult<()> {
        let named = archetypes::ContainerBlueprint::update_fields().with_display_name(name);
        self.stream.log(container, &named)
    }

    fn next_id(&mut self) -> String {
        self.last += 1;
        let hex = format!("{:032x}", self.uuid());
        let parts = [&hex[..8], &hex[8..12], &hex[12..16], &hex[16..20], &hex[20..]];
        parts.join("-")
    }
}
