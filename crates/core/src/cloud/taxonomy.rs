//! What the ids in a semantic field mean: which are things, which are one class, what they are
//! called.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

use super::coarse_class::Body;

/// A class that ids are folded into before anything compares them ("moving car" is "car").
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Class {
    /// Name as the taxonomy gives it.
    pub name: String,
    /// Whether its objects can be counted; only these are cut into instances.
    pub is_thing: bool,
    /// Whether evaluation leaves its points out.
    pub is_ignored: bool,
}

/// Usual size of a class's objects on the bird's-eye plane.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct ClassSize {
    /// Length in metres.
    pub length: f64,
    /// Width in metres.
    pub width: f64,
}

impl Class {
    /// Usual size of the class's objects, by its name; `None` for names that are not known.
    ///
    /// Sources: mean box sizes of nuScenes (Caesar et al. 2020) as published with its detection
    /// baselines, for vehicles, bicycles, motorcycles, people, barriers and cones; a rider reaches
    /// no farther than the machine. SemanticKITTI's other-vehicle holds buses, trailers and trains:
    /// nuScenes' bus.
    pub fn size(&self) -> Option<ClassSize> {
        let name = normalised(&self.name);
        let found = SIZES.iter().find(|(names, ..)| names.contains(&name.as_str()));
        found.map(|&(_, length, width)| ClassSize { length, width })
    }

    /// Whether classes of that name are movable objects in the data sets of the field.
    pub fn is_thing_name(name: &str) -> bool {
        THING_NAMES.contains(&normalised(name).as_str())
    }

    /// Whether the class is ground, by its name: what no clustering is asked for.
    pub fn is_ground(&self) -> bool {
        let name = normalised(&self.name);
        self.name.starts_with("flat.") || GROUND_NAMES.contains(&name.as_str())
    }
}

/// Names under which SemanticKITTI, nuScenes, Waymo and CARLA keep the ground.
const GROUND_NAMES: &[&str] = &[
    "road",
    "lane-marking",
    "lane-marker",
    "road-line",
    "driveable-surface",
    "parking",
    "sidewalk",
    "walkable",
    "curb",
    "other-ground",
    "other-flat",
    "ground",
    "terrain",
];

/// Names of classes that are easily taken for each other, so that one object may carry several of
/// them.
const FAMILIES: &[&[&str]] = &[
    &[
        "car",
        "van",
        "vehicle",
        "truck",
        "bus",
        "train",
        "other-vehicle",
        "trailer",
        "construction-vehicle",
    ],
    &["bicycle", "bicyclist", "cyclist"],
    &["motorcycle", "motorcyclist", "rider"],
    &["person", "people", "pedestrian"],
];

/// The body of the objects of a class, by its name; `None` for names that are not known.
pub fn body_of_class(name: &str) -> Option<Body> {
    let name = normalised(name);
    let (_, length, _) = SIZES.iter().find(|(names, ..)| names.contains(&name.as_str()))?;
    match name.as_str() {
        "barrier" | "traffic-cone" => None,
        _ if *length < 1.0 => Some(Body::Person),
        _ if *length < 3.0 => Some(Body::TwoWheeler),
        _ if *length < 5.0 => Some(Body::Car),
        _ => Some(Body::LargeVehicle),
    }
}

/// Names of classes that look alike without being of one family: they are cut apart, but a piece of
/// one that lies where an object of the other would reach is part of it.
const LOOKALIKES: &[&[&str]] = &[
    &["person", "people", "pedestrian", "bicyclist", "cyclist"],
    &["bicycle", "motorcycle"],
    &["bicyclist", "cyclist", "motorcyclist", "rider"],
];

/// Names, mean length and width in metres.
const SIZES: &[(&[&str], f64, f64)] = &[
    (&["car", "vehicle"], 4.63, 1.97),
    (&["truck"], 6.93, 2.51),
    (&["bus", "other-vehicle", "train"], 10.5, 2.94),
    (&["trailer"], 12.29, 2.90),
    (&["construction-vehicle"], 6.37, 2.85),
    (&["bicycle", "bicyclist", "cyclist"], 1.70, 0.60),
    (&["motorcycle", "motorcyclist", "rider"], 2.11, 0.77),
    (&["person", "people", "pedestrian"], 0.73, 0.67),
    (&["barrier"], 0.50, 2.53),
    (&["traffic-cone"], 0.41, 0.41),
];

/// Raw ids to classes. Class 0 is always "no class": unlabelled, an outlier, or an id that the
/// taxonomy does not know.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Taxonomy {
    /// Name for the run's own record, such as `semantic-kitti` or a file name.
    pub name: String,
    classes: Vec<Class>,
    class_of: BTreeMap<u16, u16>,
    /// Whether no class is easily taken for another.
    is_strict: bool,
}

impl Taxonomy {
    /// The same with every class a family of its own that looks like no other: no object carries
    /// several.
    pub fn without_families(self) -> Self {
        Taxonomy { is_strict: true, ..self }
    }

    /// A taxonomy of given classes, by number, and of the raw ids folded into them.
    pub fn new(name: &str, classes: Vec<Class>, class_of: BTreeMap<u16, u16>) -> Self {
        Taxonomy { name: name.to_owned(), classes, class_of, is_strict: false }
    }

    /// The classes; the index is the class number, 0 is "no class".
    pub fn classes(&self) -> &[Class] {
        &self.classes
    }

    /// The class number that a raw id is folded into, or `None` for an id the taxonomy does not
    /// know.
    pub fn class_of(&self, raw: u16) -> Option<u16> {
        self.class_of.get(&raw).copied()
    }

    /// Class number for every possible raw id (65,536 entries; unknown ids are 0).
    pub fn lookup(&self) -> Vec<u16> {
        let mut table = vec![0; 1 << 16];
        for (raw, class) in self.known_ids() {
            table[usize::from(raw)] = class;
        }
        table
    }

    /// Class numbers of raw ids; 0, "no class", for those that the taxonomy does not know.
    pub fn class_numbers(&self, raw: &[u16]) -> Vec<u16> {
        let class_of = self.lookup();
        raw.iter().map(|&id| class_of[usize::from(id)]).collect()
    }

    /// Class numbers of raw ids.
    ///
    /// # Errors
    /// The first id that the taxonomy does not know.
    pub fn known_class_numbers(&self, raw: &[u16]) -> std::result::Result<Vec<u16>, u16> {
        let mut class_of = vec![None; 1 << 16];
        for (id, class) in self.known_ids() {
            class_of[usize::from(id)] = Some(class);
        }
        raw.iter().map(|&id| class_of[usize::from(id)].ok_or(id)).collect()
    }

    /// By class number: the lowest number among the classes that it is easily taken for (vehicles
    /// of all kinds, a bicycle and its rider, a motorcycle and its rider); its own number if there
    /// are none.
    pub fn families(&self) -> Vec<u16> {
        let family = |class: &Class| {
            let name = normalised(&class.name);
            let named = FAMILIES.iter().position(|names| names.contains(&name.as_str()));
            named.filter(|_| !self.is_strict)
        };
        let families: Vec<Option<usize>> = self.classes.iter().map(family).collect();
        let first = |(class, family): (usize, &Option<usize>)| match family {
            None => class as u16,
            Some(_) => families.iter().position(|other| other == family).unwrap_or(class) as u16,
        };
        families.iter().enumerate().map(first).collect()
    }

    /// By class number: bit k is set for the classes of the k-th group that look alike (a person
    /// and a rider, a bicycle and a motorcycle, the riders of both).
    pub fn lookalikes(&self) -> Vec<u8> {
        let groups = |class: &Class| {
            let name = normalised(&class.name);
            let bits = LOOKALIKES.iter().enumerate().filter(|_| !self.is_strict);
            bits.fold(0, |bits, (bit, names)| {
                bits | u8::from(names.contains(&name.as_str())) << bit
            })
        };
        self.classes.iter().map(groups).collect()
    }

    /// The raw ids that the taxonomy knows, ascending, each with its class number.
    pub fn known_ids(&self) -> impl DoubleEndedIterator<Item = (u16, u16)> {
        self.class_of.iter().map(|(&raw, &class)| (raw, class))
    }

    /// Number of the class of that name.
    pub fn class_named(&self, name: &str) -> Option<u16> {
        let position = self.classes.iter().position(|class| class.name == name);
        position.map(|class| class as u16)
    }

    /// Number of the class that a name in other data means: upper and lower case, `_`, `-` and
    /// spaces are alike, and of `vehicle.car` the last part counts. `None` for a name that no class
    /// but "no class" has.
    pub fn class_called(&self, name: &str) -> Option<u16> {
        let name = normalised(name);
        let mut named = self.classes.iter().skip(1);
        named.position(|class| normalised(&class.name) == name).map(|before| before as u16 + 1)
    }
}

/// SemanticKITTI's.
impl Default for Taxonomy {
    fn default() -> Self {
        Self::semantic_kitti()
    }
}

fn normalised(name: &str) -> String {
    let last = name.rsplit('.').next().unwrap_or(name);
    last.to_lowercase().replace(['_', ' '], "-")
}

/// Names under which SemanticKITTI, nuScenes, SemanticPOSS and Waymo keep their movable objects.
const THING_NAMES: &[&str] = &[
    "car",
    "bicycle",
    "motorcycle",
    "truck",
    "bus",
    "trailer",
    "construction-vehicle",
    "other-vehicle",
    "person",
    "people",
    "pedestrian",
    "bicyclist",
    "cyclist",
    "motorcyclist",
    "rider",
];

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn semantic_kitti_folds_moving_classes() {
        let taxonomy = Taxonomy::semantic_kitti();
        assert_eq!(taxonomy.classes().len(), 20);
        assert_eq!(taxonomy.class_of(252), taxonomy.class_of(10));
        assert_eq!(taxonomy.class_of(254), taxonomy.class_named("person"));
        assert_eq!(taxonomy.class_of(1), Some(0));
        assert_eq!(taxonomy.class_of(7), None);
        assert_eq!(taxonomy.classes().iter().filter(|c| c.is_thing).count(), 8);
    }

    #[test]
    fn names_in_other_data() {
        let taxonomy = Taxonomy::semantic_kitti();
        assert_eq!(taxonomy.class_called("Car"), taxonomy.class_named("car"));
        assert_eq!(taxonomy.class_called("OTHER_VEHICLE"), taxonomy.class_named("other-vehicle"));
        assert_eq!(taxonomy.class_called("vehicle.truck"), taxonomy.class_named("truck"));
        assert_eq!(taxonomy.class_called("unlabeled"), None);
        assert_eq!(taxonomy.class_called(""), None);
    }

    #[test]
    fn families_of_classes_that_are_taken_for_each_other() {
        let taxonomy = Taxonomy::semantic_kitti();
        let families = taxonomy.families();
        let family = |name: &str| families[usize::from(taxonomy.class_named(name).unwrap())];
        assert_eq!(family("car"), family("other-vehicle"));
        assert_eq!(family("bicycle"), family("bicyclist"));
        assert_ne!(family("bicycle"), family("motorcycle"));
        assert_ne!(family("person"), family("bicyclist"));
        assert_eq!(family("road"), taxonomy.class_named("road").unwrap());
        let bits = taxonomy.lookalikes();
        let bits = |name: &str| bits[usize::from(taxonomy.class_named(name).unwrap())];
        assert!(
            bits("person") & bits("bicyclist") != 0 && bits("bicycle") & bits("motorcycle") != 0
        );
        assert_eq!((bits("person") & bits("bicycle"), bits("car"), bits("road")), (0, 0, 0));
        let own: Vec<u16> = (0..taxonomy.classes().len() as u16).collect();
        assert_eq!(taxonomy.clone().without_families().families(), own);
    }
}
