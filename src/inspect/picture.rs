//! A frame as the page draws it: the points of its cloud, and what a run found in them.

use serde_json::{Value, json};

use super::idle::idle;
use super::pack::{Pack, Sums};
use super::run::Run;
use super::session::Session;
use super::setting;
use super::thinning::Detail;
use crate::error::Result;
use crate::view::{Decision, brightest, class_colours, far, vote_edges};
use divmerge_core::cloud::Instance;
use divmerge_core::cloud::taxonomy::Taxonomy;

/// The points of a run's cloud, where the page does not have them yet, and the run, without arrays
/// that the page has.
///
/// # Errors
/// Those of [`Session::run`].
pub(super) fn picture(
    session: &Session,
    run: &Run,
    (with_points, known): (bool, Sums),
    detail: &Detail,
) -> Result<Pack> {
    let mut pack = Pack::beside(known);
    if with_points {
        points(session, run, detail, &mut pack);
    }
    clustering(session, run, detail, &mut pack)?;
    Ok(pack)
}

/// The cloud: x, y, z of each point, and its intensity and truth where they are known.
fn points(session: &Session, run: &Run, detail: &Detail, pack: &mut Pack) {
    let inspected = &*run.cloud;
    let (message, cloud) = (&inspected.message, &inspected.cloud);
    let seconds = message.log_time_ns().saturating_sub(session.start_ns) as f64 * 1e-9;
    pack.field(
        "cloud",
        json!({
            "topic": &*message.topic,
            "frame": message.number,
            "messages": [message.first_number(), message.number],
            "seconds": seconds,
            "log_time_ns": message.log_time_ns().to_string(),
            "frame_id": inspected.frame_id,
            "points": cloud.len(),
            "semantics": inspected.semantics,
            "remarks": inspected.remarks,
            "intensity_high": inspected.intensity.as_deref().map(brightest),
            "has_truth": inspected.truth.is_some(),
        }),
    );
    let positions: Vec<f32> = detail
        .points(cloud.len())
        .into_iter()
        .flat_map(|point| cloud.position(point).map(|along| detail.rounded(along, 1.0)))
        .collect();
    pack.f32("position", positions.into_iter());
    if let Some(intensity) = inspected.intensity.as_deref().filter(|_| detail.has_intensity) {
        let high = brightest(intensity) as f32;
        let values = detail.of(intensity);
        pack.f32("intensity", values.iter().map(|&value| detail.rounded(value, high)));
    }
    if let Some(truth) = &inspected.truth {
        let class = inspected.taxonomy(&run.config).class_numbers(&truth.class);
        pack.u16("true_class", detail.of(&class).iter().copied());
        pack.u32("true_id", detail.of(&numbered(&truth.id)).iter().copied());
    }
}

/// Segments of the truth numbered from 1 in their order, so that they have colours of their own.
fn numbered(ids: &[u32]) -> Vec<u32> {
    let mut all = ids.to_vec();
    all.sort_unstable();
    all.dedup();
    let place = |id: &u32| all.binary_search(id).map_or(0, |place| place as u32 + 1);
    ids.iter().map(place).collect()
}

/// The run: image, mask, components, instances, reasons, votes.
fn clustering(session: &Session, run: &Run, detail: &Detail, pack: &mut Pack) -> Result<()> {
    let (stages, inspected) = (&run.stages, &run.cloud);
    let colours = session.colours(run)?;
    let scene = run.scene(session.start_ns, colours.clone());
    let edges = vote_edges(&scene);
    let image = &stages.image;
    let classes = inspected.mask(&run.config).taxonomy().map_or(&[][..], Taxonomy::classes);
    let taxonomy = inspected.taxonomy(&run.config).classes();
    pack.field(
        "run",
        json!({
            "setting": run.setting,
            "values": setting::values(&run.config),
            "idle": idle(run),
            "method_parameters": setting::method_parameters(&run.config),
            "heading": scene.heading,
            "remark": scene.remark,
            "rows": image.rows(),
            "columns": image.columns(),
            "wraps": image.wraps,
            "top_row_first": image.top_row_first,
            "far": inspected.far(|| far(&scene)),
            "method": run.config.pipeline.describe(),
            "is_own_method": run.config.pipeline.other_method.is_none(),
            "has_classes": stages.mask.has_classes(),
            "classes": classes.iter().map(|class| &class.name).collect::<Vec<_>>(),
            "class_colours": class_colours(classes),
            "true_classes": taxonomy.iter().map(|class| &class.name).collect::<Vec<_>>(),
            "true_class_colours": class_colours(taxonomy),
            "components": stages.components.count,
            "decisions": [Decision::Merged, Decision::Rejoined, Decision::Apart],
            "object_pixels": stages.objects.len(),
            "reasons": stages.labels.counts(),
            "times": stages.times,
            "total_ms": stages.times.total_ms(),
            "instances": instances(run, &colours),
        }),
    );
    arrays(run, detail, pack);
    let ends: Vec<f32> =
        edges.iter().flat_map(|edge| edge.ends.as_flattened().iter().map(|&x| x as f32)).collect();
    pack.f32("edge_ends", ends.into_iter());
    pack.u8("edge_decision", edges.iter().map(|edge| edge.decision as u8));
    Ok(())
}

/// What the run makes of the pixels and of each point.
fn arrays(run: &Run, detail: &Detail, pack: &mut Pack) {
    let (image, mask, labels) = (&run.stages.image, &run.stages.mask, &run.stages.labels);
    let points = detail.point_of_pixel(image, &labels.instance);
    pack.u32("point_of_pixel", points.iter().copied());
    pack.u32("pixel_of_point", detail.of(&image.pixel_of_point).iter().copied());
    pack.u8("is_object", detail.of(&mask.is_object).iter().map(|&is_object| u8::from(is_object)));
    pack.u16("class", detail.of(&mask.class).iter().copied());
    pack.u32("component", detail.of(&labels.component).iter().copied());
    pack.u32("instance", detail.of(&labels.instance).iter().copied());
    pack.u8("reason", detail.of(&labels.reason).iter().map(|&reason| reason as u8));
}

fn instances(run: &Run, colours: &[u32]) -> Vec<Value> {
    let of_one = |instance: &Instance| {
        let number = colours.get(instance.id as usize - 1);
        json!({
            "id": instance.id,
            "title": instance.title(),
            "class": match &instance.coarse_class {
                Some(coarse) => coarse.class.name(),
                None => &instance.class_name,
            },
            "confidence": instance.confidence,
            "is_object": instance.is_object(),
            "points": instance.points,
            "pixels": instance.pixels,
            "components": instance.components,
            "centre": instance.bounds.centre,
            "size": instance.bounds.size,
            "yaw": instance.bounds.yaw,
            "colour": number.copied().unwrap_or(instance.id),
        })
    };
    run.stages.instances.iter().map(of_one).collect()
}

#[cfg(test)]
mod tests {
    use super::numbered;

    #[test]
    fn segments_are_numbered_in_their_order() {
        assert_eq!(numbered(&[70_000, 10, 10, 30]), [3, 1, 1, 2]);
    }
}
