//! Two instances that may be one object.

use super::facts::{Facts, Member};
use super::{Kind, Suspect, ramp};
use crate::footprint::{convex_hull, distance, minimum_area_rectangle};

/// A pair of instances of one family, near each other.
struct Pair<'a> {
    /// The smaller and the larger.
    members: [&'a Member<'a>; 2],
    /// Metres between their outlines.
    gap: f64,
    /// Sides of the rectangle around both as shares of the usual size of the larger's class, the longer side
    /// first.
    fill: [f64; 2],
    /// Up to this far apart pieces of one touch, metres.
    touching: f64,
    /// From this far apart on, nothing is bridged, metres.
    bridged: f64,
}

/// Pairs of instances that would fit one object of their class, or nearly so, and pairs that all but touch.
pub(super) fn pairs(facts: &Facts) -> Vec<Suspect> {
    let mut suspects = Vec::new();
    let mut members: Vec<&Member> =
        facts.members.iter().filter(|member| member.size.is_some()).collect();
    let left = |member: &Member| member.hull.iter().map(|p| p[0]).fold(f64::INFINITY, f64::min);
    let right = |member: &Member| member.hull.iter().map(|p| p[0]).fold(f64::NEG_INFINITY, f64::max);
    members.sort_by(|a, b| left(a).total_cmp(&left(b)));
    let widest = members.iter().filter_map(|member| member.size).map(|size| facts.by_size.bridged_gap(size));
    let reach = widest.fold(0.0, f64::max);
    for (number, a) in members.iter().enumerate() {
        let beside = members[number + 1..].iter().take_while(|b| left(b) <= right(a) + reach);
        for b in beside.filter(|b| b.family == a.family) {
            if let Some(pair) = Pair::of(facts, a, b) {
                suspects.extend(pair.could_be_one(facts));
                suspects.extend(pair.almost_touching(facts));
            }
        }
    }
    suspects
}

impl<'a> Pair<'a> {
    /// What there is to say on two instances; none if they are too far apart to be one.
    fn of(facts: &Facts, a: &'a Member<'a>, b: &'a Member<'a>) -> Option<Self> {
        let is_larger = a.objects.len() > b.objects.len();
        let members = if is_larger { [b, a] } else { [a, b] };
        let usual = members[1].size?;
        let bridged = facts.by_size.bridged_gap(usual);
        let gap = distance(&a.hull, &b.hull);
        if gap >= bridged {
            return None;
        }
        let union = convex_hull(&[&a.hull[..], &b.hull].concat());
        let [length, width] = minimum_area_rectangle(&union)?.size;
        Some(Pair {
            members,
            gap,
            fill: [length / usual.length, width / usual.width],
            touching: facts.by_size.touching_gap(usual),
            bridged,
        })
    }

    fn titles(&self) -> [String; 2] {
        self.members.map(|member| member.instance.title())
    }

    /// Fires where the rectangle around both is less than 1.4 times as long and as wide as usual, full
    /// where it fits; the farther apart the less.
    fn could_be_one(&self, facts: &Facts) -> Option<Suspect> {
        let seen = super::between::between(facts, &self.members[0].objects, &self.members[1].objects);
        let balance = self.members[0].objects.len() as f64 / self.members[1].objects.len() as f64;
        const TOO_LARGE: f64 = 1.4;
        let fill = self.fill[0].max(self.fill[1]);
        let is_touching = self.gap <= self.touching;
        if !is_touching && self.members[0].class != self.members[1].class {
            return None;
        }
        let evidence = ramp(fill, TOO_LARGE, 1.0) * ramp(self.gap, self.bridged, self.touching);
        let [smaller, larger] = self.titles();
        (evidence > 0.0).then(|| Suspect {
            kind: Kind::CouldBeOne,
            evidence,
            score: 0.0,
            extra: vec![self.gap / self.members[1].size.unwrap().width, balance, seen.through, seen.hidden, seen.missing, self.fill[0], self.fill[1]],
            instances: self.members.iter().map(|member| member.instance.id).collect(),
            points: facts.facing(&self.members[0].objects, &self.members[1].objects),
            position: self.members[0].instance.bounds.centre,
            measured: fill,
            bound: facts.by_size.slack,
            unit: "of the usual size",
            sentence: format!(
                "{smaller} and {larger}, {:.2} m apart, would together be {:.2} times as long and {:.2} \
                 times as wide as their class usually is",
                self.gap, self.fill[0], self.fill[1]
            ),
        })
    }

    /// Fires where the outlines are nearer than twice the gap of touching; full where they meet.
    fn almost_touching(&self, facts: &Facts) -> Option<Suspect> {
        let evidence = ramp(self.gap, 2.0 * self.touching, 0.0);
        let [smaller, larger] = self.titles();
        (evidence > 0.0).then(|| Suspect {
            kind: Kind::AlmostTouching,
            evidence,
            score: 0.0,
            extra: vec![],
            instances: self.members.iter().map(|member| member.instance.id).collect(),
            points: facts.facing(&self.members[0].objects, &self.members[1].objects),
            position: self.members[0].instance.bounds.centre,
            measured: self.gap,
            bound: self.touching,
            unit: "m",
            sentence: format!(
                "{smaller} and {larger} are {:.2} m apart; pieces of one object of their class touch up to \
                 {:.2} m",
                self.gap, self.touching
            ),
        })
    }
}
