//! Colour bar of a map.

use crate::output::plot::axis::Axis;
use crate::output::plot::{Anchor, Canvas, colour};

const BAR_WIDTH_PX: f64 = 12.0;

/// Draws the bar to the right of a plot `area` (left, top, width, height), with colours from 0 to `peak`.
pub(super) fn draw_bar(canvas: &mut Canvas, area: [f64; 4], peak: f64, unit: &str) {
    let (left, top, height) = (area[0] + area[2] + 12.0, area[1], area[3]);
    draw_colours(canvas, [left, top, height], 60);
    if peak <= 0.0 {
        canvas.text([left, top - 8.0], Anchor::Start, 11.0, unit);
        return;
    }
    let axis = Axis::with_bounds([0.0, peak], [top + height, top]);
    canvas.text([left, top - 8.0], Anchor::Start, 11.0, &axis.scaled_unit(unit));
    for (value, label) in axis.ticks() {
        let Some(y) = axis.to_pixel(value) else { continue };
        canvas.text([left + BAR_WIDTH_PX + 4.0, y + 4.0], Anchor::Start, 11.0, &label.unwrap_or_default());
    }
    let largest = three_digits(peak / 10_f64.powi(axis.label_exponent()));
    // This text lies below the last label of the x axis, which reaches under the bar.
    canvas.text([left + 57.0, top + height + 34.0], Anchor::End, 11.0, &format!("max {largest}"));
}

/// Draws the colours from low (bottom) to high in `steps` steps, in a bar of this `height` at `left`, `top`.
pub(super) fn draw_colours(canvas: &mut Canvas, [left, top, height]: [f64; 3], steps: u32) {
    let step = height / f64::from(steps);
    for i in 0..steps {
        let fill = colour::map_colour((f64::from(i) + 0.5) / f64::from(steps));
        let y = top + height - f64::from(i + 1) * step;
        canvas.add(format_args!(
            r#"<rect x="{left}" y="{y:.2}" width="{BAR_WIDTH_PX}" height="{:.2}" fill="{fill}" shape-rendering="crispEdges"/>"#,
            step + 0.5
        ));
    }
}

fn three_digits(value: f64) -> String {
    let digits = value.log10().floor() as i32;
    format!("{value:.*}", (2 - digits).max(0) as usize)
}
