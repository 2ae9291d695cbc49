//! Two instances that may be one object.

use super::facts::{FrameFacts, InstanceFacts};
use super::suspect::{Suspect, SuspectKind, ramp};
use divmerge_core::geometry::footprint::{convex_hull, distance, minimum_area_rectangle};

/// A pair of instances of one family near each other.
struct Pair<'a> {
    /// The smaller and the larger.
    members: [&'a InstanceFacts<'a>; 2],
    /// Metres between their outlines.
    gap: f64,
    /// Sides of the rectangle around both in relation to the usual size of the larger's class, the
    /// longer side first.
    fill: [f64; 2],
    /// Pieces of one object touch up to this distance, metres.
    touching: f64,
    /// Gaps from this distance on are not bridged, metres.
    bridged: f64,
}

/// Pairs of instances that would fit one object of their class, or nearly, and pairs that almost
/// touch.
pub(super) fn pairs(facts: &FrameFacts) -> Vec<Suspect> {
    let mut suspects = Vec::new();
    let reach = facts.members.iter().map(|member| reach(facts, member)).fold(0.0, f64::max);
    let mut members: Vec<([f64; 2], &InstanceFacts)> = facts.members.iter().map(across).collect();
    members.sort_by(|a, b| a.0[0].total_cmp(&b.0[0]));
    for (number, ([_, right], a)) in members.iter().enumerate() {
        let beside = members[number + 1..].iter().take_while(|b| b.0[0] <= right + reach);
        for (_, b) in beside.filter(|(_, b)| b.family == a.family) {
            if let Some(pair) = Pair::of(facts, a, b) {
                suspects.extend(pair.could_be_one(facts));
                suspects.extend(pair.almost_touching(facts));
            }
        }
    }
    suspects
}

/// Distance from an instance within which others are compared with it, metres.
fn reach(facts: &FrameFacts, member: &InstanceFacts) -> f64 {
    match member.size {
        Some(usual) => facts.by_size.bridged_gap(usual),
        None => 2.0 * facts.by_size.touching,
    }
}

/// Least and greatest x of an instance.
fn across<'a, 'b>(member: &'a InstanceFacts<'b>) -> ([f64; 2], &'a InstanceFacts<'b>) {
    let x = member.hull.iter().map(|corner| corner[0]);
    let ends = x.fold([f64::INFINITY, f64::NEG_INFINITY], |[l, h], x| [l.min(x), h.max(x)]);
    (ends, member)
}

impl<'a> Pair<'a> {
    /// The pair of two instances; none if they are too far apart to be one object. Without a usual
    /// size nothing fits, and an instance within the outline of another is not its neighbour.
    fn of(facts: &FrameFacts, a: &'a InstanceFacts<'a>, b: &'a InstanceFacts<'a>) -> Option<Self> {
        let is_larger = a.objects.len() > b.objects.len();
        let members = if is_larger { [b, a] } else { [a, b] };
        let bridged = reach(facts, members[1]);
        let gap = distance(&a.hull, &b.hull);
        if gap >= bridged || (members[1].size.is_none() && gap == 0.0) {
            return None;
        }
        let union = || convex_hull(&[&a.hull[..], &b.hull].concat());
        let (fill, touching) = match members[1].size {
            None => ([f64::INFINITY; 2], facts.by_size.touching),
            Some(usual) => {
                let [length, width] = minimum_area_rectangle(&union())?.size;
                let fill = [length / usual.length, width / usual.width];
                (fill, facts.by_size.touching_gap(usual))
            }
        };
        Some(Pair { members, gap, fill, touching, bridged })
    }

    fn suspect(&self, facts: &FrameFacts, kind: SuspectKind, evidence: f64) -> Suspect {
        let [one, other] = self.members.map(|member| &member.objects);
        Suspect {
            points: facts.facing(one, other),
            ..facts.suspect_pair(kind, evidence, self.members)
        }
    }

    fn titles(&self) -> [String; 2] {
        self.members.map(|member| member.instance.title())
    }

    /// Two of one class, or of one family if they touch. Fires if the rectangle around both is less
    /// than 1.4 times as long and as wide as usual; full if it fits; less the farther they are
    /// apart. The evidence is squared because near misses are many: objects of one class park and
    /// walk side by side.
    fn could_be_one(&self, facts: &FrameFacts) -> Option<Suspect> {
        const TOO_LARGE: f64 = 1.4;
        let fill = self.fill[0].max(self.fill[1]);
        let classes_differ = self.members[0].class != self.members[1].class;
        if self.gap > self.touching && classes_differ {
            return None;
        }
        let evidence = ramp(fill, TOO_LARGE, 1.0) * ramp(self.gap, self.bridged, self.touching);
        let [smaller, larger] = self.titles();
        (evidence > 0.0).then(|| Suspect {
            measured: fill,
            bound: facts.by_size.slack,
            unit: "of the usual size",
            sentence: format!(
                "{smaller} and {larger}, {:.2} m apart, would together be {:.2} times as long and \
                 {:.2} times as wide as their class usually is",
                self.gap, self.fill[0], self.fill[1]
            ),
            ..self.suspect(facts, SuspectKind::CouldBeOne, evidence.powi(2))
        })
    }

    /// Fires if the outlines are nearer than twice the distance of touching; full if they meet.
    fn almost_touching(&self, facts: &FrameFacts) -> Option<Suspect> {
        let evidence = ramp(self.gap, 2.0 * self.touching, 0.0);
        let [smaller, larger] = self.titles();
        (evidence > 0.0).then(|| Suspect {
            measured: self.gap,
            bound: self.touching,
            unit: "m",
            sentence: format!(
                "{smaller} and {larger} are {:.2} m apart; pieces of one object touch up to \
                 {:.2} m",
                self.gap, self.touching
            ),
            ..self.suspect(facts, SuspectKind::AlmostTouching, evidence)
        })
    }
}
