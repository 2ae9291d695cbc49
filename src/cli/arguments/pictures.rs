//! Value parsers of figures.

use std::ops::Range;

use super::values::range;
use crate::error::spelling::did_you_mean;
use crate::view::{Panel, PixelCrop, PlaneRegion};

/// Reads the name of a panel.
pub fn panel(text: &str) -> Result<Panel, String> {
    let found = Panel::NAMES.iter().find(|(name, _)| *name == text);
    let names = Panel::NAMES.map(|(name, _)| name);
    found
        .map(|&(_, panel)| panel)
        .ok_or_else(|| format!("use some of {}{}", names.join(", "), did_you_mean(text, &names)))
}

/// Reads `H:W`.
pub fn aspect(text: &str) -> Result<f64, String> {
    let wrong = || "use height:width, as in 1:8, from 1:100 to 10:1".to_owned();
    let (height, width) = text.split_once(':').ok_or_else(wrong)?;
    let number = |text: &str| text.parse::<f64>().map_err(|_| wrong());
    let aspect = number(height)? / number(width)?;
    if (0.01..=10.0).contains(&aspect) { Ok(aspect) } else { Err(wrong()) }
}

/// Reads pixels per inch.
pub fn dpi(text: &str) -> Result<f64, String> {
    let dpi: f64 = text.parse().map_err(|_| "not a number".to_owned())?;
    if (24.0..=1200.0).contains(&dpi) { Ok(dpi) } else { Err("must be in 24..=1200".into()) }
}

/// Reads `COLUMNS/ROWS`.
pub fn window(text: &str) -> Result<PixelCrop, String> {
    let (columns, rows) = match text.split_once('/') {
        Some((columns, rows)) => (columns, Some(rows)),
        None => (text, None),
    };
    let part = |text: &str| if text.is_empty() { Ok(None) } else { range(text).map(Some) };
    Ok(PixelCrop { columns: part(columns)?, rows: rows.map(part).transpose()?.flatten() })
}

/// Reads `X/Y`.
pub fn region(text: &str) -> Result<PlaneRegion, String> {
    let wrong = || "use x/y in metres, as in -10..40/-15..15, a metre to 2 km wide".to_owned();
    let (x, y) = text.split_once('/').ok_or_else(wrong)?;
    let part = |text: &str| {
        let part: Range<f64> = range(text)?;
        let is_wide = (1.0..=2000.0).contains(&(part.end - part.start));
        if is_wide { Ok([part.start, part.end]) } else { Err(wrong()) }
    };
    Ok(PlaneRegion { x: part(x)?, y: part(y)? })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ranges_crops_and_regions() {
        let frames = range::<u64>;
        assert_eq!(frames("3..7"), Ok(3..7));
        assert!(frames("7..3").is_err() && frames("3").is_err() && frames("-1..3").is_err());
        let both = PixelCrop { columns: Some(5..9), rows: Some(1..3) };
        assert_eq!(window("5..9/1..3"), Ok(both));
        assert_eq!(window("/1..3"), Ok(PixelCrop { columns: None, rows: Some(1..3) }));
        assert!(window("5").is_err());
        assert_eq!(
            region("-10..40/-15..15"),
            Ok(PlaneRegion { x: [-10.0, 40.0], y: [-15.0, 15.0] })
        );
        assert!(region("0..0.1/0..9").is_err() && region("0..inf/0..9").is_err());
        assert!(region("nan..2/0..9").is_err());
        assert_eq!(aspect("1:8"), Ok(0.125));
        assert!(aspect("0:8").is_err() && aspect("1:0").is_err() && aspect("8").is_err());
        assert!(aspect("nan:1").is_err() && dpi("nan").is_err() && dpi("1").is_err());
    }
}
