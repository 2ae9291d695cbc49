//! The figure of a clustered cloud: a heading, and rows of panels below it.

use super::axes;
use super::canvas::{Area, Canvas, Stroke};
use super::image_axes::ImageAxes;
use super::layout::{self, Caption, GAP, HEADING_ROW, MARGIN, slot_width};
use super::legend::Key;
use super::numbers::quantile;
use super::options::{FigureOptions, Panel};
use super::plane::{Plane, PlaneRegion};
use super::scene::{FrameScene, Window, thing_places};
use super::vote_graph::{self, Decision};
use super::{plane_panel, ramp, range_panel};
use crate::error::{FigureError, Result};
use crate::messages::palette::reason_colour;
use crate::text::grouped;
use divmerge_core::cloud::Reason;

/// A higher range-image panel becomes narrower instead.
const MAX_HEIGHT: f64 = 460.0;
/// Most classes in the legend of the mask.
const MAX_CLASSES: usize = 8;

/// Draws a figure of a clustered cloud.
///
/// # Errors
/// [`Error::Figure`](crate::error::Error::Figure) if there is no panel, the crop is empty, or a
/// panel shows intensity and the cloud has none.
pub fn figure(scene: &FrameScene, options: &FigureOptions) -> Result<Canvas> {
    let image = &scene.stages.image;
    if options.panels.is_empty() {
        return Err(FigureError::NoPanel.into());
    }
    let window = options.crop.within(image.rows(), image.columns())?;
    let region = options
        .region
        .unwrap_or_else(|| PlaneRegion::of_objects(scene, &window, options.crop.is_all()));
    let axes = ImageAxes::of(scene);
    let panels = Panels { scene, options, window, region, axes };
    let mut page =
        Page { canvas: layout::page(scene.theme), y: MARGIN + HEADING_ROW, count: 0, slots: 1 };
    layout::heading(&mut page.canvas, scene);
    let mut left = &options.panels[..];
    while let Some(&first) = left.first() {
        let most = if first.is_plane() { 2 } else { images_in_row(&panels) };
        let alike = left.iter().take_while(|panel| panel.is_plane() == first.is_plane()).count();
        let (row, rest) = left.split_at(alike.min(most));
        // All range-image panels of a figure have one scale.
        page.slots = if first.is_plane() { row.len() } else { most.min(alike.max(page.slots)) };
        let is_last = rest.first().is_none_or(|next| next.is_plane());
        page.row(&panels, row, is_last)?;
        left = rest;
    }
    page.canvas.height = (page.y - GAP + MARGIN).ceil();
    Ok(page.canvas)
}

/// As many range-image panels side by side as keep them low: a crop can be as high as it is wide.
fn images_in_row(panels: &Panels) -> usize {
    const LOW: f64 = 280.0;
    let height = |count: usize| panels.image_size(slot_width(count) - panels.beside())[1];
    (1..3).find(|&count| height(count) <= LOW).unwrap_or(3)
}

/// A figure in the making.
struct Page {
    canvas: Canvas,
    /// Where the next row begins.
    y: f64,
    /// Panels so far.
    count: usize,
    /// Panels that fit side by side.
    slots: usize,
}

impl Page {
    /// Draws panels side by side. The azimuth has numbers below the last row of range images,
    /// and below all where panels stand side by side.
    fn row(&mut self, panels: &Panels, row: &[Panel], is_last: bool) -> Result<()> {
        let width = slot_width(self.slots);
        let caption = |(letter, panel): (usize, &Panel)| {
            Ok(Caption { letter: Some(letter), ..panels.caption(*panel)? })
        };
        let captions: Vec<Caption> = (self.count..).zip(row).map(caption).collect::<Result<_>>()?;
        self.count += row.len();
        let top = self.y + Caption::height(&captions, width);
        let mut bottom = top;
        for (place, (panel, caption)) in row.iter().zip(&captions).enumerate() {
            let left = MARGIN + place as f64 * (width + GAP);
            caption.draw(&mut self.canvas, [left, self.y], width);
            let slot = Area { x: left, y: top, width, height: 0.0 };
            bottom = bottom.max(match panel.is_plane() {
                true => {
                    let [width, height] = panels.plane_size(width, row.len());
                    let slot = Area { width, height, ..slot };
                    panels.draw_plane(&mut self.canvas, *panel, axes::inside(slot));
                    slot.bottom()
                }
                false => {
                    let has_azimuths = is_last || self.slots > 1;
                    panels.draw_image(&mut self.canvas, *panel, slot, has_azimuths)
                }
            });
        }
        self.y = bottom + GAP;
        Ok(())
    }
}

/// What the panels of a figure show.
struct Panels<'a> {
    scene: &'a FrameScene<'a>,
    options: &'a FigureOptions,
    /// The part of the range image.
    window: Window,
    /// The part of the plane.
    region: PlaneRegion,
    /// Those of the range image.
    axes: Option<ImageAxes>,
}

impl Panels<'_> {
    /// Width and height of a range-image panel. Pixels are shaped as on the whole image.
    fn image_size(&self, width: f64) -> [f64; 2] {
        let image = &self.scene.stages.image;
        let rows = self.window.rows.len() as f64 / image.rows() as f64;
        let columns = self.window.columns.len() as f64 / image.columns() as f64;
        let height = width * self.options.aspect * rows / columns;
        match height <= MAX_HEIGHT {
            true => [width, height],
            false => [width * MAX_HEIGHT / height, MAX_HEIGHT],
        }
    }

    /// Width and height of a panel of the plane, one of so many in its row.
    fn plane_size(&self, width: f64, in_row: usize) -> [f64; 2] {
        let most = if in_row == 1 { 0.62 } else { 0.95 };
        [width, (width / self.region.aspect()).clamp(width * 0.4, width * most).round()]
    }

    /// Room for the axis beside a range image.
    fn beside(&self) -> f64 {
        self.axes.as_ref().map_or(0.0, |_| axes::LEFT)
    }

    /// Draws a range image with its axes in the middle of a slot. Returns where it ends.
    fn draw_image(&self, canvas: &mut Canvas, panel: Panel, slot: Area, has_azimuths: bool) -> f64 {
        /// Room for ticks without numbers.
        const TICKS: f64 = 3.0;
        let Panels { scene, window, .. } = self;
        let raster = match panel {
            Panel::Range => range_panel::range(scene, window, far(scene)),
            Panel::Intensity => match scene.intensity {
                Some(values) => range_panel::intensity(scene, window, values, brightest(values)),
                None => return slot.y,
            },
            Panel::Mask => range_panel::mask(scene, window),
            Panel::Components => range_panel::components(scene, window),
            Panel::Instances | Panel::Votes | Panel::BirdsEye => {
                range_panel::instances(scene, window)
            }
        };
        let beside = self.beside();
        let [width, height] = self.image_size(slot.width - beside);
        let x = slot.x + beside + (slot.width - beside - width) / 2.0;
        let area = Area { x, width, height, ..slot };
        canvas.picture(area, raster);
        axes::frame(canvas, area);
        let Some(image_axes) = &self.axes else { return area.bottom() };
        image_axes.draw(canvas, window, area, has_azimuths);
        area.bottom() + if has_azimuths { axes::BELOW } else { TICKS }
    }

    /// Draws the plane in an area of the page.
    fn draw_plane(&self, canvas: &mut Canvas, panel: Panel, area: Area) {
        let (plane, dpi) = (Plane::new(area, &self.region), self.options.dpi);
        match panel {
            Panel::Votes => plane_panel::votes(canvas, self.scene, &plane, dpi),
            _ => plane_panel::birds_eye(canvas, self.scene, &plane, dpi),
        }
    }

    /// The caption of a panel, without its letter.
    ///
    /// # Errors
    /// [`Error::Figure`](crate::error::Error::Figure) if the panel shows intensity and the cloud
    /// has none.
    fn caption(&self, panel: Panel) -> Result<Caption> {
        let scene = self.scene;
        let stages = scene.stages;
        let (title, count, keys) = match panel {
            Panel::Range => {
                let Window { rows, columns } = &self.window;
                let ends = ["0 m".into(), format!("{:.0} m", far(scene))];
                let keys = vec![Key::Ramp(ends, |_, part| ramp::near_to_far(part.sqrt()))];
                ("range", format!("({} × {} pixels)", rows.len(), columns.len()), keys)
            }
            Panel::Intensity => ("intensity", String::new(), vec![intensity_key(scene)?]),
            Panel::Mask => {
                let [objects, seen] = [stages.objects.len(), scene.seen_points().count()].map(text);
                let count = format!("({objects} of {seen} pixels with a return)");
                ("object mask", count, mask_keys(scene))
            }
            Panel::Components => {
                let keys = vec![Key::Words("one colour per component".into()), other_key(scene)];
                let count = format!("(m = {})", text(stages.components.count as usize));
                ("local components", count, keys)
            }
            Panel::Instances => ("merged instances", instance_count(scene), instance_keys(scene)),
            Panel::Votes if stages.post_merge.tree.is_some() => {
                ("votes", "(none: without classes a tree of merges is cut)".into(), Vec::new())
            }
            Panel::Votes => {
                let pairs = text(stages.votes.pairs.len());
                let count = format!("({pairs} pairs of components; wider: more votes)");
                ("votes", count, vote_keys(scene))
            }
            Panel::BirdsEye => {
                let count = format!("({} boxes)", text(stages.instances.len()));
                ("bird's-eye view", count, Vec::new())
            }
        };
        Ok(Caption { letter: None, title, count, keys })
    }
}

/// A number in words of a caption.
fn text(number: usize) -> String {
    grouped(number as u64)
}

fn other_key(scene: &FrameScene) -> Key {
    Key::square(scene.look().other_returns[1], "other returns")
}

fn intensity_key(scene: &FrameScene) -> Result<Key> {
    let values = scene.intensity.ok_or(FigureError::NoIntensity)?;
    let high = brightest(values);
    let high = if high < 10.0 { format!("{high:.2}") } else { format!("{high:.0}") };
    Ok(Key::Ramp(["0".into(), high], |look, part| look.intensity(part.sqrt())))
}

/// The things that occur, the most frequent first.
fn mask_keys(scene: &FrameScene) -> Vec<Key> {
    if scene.classes.is_empty() {
        return vec![Key::square(scene.look().object, "object"), other_key(scene)];
    }
    let mut counts = vec![0_usize; scene.classes.len()];
    for &class in &scene.stages.objects.class {
        counts[usize::from(class)] += 1;
    }
    let places = thing_places(scene.classes);
    let mut seen: Vec<usize> = (0..counts.len()).filter(|&class| counts[class] > 0).collect();
    seen.sort_by_key(|&class| std::cmp::Reverse(counts[class]));
    let square = |&class: &usize| {
        Key::square(scene.look().class_colour(places[class]), &scene.classes[class].name)
    };
    seen.iter().take(MAX_CLASSES).map(square).chain([other_key(scene)]).collect()
}

fn instance_count(scene: &FrameScene) -> String {
    let (instances, merged) = (scene.stages.instances.len(), scene.stages.merge.count as usize);
    match &scene.stages.post_merge.tree {
        Some(tree) => {
            let objects = text(tree.cut.chosen.len());
            format!("(n = {}; {objects} of them objects of the cut)", text(instances))
        }
        None if merged == instances => format!("(n = {})", text(instances)),
        None => format!("(n = {}; {} after the votes alone)", text(instances), text(merged)),
    }
}

fn instance_keys(scene: &FrameScene) -> Vec<Key> {
    let reasons = [Reason::TooSmall, Reason::Unreached, Reason::Scattered];
    let occurring =
        reasons.into_iter().filter(|reason| scene.stages.labels.reason.contains(reason));
    let of_reason = |reason: Reason| Key::square(reason_colour(reason as u8), reason.describe());
    let words = Key::Words("one colour per instance".into());
    [words].into_iter().chain(occurring.map(of_reason)).chain([other_key(scene)]).collect()
}

fn vote_keys(scene: &FrameScene) -> Vec<Key> {
    let (decisions, look) = (vote_graph::decisions(scene), scene.look());
    let count = |of: Decision| decisions.iter().filter(|(_, decision)| *decision == of).count();
    let line = |colour, words: &str, count| Key::line(colour, format!("{words} ({})", text(count)));
    let mut keys = vec![line(look.merged, "merged", count(Decision::Merged))];
    let rejoined = count(Decision::Rejoined);
    if rejoined > 0 {
        keys.push(line(look.rejoined, "rejoined later", rejoined));
    }
    keys.push(line(look.apart, "kept apart", count(Decision::Apart)));
    let thin = decisions.iter().filter(|(vote, _)| vote_graph::is_thin(scene, vote)).count();
    let dashed = Stroke { colour: look.on_panel, width: 2.0, dash: Some([4.0, 3.0]) };
    keys.push(Key::Line(dashed, format!("thin margin ({})", text(thin))));
    keys
}

/// Upper end of the intensity's ramp.
pub fn brightest(intensity: &[f32]) -> f64 {
    quantile(intensity.iter().map(|&value| f64::from(value)), 0.99).max(1e-6)
}

/// Far end of the range's ramp in metres.
pub fn far(scene: &FrameScene) -> f64 {
    let far = quantile(scene.seen_points().map(|point| scene.range(point)), 0.99);
    (far / 5.0).ceil().max(1.0) * 5.0
}
