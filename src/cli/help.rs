//! What `-h` and `--help` say beside the arguments: headings, the options that matter most, and
//! examples.

use clap::{Arg, Command};

/// Options of the commands, by heading. `COMMAND/OPTION` is that of one command alone.
const HEADINGS: &[(&str, &str)] = &[
    (
        "Input",
        "topic frame frames time at instance within sequences true-class-field \
         true-instance-field labels truth predictions class-field instance-field from to assemble \
         slice plan input sensor-frame sensor-origin units min-range max-range crop ego rows \
         columns fov sequence frame-id rate start sensor scene seed shards",
    ),
    ("Objects", "semantics taxonomy tolerance"),
    (
        "Clustering",
        "method methods preset presets voxel voxels angle gap-columns gap-rows min-points bev set \
         config over values",
    ),
    ("Time", "track lag ego-motion over-time link"),
    (
        "Output",
        "output objects flavor compression no-layout blueprint only in-place-fields resume \
         force rerun json pairs no-what-if limit csv report panels theme aspect dpi window view \
         steps steps-by video tracks save connect spawn out entropy small weigh-points root \
         encoding dry-run listen no-open evaluate/min-points compare/min-points \
         sweep/min-points export/labels",
    ),
    ("Performance", "threads unchecked profile"),
    ("Boxes (--method boxes)", "boxes boxes-calibration boxes-margin least-score"),
];

/// The options that `-h` shows, of commands that have many; `--help` shows all.
const COMMON: &[(&str, &str)] = &[
    ("annotate", "output topic from to semantics preset set config dry-run force"),
    ("compare", "topic frames labels semantics methods set output force"),
    ("demo", "out frames seed semantics set config"),
    ("evaluate", "topic labels truth predictions sequences taxonomy entropy over-time json force"),
    ("explain", "topic frame at instance track semantics preset set output json"),
    ("failures", "topic frames labels semantics preset set config limit csv force"),
    ("figure", "output frame topic panels window tracks semantics preset set force"),
    ("info", "sensor-frame sensor-origin units crop ego json"),
    ("inspect", "topic frame labels semantics taxonomy preset set config listen no-open"),
    ("sweep", "topic frames semantics over values presets set output force"),
    ("triage", "topic frames semantics preset set config limit report output force"),
    ("view", "save connect topic frames semantics preset set config force"),
];

/// Options that are of no use to a command that shares them with others.
const USELESS: &[(&str, &str)] =
    &[("explain", "method boxes boxes-calibration boxes-margin least-score")];

/// What `-h` says of options of which `--help` says more.
const SHORT_HELP: &[(&str, &str)] = &[
    ("semantics", "Objects: auto, ground, all, field:NAME, topic:T, labels:DIR or onnx:MODEL.onnx"),
    ("taxonomy", "What the ids of classes mean: a name, as nuscenes, or a YAML file"),
    ("preset", "Parameters to start from"),
    ("set", "Set any parameter, as cluster.voxel=0.3 (see `params`)"),
    ("config", "Options from a TOML file or an annotated recording"),
    ("annotate/topic", "Only this cloud topic; may be repeated [default: all]"),
    ("triage/topic", "Only this cloud topic; may be repeated [default: all]"),
    ("compare/topic", "Cloud topic [default: the first with clouds]"),
    ("sweep/topic", "Cloud topic [default: the first with clouds]"),
    ("annotate/input", "Recordings (MCAP) or rosbag2 folders; `-` is standard input"),
    ("annotate/output", "Output, or a folder for several; `-` is standard output"),
    ("dry-run", "Say what would be done, and do nothing"),
    ("compare/min-points", "Fewer points do not count where unmatched"),
    ("compare/output", "Chart (.svg, .pdf, .png), table (.csv, .md) or .json"),
    ("triage/output", "Write the recording with a topic T/suspicion"),
    ("triage/limit", "Cases to list and draw"),
    ("from", "Leave out what is before: 12.5, @1317384506.4, a date, frame:100"),
    ("figure/panels", "Panels from top to bottom, as mask,components,instances,votes,bev"),
    ("figure/window", "Only this part of the range image, as 500..900/10..50"),
    ("figure/tracks", "Follow objects over time and draw their ways from above"),
    ("explain/track", "Explain an object over time instead"),
    ("explain/at", "A point in metres; once to explain it, twice to compare two"),
    ("explain/output", "Also draw it, as .png, .svg or .pdf"),
    ("frames", "Only these clouds, numbered from 0: 5..10 (without 10), 5.., ..10 or 5"),
    ("labels", "Folder of label files with the truth"),
    ("sensor-frame", "How the clouds' frame stands: rfu, frd, ..., roll,pitch,yaw, tf or auto"),
    ("sensor-origin", "Where the sensor stands in the clouds' frame, metres"),
    ("units", "Unit of the clouds' coordinates: m, cm or mm"),
    ("crop", "Leave out returns outside a block, X0..X1,Y0..Y1,Z0..Z1 in metres"),
    ("ego", "Leave out the vehicle that carries the sensor: a block, or auto"),
    ("entropy", "Also score over- and under-segmentation entropy (OSE, USE)"),
    ("over-time", "Also score ids that persist: LSTQ, HOTA, id switches, occlusions"),
    ("triage/report", "Write pages: a figure and a reason for each case"),
    ("sweep/over", "The parameter: voxel, angle, ..., or the path of any number"),
];

/// Three examples of each command.
const EXAMPLES: &[(&str, [&str; 3])] = &[
    (
        "annotate",
        [
            "divmerge annotate drive.mcap -o annotated.mcap",
            "divmerge annotate drive.mcap -o fine.mcap --set cluster.voxel=0.3",
            "divmerge annotate a.mcap b.mcap -o annotated --resume",
        ],
    ),
    (
        "compare",
        [
            "divmerge compare drive.mcap",
            "divmerge compare drive.mcap --methods best,dbscan --frames 0..20 -o methods.svg",
            "divmerge compare drive.mcap --methods paper --voxels 1,0.5,0.2",
        ],
    ),
    (
        "completions",
        [
            "divmerge completions bash > ~/.local/share/bash-completion/completions/divmerge",
            "divmerge completions zsh > ~/.zfunc/_divmerge",
            "divmerge completions fish > ~/.config/fish/completions/divmerge.fish",
        ],
    ),
    (
        "convert",
        [
            "divmerge convert folder scans -o scans.mcap",
            "divmerge convert folder scans -o scans.mcap --rate 20 --labels labels",
            "divmerge convert semantickitti dataset -o drives",
        ],
    ),
    (
        "demo",
        [
            "divmerge demo",
            "divmerge demo --frames 100 --seed 7 --out street",
            "divmerge demo --semantics ground --set cluster.tree.gap=0.02",
        ],
    ),
    (
        "diff",
        [
            "divmerge diff before.mcap after.mcap",
            "divmerge diff before.mcap after.mcap --topic /lidar/points --limit 5",
            "divmerge diff before.mcap after.mcap --csv changes.csv",
        ],
    ),
    (
        "evaluate",
        [
            "divmerge evaluate annotated.mcap",
            "divmerge evaluate annotated.mcap --over-time --json scores.json",
            "divmerge evaluate --truth semantickitti --predictions mine --sequences 00,04",
        ],
    ),
    (
        "explain",
        [
            "divmerge explain drive.mcap --frame 12 --at 8.1,2.0,-0.6",
            "divmerge explain drive.mcap --frame 12 --instance 3 --instance 7 -o why.png",
            "divmerge explain drive.mcap --track 5 --frames 0..50",
        ],
    ),
    (
        "export",
        [
            "divmerge export annotated.mcap --labels labels",
            "divmerge export a.mcap b.mcap --root mine",
            "divmerge export annotated.mcap --root mine --sequence 08",
        ],
    ),
    (
        "failures",
        [
            "divmerge failures drive.mcap",
            "divmerge failures drive.mcap --preset paper --csv failures.csv",
            "divmerge failures semantickitti --sequences 04 --frames 0..10",
        ],
    ),
    (
        "figure",
        [
            "divmerge figure drive.mcap --frame 12 -o frame.png",
            "divmerge figure drive.mcap --panels mask,instances --theme light -o print.pdf",
            "divmerge figure drive.mcap --tracks --frames 0..50 -o ways.svg",
        ],
    ),
    (
        "info",
        [
            "divmerge info drive.mcap",
            "divmerge info bag_folder",
            "divmerge info drive.mcap --sensor-frame rfu --json",
        ],
    ),
    (
        "inspect",
        [
            "divmerge inspect drive.mcap",
            "divmerge inspect drive.mcap --frame 120 --semantics ground",
            "divmerge inspect drive.mcap --no-open --listen 127.0.0.1:8080",
        ],
    ),
    (
        "join",
        [
            "divmerge join slices -o annotated.mcap --plan plan.json",
            "divmerge join slices -o annotated --resume",
            "divmerge join slices -o annotated.mcap --input moved/drive.mcap",
        ],
    ),
    (
        "params",
        [
            "divmerge params",
            "divmerge params cluster.tree --set cluster.tree.gap=0.02",
            "divmerge params --preset paper > mine.toml",
        ],
    ),
    (
        "plan",
        [
            "divmerge plan drive.mcap --shards 8 -o plan.json",
            "divmerge plan fleet --shards 100 --topic /lidar/points -o plan.json",
            "divmerge plan a.mcap b.mcap --shards 4",
        ],
    ),
    (
        "simulate",
        [
            "divmerge simulate -o drive.mcap",
            "divmerge simulate --sensor vlp-16 --scene crowd --frames 100 -o crowd.mcap",
            "divmerge simulate --scene traffic --encoding foxglove-protobuf -o traffic.mcap",
        ],
    ),
    (
        "sweep",
        [
            "divmerge sweep drive.mcap -o tradeoff.svg",
            "divmerge sweep drive.mcap --over angle --values 5,10,15 --presets paper",
            "divmerge sweep drive.mcap --over cluster.fragments.bridged --values 1,1.5,2",
        ],
    ),
    (
        "triage",
        [
            "divmerge triage drive.mcap",
            "divmerge triage drive.mcap --report pages",
            "divmerge triage drive.mcap --frames 0..100 --csv suspects.csv",
        ],
    ),
    (
        "view",
        [
            "divmerge view drive.mcap",
            "divmerge view drive.mcap --save drive.rrd --frames 0..20",
            "divmerge view drive.mcap --connect rerun+http://127.0.0.1:9876/proxy",
        ],
    ),
];

/// The command line with headings, short help and examples.
pub fn arranged(cli: Command) -> Command {
    cli.mut_subcommands(|command| {
        let name = command.get_name().to_owned();
        let command = command.mut_args(|arg| arranged_arg(arg, &name));
        let command =
            command.mut_subcommands(|inner| inner.mut_args(|arg| arranged_arg(arg, &name)));
        match EXAMPLES.iter().find(|(command, _)| *command == name) {
            Some((_, examples)) => {
                command.after_help(format!("Examples:\n  {}", examples.join("\n  ")))
            }
            None => command,
        }
    })
}

fn arranged_arg(mut arg: Arg, command: &str) -> Arg {
    let Some(name) = arg.get_long().map(str::to_owned) else {
        let own = format!("{command}/input");
        return match arg.is_positional() {
            true => with_short_help(arg, &[&own]),
            false => arg,
        };
    };
    if arg.get_help_heading().is_none()
        && let Some((heading, _)) = found(HEADINGS, command, &name)
    {
        arg = arg.help_heading(heading);
    }
    if let Some((_, names)) = COMMON.iter().find(|(owner, _)| *owner == command) {
        arg = arg.hide_short_help(!has(names, &name));
    }
    if let Some((_, names)) = USELESS.iter().find(|(owner, _)| *owner == command) {
        arg = arg.hide(has(names, &name));
    }
    with_short_help(arg, &[&format!("{command}/{name}"), &name])
}

/// An argument with the short text of the first of these keys that has one.
fn with_short_help(arg: Arg, keys: &[&str]) -> Arg {
    let mut texts = keys.iter().filter_map(|key| SHORT_HELP.iter().find(|(own, _)| own == key));
    let long = arg.get_long_help().or(arg.get_help()).cloned();
    match (texts.next(), long) {
        (Some((_, short)), Some(long)) => arg.help(*short).long_help(long),
        _ => arg,
    }
}

/// The entry whose list has an option of a command: that of the command alone first.
fn found<'a>(
    table: &'a [(&str, &str)],
    command: &str,
    name: &str,
) -> Option<&'a (&'a str, &'a str)> {
    let own = format!("{command}/{name}");
    let by = |name: &str| table.iter().find(|(_, names)| has(names, name));
    by(&own).or_else(|| by(name))
}

fn has(names: &str, name: &str) -> bool {
    names.split_whitespace().any(|other| other == name)
}

#[cfg(test)]
mod tests {
    use clap::CommandFactory;

    use super::*;
    use crate::cli::Cli;

    /// Lines of a screen.
    const SCREEN: usize = 40;

    fn commands() -> Vec<Command> {
        let mut cli = arranged(Cli::command());
        cli.build();
        let commands = cli.get_subcommands().filter(|command| command.get_name() != "help");
        commands.cloned().collect()
    }

    #[test]
    fn short_help_fits_a_screen_and_long_help_has_all_options() {
        for command in commands() {
            let name = command.get_name().to_owned();
            let short = command.clone().term_width(80).render_help().to_string();
            let mut command = command.term_width(100);
            assert!(short.lines().count() <= SCREEN, "{name}:\n{short}");
            let long = command.render_long_help().to_string();
            let options = command.get_arguments().filter(|arg| !arg.is_hide_set());
            for option in options.filter_map(Arg::get_long) {
                assert!(long.contains(&format!("--{option}")), "{name} --{option}");
            }
            // A list without a space in it has a line of its own.
            let is_wide = |line: &&str| line.chars().count() > 100 && line.trim().contains(' ');
            assert_eq!(long.lines().find(is_wide), None, "{name}");
        }
    }

    #[test]
    fn each_option_has_a_heading_and_each_table_names_options_that_are_there() {
        let commands = commands();
        for command in &commands {
            for arg in command.get_arguments() {
                let is_shown = |name: &&str| *name != "help" && !arg.is_hide_set();
                let Some(option) = arg.get_long().filter(is_shown) else { continue };
                let name = command.get_name();
                assert!(arg.get_help_heading().is_some(), "{name} --{option} has no heading");
            }
        }
        let has_option = |command: &str, option: &str| {
            let mut own =
                commands.iter().filter(|own| command.is_empty() || own.get_name() == command);
            own.any(|own| {
                let inner = own.get_subcommands().flat_map(Command::get_arguments);
                own.get_arguments().chain(inner).any(|arg| arg.get_long() == Some(option))
            })
        };
        for (_, names) in HEADINGS {
            for name in names.split_whitespace() {
                let (command, option) = name.split_once('/').unwrap_or(("", name));
                assert!(has_option(command, option), "no option {name}");
            }
        }
        for (command, names) in COMMON.iter().chain(USELESS) {
            let names = names.split_whitespace();
            names.for_each(|name| assert!(has_option(command, name), "{command} --{name}"));
        }
        for (name, _) in SHORT_HELP.iter().filter(|(name, _)| *name != "annotate/input") {
            let (command, option) = name.split_once('/').unwrap_or(("", name));
            assert!(has_option(command, option), "no option {name}");
        }
    }

    /// The commands of divmerge in blocks of shell of a document, without what follows them.
    fn commands_of(document: &str) -> Vec<Vec<String>> {
        let blocks = document.split("```sh\n").skip(1);
        let blocks = blocks.map(|block| block.split("```").next().unwrap_or_default());
        let lines = blocks.flat_map(|block| {
            let joined = block.replace("\\\n", " ");
            joined.lines().map(str::to_owned).collect::<Vec<_>>()
        });
        let command = |line: String| {
            let own = line.split(" | ").find(|part| part.starts_with("divmerge "))?.to_owned();
            let words = own.split_whitespace();
            let words = words.take_while(|word| !["#", ">", "2>", "&&"].contains(word));
            // A shell's names of many files are one.
            Some(words.map(|word| word.replace(['"', '\''], "")).collect())
        };
        lines.filter_map(command).collect()
    }

    #[test]
    fn commands_in_documents_are_understood() {
        let root = std::path::Path::new(env!("CARGO_MANIFEST_DIR"));
        let pages = std::fs::read_dir(root.join("docs")).expect("docs");
        let pages = pages.map(|entry| entry.expect("a file").path());
        let pages = pages.filter(|path| path.extension().is_some_and(|end| end == "md"));
        let (mut understood, mut wrong) = (0, Vec::new());
        for page in pages.chain([root.join("README.md")]) {
            let document = std::fs::read_to_string(&page).expect("a page");
            for words in commands_of(&document) {
                // A file of parameters is read where it is named.
                if words.iter().any(|word| word == "--config") {
                    continue;
                }
                match arranged(Cli::command()).try_get_matches_from(&words) {
                    Ok(_) => understood += 1,
                    Err(error) => wrong.push(format!("{}: {words:?}\n{error}", page.display())),
                }
            }
        }
        assert!(wrong.is_empty(), "{}", wrong.join("\n"));
        assert!(understood > 40, "{understood}");
    }

    #[test]
    fn examples_are_commands_that_are_understood() {
        for command in commands() {
            let name = command.get_name();
            let examples = EXAMPLES.iter().find(|(command, _)| *command == name);
            let (_, examples) = examples.unwrap_or_else(|| panic!("no example of {name}"));
            for example in examples {
                let words = example.split_whitespace().take_while(|&word| word != ">");
                let parsed = arranged(Cli::command()).try_get_matches_from(words);
                assert_eq!(
                    parsed.map(drop).map_err(|error| error.to_string()),
                    Ok(()),
                    "{example}"
                );
                assert!(example.starts_with(&format!("divmerge {name}")) && example.len() <= 98);
            }
        }
    }
}
