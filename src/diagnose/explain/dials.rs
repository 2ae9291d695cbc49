//! The numeric parameters that are changed to find what gives the other answer, and how each is
//! searched.

use serde_json::Value;

use divmerge_core::parameters::{Parameter, ParameterKind, ParameterSet, UNLIMITED, registry};

/// How a numeric parameter is searched: whole multiples of 1 / `per_unit`, angles in degrees.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Dial {
    /// Its name.
    pub name: &'static str,
    /// Its path among all parameters.
    pub path: &'static str,
    /// Its unit; empty for a bare number.
    pub unit: &'static str,
    /// Steps of a unit.
    pub per_unit: f64,
    /// The coarse scan, ascending.
    pub scan: Vec<f64>,
}

/// A parameter that people turn most, with a name and a finer scan than others have.
struct Known {
    name: &'static str,
    path: &'static str,
    unit: &'static str,
    per_unit: f64,
    scan: &'static [f64],
}

const MINIMUM_SIZE: Known = Known {
    name: "minimum size",
    path: "cluster.min_pixels",
    unit: "pixels",
    per_unit: 1.0,
    scan: &[0.0, 10.0, 30.0, 100.0, 300.0, 1000.0, 3000.0, 10000.0],
};

/// Those of the votes and of what follows them.
const KNOWN: [Known; 10] = [
    Known {
        name: "angle",
        path: "cluster.condition.angle",
        unit: "degrees",
        per_unit: 20.0,
        scan: &[
            0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0, 9.0, 10.0, 11.0, 12.0, 13.0, 14.0, 15.0,
            16.0, 18.0, 20.0, 22.0, 25.0, 30.0, 35.0, 40.0, 50.0, 60.0,
        ],
    },
    Known {
        name: "nearness",
        path: "cluster.condition.nearness.share_of_width",
        unit: "widths of the class",
        per_unit: 100.0,
        scan: &[0.05, 0.1, 0.15, 0.2, 0.25, 0.3, 0.35, 0.4, 0.45, 0.5, 0.6, 0.7, 0.8, 0.9, 1.0],
    },
    Known {
        name: "voxel",
        path: "cluster.voxel",
        unit: "m",
        per_unit: 100.0,
        scan: &[
            0.05, 0.1, 0.15, 0.2, 0.25, 0.3, 0.35, 0.4, 0.45, 0.5, 0.55, 0.6, 0.7, 0.8, 0.9, 1.0,
            1.2, 1.5, 2.0, 2.5, 3.0, 4.0, 5.0,
        ],
    },
    Known {
        name: "gap columns",
        path: "cluster.gap_columns",
        unit: "pixels",
        per_unit: 1.0,
        scan: &[
            1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0, 9.0, 10.0, 11.0, 12.0, 13.0, 14.0, 15.0, 16.0,
        ],
    },
    Known {
        name: "gap rows",
        path: "cluster.gap_rows",
        unit: "pixels",
        per_unit: 1.0,
        scan: &[1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0, 9.0, 10.0],
    },
    Known {
        name: "merge ratio",
        path: "cluster.merge_ratio",
        unit: "",
        per_unit: 100.0,
        scan: &[
            0.0, 0.05, 0.1, 0.15, 0.2, 0.25, 0.3, 0.35, 0.4, 0.45, 0.5, 0.55, 0.6, 0.65, 0.7, 0.75,
            0.8, 0.85, 0.9, 0.95,
        ],
    },
    Known {
        name: "touching gap",
        path: "cluster.fragments.touching",
        unit: "m",
        per_unit: 100.0,
        scan: &[0.05, 0.1, 0.15, 0.2, 0.25, 0.3, 0.4, 0.5, 0.6, 0.8, 1.0, 1.5, 2.0],
    },
    Known {
        name: "touching share",
        path: "cluster.fragments.touching_share",
        unit: "widths of the class",
        per_unit: 100.0,
        scan: &[0.02, 0.05, 0.08, 0.1, 0.12, 0.15, 0.2, 0.25, 0.3, 0.4, 0.5, 0.7, 1.0],
    },
    Known {
        name: "slack in size",
        path: "cluster.fragments.slack",
        unit: "",
        per_unit: 100.0,
        scan: &[0.6, 0.8, 0.9, 1.0, 1.1, 1.2, 1.3, 1.4, 1.5, 1.6, 1.8, 2.0, 2.5, 3.0],
    },
    MINIMUM_SIZE,
];

/// Those of a run that cuts a tree of merges.
const KNOWN_OF_TREE: [Known; 5] = [
    Known {
        name: "gap between things",
        path: "cluster.tree.gap",
        unit: "degrees",
        per_unit: 100.0,
        scan: &[0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9, 1.0, 1.2, 1.5, 2.0, 3.0, 5.0],
    },
    Known {
        name: "gap between things nearby",
        path: "cluster.tree.nearest_gap",
        unit: "m",
        per_unit: 100.0,
        scan: &[0.02, 0.04, 0.06, 0.08, 0.1, 0.12, 0.15, 0.2, 0.25, 0.3, 0.4, 0.5, 0.7, 1.0],
    },
    Known {
        name: "least score",
        path: "cluster.tree.least_score",
        unit: "",
        per_unit: 100.0,
        scan: &[0.0, 0.05, 0.1, 0.15, 0.2, 0.25, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9, 1.0],
    },
    Known {
        name: "gaps of the background",
        path: "cluster.tree.background",
        unit: "m",
        per_unit: 100.0,
        scan: &[0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9, 1.0, 1.2, 1.5, 2.0],
    },
    MINIMUM_SIZE,
];

/// The dials that have names, in the order of an explanation.
pub(super) fn known(is_cut: bool) -> Vec<Dial> {
    let known: &[Known] = if is_cut { &KNOWN_OF_TREE } else { &KNOWN };
    known.iter().map(Known::dial).collect()
}

impl Known {
    fn dial(&self) -> Dial {
        let &Known { name, path, unit, per_unit, scan } = self;
        Dial { name, path, unit, per_unit, scan: scan.to_vec() }
    }
}

/// The values of any other number, as multiples of its present one.
const MULTIPLES: [f64; 6] = [0.25, 0.5, 0.8, 1.25, 2.0, 4.0];
/// Steps of its greatest value that are told apart.
const STEPS: f64 = 1000.0;

impl Dial {
    /// The dial of any parameter that is a number; its path is its name.
    pub fn of(parameter: &'static Parameter, set: &ParameterSet) -> Option<Dial> {
        let (limits, is_whole) = match &parameter.kind {
            ParameterKind::Number { limits } => (limits, false),
            ParameterKind::Whole { limits } => (limits, true),
            _ => return None,
        };
        let path = parameter.path.as_str();
        let unit = match parameter.unit.as_deref() {
            Some("rad") => "degrees",
            unit => unit.unwrap_or_default(),
        };
        let mut dial = Dial { name: path, path, unit, per_unit: 1.0, scan: Vec::new() };
        let now = dial.read(set)?;
        let shown = |end: f64| if dial.is_angle() { end.to_degrees() } else { end };
        let ends = limits.slider.into_iter().flatten().map(shown);
        let values: Vec<f64> = MULTIPLES.iter().map(|times| times * now).chain(ends).collect();
        if !is_whole {
            let greatest = values.iter().copied().fold(now, f64::max).max(1e-6);
            dial.per_unit = 10_f64.powf((STEPS / greatest).log10().floor());
        }
        let rounded = values.iter().map(|value| (value * dial.per_unit).round() / dial.per_unit);
        let mut scan: Vec<f64> =
            rounded.filter(|&value| limits.contain(dial.in_own_unit(value))).collect();
        scan.sort_by(f64::total_cmp);
        scan.dedup();
        (!scan.is_empty()).then_some(Dial { scan, ..dial })
    }

    /// Its value; infinite where there is no limit, none where its part is off or it is left to the
    /// data.
    pub fn read(&self, set: &ParameterSet) -> Option<f64> {
        match set.get(self.path).ok()?? {
            Value::Number(number) if self.is_angle() => {
                Some((number.as_f64()?.to_degrees() * 1e6).round() / 1e6)
            }
            Value::Number(number) => number.as_f64(),
            Value::String(word) if word == UNLIMITED => Some(f64::INFINITY),
            _ => None,
        }
    }

    /// Sets it; whether that may be.
    pub fn set(&self, set: &mut ParameterSet, value: f64) -> bool {
        set.set(self.path, &Value::from(self.in_own_unit(value))).is_ok()
    }

    fn is_angle(&self) -> bool {
        self.unit == "degrees"
    }

    fn in_own_unit(&self, value: f64) -> f64 {
        if self.is_angle() { value.to_radians() } else { value }
    }
}

/// The parameters in force that have no name here, for which `is_wanted`.
pub(super) fn others(is_wanted: impl Fn(&str) -> bool) -> Vec<&'static Parameter> {
    let is_known = |path: &str| KNOWN.iter().chain(&KNOWN_OF_TREE).any(|known| known.path == path);
    let all = registry().iter();
    all.filter(|parameter| !is_known(&parameter.path) && is_wanted(&parameter.path)).collect()
}
