//! Names in a Rerun recording: entities, and class ids with their names and colours.

use rerun::{AnnotationInfo, EntityPath, EntityPathPart, Rgba32, components};

use crate::messages::palette::{instance_colour, reason_colour};
use divmerge_core::cloud::Reason;
use divmerge_core::cloud::taxonomy::Taxonomy;

/// Name of the application that a recording and its layout are for.
pub const APPLICATION: &str = "divmerge";

/// This plus a reason's number stands for points without an instance.
const REASONS: u16 = 65_528;
/// Ids with a colour and a name of their own; the viewer makes up those of the others.
const NAMED_IDS: u16 = 4096;

/// `/lidar/points` as an entity; each text between slashes is one part.
pub fn topic_path(topic: &str) -> EntityPath {
    let named = topic.split('/').filter(|part| !part.is_empty()).map(EntityPathPart::new);
    match named.collect::<Vec<_>>() {
        none if none.is_empty() => EntityPath::from("cloud"),
        named => EntityPath::new(named),
    }
}

/// An opaque colour.
pub fn rgb([red, green, blue]: [u8; 3]) -> Rgba32 {
    components::Color::from_rgb(red, green, blue).0
}

/// Id of points without an instance for a reason.
pub fn reason_id(reason: Reason) -> u16 {
    REASONS + reason as u16
}

/// Id of a component or an instance; `reason` gives it where there is none.
pub fn shown_id(number: u32, reason: Reason) -> u16 {
    match number {
        0 if reason == Reason::None => 0,
        0 => reason_id(reason),
        number => ((number - 1) % u32::from(REASONS)) as u16 + 1,
    }
}

/// Names and colours of components, instances and reasons.
pub fn instance_ids() -> Vec<AnnotationInfo> {
    let empty = info(0, "", [0; 3]);
    let named = |id: u16| info(id, &id.to_string(), instance_colour(u32::from(id)));
    (1..=NAMED_IDS).map(named).chain([empty]).chain(reasons()).collect()
}

/// Names and colours of classes: things bright, the rest dull.
pub fn class_ids(taxonomy: &Taxonomy) -> Vec<AnnotationInfo> {
    let colour = |class: u16, is_thing: bool| {
        let bright = instance_colour(u32::from(class));
        if is_thing { bright } else { bright.map(|value| 40 + (value - value / 3) / 2) }
    };
    let mut infos: Vec<AnnotationInfo> = (0_u16..)
        .zip(taxonomy.classes())
        .map(|(id, class)| info(id, &class.name, colour(id, class.is_thing)))
        .collect();
    if let Some(none) = infos.first_mut() {
        none.color = Some(rgb(reason_colour(0)));
    }
    infos.extend(reasons());
    infos
}

fn reasons() -> impl Iterator<Item = AnnotationInfo> {
    let reasons = Reason::ALL.into_iter().skip(1);
    reasons.map(|reason| info(reason_id(reason), reason.describe(), reason_colour(reason as u8)))
}

fn info(id: u16, name: &str, colour: [u8; 3]) -> AnnotationInfo {
    AnnotationInfo::from((id, name, rgb(colour)))
}
