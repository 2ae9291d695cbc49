//! Axes beside panels: their ticks and numbers.

use super::canvas::{Anchor, Area, Canvas, Stroke, TextStyle};
use super::font::{self, Weight};
use super::theme;

/// Room left of a panel.
pub const LEFT: f64 = 34.0;
/// Room below a panel.
pub const BELOW: f64 = 16.0;
/// Size of the numbers.
const SIZE: f64 = 9.5;
const TICK: f64 = 3.5;
const BESIDE_TICK: f64 = 3.0;
/// How far numbers below reach beyond the right end of a panel, at most.
const BEYOND: f64 = 6.0;

/// A place on an axis.
#[derive(Debug, Clone, PartialEq)]
pub struct Tick {
    /// Page units from the left or upper end of the panel.
    pub at: f64,
    /// The number there.
    pub words: String,
}

/// What axes leave of an area for the panel.
pub fn inside(slot: Area) -> Area {
    Area {
        x: slot.x + LEFT,
        width: (slot.width - LEFT).max(1.0),
        height: (slot.height - BELOW).max(1.0),
        ..slot
    }
}

/// A number as people write it, with the sign of minus.
pub fn number(value: f64) -> String {
    // No -0.
    let value = (value * 1000.0).round() / 1000.0 + 0.0;
    format!("{value}").replace('-', "−")
}

/// Whether ticks in their order are so far apart that their numbers are.
pub fn are_apart(ticks: &[Tick], least: f64) -> bool {
    ticks.windows(2).all(|pair| pair[1].at - pair[0].at >= least)
}

/// Draws ticks below a panel, with or without their numbers.
pub fn below(canvas: &mut Canvas, area: Area, ticks: &[Tick], has_numbers: bool) {
    let bottom = area.bottom();
    for tick in ticks {
        let x = area.x + tick.at;
        canvas.line([x, bottom], [x, bottom + TICK], line());
        if has_numbers {
            let half = font::width(&tick.words, SIZE, Weight::Regular) / 2.0;
            let middle = x.min(area.right() + BEYOND - half);
            canvas.text([middle, bottom + TICK + SIZE], &tick.words, style(Anchor::Middle));
        }
    }
}

/// Draws ticks left of a panel with their numbers.
pub fn beside(canvas: &mut Canvas, area: Area, ticks: &[Tick]) {
    for tick in ticks {
        let y = area.y + tick.at;
        canvas.line([area.x - TICK, y], [area.x, y], line());
        let right = TICK + BESIDE_TICK;
        let words = font::fitted(&tick.words, SIZE, Weight::Regular, LEFT - right);
        // Numbers at the ends stay beside the panel.
        let baseline = (y + SIZE * 0.36).max(area.y + SIZE * 0.72).min(area.bottom());
        canvas.text([area.x - right, baseline], words, style(Anchor::End));
    }
}

/// Writes the unit of both axes into the corner between them.
pub fn unit(canvas: &mut Canvas, area: Area, words: &str) {
    // Clear of a number at the left end of the panel.
    let place = [area.x - LEFT / 2.0 - 1.0, area.bottom() + TICK + SIZE];
    canvas.text(place, words, style(Anchor::End));
}

/// Draws the frame that panels have in some themes.
pub fn frame(canvas: &mut Canvas, area: Area) {
    if let Some(colour) = canvas.look().frame {
        canvas.rect(area, None, Some(Stroke::solid(colour, 0.8)));
    }
}

fn line() -> Stroke {
    Stroke::solid(theme::FAINT_INK, 0.8)
}

fn style(anchor: Anchor) -> TextStyle {
    theme::text(SIZE, Weight::Regular, theme::FAINT_INK, anchor)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_have_one_sign() {
        assert_eq!([-10.0, 0.5, -0.0].map(number), ["−10", "0.5", "0"]);
    }
}
