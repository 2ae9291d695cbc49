//! An explanation in words, for the terminal and for the pages of a report.

use std::path::PathBuf;

use divmerge::cluster::{Evidence, Join};
use divmerge::explain::{
    Answer, BorderPair, Choice, DecidedBy, Explanation, Flip, GroupFacts, Link, Number, Place,
    PointFacts, PostMergeStage, Rule, SizeTest, VoteEvidence, WhatIf,
};
use divmerge::instances::Reason;
use serde::Serialize;

/// Adds a line.
macro_rules! say {
    ($out:expr) => {
        $out.push('\n')
    };
    ($out:expr, $($words:tt)*) => {{
        $out.push_str(&format!($($words)*));
        $out.push('\n');
    }};
}

/// Everything that is printed as JSON.
#[derive(Serialize)]
pub struct Report {
    pub file: PathBuf,
    pub topic: String,
    pub frame: u64,
    pub log_time_ns: u64,
    pub preset: &'static str,
    pub semantics: String,
    pub instances: usize,
    /// Distance of each point from where it was asked for, metres.
    pub away: Vec<f64>,
    #[serde(flatten)]
    pub explanation: Explanation,
    /// Each pair of border pixels counts twice in V+ and V-.
    pub votes_per_border_pair: u8,
    pub what_if: Option<Vec<WhatIf>>,
}

const NAMES: [&str; 2] = ["A", "B"];

/// The report for people.
pub struct Text<'a> {
    /// What is told.
    pub report: &'a Report,
    /// Most pairs of pixels to list.
    pub pairs: usize,
}

impl Text<'_> {
    /// All of it, line by line.
    pub fn text(&self) -> String {
        let mut lines = String::new();
        let out = &mut lines;
        let Report { explanation, .. } = self.report;
        say!(out, "{}", self.headline());
        say!(out);
        self.frame(out);
        for (number, point) in explanation.points.iter().enumerate() {
            self.point(out, number, point);
        }
        if let Some(votes) = &explanation.votes {
            say!(out);
            self.votes(out, votes);
        }
        for stage in &explanation.post_merge {
            say!(out);
            post_merge(out, stage);
        }
        if let Some(what_if) = &self.report.what_if {
            say!(out);
            self.what_if(out, what_if);
        }
        lines
    }

    /// The answer in one sentence.
    pub fn headline(&self) -> String {
        let Explanation { answer, points, decided_by, votes, merge_ratio, .. } =
            &self.report.explanation;
        let own: Vec<String> = points.iter().map(of_instance).collect();
        match answer {
            Answer::HasInstance | Answer::NoInstance => format!("The point has {}.", own[0]),
            Answer::OneInstance => {
                let why = match decided_by {
                    DecidedBy::OneComponent => "one seed's growth reached both".to_owned(),
                    DecidedBy::VotesInFavour => {
                        format!("the votes joined them ({})", joined(votes))
                    }
                    _ => format!("the votes left them apart, {} joined them", self.last_stage()),
                };
                format!("Yes, A and B are one: {}. Why: {why}.", own[0])
            }
            Answer::Apart => {
                let why = match (decided_by, votes) {
                    (DecidedBy::NoInstance, _) => {
                        let without = points.iter().zip(NAMES);
                        let without = without.filter(|(point, _)| point.reason != Reason::None);
                        let each = without.map(|(point, name)| {
                            format!("{name} has no instance ({})", point.reason.describe())
                        });
                        each.collect::<Vec<_>>().join(" and ")
                    }
                    (
                        DecidedBy::VotesAgainst,
                        Some(VoteEvidence::Failed { links, weakest, .. }),
                    ) => failed(&links[*weakest], *merge_ratio),
                    (DecidedBy::DifferentClasses, _) => {
                        "their classes differ, and only pixels of one class are neighbours".into()
                    }
                    (DecidedBy::NoTrueCondition, _) => {
                        "no chain of neighbouring pixels that pass the condition leads from one to \
                         the other"
                            .into()
                    }
                    _ => "a later stage parted them".into(),
                };
                format!("No, A has {} and B has {}. Why: {why}.", own[0], own[1])
            }
        }
    }

    /// The stage on the plane after the votes, in words.
    fn last_stage(&self) -> &'static str {
        let stages = &self.report.explanation.post_merge;
        match stages.iter().find(|stage| !matches!(stage, PostMergeStage::BackProjection { .. })) {
            Some(PostMergeStage::Fragments { .. }) => "the merge of fragments by size",
            Some(PostMergeStage::BirdsEye { .. }) => "the bird's-eye merge",
            Some(PostMergeStage::Gaps { .. }) => "the merge by gaps",
            _ => "a later stage",
        }
    }

    fn frame(&self, out: &mut String) {
        let report = self.report;
        say!(
            out,
            "Frame {} of {}, {} instances, preset {}, objects from {}; positions in metres in the \
             cloud's own frame.",
            report.frame,
            report.topic,
            report.instances,
            report.preset,
            report.semantics
        );
    }

    fn point(&self, out: &mut String, number: usize, point: &PointFacts) {
        let [x, y, z] = point.position;
        let away = match self.report.away.get(number) {
            Some(&away) if away >= 0.0005 => format!(", {away:.3} m from the position asked for"),
            _ => String::new(),
        };
        let class = match point.class_name.as_str() {
            "" => String::new(),
            name => format!(", class {name}"),
        };
        let index = point.index;
        let name = if self.report.explanation.points.len() == 1 { " " } else { NAMES[number] };
        say!(
            out,
            "  {name}  {x:.3},{y:.3},{z:.3} (point {index}{away}), range {:.2} m{class}",
            point.range
        );
        say!(out, "     {}", of_pixel(point));
        if let Some(component) = point.component {
            let seed = match component.seed {
                Some(seed) => format!("seeded at {}", pixel(seed)),
                None => "which no seed reached".into(),
            };
            let group = point.group.map_or(String::new(), |group| {
                format!(
                    "; group {} of the vote merge: {}, {}",
                    group.number,
                    counted(group.components, "component"),
                    counted(group.pixels, "pixel")
                )
            });
            say!(
                out,
                "     component {} ({}, {seed}){group}",
                component.label,
                counted(component.pixels, "pixel")
            );
        }
        say!(out, "     {}", verdict(point));
        if point.reason == Reason::Unreached || point.component.is_some_and(|c| c.seed.is_none()) {
            for pair in &point.neighbours {
                say!(out, "       neighbour {}: {}", pixel(pair.b), judged(pair));
            }
        }
    }

    fn votes(&self, out: &mut String, votes: &VoteEvidence) {
        let Explanation { merge_ratio, pixels_change_hands, .. } = self.report.explanation;
        let ratio = merge_ratio * 100.0;
        let rule = format!(
            "V+ and V- count the votes in favour and against, inherited ones included; each border \
             pair counts twice. A merge needs V+ above {ratio} % of V+ and V-."
        );
        match votes {
            VoteEvidence::OneComponent { component } => {
                say!(out, "Both lie in component {component}: no merge was needed.");
            }
            VoteEvidence::Chain { links } => {
                let (first, last) = ends(links, &self.report.explanation.points);
                say!(out, "Merges between component {first} (A) and component {last} (B):");
                self.links(out, links);
                say!(out, "  {rule}");
            }
            VoteEvidence::Failed { groups, links, weakest, .. } => {
                say!(
                    out,
                    "The votes on the best way from A's group to B's (groups {}):",
                    way(groups)
                );
                self.links(out, links);
                say!(out, "  Failed: {}.", failed(&links[*weakest], merge_ratio));
                say!(out, "  {rule}");
            }
            VoteEvidence::NoTrueCondition { border, groups, links, nearest, distance } => {
                let [one, other] = nearest;
                say!(
                    out,
                    "The vote merge left their groups apart, {distance:.2} m from each other at the \
                     nearest ({} and {}).",
                    pixel(*one),
                    pixel(*other)
                );
                if border.is_empty() {
                    say!(
                        out,
                        "  They have no border: no pixel of one is a neighbour of the other's."
                    );
                    if !links.is_empty() {
                        say!(out, "  The shortest way over borders (groups {}):", way(groups));
                        self.links(out, links);
                        say!(out, "  {rule}");
                    }
                } else {
                    say!(out, "  Their border: {}.", summary(border));
                    self.listed(out, border);
                }
            }
            VoteEvidence::DifferentClasses { classes: [one, other], distance } => say!(
                out,
                "A is {one}, B is {other}: pixels of different classes are never neighbours, so no \
                 votes are cast between them. Their groups are {distance:.2} m apart at the nearest."
            ),
        }
        if pixels_change_hands {
            say!(
                out,
                "  Pixels may have changed hands during the growth: pairs are those of the final \
                 components and need not add up to the votes."
            );
        }
    }

    /// The links, one after the other, with the pairs of the one that had the least share in favour.
    fn links(&self, out: &mut String, links: &[Link]) {
        let weakest = links.iter().map(Link::share).fold(f64::INFINITY, f64::min);
        let mut is_listed = false;
        for (number, link) in links.iter().enumerate() {
            say!(out, "  {}. {}", number + 1, link_line(link, self.report));
            say!(out, "     {}", summary(&link.pairs));
            if link.share() == weakest && !std::mem::replace(&mut is_listed, true) {
                self.listed(out, &link.pairs);
            }
        }
    }

    fn listed(&self, out: &mut String, pairs: &[BorderPair]) {
        for pair in pairs.iter().take(self.pairs) {
            say!(out, "       {} and {}: {}", pixel(pair.a), pixel(pair.b), judged(pair));
        }
        if self.pairs > 0 && pairs.len() > self.pairs {
            say!(out, "       and {} farther from the other verdict", pairs.len() - self.pairs);
        }
    }

    fn what_if(&self, out: &mut String, what_if: &[WhatIf]) {
        if what_if.is_empty() {
            say!(out, "No parameter of the clustering changes that: the object mask decides.");
            return;
        }
        let (mut found, mut searched) = (Vec::new(), Vec::new());
        for each in what_if {
            let (name, change) = match each {
                WhatIf::Number(number) => (number.parameter, change(number)),
                WhatIf::Choice(choice) => (choice.parameter, chosen(choice)),
            };
            match change {
                Ok(change) => found.push(format!("  {name:<24}{change}")),
                Err(range) => searched.push(format!("{name} ({range})")),
            }
        }
        say!(out, "What would give the other answer, each change alone, found by running it:");
        match found.is_empty() {
            true => say!(out, "  nothing that was tried"),
            false => say!(out, "{}", found.join("\n")),
        }
        if !searched.is_empty() {
            say!(out, "  Does not, wherever it was tried: {}.", searched.join(", "));
        }
    }
}

fn of_instance(point: &PointFacts) -> String {
    match (point.instance, point.instance_class.as_str()) {
        (0, _) => format!("no instance ({})", point.reason.describe()),
        (id, "") => format!("instance {id}"),
        (id, class) => format!("instance {id} ({class})"),
    }
}

fn of_pixel(point: &PointFacts) -> String {
    let Some([row, column]) = point.pixel else {
        return "no pixel".into();
    };
    let hidden = point.hidden_behind.map_or(String::new(), |front| {
        format!(", hidden behind a nearer point at {}", at(front.position))
    });
    format!("pixel row {row} column {column}{hidden}")
}

/// A point's instance, or why it has none.
fn verdict(point: &PointFacts) -> String {
    let class = &point.class_name;
    match point.reason {
        Reason::None => of_instance(point),
        Reason::NoReturn => "no return: the beam came back with nothing".into(),
        Reason::NotAnObject => {
            format!("not an object: class {class} (id {}) is no thing", point.semantic)
        }
        Reason::Ground => "not an object: ground, by its geometry".into(),
        Reason::Shadowed => {
            "no instance: hidden, and no pixel of its class near enough to take a label from".into()
        }
        Reason::Unreached => {
            "no instance: no seed reached its pixel; the conditions towards its neighbours:".into()
        }
        Reason::TooSmall => "no instance: the one it was in is under the minimum size".into(),
    }
}

/// Groups one after the other.
fn way(groups: &[GroupFacts]) -> String {
    let numbers: Vec<String> = groups.iter().map(|group| group.number.to_string()).collect();
    numbers.join(" - ")
}

fn joined(votes: &Option<VoteEvidence>) -> String {
    let Some(VoteEvidence::Chain { links }) = votes else {
        return String::new();
    };
    let weakest = links.iter().min_by(|a, b| a.share().total_cmp(&b.share()));
    let weakest = weakest.map_or(String::new(), |link| {
        let which = if links.len() == 1 { "with" } else { "the weakest with" };
        format!(", {which} V+ {} to V- {}", link.positive, link.negative)
    });
    format!("{}{weakest}", counted(links.len(), "merge"))
}

fn failed(link: &Link, ratio: f64) -> String {
    let missing = match link.short_by(ratio) {
        Some(missing) => format!("{} in favour short", counted(missing as usize, "vote")),
        None => "which no number of votes would change".into(),
    };
    format!(
        "components {} and {} had V+ {} to V- {}, {missing}",
        link.target, link.query, link.positive, link.negative
    )
}

fn ends(links: &[Link], points: &[PointFacts]) -> (u32, u32) {
    let label = |point: &PointFacts| point.component.map_or(0, |component| component.label);
    match points {
        [a, b] => (label(a), label(b)),
        _ => (links[0].target, links[0].query),
    }
}

fn link_line(link: &Link, report: &Report) -> String {
    let is_merged = link.short_by(report.explanation.merge_ratio) == Some(0);
    let happened = if is_merged { "joined" } else { "did not join" };
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
        "{} {happened} {}: V+ {}, V- {} ({:.0} % in favour{own})",
        link.query,
        link.target,
        link.positive,
        link.negative,
        link.share() * 100.0
    )
}

/// How many pairs voted which way, and the span of what they went by.
fn summary(pairs: &[BorderPair]) -> String {
    let side = |holds: bool, name: &str| {
        let side: Vec<&BorderPair> = pairs.iter().filter(|pair| pair.holds == holds).collect();
        if side.is_empty() {
            return None;
        }
        let mut line = format!("{} {name}", counted(side.len(), "pair"));
        let angles = side.iter().filter(|pair| pair.rule == Rule::Angle);
        if let Some(span) = span(angles.map(|pair| pair.beta_degrees)) {
            line += &format!(", beta {} degrees", between(span, 1));
        }
        let near = side.iter().filter_map(|pair| match pair.rule {
            Rule::Nearness { distance, .. } => Some(distance),
            _ => None,
        });
        if let Some(span) = span(near) {
            line += &format!(", {} m apart on the plane", between(span, 2));
        }
        let gaps = side.iter().filter_map(|pair| match pair.rule {
            Rule::Gap { separation, .. } => Some(separation),
            _ => None,
        });
        if let Some(span) = span(gaps) {
            line += &format!(", {} of the reach of touching apart", between(span, 2));
        }
        let gated = side.iter().filter(|pair| pair.rule == Rule::Gate).count();
        if gated > 0 {
            line += &format!(", {gated} by the distance gates");
        }
        Some(line)
    };
    let sides = [side(true, "in favour"), side(false, "against")];
    sides.into_iter().flatten().collect::<Vec<_>>().join("; ")
}

fn span(values: impl Iterator<Item = f64>) -> Option<(f64, f64)> {
    values.fold(None, |span, value| match span {
        None => Some((value, value)),
        Some((low, high)) => Some((value.min(low), value.max(high))),
    })
}

fn between((low, high): (f64, f64), digits: usize) -> String {
    let [from, to] = [low, high].map(|value| format!("{value:.digits$}"));
    if from == to { from } else { format!("{from} to {to}") }
}

fn judged(pair: &BorderPair) -> String {
    let vote = if pair.holds { "in favour" } else { "against" };
    let beta = pair.beta_degrees;
    let distance = pair.distance;
    match pair.rule {
        Rule::Angle => format!("{distance:.2} m apart, beta {beta:.1} degrees: {vote}"),
        Rule::Gate => {
            format!("{distance:.2} m apart, beta {beta:.1} degrees, but the distance gate: {vote}")
        }
        Rule::Nearness { distance, reach } => format!(
            "{distance:.2} m apart on the bird's-eye plane, limit {reach:.2} m: {vote} (beta {beta:.1} \
             degrees, not used)"
        ),
        Rule::Gap { separation, reach: [across, upright] } => format!(
            "{distance:.2} m apart, {separation:.2} of the reach of touching ({across:.2} m across, \
             {upright:.2} m in height): {vote} (beta {beta:.1} degrees, not used)"
        ),
    }
}

fn post_merge(out: &mut String, stage: &PostMergeStage) {
    match stage {
        PostMergeStage::BirdsEye { region: None, .. } => say!(out, "Bird's-eye merge: off."),
        PostMergeStage::BirdsEye { joined, region, margin, groups, gaps, classes_differ } => {
            let region =
                region.map_or(String::new(), |region| format!("{region:?}").to_lowercase());
            if *classes_differ {
                say!(out, "Bird's-eye merge: only within a class, and theirs differ.");
                return;
            }
            let outcome = if *joined { "joined them" } else { "left them apart" };
            say!(out, "Bird's-eye merge ({region} outlines, margin {margin} m): {outcome}.");
            let pixels = |group: &GroupFacts| counted(group.pixels, "pixel");
            for (pair, gap) in groups.windows(2).zip(gaps) {
                // Apart, they are the nearest of all groups that this merge put together with A and B.
                let [of_a, of_b] =
                    if *joined { ["", ""] } else { ["of A's instance, ", "of B's instance, "] };
                say!(
                    out,
                    "  group {} ({of_a}{}) and group {} ({of_b}{}): {gap:.2} m apart",
                    pair[0].number,
                    pixels(&pair[0]),
                    pair[1].number,
                    pixels(&pair[1])
                );
            }
        }
        PostMergeStage::Fragments { joined: true, joins, .. } => {
            say!(out, "Merge of fragments by size: joined them.");
            joins.iter().for_each(|one| join(out, one));
        }
        PostMergeStage::Gaps { joined: true, joins, .. } => {
            say!(out, "Merge by gaps: joined them.");
            joins.iter().for_each(|one| join(out, one));
        }
        PostMergeStage::Gaps { test: None, .. } => say!(out, "Merge by gaps: left them apart."),
        PostMergeStage::Gaps { test: Some(test), .. } => say!(
            out,
            "Merge by gaps: left them apart, {:.2} m from one another, which is {:.2} of the reach of \
             touching; the smaller has {}, and under {} up to {:.2} would do.",
            test.gap,
            test.separation,
            counted(test.pixels, "pixel"),
            test.leftover,
            test.leftover_reach
        ),
        PostMergeStage::Fragments { classes_differ: true, .. } => {
            say!(out, "Merge of fragments by size: only within a class, and theirs differ.");
        }
        PostMergeStage::Fragments { test: None, .. } => {
            say!(
                out,
                "Merge of fragments by size: left them apart, their class is of no known size."
            );
        }
        PostMergeStage::Fragments { test: Some(test), .. } => {
            say!(out, "Merge of fragments by size: left them apart, {}.", size_test(test));
        }
        PostMergeStage::MinimumSize { point, pixels, minimum } => say!(
            out,
            "Minimum size: the instance of {} had {}, and {minimum} are asked for.",
            NAMES[*point],
            counted(*pixels, "pixel")
        ),
        PostMergeStage::BackProjection { point, from, distance } => say!(
            out,
            "Back-projection: {} is hidden in its pixel and took the label of {}, {distance:.2} m away.",
            NAMES[*point],
            pixel(*from)
        ),
    }
}

fn join(out: &mut String, join: &Join) {
    let why = match join.evidence {
        Evidence::Touching => "touching".to_owned(),
        Evidence::Fits { union, limit } => format!(
            "together {}, which fits an object of their class (limit {})",
            sides(union),
            sides(limit)
        ),
        Evidence::Leftover { pixels } => {
            format!("a leftover of {} and the nearest to it", counted(pixels, "pixel"))
        }
    };
    let (query, target) = (join.query, join.target);
    say!(out, "  group {query} joined group {target}: {:.2} m apart, {why}", join.gap);
}

fn size_test(test: &SizeTest) -> String {
    if test.gap >= test.too_far {
        return format!(
            "{:.2} m apart, where gaps of less than {:.2} m are bridged for their class",
            test.gap, test.too_far
        );
    }
    if test.gap <= test.touching {
        return format!(
            "{:.2} m apart, which is touching, but the rectangle around both, {}, is wider than the {:.2} m \
             of one object of their class: they lie side by side",
            test.gap,
            sides(test.union),
            test.widest
        );
    }
    format!(
        "{:.2} m apart (touching is up to {:.2} m), and the rectangle around both, {}, is larger than \
         {} for their class",
        test.gap,
        test.touching,
        sides(test.union),
        sides(test.limit)
    )
}

fn sides([length, width]: [f64; 2]) -> String {
    format!("{length:.1} x {width:.1} m")
}

/// The smallest changes in words, or the range that was searched for one.
fn change(number: &Number) -> Result<String, String> {
    let unit = match number.unit {
        "" => String::new(),
        unit => format!(" {unit}"),
    };
    let written = |value: f64| match value {
        value if value >= f64::from(1 << 20) => "any".to_owned(),
        value => value.to_string(),
    };
    let Some(smallest) = number.smallest() else {
        return Err(format!("{} to {}{unit}", number.searched[0], number.searched[1]));
    };
    let told = |flip: Flip| {
        let (value, not_yet) = (written(flip.value), written(flip.unchanged_at));
        match flip.unchanged_at == number.now {
            true => format!("{value}{unit}"),
            false => format!("{value}{unit} ({not_yet} is not enough)"),
        }
    };
    let both = [number.lower, number.higher].into_iter().flatten();
    let other = both.filter(|&flip| flip != smallest).map(|flip| format!(", or {}", told(flip)));
    Ok(format!("{} -> {}{}", written(number.now), told(smallest), other.collect::<String>()))
}

/// The other values that do in words, or all that were tried.
fn chosen(choice: &Choice) -> Result<String, String> {
    match &choice.flips[..] {
        [] => Err(choice.tried.join(", ")),
        flips => Ok(format!("{} -> {}", choice.now, flips.join(" or "))),
    }
}

fn pixel(place: Place) -> String {
    format!("row {} column {}", place.row, place.column)
}

fn at([x, y, z]: [f32; 3]) -> String {
    format!("{x:.3},{y:.3},{z:.3}")
}

fn counted(count: usize, what: &str) -> String {
    let plural = if count == 1 { "" } else { "s" };
    format!("{count} {what}{plural}")
}
