//! A page on a dark ground: the panels stay as they are, since they are dark on every page.

use super::canvas::{Canvas, Colour, Drawing, Stroke};
use super::theme;

/// The colours of a light page and what they become on a dark one.
const DARK: [(Colour, Colour); 4] = [
    (theme::PAGE, [21, 23, 27, 255]),
    (theme::INK, [228, 230, 234, 255]),
    (theme::FAINT_INK, [154, 160, 169, 255]),
    (theme::PALE_INK, [92, 98, 108, 255]),
];

/// Rules of a style sheet that put the pages among its elements on a dark ground.
pub fn dark_rules(elements: &str) -> String {
    let hex = |[r, g, b, _]: Colour| format!("#{r:02x}{g:02x}{b:02x}");
    let rule = |&(light, dark): &(Colour, Colour)| {
        let (light, dark) = (hex(light), hex(dark));
        ["fill", "stroke"]
            .map(|what| {
                // What lets through what is below it lies on a panel.
                let is_it = format!("[{what}=\"{light}\"]:not([{what}-opacity])");
                format!("  {elements} {is_it} {{ {what}: {dark}; }}\n")
            })
            .concat()
    };
    DARK.iter().map(rule).collect()
}

/// The same page on a dark ground.
pub fn dark_page(mut canvas: Canvas) -> Canvas {
    darken(&mut canvas.background);
    canvas.shapes.iter_mut().for_each(shape);
    canvas
}

fn shape(drawing: &mut Drawing) {
    match drawing {
        Drawing::Path { fill, stroke, .. } | Drawing::Circle { fill, stroke, .. } => {
            fill.iter_mut().for_each(darken);
            stroke.iter_mut().for_each(|Stroke { colour, .. }| darken(colour));
        }
        Drawing::Text { style, .. } => darken(&mut style.colour),
        Drawing::Clip { shapes, .. } => shapes.iter_mut().for_each(shape),
        Drawing::Picture { .. } => {}
    }
}

fn darken(colour: &mut Colour) {
    if let Some((_, dark)) = DARK.iter().find(|(light, _)| light == colour) {
        *colour = *dark;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::view::canvas::{Anchor, Area};

    const ON_PANEL: Colour = crate::view::look::DARK.on_panel;

    #[test]
    fn rules_are_for_each_colour_of_the_page() {
        let rules = dark_rules("figure svg");
        assert_eq!(rules.lines().count(), 2 * DARK.len());
        let page = "  figure svg [fill=\"#ffffff\"]:not([fill-opacity]) { fill: #15171b; }";
        assert_eq!(rules.lines().next(), Some(page));
    }

    #[test]
    fn page_and_ink_change_and_panels_stay() {
        let mut page = Canvas::new(9.0, 9.0, theme::PAGE);
        let area = Area { x: 0.0, y: 0.0, width: 2.0, height: 2.0 };
        page.clipped(area, |page| page.text([1.0, 1.0], "a", theme::faint(Anchor::Start)));
        page.rect(area, Some(ON_PANEL), None);
        let dark = dark_page(page);
        assert_eq!(dark.background, DARK[0].1);
        let Drawing::Clip { shapes, .. } = &dark.shapes[0] else { panic!("{dark:?}") };
        assert!(matches!(&shapes[0], Drawing::Text { style, .. } if style.colour == DARK[2].1));
        let is_kept = |fill: &Option<Colour>| *fill == Some(ON_PANEL);
        assert!(matches!(&dark.shapes[1], Drawing::Path { fill, .. } if is_kept(fill)));
    }
}
