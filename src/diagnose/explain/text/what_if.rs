//! Which change of one parameter gives the other answer.

use std::fmt::{self, Write};

use crate::diagnose::explain::{Choice, Flip, Number, WhatIf};
use crate::text::wrapped;

/// Writes the changes that give the other answer, then the parameters that never do.
pub(super) fn write(out: &mut String, what_if: &[WhatIf]) -> fmt::Result {
    if what_if.is_empty() {
        return writeln!(
            out,
            "No parameter of the clustering changes the answer: the object mask decides."
        );
    }
    let (mut found, mut searched, mut others) = (Vec::new(), Vec::new(), 0);
    for each in what_if {
        let (name, path, change) = match each {
            WhatIf::Number(number) => (number.parameter, Some(number.path), number_change(number)),
            WhatIf::Choice(choice) => (choice.parameter, choice.path, choice_change(choice)),
        };
        match change {
            Ok(change) => found.push(format!("  {name:<23} {change}")),
            // What has no name but its path is counted: there are many.
            Err(_) if path == Some(name) => others += 1,
            Err(range) => searched.push(format!("{name} ({range})")),
        }
    }
    if others > 0 {
        let which = match searched.is_empty() {
            true => format!("all {others} parameters tried"),
            false => format!("and {others} more"),
        };
        searched.push(format!("{which} (`--json` lists them)"));
    }
    writeln!(out, "Each of these changes alone gives the other answer (found by trying):")?;
    match found.is_empty() {
        true => writeln!(out, "  none of those tried")?,
        false => writeln!(out, "{}", found.join("\n"))?,
    }
    match searched.is_empty() {
        true => Ok(()),
        false => {
            let text = format!("Without effect on the answer: {}.", searched.join(", "));
            wrapped(&text, 96).iter().try_for_each(|line| writeln!(out, "  {line}"))
        }
    }
}

/// The smallest changes, or the range that was searched without finding one.
fn number_change(number: &Number) -> Result<String, String> {
    let unit = match number.unit {
        "" => String::new(),
        unit => format!(" {unit}"),
    };
    let Some(smallest) = number.smallest() else {
        return Err(format!("{} to {}{unit}", number.searched[0], number.searched[1]));
    };
    let flip = |flip: Flip| {
        let (value, not_yet) = (value(flip.value), value(flip.unchanged_at));
        match flip.unchanged_at == number.now {
            true => format!("{value}{unit}"),
            false => format!("{value}{unit} ({not_yet} is not enough)"),
        }
    };
    let both = [number.lower, number.higher].into_iter().flatten();
    let other =
        both.filter(|&other| other != smallest).map(|other| format!(", or {}", flip(other)));
    Ok(format!("{} -> {}{}", value(number.now), flip(smallest), other.collect::<String>()))
}

fn value(value: f64) -> String {
    match value {
        value if value >= f64::from(1 << 20) => "any".to_owned(),
        value => value.to_string(),
    }
}

/// The other values that change the answer, or all that were tried.
fn choice_change(choice: &Choice) -> Result<String, String> {
    match &choice.flips[..] {
        [] => Err(choice.tried.join(", ")),
        flips => Ok(format!("{} -> {}", choice.now, flips.join(" or "))),
    }
}
