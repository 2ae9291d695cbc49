//! A drive from above: the ways of its objects and of the sensor in a frame that stands still.

use std::collections::BTreeMap;

use super::axes;
use super::canvas::{Area, Canvas, Raster, Stroke, opaque};
use super::layout::{Caption, GAP, HEADING_ROW, INNER_WIDTH, MARGIN, page, titled};
use super::legend::Key;
use super::look::Theme;
use super::plane::{Plane, PlaneRegion};
use super::plane_panel::{NumberLimit, numbers};
use crate::annotate::{FollowedCloud, FollowedDrive};
use crate::messages::palette::instance_colour;
use crate::text::grouped;
use divmerge_core::geometry::footprint::Rectangle;
use divmerge_core::over_time::TrackedObject;

/// Most tracks that have their numbers beside them.
const MOST_NUMBERS: usize = 80;

/// Height of the panel over its width, least and most.
const ASPECT: (f64, f64) = (0.3, 0.75);

/// Margin around what is drawn, metres.
const AROUND: f64 = 8.0;

/// Fewest clouds of a track that is drawn: what is seen once or twice may be nothing.
const LEAST_CLOUDS: usize = 3;

/// Draws the tracks of a drive on the plane, `dpi` pixels to the inch. Where the motion of the
/// sensor breaks off, the longest piece is drawn.
pub fn track_figure(
    drive: &FollowedDrive,
    region: Option<PlaneRegion>,
    theme: Theme,
    dpi: f64,
) -> Canvas {
    let piece = longest_piece(&drive.clouds);
    let tracks = Ways::of(drive, piece);
    let sensor: Vec<[f64; 2]> = piece.iter().map(sensor_place).collect();
    let region = region.unwrap_or_else(|| {
        let ways = tracks.0.values().flat_map(|way| way.places.iter().copied());
        PlaneRegion::whole(&ways.chain(sensor.iter().copied()).collect::<Vec<_>>(), AROUND, 20.0)
    });
    let (mut canvas, look) = (page(theme), theme.look());
    let (first, last) = (piece[0].number, piece[piece.len() - 1].number);
    let heading = format!("{}  ·  frames {first} to {last}", drive.topic);
    titled(&mut canvas, &heading, &remark(drive, piece));
    let moving = tracks.0.values().filter(|way| way.is_moving).count();
    let caption = Caption {
        letter: None,
        title: "objects over time",
        count: format!(
            "({} tracks, {} of them moving)",
            grouped(tracks.0.len() as u64),
            grouped(moving as u64)
        ),
        keys: vec![
            Key::Words("one colour per track".into()),
            Key::Line(Stroke::solid(look.on_panel, 2.0), "the sensor".into()),
        ],
    };
    let captions = [caption];
    let top = MARGIN + HEADING_ROW + Caption::height(&captions, INNER_WIDTH);
    captions[0].draw(&mut canvas, [MARGIN, MARGIN + HEADING_ROW], INNER_WIDTH);
    let share = (1.0 / region.aspect()).clamp(ASPECT.0, ASPECT.1);
    let height = (INNER_WIDTH * share).round();
    let slot = Area { x: MARGIN, y: top, width: INNER_WIDTH, height };
    let area = axes::inside(slot);
    let plane = Plane::new(area, &region);
    surroundings(&mut canvas, &plane, piece, dpi / 96.0);
    canvas.clipped(area, |canvas| {
        tracks.draw(canvas, &plane);
        way(canvas, &plane, &sensor, Stroke::solid(look.on_panel, 2.0));
    });
    plane.axes(&mut canvas);
    tracks.numbers(&mut canvas, &plane);
    canvas.height = slot.bottom() + GAP;
    canvas
}

/// What the motion came from, and what is not drawn.
fn remark(drive: &FollowedDrive, piece: &[FollowedCloud]) -> String {
    let sources: Vec<&str> = drive.motion.sources.keys().map(String::as_str).collect();
    let left = drive.clouds.len() - piece.len();
    let left = match left {
        0 => String::new(),
        left => format!("  ·  {left} more frames lie elsewhere"),
    };
    format!("motion of the sensor from {}{left}", sources.join(" and "))
}

/// The most clouds one behind the other whose poses are in one frame.
fn longest_piece(clouds: &[FollowedCloud]) -> &[FollowedCloud] {
    let mut begins: Vec<usize> =
        (0..clouds.len()).filter(|&at| at == 0 || clouds[at].began_anew).collect();
    begins.push(clouds.len());
    let pieces = begins.windows(2).map(|ends| &clouds[ends[0]..ends[1]]);
    pieces
        .fold(&clouds[..0], |longest, next| if next.len() > longest.len() { next } else { longest })
}

fn sensor_place(cloud: &FollowedCloud) -> [f64; 2] {
    let place = cloud.world_from_cloud.translation.vector;
    [place.x, place.y]
}

/// The ways of objects by the number of their track.
struct Ways(BTreeMap<u32, Way>);

struct Way {
    places: Vec<[f64; 2]>,
    /// The box where it was last seen.
    last: Rectangle,
    is_moving: bool,
}

impl Ways {
    fn of(drive: &FollowedDrive, piece: &[FollowedCloud]) -> Self {
        let moving = |track: u32| {
            let found = drive.tracks.binary_search_by_key(&track, |summary| summary.track);
            found.is_ok_and(|at| drive.tracks[at].moving)
        };
        let mut ways: BTreeMap<u32, Way> = BTreeMap::new();
        for cloud in piece {
            for object in &cloud.objects {
                let last = footprint(cloud, object);
                let way = ways.entry(object.track).or_insert_with(|| Way {
                    places: Vec::new(),
                    last,
                    is_moving: moving(object.track),
                });
                way.places.push(last.centre);
                way.last = last;
            }
        }
        ways.retain(|_, way| way.places.len() >= LEAST_CLOUDS);
        Ways(ways)
    }

    /// What stands first, then what moves.
    fn draw(&self, canvas: &mut Canvas, plane: &Plane) {
        let look = canvas.look();
        for is_moving in [false, true] {
            for (&track, of) in self.0.iter().filter(|(_, of)| of.is_moving == is_moving) {
                let colour = look.line_colour(instance_colour(track));
                if is_moving {
                    way(canvas, plane, &of.places, Stroke::solid(opaque(colour), 1.8));
                }
                plane.rectangle(canvas, &of.last, Stroke::solid(opaque(colour), 1.0));
            }
        }
    }

    /// Numbers beside the boxes where there is room, those of what is seen longest first.
    fn numbers(&self, canvas: &mut Canvas, plane: &Plane) {
        let mut longest: Vec<(&u32, &Way)> = self.0.iter().collect();
        longest.sort_by_key(|(track, of)| (std::cmp::Reverse(of.places.len()), **track));
        let boxes: Vec<(u32, Rectangle)> =
            longest.into_iter().map(|(&track, of)| (track, of.last)).collect();
        let limit = NumberLimit { most: MOST_NUMBERS, others: ["shorter track", "shorter tracks"] };
        numbers(canvas, plane, &boxes, limit);
    }
}

/// The box of an object in the frame that stands still.
fn footprint(cloud: &FollowedCloud, object: &TrackedObject) -> Rectangle {
    let pose = cloud.world_from_cloud * object.bounds.pose();
    let ahead = pose.rotation * nalgebra::Vector3::x();
    let size = [object.bounds.size[0].max(0.3), object.bounds.size[1].max(0.3)];
    let centre = [pose.translation.vector.x, pose.translation.vector.y];
    Rectangle { centre, size, yaw: ahead.y.atan2(ahead.x) }
}

/// A line from place to place.
fn way(canvas: &mut Canvas, plane: &Plane, places: &[[f64; 2]], stroke: Stroke) {
    for pair in places.windows(2) {
        let [from, to] = [pair[0], pair[1]].map(|place| plane.to_page(place));
        canvas.line(from, to, stroke);
    }
}

/// What stands around, from above.
fn surroundings(canvas: &mut Canvas, plane: &Plane, clouds: &[FollowedCloud], density: f64) {
    let look = canvas.look();
    let [width, height] =
        [plane.area.width, plane.area.height].map(|side| ((side * density) as usize).max(1));
    let mut raster = Raster::filled(width, height, look.panel);
    let side = density.round().max(1.0) as usize;
    for place in clouds.iter().flat_map(|cloud| &cloud.surroundings) {
        let page = plane.to_page(place.map(f64::from));
        let corner = [page[0] - plane.area.x, page[1] - plane.area.y].map(|at| at * density);
        if corner.iter().all(|at| *at >= 0.0) {
            raster.fill_square(corner.map(|at| at as usize), side, look.other_returns[1]);
        }
    }
    canvas.picture(plane.area, raster);
}
