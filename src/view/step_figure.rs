//! The figure of one step of the merge: the components over the range image, the votes from above,
//! and a table of the decisions.

use super::canvas::{Anchor, Area, Canvas, Colour, Stroke, between, opaque};
use super::font::{self, Weight};
use super::layout::{self, Caption, GAP, HEADING_ROW, INNER_WIDTH, MARGIN, TITLE_ROW, slot_width};
use super::legend::Key;
use super::look::Look;
use super::options::FigureOptions;
use super::plane::{LabelSpots, Plane, PlaneRegion};
use super::scene::{FrameScene, Window, instance_of_component};
use super::steps::{FigureStep, Role, kept_apart, roles};
use super::vote_graph::{self, Decision};
use super::{axes, image_axes, range_panel, theme};
use crate::text::{counted, grouped};
use divmerge_core::cluster::{MergeStep, Vote};

const PICTURE: f64 = 226.0;
const LOWER: f64 = 356.0;
/// Size of the components' numbers.
const NUMBER: f64 = 9.0;
/// Most components with a number.
const MAX_NUMBERS: usize = 60;

/// Height of a row of the table.
const ROW: f64 = 17.5;
const JOINS: (&str, Colour) = ("joins", [20, 110, 190, 255]);
const KEPT_APART: (&str, Colour) = ("kept apart", [196, 72, 20, 255]);
const AGAINST: Colour = [255, 196, 168, 255];

/// Draws one step, the `number`th of `total`.
pub fn step_figure(
    scene: &FrameScene,
    options: &FigureOptions,
    step: &FigureStep,
    number: usize,
    total: usize,
) -> Canvas {
    let roles = roles(scene, step);
    let apart = kept_apart(scene, &roles);
    let mut canvas = layout::page(scene.theme);
    layout::heading(&mut canvas, &headed(scene, step, number, total));
    let panel = StepPanel { scene, options, roles: &roles };

    let top = MARGIN + HEADING_ROW;
    let own = scene.colour(instance_of_component(scene.stages)[step.opener as usize - 1]);
    let look = scene.look();
    components_caption(look, own, step.joined.len() + 1).draw(
        &mut canvas,
        [MARGIN, top],
        INNER_WIDTH,
    );
    let slot = Area { x: MARGIN, y: top + TITLE_ROW, width: INNER_WIDTH, height: PICTURE };
    panel.components(&mut canvas, own, axes::inside(slot));

    let (y, width) = (slot.bottom() + GAP, slot_width(2));
    votes_caption(look).draw(&mut canvas, [MARGIN, y], width);
    let right = MARGIN + width + GAP;
    decisions_caption(scene).draw(&mut canvas, [right, y], width);
    let area = Area { x: MARGIN, y: y + TITLE_ROW, width, height: LOWER };
    panel.graph(&mut canvas, &apart, axes::inside(area));
    draw_table(&mut canvas, scene.merge_ratio, &step.joined, &apart, Area { x: right, ..area });
    canvas.height = area.bottom() + MARGIN;
    canvas
}

/// The scene under the heading of a step.
fn headed<'a>(
    scene: &FrameScene<'a>,
    step: &FigureStep,
    number: usize,
    total: usize,
) -> FrameScene<'a> {
    let FigureStep { opener, instance, .. } = step;
    FrameScene {
        heading: format!(
            "merge {number} of {total}  ·  component {opener} opens instance {instance}"
        ),
        remark: format!("{}  ·  {}", scene.heading, scene.remark),
        ..scene.clone()
    }
}

fn components_caption(look: &Look, own: [u8; 3], members: usize) -> Caption {
    let keys = vec![
        Key::square(own, "this instance"),
        Key::square(look.focus, "newest member"),
        Key::square(look.apart, "asked, kept apart"),
        Key::square(look.waiting, "not yet asked"),
        Key::Words("dimmed: earlier instances".into()),
    ];
    Caption {
        letter: None,
        title: "components",
        count: format!("({})", counted(members, "component")),
        keys,
    }
}

fn votes_caption(look: &Look) -> Caption {
    let keys =
        vec![Key::line(look.merged, "joins".into()), Key::line(look.apart, "kept apart".into())];
    Caption { title: "votes on the plane", keys, ..Caption::default() }
}

fn decisions_caption(scene: &FrameScene) -> Caption {
    let count = format!("(V+ : V−, more than {:.0} % to join)", scene.merge_ratio * 100.0);
    Caption { title: "decisions", count, ..Caption::default() }
}

/// What the pictures of a step show.
struct StepPanel<'a> {
    scene: &'a FrameScene<'a>,
    options: &'a FigureOptions,
    roles: &'a [Role],
}

impl StepPanel<'_> {
    /// The components over the range image, each coloured by its role.
    fn components(&self, canvas: &mut Canvas, own: [u8; 3], area: Area) {
        let scene = self.scene;
        let component = scene.component_of_pixel();
        let instance = instance_of_component(scene.stages);
        let (look, window) = (scene.look(), self.window(area));
        let raster = range_panel::raster(scene, &window, |pixel, point| {
            let Some(label) = component[pixel].checked_sub(1).map(|label| label as usize) else {
                return range_panel::backdrop(scene, point);
            };
            match self.roles[label] {
                Role::Member => own,
                Role::Newest => look.focus,
                // Two tints tell neighbours apart.
                Role::KeptApart => {
                    between(look.apart, look.panel, if label % 2 == 0 { 0.0 } else { 0.25 })
                }
                Role::Earlier => between(look.panel, scene.colour(instance[label]), 0.42),
                Role::Waiting => between(look.waiting, look.panel, (label % 3) as f64 * 0.14),
            }
        });
        canvas.picture(area, raster);
        image_axes::draw(canvas, scene, &window, area);
    }

    /// The part of the image around the components in focus, in the shape of the area.
    fn window(&self, area: Area) -> Window {
        let scene = self.scene;
        let is_in_focus = |label: u32| label != 0 && self.roles[label as usize - 1].is_in_focus();
        let pixels = scene.object_pixels().filter(|&(_, _, label)| is_in_focus(label));
        let pixels = pixels.map(|(row, column, _)| [row, column]);
        scene.window_around(pixels, self.options.aspect, area.width / area.height)
    }

    /// The components in focus from above, with the votes between them.
    fn graph(&self, canvas: &mut Canvas, apart: &[(u32, u32, Vote)], area: Area) {
        let centres = vote_graph::centres(self.scene);
        let in_focus = (0..self.roles.len()).filter(|&label| self.roles[label].is_in_focus());
        let nodes: Vec<(usize, [f64; 2])> = in_focus
            .filter(|&label| centres[label].1 > 0)
            .map(|label| (label, centres[label].0))
            .collect();
        let places: Vec<[f64; 2]> = nodes.iter().map(|&(_, centre)| centre).collect();
        let plane = Plane::new(area, &PlaneRegion::whole(&places, 0.8, 3.0));
        self.cloud(canvas, &plane);
        let look = self.scene.look();
        let on_page = |label: u32| plane.to_page(centres[label as usize - 1].0);
        canvas.clipped(area, |canvas| {
            let mut edge = |a: u32, b: u32, vote: &Vote, decision: Decision| {
                let stroke = vote_graph::edge(self.scene, vote, decision, 1.2);
                canvas.line(on_page(a), on_page(b), stroke);
            };
            for (member, other, vote) in apart {
                edge(*member, *other, vote, Decision::Apart);
            }
            let is_member = |label: u32| self.roles[label as usize - 1].is_member();
            let pairs = self.scene.stages.votes.pairs.iter();
            for vote in pairs.filter(|vote| is_member(vote.a) && is_member(vote.b)) {
                edge(vote.a, vote.b, vote, Decision::Merged);
            }
            for &(label, centre) in &nodes {
                let fill = match self.roles[label] {
                    Role::Newest => opaque(look.focus),
                    Role::Member => look.on_panel,
                    _ => opaque(look.apart),
                };
                let rim = Stroke::solid(opaque(look.panel), 1.0);
                canvas.circle(plane.to_page(centre), 3.4, Some(fill), Some(rim));
            }
        });
        plane.furniture(canvas);
        numbers(canvas, &plane, &nodes[..nodes.len().min(MAX_NUMBERS)]);
    }

    /// The cloud from above, the instance brighter than the rest.
    fn cloud(&self, canvas: &mut Canvas, plane: &Plane) {
        let labels = &self.scene.stages.labels;
        plane.points(canvas, self.scene, self.options.dpi / 96.0, |point| {
            let component = labels.component[point].checked_sub(1);
            let is_own = component.is_some_and(|label| self.roles[label as usize].is_member());
            let colour = self.scene.colour(labels.instance[point]);
            between(self.scene.look().panel, colour, if is_own { 0.6 } else { 0.3 })
        });
    }
}

/// Writes the components' numbers beside their centres where there is room.
fn numbers(canvas: &mut Canvas, plane: &Plane, nodes: &[(usize, [f64; 2])]) {
    let mut spots = LabelSpots::new(plane.area, Vec::new());
    let look = canvas.look();
    let style = look.label(NUMBER, look.on_panel, Anchor::Start);
    for &(label, centre) in nodes {
        let [x, y] = plane.to_page(centre);
        let words = (label + 1).to_string();
        let width = font::width(&words, NUMBER, Weight::Medium);
        let spot = Area { x: x + 4.5, y: y - 9.5, width, height: 9.0 };
        if spots.take(spot) {
            canvas.text([spot.x, spot.bottom()], words, style);
        }
    }
}

/// Draws a line for each decision: who asked whom, the votes, and the outcome. Without room for
/// all, the newest merges and the decisions with most votes remain.
fn draw_table(
    canvas: &mut Canvas,
    merge_ratio: f64,
    joined: &[MergeStep],
    apart: &[(u32, u32, Vote)],
    area: Area,
) {
    // Both ends may say how many are left out.
    let lines = ((area.height / ROW) as usize).saturating_sub(2);
    // A third of the room for those kept apart, the rest to whoever needs it.
    let shown_joined = joined.len().min(lines.saturating_sub(apart.len().min(lines / 3)));
    let shown_apart = apart.len().min(lines - shown_joined);
    let skipped = joined.len() - shown_joined;
    let mut table = Table { canvas, merge_ratio, area, y: area.y + 13.0 };
    if skipped > 0 {
        table.note(&format!("… {} earlier merges", grouped(skipped as u64)));
    }
    for step in &joined[skipped..] {
        table.row([step.target, step.query], [step.positive, step.negative], JOINS);
    }
    for (asker, other, vote) in &apart[..shown_apart] {
        let votes = [vote.positive, vote.negative].map(u64::from);
        table.row([*asker, *other], votes, KEPT_APART);
    }
    if shown_apart < apart.len() {
        table.note(&format!("… {} more kept apart", grouped((apart.len() - shown_apart) as u64)));
    } else if joined.is_empty() && apart.is_empty() {
        table.note("all neighbours belong to earlier instances");
    }
}

/// A table in the making.
struct Table<'a> {
    canvas: &'a mut Canvas,
    merge_ratio: f64,
    area: Area,
    /// Baseline of the next row.
    y: f64,
}

impl Table<'_> {
    fn note(&mut self, words: &str) {
        self.canvas.text([self.area.x, self.y], words, theme::faint(Anchor::Start));
        self.y += ROW;
    }

    fn row(
        &mut self,
        [asker, other]: [u32; 2],
        [positive, negative]: [u64; 2],
        (outcome, colour): (&str, Colour),
    ) {
        let (x, y) = (self.area.x, self.y);
        let mut cell = |x: f64, words: String, colour: Colour, anchor: Anchor| {
            self.canvas.text([x, y], words, theme::small(colour, anchor));
        };
        cell(x, format!("{asker} asks {other}"), theme::INK, Anchor::Start);
        cell(x + 180.0, format!("{positive} : {negative}"), theme::INK, Anchor::End);
        let share = positive as f64 / (positive + negative).max(1) as f64;
        self.bar(share, Area { x: x + 194.0, y: y - 9.0, width: 150.0, height: 10.0 });
        let style = theme::small(colour, Anchor::Start);
        self.canvas.text([x + 356.0, y], outcome, style);
        self.y += ROW;
    }

    /// The share of votes in favour, with a tick at the threshold.
    fn bar(&mut self, share: f64, area: Area) {
        let in_favour = Area { width: area.width * share, ..area };
        self.canvas.rect(area, Some(AGAINST), None);
        self.canvas.rect(in_favour, Some(opaque(theme::IN_FAVOUR)), None);
        let x = area.x + area.width * self.merge_ratio;
        let tick = Stroke::solid(theme::INK, 1.0);
        self.canvas.line([x, area.y - 2.0], [x, area.bottom() + 2.0], tick);
    }
}
