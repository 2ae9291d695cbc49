//! The numeric parameters that are changed to find what gives the other answer, and how each is
//! searched.

use divmerge_core::cluster::params::{ClusterParams, FragmentMerge, TreeMerge};

/// How a numeric parameter is searched: whole multiples of 1 / `per_unit`.
pub(super) struct Dial {
    /// Its name.
    pub parameter: &'static str,
    /// Its path among all parameters.
    pub path: &'static str,
    /// Its unit; empty for a bare number.
    pub unit: &'static str,
    /// Steps of a unit.
    pub per_unit: f64,
    /// The coarse scan, ascending.
    pub scan: &'static [f64],
    /// In its unit; none where the parameter is not in force.
    pub get: fn(&ClusterParams) -> Option<f64>,
    /// Sets it, in its unit.
    pub set: fn(&mut ClusterParams, f64),
}

const MINIMUM_SIZE: Dial = Dial {
    parameter: "minimum size",
    path: "cluster.min_pixels",
    unit: "pixels",
    per_unit: 1.0,
    scan: &[0.0, 10.0, 30.0, 100.0, 300.0, 1000.0, 3000.0, 10000.0],
    get: |params| Some(params.min_pixels as f64),
    set: |params, pixels| params.min_pixels = pixels as usize,
};

pub(super) const DIALS: [Dial; 10] = [
    Dial {
        parameter: "angle",
        path: "cluster.condition.angle",
        unit: "degrees",
        per_unit: 20.0,
        scan: &[
            0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0, 9.0, 10.0, 11.0, 12.0, 13.0, 14.0, 15.0,
            16.0, 18.0, 20.0, 22.0, 25.0, 30.0, 35.0, 40.0, 50.0, 60.0,
        ],
        get: |params| Some((params.condition.angle.to_degrees() * 1e6).round() / 1e6),
        set: |params, degrees| params.condition.angle = degrees.to_radians(),
    },
    Dial {
        parameter: "nearness",
        path: "cluster.condition.nearness.share_of_width",
        unit: "widths of the class",
        per_unit: 100.0,
        scan: &[0.05, 0.1, 0.15, 0.2, 0.25, 0.3, 0.35, 0.4, 0.45, 0.5, 0.6, 0.7, 0.8, 0.9, 1.0],
        get: |params| params.condition.nearness.map(|nearness| nearness.share_of_width),
        set: |params, share| {
            if let Some(nearness) = &mut params.condition.nearness {
                nearness.share_of_width = share;
            }
        },
    },
    Dial {
        parameter: "voxel",
        path: "cluster.voxel",
        unit: "m",
        per_unit: 100.0,
        scan: &[
            0.05, 0.1, 0.15, 0.2, 0.25, 0.3, 0.35, 0.4, 0.45, 0.5, 0.55, 0.6, 0.7, 0.8, 0.9, 1.0,
            1.2, 1.5, 2.0, 2.5, 3.0, 4.0, 5.0,
        ],
        get: |params| Some(params.voxel),
        set: |params, metres| params.voxel = metres,
    },
    Dial {
        parameter: "gap columns",
        path: "cluster.gap_columns",
        unit: "pixels",
        per_unit: 1.0,
        scan: &[
            1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0, 9.0, 10.0, 11.0, 12.0, 13.0, 14.0, 15.0, 16.0,
        ],
        get: |params| Some(params.gap_columns as f64),
        set: |params, pixels| params.gap_columns = pixels as usize,
    },
    Dial {
        parameter: "gap rows",
        path: "cluster.gap_rows",
        unit: "pixels",
        per_unit: 1.0,
        scan: &[1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0, 9.0, 10.0],
        get: |params| Some(params.gap_rows as f64),
        set: |params, pixels| params.gap_rows = pixels as usize,
    },
    Dial {
        parameter: "merge ratio",
        path: "cluster.merge_ratio",
        unit: "",
        per_unit: 100.0,
        scan: &[
            0.0, 0.05, 0.1, 0.15, 0.2, 0.25, 0.3, 0.35, 0.4, 0.45, 0.5, 0.55, 0.6, 0.65, 0.7, 0.75,
            0.8, 0.85, 0.9, 0.95,
        ],
        get: |params| Some(params.merge_ratio),
        set: |params, ratio| params.merge_ratio = ratio,
    },
    Dial {
        parameter: "touching gap",
        path: "cluster.fragments.touching",
        unit: "m",
        per_unit: 100.0,
        scan: &[0.05, 0.1, 0.15, 0.2, 0.25, 0.3, 0.4, 0.5, 0.6, 0.8, 1.0, 1.5, 2.0],
        get: |params| params.fragments.map(|fragments| fragments.touching),
        set: |params, metres| set_fragments(params, |fragments| fragments.touching = metres),
    },
    Dial {
        parameter: "touching share",
        path: "cluster.fragments.touching_share",
        unit: "widths of the class",
        per_unit: 100.0,
        scan: &[0.02, 0.05, 0.08, 0.1, 0.12, 0.15, 0.2, 0.25, 0.3, 0.4, 0.5, 0.7, 1.0],
        get: |params| params.fragments.map(|fragments| fragments.touching_share),
        set: |params, share| set_fragments(params, |fragments| fragments.touching_share = share),
    },
    Dial {
        parameter: "slack in size",
        path: "cluster.fragments.slack",
        unit: "",
        per_unit: 100.0,
        scan: &[0.6, 0.8, 0.9, 1.0, 1.1, 1.2, 1.3, 1.4, 1.5, 1.6, 1.8, 2.0, 2.5, 3.0],
        get: |params| params.fragments.map(|fragments| fragments.slack),
        set: |params, factor| set_fragments(params, |fragments| fragments.slack = factor),
    },
    MINIMUM_SIZE,
];

/// Those of a run that cuts a tree of merges; all others are not in force there.
pub(super) const TREE_DIALS: [Dial; 5] = [
    Dial {
        parameter: "gap between things",
        path: "cluster.tree.gap",
        unit: "degrees",
        per_unit: 100.0,
        scan: &[0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9, 1.0, 1.2, 1.5, 2.0, 3.0, 5.0],
        get: |params| params.tree.map(|tree| tree.gap.to_degrees()),
        set: |params, degrees| set_tree(params, |tree| tree.gap = degrees.to_radians()),
    },
    Dial {
        parameter: "gap between things nearby",
        path: "cluster.tree.nearest_gap",
        unit: "m",
        per_unit: 100.0,
        scan: &[0.02, 0.04, 0.06, 0.08, 0.1, 0.12, 0.15, 0.2, 0.25, 0.3, 0.4, 0.5, 0.7, 1.0],
        get: |params| params.tree.map(|tree| tree.nearest_gap),
        set: |params, metres| set_tree(params, |tree| tree.nearest_gap = metres),
    },
    Dial {
        parameter: "least score",
        path: "cluster.tree.least_score",
        unit: "",
        per_unit: 100.0,
        scan: &[0.0, 0.05, 0.1, 0.15, 0.2, 0.25, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9, 1.0],
        get: |params| params.tree.map(|tree| tree.least_score),
        set: |params, score| set_tree(params, |tree| tree.least_score = score),
    },
    Dial {
        parameter: "gaps of the background",
        path: "cluster.tree.background",
        unit: "m",
        per_unit: 100.0,
        scan: &[0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9, 1.0, 1.2, 1.5, 2.0],
        get: |params| params.tree.map(|tree| tree.background),
        set: |params, metres| set_tree(params, |tree| tree.background = metres),
    },
    MINIMUM_SIZE,
];

fn set_fragments(params: &mut ClusterParams, set: impl FnOnce(&mut FragmentMerge)) {
    if let Some(fragments) = &mut params.fragments {
        set(fragments);
    }
}

fn set_tree(params: &mut ClusterParams, set: impl FnOnce(&mut TreeMerge)) {
    if let Some(tree) = &mut params.tree {
        set(tree);
    }
}
