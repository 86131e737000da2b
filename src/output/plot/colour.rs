//! Colours of maps and lines.

/// Colours of the series of a chart, distinguishable with colour-blindness.
///
/// # Source
/// M. Okabe, K. Ito, Color universal design, 2008.
pub(crate) const SERIES_COLOURS: [&str; 7] =
    ["#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9", "#222222"];

/// Colours from low to high. Low values are nearly as light as open cells, which stay white.
const COLOUR_MAP: [[f64; 3]; 7] = [
    [255.0, 255.0, 217.0],
    [217.0, 240.0, 163.0],
    [127.0, 205.0, 187.0],
    [65.0, 182.0, 196.0],
    [29.0, 145.0, 192.0],
    [37.0, 82.0, 160.0],
    [8.0, 29.0, 88.0],
];

/// Colour of the relative value `share` in 0..=1, as `#rrggbb`.
pub(crate) fn map_colour(share: f64) -> String {
    let at = share.clamp(0.0, 1.0) * (COLOUR_MAP.len() - 1) as f64;
    let below = (at.floor() as usize).min(COLOUR_MAP.len() - 2);
    let rest = at - below as f64;
    let [r, g, b] = [0, 1, 2].map(|k| {
        (COLOUR_MAP[below][k] + rest * (COLOUR_MAP[below + 1][k] - COLOUR_MAP[below][k])).round() as u8
    });
    format!("#{r:02x}{g:02x}{b:02x}")
}
