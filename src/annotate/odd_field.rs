//! A field of classes that `auto` does not take for what it seems to be.

use divmerge_core::semantics::evidence::{Doubt, DoubtReason};

/// A field of classes whose ids are not those of the taxonomy that `auto` assumes.
#[derive(Debug, Clone, PartialEq)]
pub struct OddField {
    /// Its name.
    pub name: String,
    /// What is wrong with it; `None` where a known taxonomy is believed in place of the assumed
    /// one.
    pub doubt: Option<Doubt>,
    /// The taxonomy that is believed, else the one that was assumed.
    pub taxonomy: String,
}

impl OddField {
    /// A word for the kind of what is wrong.
    pub(super) fn kind(&self) -> &'static str {
        match self.doubt {
            None => "with classes of another taxonomy",
            Some(_) => "with classes that are not believed",
        }
    }

    /// What is wrong, and what to do.
    pub fn describe(&self) -> String {
        let OddField { name, taxonomy, .. } = self;
        match &self.doubt {
            None => format!(
                "the ids in `{name}` agree with `{taxonomy}` alone and are read as its classes: \
                 `--taxonomy {taxonomy}` says so without this warning, another `--taxonomy` or \
                 `--semantics ground` otherwise"
            ),
            Some(doubt) => format!(
                "the ids in `{name}` are not believed: {}; they are {}{}. Objects are what is not \
                 ground. `--taxonomy NAME or FILE` says what the ids mean, `--semantics \
                 field:{name}` takes them as they are, `--semantics ground` leaves them out",
                reason(&doubt.reason, taxonomy),
                ids(doubt),
                candidates(&doubt.candidates),
            ),
        }
    }
}

fn reason(reason: &DoubtReason, taxonomy: &str) -> String {
    match reason {
        DoubtReason::Nothing => format!("no return has a class of `{taxonomy}`"),
        DoubtReason::Unknown { unknown, returns } => {
            format!("{unknown} of {returns} returns have ids without a class in `{taxonomy}`")
        }
        DoubtReason::UnknownObjects { unknown, named } => format!(
            "{unknown} returns have ids without a class in `{taxonomy}`, and only {named} a class \
             that is no ground"
        ),
        DoubtReason::FlatThing { class, returns, on_ground } => format!(
            "of the {returns} returns that are `{class}` in `{taxonomy}`, {on_ground} lie on the \
             ground"
        ),
        DoubtReason::OtherGround { ground, agreeing } => format!(
            "of the {ground} returns on the ground, only {agreeing} are ground in `{taxonomy}`"
        ),
    }
}

/// The ids with their numbers of returns. A negative id of 16 bits or fewer is said as it is.
fn ids(doubt: &Doubt) -> String {
    const NEGATIVE: u16 = 0xFF00;
    let one = |&(id, returns): &(u16, usize)| match id {
        NEGATIVE.. => format!("{} ({returns} returns)", id.cast_signed()),
        _ => format!("{id} ({returns} returns)"),
    };
    doubt.ids.iter().map(one).collect::<Vec<_>>().join(", ")
}

fn candidates(names: &[&str]) -> String {
    match names {
        [] => String::new(),
        names => format!(" and agree with several taxonomies ({})", names.join(", ")),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn remarks_name_ids_and_options() {
        let doubt = Doubt {
            reason: DoubtReason::Unknown { unknown: 90, returns: 100 },
            ids: vec![(u16::MAX, 90), (10, 10)],
            candidates: vec!["waymo", "carla"],
        };
        let odd = OddField {
            name: "label".into(),
            doubt: Some(doubt),
            taxonomy: "semantic-kitti".into(),
        };
        let problem = odd.describe();
        for part in
            ["90 of 100", "-1 (90 returns), 10 (10", "(waymo, carla)", "--taxonomy", "field:label"]
        {
            assert!(problem.contains(part), "{part}: {problem}");
        }
        let problem = OddField { doubt: None, ..odd }.describe();
        assert!(problem.contains("--taxonomy semantic-kitti"), "{problem}");
    }
}
