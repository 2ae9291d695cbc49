//! `divmerge explain`

use std::path::{Path, PathBuf};

use anyhow::{Context, Result, bail};
use clap::error::ErrorKind;
use clap::{Args, CommandFactory};
use divmerge::annotate::Method;
use divmerge::cluster::{Evidence, Join};
use divmerge::explain::{
    Answer, BorderPair, Choice, DecidedBy, Explanation, Flip, Frame, GroupFacts, LaterStage, Link,
    Number, Place, PointFacts, Rule, SizeTest, Subject, VoteEvidence, WhatIf, explain,
    nearest_points, return_at, what_if,
};
use divmerge::instances::Reason;
use divmerge::io::{PointCloud2, Which, cloud_message_at};
use divmerge::pipeline;
use divmerge::view::{self, ColourTracker, Scene, Target};
use serde::Serialize;

use crate::arguments::{MethodArguments, number, positive};
use crate::figure::{picture, write};
use crate::{Outcome, viewer};

/// Say why two points are one instance or not, or why one point is what it is
///
/// Shows the points' pixels and components, the merges between them with the votes in favour (V+) and
/// against (V-) and the pairs of pixels that cast them, or where the votes failed; what the later stages
/// did; and the smallest change of each parameter alone that would give the other answer.
#[derive(Args)]
pub struct Arguments {
    /// The recording (MCAP)
    input: PathBuf,

    /// Cloud topic [default: the first that can be read]
    #[arg(long, value_name = "T")]
    topic: Option<String>,

    /// Number of the cloud on its topic, from 0
    #[arg(long, value_name = "N", default_value_t = 0)]
    frame: u64,

    /// A point in metres in the cloud's own frame; once to explain it, twice to compare two
    #[arg(long, value_name = "X,Y,Z", value_parser = position, allow_hyphen_values = true)]
    at: Vec<[f64; 3]>,

    /// An instance of this frame with these parameters; twice, in place of two points
    #[arg(long, value_name = "ID", conflicts_with = "at")]
    instance: Vec<u32>,

    /// How far the nearest return may be from a point asked for, metres
    #[arg(long, value_name = "M", default_value_t = 0.3, value_parser = positive)]
    within: f64,

    #[command(flatten)]
    method: MethodArguments,

    /// Most pairs of pixels to list; --json has them all
    #[arg(long, value_name = "N", default_value_t = 3)]
    pairs: usize,

    /// Do not look for changes of parameters that give the other answer
    #[arg(long)]
    no_what_if: bool,

    /// Print as JSON
    #[arg(long)]
    json: bool,

    /// Draw it too; the ending, .png or .svg, says which
    #[arg(short, long, value_name = "OUT", value_parser = picture)]
    output: Option<PathBuf>,

    /// Write it with its frame into a file that `rerun F.rrd` opens; needs a divmerge built with
    /// `--features rerun`
    #[arg(long, value_name = "F.rrd", value_parser = viewer::rrd)]
    rerun: Option<PathBuf>,

    /// Replace existing files
    #[arg(long)]
    force: bool,
}

/// Everything that is printed as JSON.
#[derive(Serialize)]
struct Report {
    file: PathBuf,
    topic: String,
    frame: u64,
    log_time_ns: u64,
    preset: &'static str,
    semantics: String,
    instances: usize,
    /// Distance of each point from where it was asked for, metres.
    away: Vec<f64>,
    #[serde(flatten)]
    explanation: Explanation,
    /// Each pair of border pixels counts twice in V+ and V-.
    votes_per_border_pair: u8,
    what_if: Option<Vec<WhatIf>>,
}

pub fn run(arguments: &Arguments) -> Result<Outcome> {
    check_usage(arguments);
    if arguments.rerun.is_some() {
        viewer::require_built()?;
    }
    for output in arguments.output.iter().chain(&arguments.rerun) {
        crate::refuse_existing(output, arguments.force)?;
    }
    let method = arguments.method.method(&arguments.input)?;
    if let Some(other) = &method.config.baseline {
        bail!(
            "{} has no votes or merges to explain; `divmerge figure --method {0}` draws what it cuts",
            other.name()
        );
    }
    let (path, which) = (&arguments.input, Which::Frame(arguments.frame));
    let message = cloud_message_at(path, arguments.topic.as_deref(), which)?;
    let place = || format!("{}: frame {} of {}", path.display(), message.number, message.topic);
    let wire = PointCloud2::parse(&message.data).with_context(place)?;
    let decoded = method.decode(&wire).with_context(place)?;
    let (cloud, mask, config) = (&decoded.cloud, decoded.mask, &method.config);
    let stages = pipeline::run(cloud, mask, config);
    let frame = Frame { cloud, mask, config, stages: &stages };

    let subject = subject(arguments, &frame).with_context(place)?;
    let explanation = explain(&frame, subject);
    let report = Report {
        file: path.clone(),
        topic: message.topic.clone(),
        frame: message.number,
        log_time_ns: message.log_time,
        preset: config.preset,
        semantics: decoded.semantics.clone(),
        instances: stages.instances.len(),
        away: explanation.points.iter().zip(&arguments.at).map(away).collect(),
        votes_per_border_pair: 2,
        what_if: (!arguments.no_what_if).then(|| what_if(&frame, subject)),
        explanation,
    };
    if arguments.json {
        println!("{}", serde_json::to_string_pretty(&report)?);
    } else {
        Text { report: &report, pairs: arguments.pairs }.print();
    }
    if let Some(output) = &arguments.output {
        let bytes = draw(&report, &frame, output, arguments.force)?;
        if !arguments.json {
            println!();
            println!("wrote {} ({bytes} bytes)", output.display());
        }
    }
    if let Some(rrd) = &arguments.rerun {
        let target = Target::Save { path: rrd.clone(), force: arguments.force };
        let shown = divmerge::annotate::Frame {
            topic: &message.topic,
            number: message.number,
            log_time_ns: message.log_time,
            stamp_ns: wire.stamp_ns(),
            frame_id: &wire.frame_id,
            cloud,
            stages: &stages,
            remarks: &[],
        };
        stream(&report, &shown, &target, &method)?;
        if !arguments.json {
            println!("wrote {}", rrd.display());
        }
    }
    Ok(Outcome::Done)
}

/// Draws the explanation and returns the size of the picture in bytes.
fn draw(report: &Report, frame: &Frame, output: &Path, force: bool) -> Result<u64> {
    const DPI: f64 = 192.0;
    let Frame { cloud, config, stages, .. } = *frame;
    let scene = Scene {
        cloud,
        stages,
        classes: Vec::new(),
        intensity: None,
        merge_ratio: config.cluster.merge_ratio,
        colour_numbers: ColourTracker::default().colour_numbers(&stages.instances),
        heading: format!("frame {} of {}", report.frame, report.topic),
        remark: format!("objects: {}  ·  preset {}", report.semantics, report.preset),
    };
    let headline = Text { report, pairs: 0 }.headline();
    write(output, &view::explanation(&scene, &report.explanation, &headline, DPI), DPI, force)
}

/// Sends the frame and the explanation to the viewer's file.
fn stream(
    report: &Report,
    shown: &divmerge::annotate::Frame,
    target: &Target,
    method: &Method,
) -> Result<()> {
    let headline = Text { report, pairs: 0 }.headline();
    let mut stream = viewer::open(target, &report.file, method)?;
    stream.log(shown)?;
    stream.explain(shown, &report.explanation, &headline)?;
    Ok(stream.finish()?)
}

/// Ends the program with exit code 2 unless there are one or two points, or two instances.
fn check_usage(arguments: &Arguments) {
    let problem = match (arguments.at.len(), arguments.instance.len()) {
        (1 | 2, 0) | (0, 2) => return,
        (0, 0) => "say what to explain: --at X,Y,Z once or twice, or --instance ID twice".into(),
        (points, 0) => format!("--at is given {points} times; one or two points can be explained"),
        (_, instances) => format!("--instance is given {instances} times; it takes two"),
    };
    let mut command = crate::Cli::command();
    let command = command.find_subcommand_mut("explain").expect("this command");
    command.error(ErrorKind::WrongNumberOfValues, problem).exit()
}

fn subject(arguments: &Arguments, frame: &Frame) -> Result<Subject> {
    if let &[a, b] = &arguments.instance[..] {
        if a == b {
            bail!("--instance {a} twice: name two different instances");
        }
        let (a, b) = nearest_points(frame, a, b)?;
        return Ok(Subject::Pair(a, b));
    }
    let at = |at: &[f64; 3]| return_at(frame.cloud, *at, arguments.within);
    let points = arguments.at.iter().map(at).collect::<divmerge::Result<Vec<usize>>>()?;
    match points[..] {
        [a] => Ok(Subject::Point(a)),
        [a, b] if a == b => bail!("both --at lie nearest to the same point, number {a}"),
        [a, b] => Ok(Subject::Pair(a, b)),
        _ => unreachable!("checked before"),
    }
}

fn away((point, asked): (&PointFacts, &[f64; 3])) -> f64 {
    let along = |axis: usize| f64::from(point.position[axis]) - asked[axis];
    (0..3).map(|axis| along(axis).powi(2)).sum::<f64>().sqrt()
}

fn position(text: &str) -> Result<[f64; 3], String> {
    let numbers = text.split(',').map(|part| number(part.trim()));
    let numbers = numbers.collect::<Result<Vec<f64>, String>>();
    let form = || "use x,y,z in metres, as in 12.5,-3.2,0.4".to_owned();
    numbers.map_err(|_| form())?.try_into().map_err(|_| form())
}

const NAMES: [&str; 2] = ["A", "B"];

/// The report for people.
struct Text<'a> {
    report: &'a Report,
    pairs: usize,
}

impl Text<'_> {
    fn print(&self) {
        let Report { explanation, .. } = self.report;
        println!("{}", self.headline());
        println!();
        self.frame();
        for (number, point) in explanation.points.iter().enumerate() {
            self.point(number, point);
        }
        if let Some(votes) = &explanation.votes {
            println!();
            self.votes(votes);
        }
        for stage in &explanation.later {
            println!();
            later(stage);
        }
        if let Some(what_if) = &self.report.what_if {
            println!();
            self.what_if(what_if);
        }
    }

    fn headline(&self) -> String {
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
        let later = &self.report.explanation.later;
        match later.iter().find(|stage| !matches!(stage, LaterStage::BackProjection { .. })) {
            Some(LaterStage::Fragments { .. }) => "the merge of fragments by size",
            Some(LaterStage::BirdsEye { .. }) => "the bird's-eye merge",
            Some(LaterStage::Gaps { .. }) => "the merge by gaps",
            _ => "a later stage",
        }
    }

    fn frame(&self) {
        let report = self.report;
        println!(
            "Frame {} of {}, {} instances, preset {}, objects from {}; positions in metres in the \
             cloud's own frame.",
            report.frame, report.topic, report.instances, report.preset, report.semantics
        );
    }

    fn point(&self, number: usize, point: &PointFacts) {
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
        println!(
            "  {name}  {x:.3},{y:.3},{z:.3} (point {index}{away}), range {:.2} m{class}",
            point.range
        );
        println!("     {}", of_pixel(point));
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
            println!(
                "     component {} ({}, {seed}){group}",
                component.label,
                counted(component.pixels, "pixel")
            );
        }
        println!("     {}", verdict(point));
        if point.reason == Reason::Unreached || point.component.is_some_and(|c| c.seed.is_none()) {
            for pair in &point.neighbours {
                println!("       neighbour {}: {}", pixel(pair.b), judged(pair));
            }
        }
    }

    fn votes(&self, votes: &VoteEvidence) {
        let Explanation { merge_ratio, pixels_change_hands, .. } = self.report.explanation;
        let ratio = merge_ratio * 100.0;
        let rule = format!(
            "V+ and V- count the votes in favour and against, inherited ones included; each border \
             pair counts twice. A merge needs V+ above {ratio} % of V+ and V-."
        );
        match votes {
            VoteEvidence::OneComponent { component } => {
                println!("Both lie in component {component}: no merge was needed.");
            }
            VoteEvidence::Chain { links } => {
                let (first, last) = ends(links, &self.report.explanation.points);
                println!("Merges between component {first} (A) and component {last} (B):");
                self.links(links);
                println!("  {rule}");
            }
            VoteEvidence::Failed { groups, links, weakest, .. } => {
                println!(
                    "The votes on the best way from A's group to B's (groups {}):",
                    way(groups)
                );
                self.links(links);
                println!("  Failed: {}.", failed(&links[*weakest], merge_ratio));
                println!("  {rule}");
            }
            VoteEvidence::NoTrueCondition { border, groups, links, nearest, distance } => {
                let [one, other] = nearest;
                println!(
                    "The vote merge left their groups apart, {distance:.2} m from each other at the \
                     nearest ({} and {}).",
                    pixel(*one),
                    pixel(*other)
                );
                if border.is_empty() {
                    println!(
                        "  They have no border: no pixel of one is a neighbour of the other's."
                    );
                    if !links.is_empty() {
                        println!("  The shortest way over borders (groups {}):", way(groups));
                        self.links(links);
                        println!("  {rule}");
                    }
                } else {
                    println!("  Their border: {}.", summary(border));
                    self.listed(border);
                }
            }
            VoteEvidence::DifferentClasses { classes: [one, other], distance } => println!(
                "A is {one}, B is {other}: pixels of different classes are never neighbours, so no \
                 votes are cast between them. Their groups are {distance:.2} m apart at the nearest."
            ),
        }
        if pixels_change_hands {
            println!(
                "  Pixels may have changed hands during the growth: pairs are those of the final \
                 components and need not add up to the votes."
            );
        }
    }

    /// The links, one after the other, with the pairs of the one that had the least share in favour.
    fn links(&self, links: &[Link]) {
        let weakest = links.iter().map(Link::share).fold(f64::INFINITY, f64::min);
        let mut is_listed = false;
        for (number, link) in links.iter().enumerate() {
            println!("  {}. {}", number + 1, link_line(link, self.report));
            println!("     {}", summary(&link.pairs));
            if link.share() == weakest && !std::mem::replace(&mut is_listed, true) {
                self.listed(&link.pairs);
            }
        }
    }

    fn listed(&self, pairs: &[BorderPair]) {
        for pair in pairs.iter().take(self.pairs) {
            println!("       {} and {}: {}", pixel(pair.a), pixel(pair.b), judged(pair));
        }
        if self.pairs > 0 && pairs.len() > self.pairs {
            println!("       and {} farther from the other verdict", pairs.len() - self.pairs);
        }
    }

    fn what_if(&self, what_if: &[WhatIf]) {
        if what_if.is_empty() {
            println!("No parameter of the clustering changes that: the object mask decides.");
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
        println!("What would give the other answer, each change alone, found by running it:");
        match found.is_empty() {
            true => println!("  nothing that was tried"),
            false => println!("{}", found.join("\n")),
        }
        if !searched.is_empty() {
            println!("  Does not, wherever it was tried: {}.", searched.join(", "));
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

fn later(stage: &LaterStage) {
    match stage {
        LaterStage::BirdsEye { region: None, .. } => println!("Bird's-eye merge: off."),
        LaterStage::BirdsEye { joined, region, margin, groups, gaps, classes_differ } => {
            let region =
                region.map_or(String::new(), |region| format!("{region:?}").to_lowercase());
            if *classes_differ {
                println!("Bird's-eye merge: only within a class, and theirs differ.");
                return;
            }
            let outcome = if *joined { "joined them" } else { "left them apart" };
            println!("Bird's-eye merge ({region} outlines, margin {margin} m): {outcome}.");
            let pixels = |group: &GroupFacts| counted(group.pixels, "pixel");
            for (pair, gap) in groups.windows(2).zip(gaps) {
                // Apart, they are the nearest of all groups that this merge put together with A and B.
                let [of_a, of_b] =
                    if *joined { ["", ""] } else { ["of A's instance, ", "of B's instance, "] };
                println!(
                    "  group {} ({of_a}{}) and group {} ({of_b}{}): {gap:.2} m apart",
                    pair[0].number,
                    pixels(&pair[0]),
                    pair[1].number,
                    pixels(&pair[1])
                );
            }
        }
        LaterStage::Fragments { joined: true, joins, .. } => {
            println!("Merge of fragments by size: joined them.");
            joins.iter().for_each(join);
        }
        LaterStage::Gaps { joined: true, joins, .. } => {
            println!("Merge by gaps: joined them.");
            joins.iter().for_each(join);
        }
        LaterStage::Gaps { test: None, .. } => println!("Merge by gaps: left them apart."),
        LaterStage::Gaps { test: Some(test), .. } => println!(
            "Merge by gaps: left them apart, {:.2} m from one another, which is {:.2} of the reach of \
             touching; the smaller has {}, and under {} up to {:.2} would do.",
            test.gap,
            test.separation,
            counted(test.pixels, "pixel"),
            test.leftover,
            test.leftover_reach
        ),
        LaterStage::Fragments { classes_differ: true, .. } => {
            println!("Merge of fragments by size: only within a class, and theirs differ.");
        }
        LaterStage::Fragments { test: None, .. } => {
            println!(
                "Merge of fragments by size: left them apart, their class is of no known size."
            );
        }
        LaterStage::Fragments { test: Some(test), .. } => {
            println!("Merge of fragments by size: left them apart, {}.", size_test(test));
        }
        LaterStage::MinimumSize { point, pixels, minimum } => println!(
            "Minimum size: the instance of {} had {}, and {minimum} are asked for.",
            NAMES[*point],
            counted(*pixels, "pixel")
        ),
        LaterStage::BackProjection { point, from, distance } => println!(
            "Back-projection: {} is hidden in its pixel and took the label of {}, {distance:.2} m away.",
            NAMES[*point],
            pixel(*from)
        ),
    }
}

fn join(join: &Join) {
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
    println!("  group {query} joined group {target}: {:.2} m apart, {why}", join.gap);
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
