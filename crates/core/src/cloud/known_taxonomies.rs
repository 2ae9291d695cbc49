//! The taxonomies of the field's data sets, by name.

use std::collections::BTreeMap;
use std::sync::LazyLock;

use super::taxonomy::{Class, Taxonomy};

/// A class: its name, whether its objects are counted, and the raw ids folded into it, of which the
/// first stands for it.
type Row = (&'static str, bool, &'static [u16]);

static KNOWN: LazyLock<[Taxonomy; 5]> = LazyLock::new(|| {
    [
        Taxonomy::semantic_kitti(),
        of_table("nuscenes", &NUSCENES, &NUSCENES_VOID),
        of_table("waymo", &WAYMO, &[0]),
        of_table("carla", &CARLA, &[0]),
        of_table("carla-0.9.13", &CARLA_0_9_13, &[0]),
    ]
});

impl Taxonomy {
    /// SemanticKITTI's raw ids folded into its 19 classes of the single-scan benchmarks (class 1
    /// car ... class 19 traffic-sign; eight things).
    pub fn semantic_kitti() -> Self {
        of_table("semantic-kitti", &SEMANTIC_KITTI, &SEMANTIC_KITTI_VOID)
    }

    /// The taxonomies that have a name here: `semantic-kitti`; `nuscenes`, the raw ids of
    /// nuScenes-lidarseg folded into its 16 classes; `waymo`, the 3D segmentation of the Waymo Open
    /// Dataset; `carla`, the semantic tags of CARLA from 0.9.14 on, and `carla-0.9.13`, those of
    /// the releases before.
    pub fn known() -> &'static [Taxonomy] {
        &*KNOWN
    }

    /// The taxonomy of a name of [`known`](Self::known).
    pub fn named(name: &str) -> Option<&'static Taxonomy> {
        Self::known().iter().find(|taxonomy| taxonomy.name == name)
    }
}

fn of_table(name: &str, rows: &[Row], void: &[u16]) -> Taxonomy {
    let mut classes = vec![Class { name: "unlabeled".into(), is_thing: false, is_ignored: true }];
    let mut class_of: BTreeMap<u16, u16> = void.iter().map(|&id| (id, 0)).collect();
    for (number, &(name, is_thing, ids)) in (1..).zip(rows) {
        classes.push(Class { name: name.into(), is_thing, is_ignored: false });
        class_of.extend(ids.iter().map(|&id| (id, number)));
    }
    let first = (1..).zip(rows).map(|(number, (.., ids))| (number, ids[0]));
    Taxonomy::new(name, classes, class_of).with_ids(first)
}

/// Unlabelled, outlier, other structure, other object.
const SEMANTIC_KITTI_VOID: [u16; 4] = [0, 1, 52, 99];

const SEMANTIC_KITTI: [Row; 19] = [
    ("car", true, &[10, 252]),
    ("bicycle", true, &[11]),
    ("motorcycle", true, &[15]),
    ("truck", true, &[18, 258]),
    ("other-vehicle", true, &[20, 13, 16, 256, 257, 259]),
    ("person", true, &[30, 254]),
    ("bicyclist", true, &[31, 253]),
    ("motorcyclist", true, &[32, 255]),
    ("road", false, &[40, 60]),
    ("parking", false, &[44]),
    ("sidewalk", false, &[48]),
    ("other-ground", false, &[49]),
    ("building", false, &[50]),
    ("fence", false, &[51]),
    ("vegetation", false, &[70]),
    ("trunk", false, &[71]),
    ("terrain", false, &[72]),
    ("pole", false, &[80]),
    ("traffic-sign", false, &[81]),
];

/// Those that the challenge of nuScenes-lidarseg leaves out: noise, animals, personal mobility,
/// strollers, wheelchairs, debris, things pushed, bicycle racks, ambulances, police cars, other
/// static things, the ego vehicle.
const NUSCENES_VOID: [u16; 12] = [0, 1, 5, 7, 8, 10, 11, 13, 19, 20, 29, 31];

const NUSCENES: [Row; 16] = [
    ("barrier", true, &[9]),
    ("bicycle", true, &[14]),
    ("bus", true, &[15, 16]),
    ("car", true, &[17]),
    ("construction_vehicle", true, &[18]),
    ("motorcycle", true, &[21]),
    ("pedestrian", true, &[2, 3, 4, 6]),
    ("traffic_cone", true, &[12]),
    ("trailer", true, &[22]),
    ("truck", true, &[23]),
    ("driveable_surface", false, &[24]),
    ("other_flat", false, &[25]),
    ("sidewalk", false, &[26]),
    ("terrain", false, &[27]),
    ("manmade", false, &[28]),
    ("vegetation", false, &[30]),
];

const WAYMO: [Row; 22] = [
    ("car", true, &[1]),
    ("truck", true, &[2]),
    ("bus", true, &[3]),
    ("other_vehicle", true, &[4]),
    ("motorcyclist", true, &[5]),
    ("bicyclist", true, &[6]),
    ("pedestrian", true, &[7]),
    ("sign", false, &[8]),
    ("traffic_light", false, &[9]),
    ("pole", false, &[10]),
    ("construction_cone", false, &[11]),
    ("bicycle", true, &[12]),
    ("motorcycle", true, &[13]),
    ("building", false, &[14]),
    ("vegetation", false, &[15]),
    ("tree_trunk", false, &[16]),
    ("curb", false, &[17]),
    ("road", false, &[18]),
    ("lane_marker", false, &[19]),
    ("other_ground", false, &[20]),
    ("walkable", false, &[21]),
    ("sidewalk", false, &[22]),
];

const CARLA: [Row; 28] = [
    ("road", false, &[1]),
    ("sidewalk", false, &[2]),
    ("building", false, &[3]),
    ("wall", false, &[4]),
    ("fence", false, &[5]),
    ("pole", false, &[6]),
    ("traffic_light", false, &[7]),
    ("traffic_sign", false, &[8]),
    ("vegetation", false, &[9]),
    ("terrain", false, &[10]),
    ("sky", false, &[11]),
    ("pedestrian", true, &[12]),
    ("rider", true, &[13]),
    ("car", true, &[14]),
    ("truck", true, &[15]),
    ("bus", true, &[16]),
    ("train", true, &[17]),
    ("motorcycle", true, &[18]),
    ("bicycle", true, &[19]),
    ("static", false, &[20]),
    ("dynamic", false, &[21]),
    ("other", false, &[22]),
    ("water", false, &[23]),
    ("road_line", false, &[24]),
    ("ground", false, &[25]),
    ("bridge", false, &[26]),
    ("rail_track", false, &[27]),
    ("guard_rail", false, &[28]),
];

const CARLA_0_9_13: [Row; 22] = [
    ("building", false, &[1]),
    ("fence", false, &[2]),
    ("other", false, &[3]),
    ("pedestrian", true, &[4]),
    ("pole", false, &[5]),
    ("road_line", false, &[6]),
    ("road", false, &[7]),
    ("sidewalk", false, &[8]),
    ("vegetation", false, &[9]),
    ("vehicle", true, &[10]),
    ("wall", false, &[11]),
    ("traffic_sign", false, &[12]),
    ("sky", false, &[13]),
    ("ground", false, &[14]),
    ("bridge", false, &[15]),
    ("rail_track", false, &[16]),
    ("guard_rail", false, &[17]),
    ("traffic_light", false, &[18]),
    ("static", false, &[19]),
    ("dynamic", false, &[20]),
    ("water", false, &[21]),
    ("terrain", false, &[22]),
];

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn known_taxonomies_have_their_ids_things_and_ground() {
        let expected = [
            ("semantic-kitti", 34, 8, "car", 10),
            ("nuscenes", 32, 10, "car", 17),
            ("waymo", 23, 9, "car", 1),
            ("carla", 29, 8, "car", 14),
            ("carla-0.9.13", 23, 2, "vehicle", 10),
        ];
        assert_eq!(Taxonomy::known().len(), expected.len());
        for (name, ids, things, class, id) in expected {
            let taxonomy = Taxonomy::named(name).unwrap();
            assert_eq!(taxonomy.known_ids().count(), ids, "{name}");
            let classes = taxonomy.classes();
            assert_eq!(classes.iter().filter(|class| class.is_thing).count(), things, "{name}");
            assert!(classes.iter().any(Class::is_ground), "{name}");
            assert_eq!(taxonomy.class_of(id), taxonomy.class_named(class), "{name}");
            assert!(
                classes.iter().all(|class| !class.is_thing || class.size().is_some()),
                "{name}"
            );
        }
        assert_eq!(Taxonomy::named("cityscapes"), None);
    }
}
