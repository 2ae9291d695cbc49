//! The geometry of a cloud in words.

use crate::range_image::{BandGeometry, Evidence, Geometry, Projection, RingFlaw};

use super::facts::CloudFacts;
use crate::cli::text::counted;

/// The image, each sensor, returns, the ground, and the options that change them.
pub fn lines(cloud: &CloudFacts) -> Vec<String> {
    let geometry = &cloud.geometry;
    let mut lines = vec![limits(cloud), image(geometry)];
    lines.extend(geometry.ring_flaw.map(ring_flaw));
    lines.extend(stagger(geometry));
    for sensor in &geometry.sensors {
        lines.extend(sensor_lines(sensor, geometry.sensors.len() > 1));
    }
    lines.push(returns(geometry));
    lines.extend(turned(cloud));
    lines.push(ground(cloud));
    lines.push(overrides(geometry).to_owned());
    lines
}

fn limits(cloud: &CloudFacts) -> String {
    let [x, y, z] = cloud.limits.map(|[least, most]| format!("{least:.1} to {most:.1}"));
    let unit = match cloud.immense {
        true => "; warning: too large for metres: --units mm or --units cm",
        false => "",
    };
    format!("x {x}, y {y}, z {z} m{unit}")
}

fn image(geometry: &Geometry) -> String {
    let why = match geometry.projection {
        Projection::Ring => "the ring field numbers the beams",
        Projection::Organised => "the cloud has rows and columns of its own",
        Projection::OrganisedTransposed => "each column of the cloud is a beam",
        Projection::ScanOrder => "no beams by a ring field, but points are stored beam after beam",
        Projection::Elevations => {
            "no beams by a ring field, but returns cluster at a few elevations"
        }
        Projection::Sources => "a field numbers the sensors",
        Projection::UniformElevation => {
            "no beams found: pixels as fine as the points, unless given"
        }
    };
    format!(
        "range image {} x {} ({}: {why})",
        geometry.rows,
        geometry.columns,
        geometry.projection.describe()
    )
}

fn ring_flaw(flaw: RingFlaw) -> String {
    let why = match flaw {
        RingFlaw::Constant => "one number stands for returns at many elevations",
        RingFlaw::Scattered => "returns of one number lie as far apart in elevation as any others",
        RingFlaw::Repeated => "several numbers stand for one elevation",
        RingFlaw::TooHigh => "its numbers are higher than any sensor has beams",
    };
    format!("warning: the ring field is left aside: {why}")
}

fn stagger(geometry: &Geometry) -> Option<String> {
    (geometry.stagger > 0).then(|| {
        format!(
            "staggered: rows were shifted by up to {} to align them",
            counted(geometry.stagger as u64, "column")
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
    let [start, width] = sensor.azimuth_degrees;
    let around = match sensor.closes {
        true => "all round".to_owned(),
        false => {
            format!("{width:.0} degrees of azimuth, from {start:.0} to {:.0}", start + width)
        }
    };
    lines.push(format!(
        "{} {rows} with returns from {upper:+.1} to {lower:+.1} degrees{spacing}; a shot every \
         {:.3} degrees, {around}",
        sensor.beams, sensor.column_degrees
    ));
    lines.extend(sensor.stands.map(|[x, y, z, lean]| {
        format!(
            "sensor at {x:.2}, {y:.2}, {z:.2} m in the cloud's frame, axis {lean:.1} degrees from \
             z: {}",
            evidence(sensor.evidence)
        )
    }));
    lines
}

fn evidence(evidence: Evidence) -> &'static str {
    match evidence {
        Evidence::Origin => "the frame's origin",
        Evidence::Given => "given by --sensor-origin",
        Evidence::Beams => "from there the beams are cones",
        Evidence::Recorded => "by the recorded transforms",
        Evidence::Assumed => "assumed, for the points do not show it (--sensor-origin X,Y,Z)",
    }
}

fn returns(geometry: &Geometry) -> String {
    let percent = |count: usize, of: usize| 100.0 * count as f64 / of.max(1) as f64;
    let none = geometry.points - geometry.returns;
    let mut line = format!(
        "{:.1} % of the points have no return; {} ({:.1} %) lie behind a nearer one in their pixel",
        percent(none, geometry.points),
        counted(geometry.shadowed as u64, "return"),
        percent(geometry.shadowed, geometry.returns)
    );
    // More than by chance: two returns of different shots are rarely on one ray.
    if geometry.multiple_returns > 0.01 {
        let share = 100.0 * geometry.multiple_returns;
        line += &format!("; {share:.1} % are one of several returns of a shot");
    }
    line
}

fn turned(cloud: &CloudFacts) -> Option<String> {
    cloud.turned_degrees.map(|[roll, pitch, yaw]| {
        format!("rotated upright by roll {roll:.1}, pitch {pitch:.1}, yaw {yaw:.1} degrees")
    })
}

fn ground(cloud: &CloudFacts) -> String {
    if let Some(frame) = cloud.upright_frame {
        return format!(
            "warning: the largest level surface lies under another axis than z: --sensor-frame \
             {frame} turns such a frame upright"
        );
    }
    match cloud.ground {
        None => "no ground found around the sensor: the up direction is unknown".to_owned(),
        Some(pose) if pose.is_overhead => {
            "warning: the largest level surface is above the sensor; if it is the ground, z points \
             down: use --sensor-frame frd (y right, z down) or 180,0,0 (mounted upside down)"
                .to_owned()
        }
        Some(pose) if pose.lean_degrees > 10.0 => format!(
            "the ground is tilted by {:.1} degrees: if the sensor is tilted, --sensor-frame \
             roll,pitch,yaw makes boxes upright",
            pose.lean_degrees
        ),
        Some(pose) => {
            format!("the ground is below, {:.1} degrees off level: z is up", pose.lean_degrees)
        }
    }
}

fn overrides(geometry: &Geometry) -> &'static str {
    match geometry.projection {
        Projection::Organised | Projection::OrganisedTransposed => {
            "to change this: --sensor-frame, --sensor-origin (rows and columns are the cloud's own)"
        }
        _ => {
            "to change this: --rows N, --columns N, --fov UP,DOWN, --sensor-frame, --sensor-origin"
        }
    }
}
