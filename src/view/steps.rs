//! The merge step by step: which instance is opened, whom its components ask, and what the votes say.

use super::canvas::{Anchor, Area, Canvas, Stroke, between, opaque};
use super::figure::{FigureOptions, GAP, HEADING_ROW, MARGIN, TITLE_ROW, WIDTH, grouped};
use super::font::{self, Weight};
use super::plane::{Plane, Region};
use super::range_panel;
use super::scene::{Scene, Window};
use super::theme::{self, Key};
use super::vote_graph::{self, Decision};
use crate::cluster::{MergeStep, Vote};
use crate::error::Result;

/// A moment of the merge.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Step {
    /// The instance of the merge step that is being gathered.
    pub instance: u32,
    /// The component that opened it.
    pub opener: u32,
    /// What has been decided for it by then, in order.
    pub joined: Vec<MergeStep>,
    /// Whether all its components have been asked by then.
    pub is_complete: bool,
}

/// Instances of the merge in the order in which they were opened, those that have anyone to ask; of a
/// crop, those with a pixel in it. With `by_decision` a moment for each that joins, else one for each
/// instance.
///
/// # Errors
/// That of [`super::Crop::within`].
pub fn steps(scene: &Scene, options: &FigureOptions, by_decision: bool) -> Result<Vec<Step>> {
    let merge = &scene.stages.merge;
    let count = merge.count as usize;
    let image = &scene.stages.image;
    let window = options.crop.within(image.rows(), image.columns())?;
    let mut has_votes = vec![false; count];
    let instance_of = |label: u32| merge.instance_of_component[label as usize - 1] as usize;
    for vote in &scene.stages.votes.pairs {
        // Instances opened before are not asked.
        has_votes[instance_of(vote.a).min(instance_of(vote.b)) - 1] = true;
    }
    let mut is_seen = vec![false; count];
    for (&pixel, &label) in scene.stages.objects.pixel.iter().zip(&scene.stages.components.label) {
        let (row, column) = place(scene, pixel as usize);
        if label != 0 && window.columns.contains(&column) && window.rows.contains(&row) {
            is_seen[instance_of(label) - 1] = true;
        }
    }
    let mut openers = vec![0_u32; count];
    for (label, &instance) in (1_u32..).zip(&merge.instance_of_component) {
        let opener = &mut openers[instance as usize - 1];
        *opener = if *opener == 0 { label } else { *opener };
    }
    let mut joined: Vec<Vec<MergeStep>> = vec![Vec::new(); count];
    for step in &merge.steps {
        joined[instance_of(step.query) - 1].push(*step);
    }
    let mut moments = Vec::new();
    for (place, (opener, joined)) in openers.into_iter().zip(joined).enumerate() {
        if !has_votes[place] || !is_seen[place] {
            continue;
        }
        let first = if by_decision { joined.len().min(1) } else { joined.len() };
        for decided in first..=joined.len() {
            moments.push(Step {
                instance: place as u32 + 1,
                opener,
                joined: joined[..decided].to_vec(),
                is_complete: decided == joined.len(),
            });
        }
    }
    Ok(moments)
}

/// Row from the top and column of a pixel.
fn place(scene: &Scene, pixel: usize) -> (usize, usize) {
    let image = &scene.stages.image;
    let (row, column) = (pixel / image.columns(), pixel % image.columns());
    (if image.top_row_first { row } else { image.rows() - 1 - row }, column)
}

/// What a component is in a step.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Role {
    Member,
    Newest,
    KeptApart,
    Earlier,
    Waiting,
}

const PICTURE: f64 = 210.0;
const LOWER: f64 = 340.0;
const WAITING: [u8; 3] = [138, 144, 158];

/// Draws one step, the `number`th of `total`.
pub fn step_figure(
    scene: &Scene,
    options: &FigureOptions,
    step: &Step,
    number: usize,
    total: usize,
) -> Canvas {
    let roles = roles(scene, step);
    let asked = pairs(scene, &roles);
    let mut canvas = Canvas::new(WIDTH, 0.0, theme::PAGE);
    let members = step.joined.len() + 1;
    let heading = Scene {
        heading: format!(
            "merge {number} of {total}  ·  component {} opens instance {}",
            step.opener, step.instance
        ),
        remark: format!("{}  ·  {}", scene.heading, scene.remark),
        ..scene.clone()
    };
    super::figure::heading(&mut canvas, &heading);
    let colour = opaque(scene.colour(final_instance(scene, step.opener)));

    let mut y = MARGIN + HEADING_ROW;
    let keys = [
        Key::Square(colour, "this instance".into()),
        Key::Square(theme::FOCUS, "newest member".into()),
        Key::Square(theme::APART, "asked, kept apart".into()),
        Key::Square(opaque(WAITING), "not yet asked".into()),
        Key::Words("dimmed: instances opened before".into()),
    ];
    let count = format!("({} {})", members, if members == 1 { "component" } else { "components" });
    title(&mut canvas, MARGIN, y, "components", &count);
    theme::legend(&mut canvas, &keys, WIDTH - MARGIN, y + 14.0);
    y += TITLE_ROW;
    let area = Area { x: MARGIN, y, width: WIDTH - 2.0 * MARGIN, height: PICTURE };
    range_picture(&mut canvas, scene, options, &roles, area, step);
    y = area.bottom() + GAP;

    let width = (WIDTH - 2.0 * MARGIN - GAP) / 2.0;
    let keys = [
        Key::Line(Stroke::solid(theme::MERGED, 2.0), "joins".into()),
        Key::Line(Stroke::solid(theme::APART, 2.0), "kept apart".into()),
    ];
    title(&mut canvas, MARGIN, y, "votes from above", "");
    theme::legend(&mut canvas, &keys, MARGIN + width, y + 14.0);
    let right = MARGIN + width + GAP;
    let said = format!("(V+ : V−, more than {} to join)", percent(scene.merge_ratio));
    title(&mut canvas, right, y, "decisions", &said);
    y += TITLE_ROW;
    let area = Area { x: MARGIN, y, width, height: LOWER };
    graph(&mut canvas, scene, options, &roles, &asked, area);
    table(&mut canvas, scene, step, &asked, Area { x: right, ..area });
    canvas.height = y + LOWER + MARGIN;
    canvas
}

fn percent(share: f64) -> String {
    format!("{:.0} %", share * 100.0)
}

fn title(canvas: &mut Canvas, x: f64, y: f64, words: &str, count: &str) {
    let style = theme::text(theme::TITLE, Weight::Medium, theme::INK, Anchor::Start);
    canvas.text([x, y + 14.0], words, style);
    let x = x + font::width(words, theme::TITLE, Weight::Medium) + 7.0;
    let style = theme::text(theme::SMALL, Weight::Regular, theme::FAINT_INK, Anchor::Start);
    canvas.text([x, y + 14.0], count, style);
}

fn final_instance(scene: &Scene, component: u32) -> u32 {
    scene.instance_of_component()[component as usize - 1]
}

/// What each component is, component k at k - 1.
fn roles(scene: &Scene, step: &Step) -> Vec<Role> {
    let instances = &scene.stages.merge.instance_of_component;
    let mut roles: Vec<Role> = instances
        .iter()
        .map(|&instance| if instance < step.instance { Role::Earlier } else { Role::Waiting })
        .collect();
    roles[step.opener as usize - 1] = Role::Member;
    for joined in &step.joined {
        roles[joined.query as usize - 1] = Role::Member;
    }
    for vote in &scene.stages.votes.pairs {
        for (member, other) in [(vote.a, vote.b), (vote.b, vote.a)] {
            let is_final = instances[other as usize - 1] != step.instance;
            let other = other as usize - 1;
            if roles[member as usize - 1] == Role::Member
                && roles[other] == Role::Waiting
                && is_final
            {
                roles[other] = Role::KeptApart;
            }
        }
    }
    if let Some(last) = step.joined.last().filter(|_| !step.is_complete) {
        roles[last.query as usize - 1] = Role::Newest;
    }
    roles
}

/// Pairs of a member and a component that it asked in vain, those with most votes first.
fn pairs(scene: &Scene, roles: &[Role]) -> Vec<(u32, u32, Vote)> {
    let is = |label: u32, role: Role| roles[label as usize - 1] == role;
    let is_member = |label: u32| is(label, Role::Member) || is(label, Role::Newest);
    let mut pairs: Vec<(u32, u32, Vote)> = Vec::new();
    for vote in &scene.stages.votes.pairs {
        for (member, other) in [(vote.a, vote.b), (vote.b, vote.a)] {
            if is_member(member) && is(other, Role::KeptApart) {
                pairs.push((member, other, *vote));
            }
        }
    }
    pairs.sort_by_key(|&(a, b, vote)| (std::cmp::Reverse(vote.positive + vote.negative), a, b));
    pairs
}

fn range_picture(
    canvas: &mut Canvas,
    scene: &Scene,
    options: &FigureOptions,
    roles: &[Role],
    area: Area,
    step: &Step,
) {
    let component = scene.component_of_pixel();
    let instance = scene.instance_of_component();
    let window = window_around(scene, roles, options, area);
    let own = scene.colour(instance[step.opener as usize - 1]);
    let raster = range_panel::raster(scene, &window, |pixel, point| {
        let Some(label) = component[pixel].checked_sub(1).map(|label| label as usize) else {
            return range_panel::backdrop(scene, point);
        };
        match roles[label] {
            Role::Member => own,
            Role::Newest => [theme::FOCUS[0], theme::FOCUS[1], theme::FOCUS[2]],
            // Neighbours in vain stay apart from each other by two tints.
            Role::KeptApart => {
                let [r, g, b, _] = theme::APART;
                between([r, g, b], theme::PANEL, if label % 2 == 0 { 0.0 } else { 0.25 })
            }
            Role::Earlier => between(theme::PANEL, scene.colour(instance[label]), 0.42),
            Role::Waiting => between(WAITING, theme::PANEL, (label % 3) as f64 * 0.14),
        }
    });
    canvas.rect(area, Some(opaque(theme::PANEL)), None);
    canvas.picture(area, raster);
}

/// The part of the image with the instance and those it asks in its middle, in the shape of the area.
fn window_around(scene: &Scene, roles: &[Role], options: &FigureOptions, area: Area) -> Window {
    const LEAST_ROWS: usize = 24;
    let image = &scene.stages.image;
    let size = [image.rows(), image.columns()];
    let mut low = size;
    let mut high = [0, 0];
    for (&pixel, &label) in scene.stages.objects.pixel.iter().zip(&scene.stages.components.label) {
        let is_shown = label != 0
            && matches!(roles[label as usize - 1], Role::Member | Role::Newest | Role::KeptApart);
        if is_shown {
            let (row, column) = place(scene, pixel as usize);
            low = [low[0].min(row), low[1].min(column)];
            high = [high[0].max(row), high[1].max(column)];
        }
    }
    if low[0] > high[0] {
        (low, high) = ([0, 0], size.map(|side| side - 1));
    }
    // Columns to a row of the area, in the pixels' shape.
    let pixel_shape = options.aspect * size[1] as f64 / size[0] as f64;
    let shape = area.width / area.height * pixel_shape;
    let with_margin = |axis: usize| (high[axis] + 1 - low[axis]) as f64 * 1.3 + 2.0;
    let least = LEAST_ROWS.min(size[0]) as f64;
    let tall = with_margin(0).max(with_margin(1) / shape).max(least).min(size[0] as f64);
    let wide = tall * shape;
    let part = |axis: usize, length: f64| {
        let length = (length.round() as usize).clamp(1, size[axis]);
        let middle = (low[axis] + high[axis]) / 2;
        let start = middle.saturating_sub(length / 2).min(size[axis] - length);
        start..start + length
    };
    // What is wider than that is shown whole, its pixels narrower.
    Window { rows: part(0, tall), columns: part(1, wide.max(with_margin(1))) }
}

fn graph(
    canvas: &mut Canvas,
    scene: &Scene,
    options: &FigureOptions,
    roles: &[Role],
    asked: &[(u32, u32, Vote)],
    area: Area,
) {
    let centres = vote_graph::centres(scene);
    let is_member = |label: usize| matches!(roles[label], Role::Member | Role::Newest);
    let shown =
        (0..roles.len()).filter(|&label| is_member(label) || roles[label] == Role::KeptApart);
    let shown: Vec<usize> = shown.filter(|&label| centres[label].1 > 0).collect();
    let region = Region::whole(shown.iter().map(|&label| centres[label].0), 0.8, 3.0);
    let plane = Plane::new(area, &region);
    let component = &scene.stages.labels.component;
    let instance = &scene.stages.labels.instance;
    plane.points(canvas, scene, options.dpi / 96.0, |point| {
        let is_own = component[point].checked_sub(1).is_some_and(|label| is_member(label as usize));
        between(theme::PANEL, scene.colour(instance[point]), if is_own { 0.6 } else { 0.3 })
    });
    canvas.clipped(area, |canvas| {
        for &(a, b, vote) in asked {
            let ends = [a, b].map(|label| plane.to_page(centres[label as usize - 1].0));
            let stroke = vote_graph::edge(scene, &vote, Decision::Apart, 1.2);
            canvas.line(ends[0], ends[1], stroke);
        }
        for vote in &scene.stages.votes.pairs {
            let [a, b] = [vote.a, vote.b].map(|label| label as usize - 1);
            if is_member(a) && is_member(b) {
                let ends = [a, b].map(|label| plane.to_page(centres[label].0));
                let stroke = vote_graph::edge(scene, vote, Decision::Merged, 1.2);
                canvas.line(ends[0], ends[1], stroke);
            }
        }
        for &label in &shown {
            let fill = match roles[label] {
                Role::Newest => theme::FOCUS,
                Role::Member => theme::ON_PANEL,
                _ => theme::APART,
            };
            let rim = Stroke::solid(opaque(theme::PANEL), 1.0);
            canvas.circle(plane.to_page(centres[label].0), 3.4, Some(fill), Some(rim));
        }
    });
    plane.furniture(canvas);
    let mut taken: Vec<Area> = Vec::new();
    for &label in shown.iter().take(60) {
        let [x, y] = plane.to_page(centres[label].0);
        let words = (label + 1).to_string();
        let width = font::width(&words, 9.0, Weight::Medium);
        let spot = Area { x: x + 4.5, y: y - 9.5, width, height: 9.0 };
        if area.holds(&spot) && !taken.iter().any(|other| other.meets(&spot)) {
            canvas.text(
                [spot.x, spot.bottom()],
                words,
                theme::label(9.0, theme::ON_PANEL, Anchor::Start),
            );
            taken.push(spot);
        }
    }
}

const ROW: f64 = 17.5;

/// A line for each decision: who asked whom, the votes, what came of it.
fn table(canvas: &mut Canvas, scene: &Scene, step: &Step, asked: &[(u32, u32, Vote)], area: Area) {
    let rows: Vec<(u32, u32, [u64; 2], bool)> = step
        .joined
        .iter()
        .map(|s| (s.target, s.query, [s.positive, s.negative], true))
        .chain(asked.iter().map(|&(a, b, vote)| {
            (a, b, [u64::from(vote.positive), u64::from(vote.negative)], false)
        }))
        .collect();
    let fitting = (area.height / ROW) as usize;
    let (joined, apart) = (step.joined.len(), asked.len());
    // Some room for either kind, the rest to whoever needs it.
    let lines = fitting.saturating_sub(2);
    let shown_joined = joined.min(lines.saturating_sub(apart.min(lines / 3)));
    let shown_apart = apart.min(lines - shown_joined);
    let small = |colour, anchor| theme::text(theme::SMALL, Weight::Regular, colour, anchor);
    let mut y = area.y + 13.0;
    // In a series by decision the newest is at the end.
    let skipped = joined - shown_joined;
    if skipped > 0 {
        let words = format!("… {} that joined before", grouped(skipped));
        canvas.text([area.x, y], words, small(theme::FAINT_INK, Anchor::Start));
        y += ROW;
    }
    let shown = rows[skipped..joined].iter().chain(&rows[joined..joined + shown_apart]);
    for &(asker, other, [positive, negative], joins) in shown {
        let ink = small(theme::INK, Anchor::Start);
        canvas.text([area.x, y], format!("{asker} asks {other}"), ink);
        canvas.text(
            [area.x + 180.0, y],
            format!("{positive} : {negative}"),
            small(theme::INK, Anchor::End),
        );
        bar(
            canvas,
            scene,
            [positive, negative],
            Area { x: area.x + 194.0, y: y - 9.0, width: 150.0, height: 10.0 },
        );
        let (words, colour) =
            if joins { ("joins", [20, 110, 190, 255]) } else { ("kept apart", [196, 72, 20, 255]) };
        canvas.text([area.x + 356.0, y], words, small(colour, Anchor::Start));
        y += ROW;
    }
    if shown_apart < apart {
        let words = format!("… {} more kept apart", grouped(apart - shown_apart));
        canvas.text([area.x, y], words, small(theme::FAINT_INK, Anchor::Start));
    } else if rows.is_empty() {
        let words = "all its neighbours belong to instances opened before";
        canvas.text([area.x, y], words, small(theme::FAINT_INK, Anchor::Start));
    }
}

/// Votes in favour and against as shares, with a tick at the threshold.
fn bar(canvas: &mut Canvas, scene: &Scene, [positive, negative]: [u64; 2], area: Area) {
    let share = positive as f64 / (positive + negative).max(1) as f64;
    canvas.rect(area, Some([255, 196, 168, 255]), None);
    canvas.rect(Area { width: area.width * share, ..area }, Some([120, 184, 240, 255]), None);
    let x = area.x + area.width * scene.merge_ratio;
    let tick = Stroke::solid(theme::INK, 1.0);
    canvas.line([x, area.y - 2.0], [x, area.bottom() + 2.0], tick);
}
