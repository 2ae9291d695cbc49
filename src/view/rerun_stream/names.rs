//! Names in a Rerun recording: entities, and class ids with their names and colours.

use rerun::{AnnotationInfo, EntityPath, EntityPathPart, Rgba32, components};

use crate::messages::palette::{instance_colour, reason_colour};
use crate::view::colour_tables::class_colours;
use crate::view::look;
use divmerge_core::cloud::Reason;
use divmerge_core::cloud::taxonomy::Taxonomy;

/// Name of the application that a recording and its layout are for.
pub const APPLICATION: &str = "divmerge";

/// This plus a reason's number stands for points without an instance.
const REASONS: u16 = 65_520;
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
        number => ((number - 1) % u32::from(REASONS - 1)) as u16 + 1,
    }
}

/// Names and colours of components, instances and reasons.
pub fn instance_ids() -> Vec<AnnotationInfo> {
    let empty = info(0, "", [0; 3]);
    let named = |id: u16| info(id, &id.to_string(), instance_colour(u32::from(id)));
    (1..=NAMED_IDS).map(named).chain([empty]).chain(reasons()).collect()
}

/// Names and colours of classes, those of figures; what is no thing is dull. Without classes, of
/// objects alone.
pub fn class_ids(taxonomy: Option<&Taxonomy>) -> Vec<AnnotationInfo> {
    let classes = taxonomy.map_or(&[][..], Taxonomy::classes);
    let dull = |class: u16| instance_colour(u32::from(class)).map(|value| 40 + value / 3);
    let named = (0_u16..).zip(classes.iter().zip(class_colours(classes))).skip(1);
    let mut infos: Vec<AnnotationInfo> = named
        .map(|(id, (class, colour))| info(id, &class.name, colour.unwrap_or_else(|| dull(id))))
        .collect();
    infos.push(info(0, "object", look::DARK.object));
    infos.extend(reasons());
    infos
}

/// Id of a true segment: class, and from the 17th bit its instance. Objects of one number and of
/// different classes have different colours; what has no instance is no object.
pub fn truth_id(segment: u32) -> u16 {
    /// Coprime to the number of colours.
    const CLASS_STEP: u32 = 61;
    let (class, instance) = (segment & 0xffff, segment >> 16);
    match instance {
        0 => reason_id(Reason::NotAnObject),
        instance => ((instance + CLASS_STEP * class) % u32::from(NAMED_IDS)) as u16 + 1,
    }
}

/// Colours of true objects. They have no names: a number is not the one of the truth.
pub fn truth_ids() -> Vec<AnnotationInfo> {
    let coloured = |id: u16| AnnotationInfo {
        id,
        label: None,
        color: Some(rgb(instance_colour(u32::from(id)))),
    };
    (1..=NAMED_IDS).map(coloured).chain(reasons()).collect()
}

/// Names and colours of reasons; a point with an instance has the colour of objects.
fn reasons() -> impl Iterator<Item = AnnotationInfo> {
    Reason::ALL.into_iter().map(|reason| {
        let colour = match reason {
            Reason::None => look::DARK.object,
            reason => reason_colour(reason as u8),
        };
        info(reason_id(reason), reason.describe(), colour)
    })
}

fn info(id: u16, name: &str, colour: [u8; 3]) -> AnnotationInfo {
    AnnotationInfo::from((id, name, rgb(colour)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ids_of_reasons_are_no_instances() {
        let ids: Vec<u16> = reasons().map(|reason| reason.id).collect();
        assert_eq!(ids.len(), Reason::ALL.len());
        for id in [1, 2, u32::from(REASONS), u32::from(REASONS) + 1, u32::MAX] {
            assert!(!ids.contains(&shown_id(id, Reason::None)), "{id}");
        }
        assert_eq!(shown_id(0, Reason::Scattered), *ids.last().unwrap());
    }

    #[test]
    fn true_objects_of_two_classes_differ() {
        let [car, person] = [10, 30].map(|class| truth_id(class | 7 << 16));
        assert_ne!(car, person);
        let last = truth_id(u32::MAX);
        assert!(truth_ids().iter().any(|info| info.id == last), "{last}");
        assert_eq!(truth_id(10), reason_id(Reason::NotAnObject));
    }

    #[test]
    fn classes_have_the_colours_of_figures() {
        let taxonomy = Taxonomy::semantic_kitti();
        let ids = class_ids(Some(&taxonomy));
        let colours = class_colours(taxonomy.classes());
        for (id, class) in (1_u16..).zip(&taxonomy.classes()[1..]) {
            let found = ids.iter().find(|info| info.id == id).expect("every class");
            assert_eq!(found.label.as_deref(), Some(class.name.as_str()));
            let thing = colours[usize::from(id)].map(rgb);
            assert!(thing.is_none() || found.color == thing, "{}", class.name);
        }
    }
}
