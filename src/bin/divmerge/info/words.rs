//! The geometry of a cloud in words.

use divmerge::range_image::{BandGeometry, Geometry, Projection};

use super::Look;
use crate::terminal::grouped;

/// Lines about the image, each sensor, returns, the ground, and what would change them.
pub(super) fn geometry(look: &Look) -> Vec<String> {
    let geometry = &look.geometry;
    let mut lines = vec![image(geometry)];
    lines.extend(stagger(geometry));
    for sensor in &geometry.sensors {
        lines.extend(sensor_lines(sensor, geometry.sensors.len() > 1));
    }
    lines.push(returns(geometry));
    lines.extend(turned(look));
    lines.push(ground(look));
    lines.push(overrides(geometry).to_owned());
    lines
}

fn image(geometry: &Geometry) -> String {
    let why = match geometry.projection {
        Projection::Ring => "the ring field numbers the beams",
        Projection::Organised => "the cloud has rows and columns of its own",
        Projection::OrganisedTransposed => "each column of the cloud is a beam",
        Projection::ScanOrder => "no ring field, but stored beam after beam",
        Projection::Elevations => "no ring field, but returns crowd at a few elevations",
        Projection::Sources => "a field tells several sensors apart",
        Projection::UniformElevation => {
            "no beams to be found: pixels as fine as the points lie, unless asked for"
        }
    };
    format!(
        "range image {} x {} ({}: {why})",
        geometry.rows,
        geometry.columns,
        geometry.projection.describe()
    )
}

fn stagger(geometry: &Geometry) -> Option<String> {
    (geometry.stagger > 0).then(|| {
        format!(
            "staggered: rows stood up to {} columns aside and were brought into line",
            geometry.stagger
        )
    })
}

fn sensor_lines(sensor: &BandGeometry, is_one_of_several: bool) -> Vec<String> {
    let mut lines = Vec::new();
    if let Some(source) = sensor.source.filter(|_| is_one_of_several) {
        lines.push(format!("sensor {source}: {}", sensor.projection.describe()));
    }
    let spacing = sensor
        .beam_spacing_degrees
        .map_or(String::new(), |[least, most]| format!(", {least:.2} to {most:.2} degrees apart"));
    let [upper, lower] = sensor.elevation_degrees;
    let rows = if sensor.projection == Projection::UniformElevation { "rows" } else { "beams" };
    lines.push(format!(
        "{} {rows} with returns from {upper:+.1} to {lower:+.1} degrees{spacing}; a shot every {:.3} degrees",
        sensor.beams, sensor.column_degrees
    ));
    let [start, width] = sensor.azimuth_degrees;
    lines.push(match sensor.closes {
        true => "the scan goes all round".to_owned(),
        false => format!(
            "the scan covers {width:.0} degrees, from {start:.0} to {:.0} degrees of azimuth, and does not close",
            start + width
        ),
    });
    lines.extend(sensor.stands.map(|[x, y, z, lean]| {
        format!(
            "the sensor stands at {x:.2}, {y:.2}, {z:.2} m in the cloud's frame, its axis {lean:.1} degrees off z"
        )
    }));
    lines
}

fn returns(geometry: &Geometry) -> String {
    let percent = |count: usize, of: usize| 100.0 * count as f64 / of.max(1) as f64;
    let none = geometry.points - geometry.returns;
    let mut line = format!(
        "{:.1} % of the points are no return; {} returns ({:.1} %) lie behind a nearer one in their pixel",
        percent(none, geometry.points),
        grouped(geometry.shadowed as u64),
        percent(geometry.shadowed, geometry.returns)
    );
    // Beyond chance: two returns of different shots hardly ever lie on one ray.
    if geometry.multiple_returns > 0.01 {
        let share = 100.0 * geometry.multiple_returns;
        line += &format!("; {share:.1} % are one of several returns of a shot, the nearest leads");
    }
    line
}

fn turned(look: &Look) -> Option<String> {
    look.turned_degrees.map(|[roll, pitch, yaw]| {
        format!("turned upright by roll {roll:.1}, pitch {pitch:.1}, yaw {yaw:.1} degrees")
    })
}

fn ground(look: &Look) -> String {
    match look.ground {
        None => "no ground is found around the sensor: which way is up cannot be told".to_owned(),
        Some(lie) if lie.is_overhead => {
            "warning: the largest level surface lies above the sensor; if it is the ground, z points down, and \
             --sensor-frame frd (y right, z down) or --sensor-frame 180,0,0 (hung upside down) turns it"
                .to_owned()
        }
        Some(lie) if lie.lean_degrees > 10.0 => format!(
            "the ground leans {:.1} degrees from the frame's z: is the sensor tilted? --sensor-frame \
             roll,pitch,yaw lets boxes stand upright",
            lie.lean_degrees
        ),
        Some(lie) => {
            format!("the ground lies below, {:.1} degrees off level: z is up", lie.lean_degrees)
        }
    }
}

fn overrides(geometry: &Geometry) -> &'static str {
    match geometry.projection {
        Projection::Organised | Projection::OrganisedTransposed => {
            "otherwise: --sensor-frame (rows and columns are the cloud's own)"
        }
        _ => "otherwise: --rows N, --columns N, --fov UP,DOWN, --sensor-frame",
    }
}
