//! What the votes decided on two points.

use std::fmt::{self, Write};

use super::words::{condition, counted, pixel};
use crate::diagnose::explain::{
    BorderPair, Explanation, GroupFacts, Link, Place, PointFacts, Rule, VoteEvidence,
};

/// Writes the votes between the two points, with at most `max_pairs` pixel pairs of a border.
pub(super) fn write(
    out: &mut String,
    evidence: &VoteEvidence,
    explanation: &Explanation,
    max_pairs: usize,
) -> fmt::Result {
    let ratio = explanation.merge_ratio;
    match evidence {
        VoteEvidence::OneComponent { component } => {
            writeln!(out, "Both lie in component {component}: no merge was needed.")?;
        }
        VoteEvidence::Chain { links } => {
            let (first, last) = ends(links, &explanation.points);
            writeln!(out, "Merges between component {first} (A) and component {last} (B):")?;
            links_and_rule(out, links, ratio, max_pairs)?;
        }
        VoteEvidence::Failed { groups, links, weakest, .. } => {
            let path = path(groups);
            writeln!(out, "Votes on the best path from A's group to B's (groups {path}):")?;
            write_links(out, links, ratio, max_pairs)?;
            writeln!(out, "  Failed: {}.", failed_link(&links[*weakest], ratio))?;
            write_rule(out, ratio)?;
        }
        VoteEvidence::NoTrueCondition { border, groups, links, nearest, distance } => {
            nearest_pixels(out, *nearest, *distance)?;
            if border.is_empty() {
                path_over_borders(out, groups, links, ratio, max_pairs)?;
            } else {
                writeln!(out, "  Their border: {}.", summary(border))?;
                write_pairs(out, border, max_pairs)?;
            }
        }
        VoteEvidence::DifferentClasses { classes: [one, other], distance } => writeln!(
            out,
            "A is {one}, B is {other}: pixels of different classes are never neighbours, so there \
             are no votes between them. Their groups are at least {distance:.2} m apart."
        )?,
    }
    if explanation.pixels_change_hands {
        writeln!(
            out,
            "  Pixels can change their component during growth: the pairs are those of the final \
             components and may not add up to the votes."
        )?;
    }
    Ok(())
}

fn nearest_pixels(out: &mut String, [one, other]: [Place; 2], distance: f64) -> fmt::Result {
    let (one, other) = (pixel(one), pixel(other));
    writeln!(
        out,
        "The vote merge left their groups apart, {distance:.2} m at the nearest ({one} and \
         {other})."
    )
}

fn path_over_borders(
    out: &mut String,
    groups: &[GroupFacts],
    links: &[Link],
    ratio: f64,
    max_pairs: usize,
) -> fmt::Result {
    writeln!(out, "  They have no border: none of their pixels are neighbours.")?;
    if links.is_empty() {
        return Ok(());
    }
    writeln!(out, "  The shortest path over borders (groups {}):", path(groups))?;
    links_and_rule(out, links, ratio, max_pairs)
}

fn links_and_rule(out: &mut String, links: &[Link], ratio: f64, max_pairs: usize) -> fmt::Result {
    write_links(out, links, ratio, max_pairs)?;
    write_rule(out, ratio)
}

fn write_rule(out: &mut String, ratio: f64) -> fmt::Result {
    let percent = ratio * 100.0;
    writeln!(
        out,
        "  V+ and V- are the votes in favour and against, with inherited ones; each border pair \
         counts twice. A merge needs V+ above {percent} % of V+ and V-."
    )
}

/// Writes the links in order, with the pairs of the one with the least share in favour.
fn write_links(out: &mut String, links: &[Link], ratio: f64, max_pairs: usize) -> fmt::Result {
    let weakest = links.iter().map(Link::share).fold(f64::INFINITY, f64::min);
    let listed = links.iter().position(|link| link.share() == weakest);
    for (number, link) in links.iter().enumerate() {
        writeln!(out, "  {}. {}", number + 1, link_line(link, ratio))?;
        writeln!(out, "     {}", summary(&link.pairs))?;
        if listed == Some(number) {
            write_pairs(out, &link.pairs, max_pairs)?;
        }
    }
    Ok(())
}

fn write_pairs(out: &mut String, pairs: &[BorderPair], max_pairs: usize) -> fmt::Result {
    for pair in pairs.iter().take(max_pairs) {
        writeln!(out, "       {} and {}: {}", pixel(pair.a), pixel(pair.b), condition(pair))?;
    }
    if max_pairs > 0 && pairs.len() > max_pairs {
        writeln!(out, "       and {} clearer ones", pairs.len() - max_pairs)?;
    }
    Ok(())
}

/// The votes of a link that did not merge.
pub(super) fn failed_link(link: &Link, ratio: f64) -> String {
    let missing = match link.short_by(ratio) {
        Some(missing) => format!("{} in favour short", counted(missing as usize, "vote")),
        None => "which no number of votes would change".into(),
    };
    format!(
        "components {} and {} had V+ {} to V- {}, {missing}",
        link.target, link.query, link.positive, link.negative
    )
}

fn link_line(link: &Link, ratio: f64) -> String {
    let verb = if link.short_by(ratio) == Some(0) { "joined" } else { "did not join" };
    let inherited: Vec<String> = link
        .inherited
        .iter()
        .map(|donor| format!("{}:{} from {}", donor.positive, donor.negative, donor.component))
        .collect();
    let own = match inherited.is_empty() {
        true => String::new(),
        false => format!(
            "; V+:V- {}:{} on their own border, inherited {}",
            link.own_positive,
            link.own_negative,
            inherited.join(", ")
        ),
    };
    format!(
        "{} {verb} {}: V+ {}, V- {} ({:.0} % in favour{own})",
        link.query,
        link.target,
        link.positive,
        link.negative,
        link.share() * 100.0
    )
}

fn path(groups: &[GroupFacts]) -> String {
    let numbers: Vec<String> = groups.iter().map(|group| group.number.to_string()).collect();
    numbers.join(" - ")
}

fn ends(links: &[Link], points: &[PointFacts]) -> (u32, u32) {
    let label = |point: &PointFacts| point.component.map_or(0, |component| component.label);
    match points {
        [a, b] => (label(a), label(b)),
        _ => (links[0].target, links[0].query),
    }
}

/// How many pairs voted which way, and the range of the values that decided.
fn summary(pairs: &[BorderPair]) -> String {
    let sides = [(true, "in favour"), (false, "against")].map(|(holds, name)| {
        let side: Vec<&BorderPair> = pairs.iter().filter(|pair| pair.holds == holds).collect();
        (!side.is_empty()).then(|| side_summary(&side, name))
    });
    sides.into_iter().flatten().collect::<Vec<_>>().join("; ")
}

fn side_summary(side: &[&BorderPair], name: &str) -> String {
    let values = |value: fn(&BorderPair) -> Option<f64>| {
        let values = side.iter().filter_map(|pair| value(pair));
        values.fold(None, |span: Option<(f64, f64)>, value| {
            let (low, high) = span.unwrap_or((value, value));
            Some((low.min(value), high.max(value)))
        })
    };
    let mut line = format!("{} {name}", counted(side.len(), "pair"));
    if let Some(span) = values(|pair| (pair.rule == Rule::Angle).then_some(pair.beta_degrees)) {
        line += &format!(", beta {} degrees", between(span, 1));
    }
    let nearness = values(|pair| match pair.rule {
        Rule::Nearness { distance, .. } => Some(distance),
        _ => None,
    });
    if let Some(span) = nearness {
        line += &format!(", {} m apart on the plane", between(span, 2));
    }
    let by_distance = side.iter().filter(|pair| pair.rule == Rule::Gate).count();
    if by_distance > 0 {
        line += &format!(", {by_distance} decided by distance");
    }
    line
}

fn between((low, high): (f64, f64), digits: usize) -> String {
    let [from, to] = [low, high].map(|value| format!("{value:.digits$}"));
    if from == to { from } else { format!("{from} to {to}") }
}
