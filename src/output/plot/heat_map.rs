//! Heat maps: values over two axes with a few positions each.

use crate::output::number_format::five_digits_of_group;
use crate::output::plot::bar::draw_colours;
use crate::output::plot::{Anchor, Canvas, PANEL, colour};

/// Heat map of a table of values.
#[derive(Debug, Clone, PartialEq)]
pub struct HeatMap {
    /// Title.
    pub title: String,
    /// Labels of x, y and the values, with units.
    pub labels: [String; 3],
    /// Names of the columns from left to right, and of the rows from bottom to top.
    pub names: [Vec<String>; 2],
    /// Values, row by row from bottom to top; `None` where a value is missing.
    pub values: Vec<Option<f64>>,
}

/// Plot area: left, top, width, height.
const AREA: [f64; 4] = [76.0, 34.0, 384.0, 314.0];
const MIN_LABELLED_WIDTH_PX: f64 = 50.0;
const MIN_LABELLED_HEIGHT_PX: f64 = 16.0;
const STEPS: u32 = 50;

impl HeatMap {
    pub(crate) fn panel(&self) -> Canvas {
        let mut canvas = Canvas::default();
        let [left, top, width, height] = AREA;
        let counts = [0, 1].map(|k| self.names[k].len());
        let size = [width / counts[0].max(1) as f64, height / counts[1].max(1) as f64];
        let known = || self.values.iter().flatten().copied();
        let (low, high) = known().fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), v| (l.min(v), h.max(v)));
        let largest = low.abs().max(high.abs());
        canvas.text([0.5 * PANEL[0], 20.0], Anchor::Middle, 14.0, &self.title);
        let numbers = size[0] >= MIN_LABELLED_WIDTH_PX && size[1] >= MIN_LABELLED_HEIGHT_PX;
        for (i, value) in self.values.iter().enumerate() {
            let (column, row) = (i % counts[0], i / counts[0]);
            let at = [left + column as f64 * size[0], top + height - (row + 1) as f64 * size[1]];
            let Some(value) = value else { continue };
            let share = if high > low { (value - low) / (high - low) } else { 0.5 };
            let (fill, [w, h]) = (colour::map_colour(share), size);
            canvas.add(format_args!(
                r#"<rect x="{:.2}" y="{:.2}" width="{w:.2}" height="{h:.2}" fill="{fill}" shape-rendering="crispEdges"/>"#,
                at[0], at[1]
            ));
            if numbers {
                let ink = if share > 0.5 { "white" } else { "#222" };
                canvas.add(format_args!(r#"<g fill="{ink}">"#));
                let middle = [at[0] + 0.5 * w, at[1] + 0.5 * h + 4.0];
                canvas.text(middle, Anchor::Middle, 11.0, &five_digits_of_group(*value, largest));
                canvas.add(format_args!("</g>"));
            }
        }
        canvas.add(format_args!(
            r##"<rect x="{left}" y="{top}" width="{width}" height="{height}" fill="none" stroke="#555"/>"##
        ));
        let longest = self.names[0].iter().map(|name| name.chars().count()).max().unwrap_or(0);
        let every = |room: f64, step: f64| (room / step).ceil().max(1.0) as usize;
        for (i, name) in self.names[0].iter().enumerate().step_by(every(6.6 * longest as f64 + 8.0, size[0]))
        {
            canvas.text([left + (i as f64 + 0.5) * size[0], top + height + 17.0], Anchor::Middle, 12.0, name);
        }
        for (i, name) in self.names[1].iter().enumerate().step_by(every(MIN_LABELLED_HEIGHT_PX, size[1])) {
            let y = top + height - (i as f64 + 0.5) * size[1] + 4.0;
            canvas.text([left - 7.0, y], Anchor::End, 12.0, name);
        }
        canvas.text([left + 0.5 * width, PANEL[1] - 12.0], Anchor::Middle, 13.0, &self.labels[0]);
        canvas.upward_text([17.0, top + 0.5 * height], 13.0, &self.labels[1]);
        if high.is_finite() {
            self.bar(&mut canvas, [low, high]);
        }
        canvas
    }

    fn bar(&self, canvas: &mut Canvas, [low, high]: [f64; 2]) {
        let number = |x: f64| five_digits_of_group(x, low.abs().max(high.abs()));
        let (left, top, height) = (AREA[0] + AREA[2] + 14.0, AREA[1], AREA[3]);
        draw_colours(canvas, [left, top, height], STEPS);
        canvas.text([left + 18.0, top + 10.0], Anchor::Start, 11.0, &number(high));
        canvas.text([left + 18.0, top + height], Anchor::Start, 11.0, &number(low));
        canvas.upward_text([PANEL[0] - 22.0, top + 0.5 * height], 12.0, &self.labels[2]);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Truth: positions computed by hand: columns of 192 pixels from 76, and rows of 157 pixels upwards from 348. The
    /// smallest value is lightest and the largest value darkest. A missing value has no colour.
    #[test]
    fn fields_lie_where_their_values_do() {
        let names = [vec!["0".into(), "90".into()], vec!["a".into(), "b".into()]];
        let heat = HeatMap {
            title: "t".into(),
            labels: ["x".into(), "y".into(), "z".into()],
            names,
            values: vec![Some(1.0), None, Some(2.0), Some(3.0)],
        };
        let picture = heat.panel().into_svg(PANEL);
        let field = |x: &str, y: &str, share: f64| {
            let fill = colour::map_colour(share);
            let rect =
                format!("<rect x=\"{x}\" y=\"{y}\" width=\"192.00\" height=\"157.00\" fill=\"{fill}\"");
            picture.matches(&rect).count()
        };
        assert_eq!(field("76.00", "191.00", 0.0), 1, "{picture}");
        assert_eq!(field("76.00", "34.00", 0.5), 1);
        assert_eq!(field("268.00", "34.00", 1.0), 1);
        assert_eq!(picture.matches("width=\"192.00\"").count(), 3);
    }
}
