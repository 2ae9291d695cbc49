//! The figure: a heading, and panels with a title, a count and a legend each.

use super::canvas::{Anchor, Area, Canvas, Raster, Stroke, opaque};
use super::font::{self, Weight};
use super::plane::{Plane, Region};
use super::ramp;
use super::range_panel;
use super::scene::{Crop, Scene, Window};
use super::theme::{self, Key};
use super::vote_graph;
use crate::error::{Error, Result};
use crate::footprint::Rectangle;
use crate::instances::Reason;
use crate::palette::reason_colour;

/// One picture of a figure.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Panel {
    /// The range image by range.
    Range,
    /// The range image by intensity.
    Intensity,
    /// The object mask.
    Mask,
    /// The local components of the divide step.
    Components,
    /// The instances.
    Instances,
    /// The votes on the bird's-eye plane.
    Votes,
    /// The instances on the bird's-eye plane.
    BirdsEye,
}

impl Panel {
    /// All panels with the name that the command line gives them.
    pub const NAMES: [(&'static str, Panel); 7] = [
        ("range", Panel::Range),
        ("intensity", Panel::Intensity),
        ("mask", Panel::Mask),
        ("components", Panel::Components),
        ("instances", Panel::Instances),
        ("votes", Panel::Votes),
        ("bev", Panel::BirdsEye),
    ];

    /// Whether it shows the plane, not the range image.
    pub fn is_plane(self) -> bool {
        matches!(self, Panel::Votes | Panel::BirdsEye)
    }
}

/// How a figure is laid out.
#[derive(Debug, Clone, PartialEq)]
pub struct FigureOptions {
    /// Panels from the top. Default: mask, components, instances (the paper's first figure), votes, bev.
    pub panels: Vec<Panel>,
    /// Height of the whole range image over its width. Default 1/8 (the paper's).
    pub aspect: f64,
    /// Part of the range image that is shown. Default: all.
    pub crop: Crop,
    /// Part of the plane that is shown. Default: around the objects that are shown.
    pub region: Option<Region>,
    /// Pixels to the inch; a figure is 10.4 inches wide. Default 192.
    pub dpi: f64,
}

impl Default for FigureOptions {
    fn default() -> Self {
        FigureOptions {
            panels: vec![
                Panel::Mask,
                Panel::Components,
                Panel::Instances,
                Panel::Votes,
                Panel::BirdsEye,
            ],
            aspect: 1.0 / 8.0,
            crop: Crop::default(),
            region: None,
            dpi: 192.0,
        }
    }
}

/// Width of a figure in page units.
pub const WIDTH: f64 = 1000.0;
pub(super) const MARGIN: f64 = 14.0;
pub(super) const GAP: f64 = 12.0;
pub(super) const TITLE_ROW: f64 = 21.0;
pub(super) const LEGEND_ROW: f64 = 17.0;
pub(super) const HEADING_ROW: f64 = 26.0;
/// Farther than this up, a range-image panel becomes narrower instead.
const MAX_HEIGHT: f64 = 460.0;

/// Draws a figure of a clustered cloud.
///
/// # Errors
/// [`Error::Figure`] if there is no panel, the crop is empty, or the cloud has no intensity to show.
pub fn figure(scene: &Scene, options: &FigureOptions) -> Result<Canvas> {
    let image = &scene.stages.image;
    if options.panels.is_empty() {
        return Err(Error::Figure { problem: "a figure needs a panel".into() });
    }
    let window = options.crop.within(image.rows(), image.columns())?;
    let region =
        options.region.unwrap_or_else(|| Region::of_objects(scene, &window, options.crop.is_all()));
    let mut page =
        Page { canvas: Canvas::new(WIDTH, 0.0, theme::PAGE), y: MARGIN, count: 0, slots: 1 };
    heading(&mut page.canvas, scene);
    page.y += HEADING_ROW;
    let mut left = &options.panels[..];
    while let Some(&first) = left.first() {
        let most = if first.is_plane() { 2 } else { images_in_row(scene, options, &window) };
        let alike = left.iter().take_while(|panel| panel.is_plane() == first.is_plane()).count();
        let (row, rest) = left.split_at(alike.min(most));
        // Panels of one figure have one scale.
        let slots = if first.is_plane() { row.len() } else { most.min(alike.max(page.slots)) };
        page.slots = slots;
        page.row(scene, options, &window, &region, row)?;
        left = rest;
    }
    page.canvas.height = (page.y - GAP + MARGIN).ceil();
    Ok(page.canvas)
}

/// Width of each of so many panels side by side.
fn slot_width(count: usize) -> f64 {
    (WIDTH - 2.0 * MARGIN - GAP * (count - 1) as f64) / count as f64
}

/// As many range-image panels side by side as keep them low: a crop can be as high as it is wide.
fn images_in_row(scene: &Scene, options: &FigureOptions, window: &Window) -> usize {
    const LOW: f64 = 280.0;
    let height = |count: usize| image_size(scene, options, window, slot_width(count))[1];
    (1..3).find(|&count| height(count) <= LOW).unwrap_or(3)
}

/// Frame and time on the left, the rest on the right.
pub(super) fn heading(canvas: &mut Canvas, scene: &Scene) {
    let baseline = MARGIN + theme::HEADING;
    let ink = theme::text(theme::HEADING, Weight::Medium, theme::INK, Anchor::Start);
    canvas.text([MARGIN, baseline], &scene.heading, ink);
    let taken = font::width(&scene.heading, theme::HEADING, Weight::Medium);
    let room = WIDTH - 2.0 * MARGIN - taken - 20.0;
    let faint = theme::text(theme::SMALL, Weight::Regular, theme::FAINT_INK, Anchor::End);
    let remark = font::fitted(&scene.remark, theme::SMALL, Weight::Regular, room);
    canvas.text([WIDTH - MARGIN, baseline], remark, faint);
}

/// A figure under way: how far down it is drawn, how many panels it has, how many fit side by side.
struct Page {
    canvas: Canvas,
    y: f64,
    count: usize,
    slots: usize,
}

impl Page {
    fn row(
        &mut self,
        scene: &Scene,
        options: &FigureOptions,
        window: &Window,
        region: &Region,
        row: &[Panel],
    ) -> Result<()> {
        let width = slot_width(self.slots);
        let shape = |panel: &Panel| match panel.is_plane() {
            true => plane_size(width, region, row.len()),
            false => image_size(scene, options, window, width),
        };
        let captions: Vec<Caption> =
            row.iter().map(|panel| caption(scene, window, *panel)).collect::<Result<_>>()?;
        let second_row = captions.iter().any(|caption| !caption.fits(width));
        let top = self.y + TITLE_ROW + if second_row { LEGEND_ROW } else { 0.0 };
        let mut bottom = top;
        for (place, (panel, caption)) in row.iter().zip(&captions).enumerate() {
            let x = MARGIN + place as f64 * (width + GAP);
            let slot = Area { x, y: self.y, width, height: 0.0 };
            caption.draw(&mut self.canvas, slot, self.count, second_row);
            self.count += 1;
            let [panel_width, height] = shape(panel);
            let area =
                Area { x: x + (width - panel_width) / 2.0, y: top, width: panel_width, height };
            draw(&mut self.canvas, scene, options, window, region, *panel, area);
            bottom = bottom.max(area.bottom());
        }
        self.y = bottom + GAP;
        Ok(())
    }
}

/// A pixel has the shape that it has on the whole image.
fn image_size(scene: &Scene, options: &FigureOptions, window: &Window, width: f64) -> [f64; 2] {
    let image = &scene.stages.image;
    let rows = window.rows.len() as f64 / image.rows() as f64;
    let columns = window.columns.len() as f64 / image.columns() as f64;
    let height = width * options.aspect * rows / columns;
    if height <= MAX_HEIGHT { [width, height] } else { [width * MAX_HEIGHT / height, MAX_HEIGHT] }
}

fn plane_size(width: f64, region: &Region, in_row: usize) -> [f64; 2] {
    let most = if in_row == 1 { 0.62 } else { 0.95 };
    [width, (width / region.aspect()).clamp(width * 0.4, width * most).round()]
}

/// Title, count and legend of a panel.
pub(super) struct Caption {
    pub(super) title: &'static str,
    pub(super) count: String,
    pub(super) keys: Vec<Key>,
}

const LETTER: f64 = 19.0;

impl Caption {
    fn words_width(&self) -> f64 {
        let title = font::width(self.title, theme::TITLE, Weight::Medium);
        LETTER + title + 7.0 + font::width(&self.count, theme::SMALL, Weight::Regular)
    }

    /// Whether the legend has room beside the title.
    pub(super) fn fits(&self, width: f64) -> bool {
        self.keys.is_empty() || self.words_width() + 24.0 + theme::legend_width(&self.keys) <= width
    }

    pub(super) fn draw(&self, canvas: &mut Canvas, slot: Area, place: usize, second_row: bool) {
        let baseline = slot.y + 14.0;
        let letter = char::from(b'a' + (place % 26) as u8);
        let style = theme::text(theme::TITLE, Weight::Regular, theme::FAINT_INK, Anchor::Start);
        canvas.text([slot.x, baseline], format!("({letter})"), style);
        let x = slot.x + LETTER;
        let style = theme::text(theme::TITLE, Weight::Medium, theme::INK, Anchor::Start);
        canvas.text([x, baseline], self.title, style);
        let x = x + font::width(self.title, theme::TITLE, Weight::Medium) + 7.0;
        let style = theme::text(theme::SMALL, Weight::Regular, theme::FAINT_INK, Anchor::Start);
        let count = font::fitted(&self.count, theme::SMALL, Weight::Regular, slot.right() - x);
        canvas.text([x, baseline], count, style);
        let mut keys = &self.keys[..];
        while theme::legend_width(keys) > slot.width && !keys.is_empty() {
            keys = &keys[..keys.len() - 1];
        }
        if self.fits(slot.width) {
            theme::legend(canvas, keys, slot.right(), baseline);
        } else if second_row {
            theme::legend(canvas, keys, slot.x + theme::legend_width(keys), baseline + LEGEND_ROW);
        }
    }
}

fn caption(scene: &Scene, window: &Window, panel: Panel) -> Result<Caption> {
    let stages = scene.stages;
    let other = || Key::Square(opaque(theme::OTHER_RETURNS[1]), "other return".into());
    Ok(match panel {
        Panel::Range => Caption {
            title: "range",
            count: format!("({} × {} pixels)", window.rows.len(), window.columns.len()),
            keys: vec![Key::Ramp(["0 m".into(), format!("{:.0} m", far(scene))], |part| {
                ramp::near_to_far(part.sqrt())
            })],
        },
        Panel::Intensity => {
            let high = brightest(intensity(scene)?);
            let high = if high < 10.0 { format!("{high:.2}") } else { format!("{high:.0}") };
            Caption {
                title: "intensity",
                count: String::new(),
                keys: vec![Key::Ramp(["0".into(), high], |part| ramp::grey(part.sqrt()))],
            }
        }
        Panel::Mask => Caption {
            title: "object mask",
            count: format!(
                "({} of {} pixels with a return)",
                grouped(stages.objects.len()),
                grouped(scene.seen_points().count())
            ),
            keys: mask_keys(scene),
        },
        Panel::Components => Caption {
            title: "local components",
            count: format!("(m = {})", grouped(stages.components.count as usize)),
            keys: vec![Key::Words("a colour for each component".into()), other()],
        },
        Panel::Instances => {
            let mut keys = vec![Key::Words("a colour for each instance".into())];
            for reason in [Reason::TooSmall, Reason::Unreached] {
                if stages.labels.reason.contains(&reason) {
                    let colour = opaque(reason_colour(reason as u8));
                    keys.push(Key::Square(colour, reason.describe().into()));
                }
            }
            keys.push(other());
            Caption { title: "merged instances", count: instance_count(scene), keys }
        }
        Panel::Votes => vote_caption(scene),
        Panel::BirdsEye => Caption {
            title: "bird's-eye view",
            count: format!("({} boxes)", grouped(stages.instances.len())),
            keys: Vec::new(),
        },
    })
}

fn instance_count(scene: &Scene) -> String {
    let instances = scene.stages.instances.len();
    match scene.stages.merge.count as usize {
        merged if merged != instances => {
            format!("(n = {}; {} after the vote alone)", grouped(instances), grouped(merged))
        }
        _ => format!("(n = {})", grouped(instances)),
    }
}

fn vote_caption(scene: &Scene) -> Caption {
    let decisions = vote_graph::decisions(scene);
    let line = |colour, dash, words: String| Key::Line(Stroke { colour, width: 2.0, dash }, words);
    let mut keys =
        vec![line(theme::MERGED, None, format!("merged ({})", grouped(decisions.merged)))];
    if decisions.rejoined > 0 {
        let [r, g, b, _] = theme::REJOINED;
        let words = format!("rejoined later ({})", grouped(decisions.rejoined));
        keys.push(line([r, g, b, 255], None, words));
    }
    keys.push(line(theme::APART, None, format!("kept apart ({})", grouped(decisions.apart))));
    let thin = format!("thin margin ({})", grouped(decisions.thin));
    keys.push(line(theme::ON_PANEL, Some([4.0, 3.0]), thin));
    Caption {
        title: "votes",
        count: format!(
            "({} pairs of components; wider: more votes)",
            grouped(scene.stages.votes.pairs.len())
        ),
        keys,
    }
}

/// The things that occur, the most frequent first.
fn mask_keys(scene: &Scene) -> Vec<Key> {
    let other = Key::Square(opaque(theme::OTHER_RETURNS[1]), "other return".into());
    if scene.classes.is_empty() {
        return vec![Key::Square(opaque(theme::OBJECT), "object".into()), other];
    }
    let mut counts = vec![0_usize; scene.classes.len()];
    for &class in &scene.stages.objects.class {
        counts[usize::from(class)] += 1;
    }
    let places = scene.thing_places();
    let mut seen: Vec<usize> = (0..counts.len()).filter(|&class| counts[class] > 0).collect();
    seen.sort_by_key(|&class| std::cmp::Reverse(counts[class]));
    let square = |&class: &usize| {
        let colour = opaque(theme::class_colour(places[class]));
        Key::Square(colour, scene.classes[class].name.clone())
    };
    seen.iter().take(8).map(square).chain([other]).collect()
}

fn draw(
    canvas: &mut Canvas,
    scene: &Scene,
    options: &FigureOptions,
    window: &Window,
    region: &Region,
    panel: Panel,
    area: Area,
) {
    let raster: Raster = match panel {
        Panel::Range => range_panel::range(scene, window, far(scene)),
        Panel::Intensity => match scene.intensity.as_deref() {
            Some(values) => range_panel::intensity(scene, window, values, brightest(values)),
            None => return,
        },
        Panel::Mask => range_panel::mask(scene, window),
        Panel::Components => range_panel::components(scene, window),
        Panel::Instances => range_panel::instances(scene, window),
        Panel::Votes => return votes(canvas, scene, &Plane::new(area, region), options.dpi),
        Panel::BirdsEye => return birds_eye(canvas, scene, &Plane::new(area, region), options.dpi),
    };
    canvas.picture(area, raster);
}

/// Components and votes over the dimmed cloud.
pub(super) fn votes(canvas: &mut Canvas, scene: &Scene, plane: &Plane, dpi: f64) {
    let instance = &scene.stages.labels.instance;
    plane.points(canvas, scene, dpi / 96.0, |point| {
        super::canvas::between(theme::PANEL, scene.colour(instance[point]), 0.38)
    });
    vote_graph::draw(canvas, plane, scene);
    plane.furniture(canvas);
}

/// The instances with their boxes, and the numbers of those with most points where there is room.
pub(super) fn birds_eye(canvas: &mut Canvas, scene: &Scene, plane: &Plane, dpi: f64) {
    let labels = &scene.stages.labels;
    plane.points(canvas, scene, dpi / 96.0, |point| match labels.instance[point] {
        0 => reason_colour(labels.reason[point] as u8),
        instance => scene.colour(instance),
    });
    let mut by_points: Vec<_> = scene.stages.instances.iter().collect();
    by_points.sort_by_key(|instance| (std::cmp::Reverse(instance.points), instance.id));
    canvas.clipped(plane.area, |canvas| {
        for instance in &by_points {
            let bounds = &instance.bounds;
            let rectangle = Rectangle {
                centre: [bounds.centre[0], bounds.centre[1]],
                size: [bounds.size[0].max(0.2), bounds.size[1].max(0.2)],
                yaw: bounds.yaw,
            };
            let stroke = Stroke::solid(opaque(scene.colour(instance.id)), 0.9);
            plane.rectangle(canvas, &rectangle, stroke);
        }
    });
    plane.furniture(canvas);
    let mut taken: Vec<Area> = Vec::new();
    // Clear of the metre bar.
    taken.push(Area {
        x: plane.area.right() - plane.area.width / 4.0,
        y: plane.area.bottom() - 32.0,
        width: plane.area.width / 4.0,
        height: 32.0,
    });
    for instance in by_points {
        let words = instance.id.to_string();
        let [x, y] = plane.to_page([instance.bounds.centre[0], instance.bounds.centre[1]]);
        let half = instance.bounds.size[1] / 2.0 * plane.scale;
        let width = font::width(&words, 8.5, Weight::Medium) + 4.0;
        let label = Area { x: x - width / 2.0, y: y - half - 11.0, width, height: 10.0 };
        if plane.area.holds(&label) && !taken.iter().any(|other| other.meets(&label)) {
            let style = theme::label(8.5, theme::ON_PANEL, Anchor::Middle);
            canvas.text([x, label.bottom() - 2.0], words, style);
            taken.push(label);
        }
    }
}

fn intensity<'a>(scene: &'a Scene) -> Result<&'a [f32]> {
    scene.intensity.as_deref().ok_or_else(|| Error::Figure {
        problem: "the cloud has no field `intensity` or `reflectivity` for a panel `intensity`"
            .into(),
    })
}

/// Upper end of the intensity's ramp.
fn brightest(intensity: &[f32]) -> f64 {
    ramp::quantile(intensity.iter().map(|&value| f64::from(value)), 0.99).max(1e-6)
}

/// Far end of the range's ramp in metres.
fn far(scene: &Scene) -> f64 {
    let far = ramp::quantile(scene.seen_points().map(|point| scene.range(point)), 0.99);
    (far / 5.0).ceil().max(1.0) * 5.0
}

/// 1234567 as `1,234,567`.
pub(super) fn grouped(number: usize) -> String {
    let digits = number.to_string();
    let mut grouped = String::new();
    for (place, digit) in digits.chars().enumerate() {
        if place > 0 && (digits.len() - place).is_multiple_of(3) {
            grouped.push(',');
        }
        grouped.push(digit);
    }
    grouped
}
