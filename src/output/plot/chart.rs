//! Charts: lines and points of series over linear or logarithmic axes.

use crate::output::plot::axis::{Axis, Scale};
use crate::output::plot::colour::SERIES_COLOURS;
use crate::output::plot::{Anchor, Canvas, PANEL};

/// Named series of points.
#[derive(Debug, Clone, PartialEq)]
pub struct Series {
    /// Name in the legend.
    pub name: String,
    /// Points (x, y), joined in order. Points that the axes cannot show are omitted.
    pub points: Vec<[f64; 2]>,
}

/// Shaded range around a series, in its colour.
#[derive(Debug, Clone, PartialEq)]
pub struct Band {
    /// Index of the series.
    pub series: usize,
    /// Edges (x, low, high), in order of x.
    pub edges: Vec<[f64; 3]>,
}

/// Chart of one or several series.
#[derive(Debug, Clone, PartialEq)]
pub struct Chart {
    /// Title.
    pub title: String,
    /// Labels of x and y, with units.
    pub labels: [String; 2],
    /// Scales of x and y.
    pub scales: [Scale; 2],
    /// Series.
    pub series: Vec<Series>,
}

/// Margins around the plot area: left, top, right, bottom.
const MARGIN: [f64; 4] = [76.0, 34.0, 18.0, 52.0];

impl Chart {
    /// Draws the chart as an SVG picture.
    pub fn svg(&self) -> String {
        self.panel().into_svg(PANEL)
    }

    pub(crate) fn panel(&self) -> Canvas {
        self.panel_with_bands(&[])
    }

    pub(crate) fn scattered_panel(&self) -> Canvas {
        self.drawn(&[], false)
    }

    pub(crate) fn panel_with_bands(&self, bands: &[Band]) -> Canvas {
        self.drawn(bands, true)
    }

    fn drawn(&self, bands: &[Band], joined: bool) -> Canvas {
        let mut axes = self.axes(bands, 0.0);
        let (mut corner, hidden) = self.legend_corner(&axes);
        if hidden > 0 && self.series.len() > 1 {
            let height = PANEL[1] - MARGIN[3] - MARGIN[1];
            let share = (self.legend_size()[1] + 24.0) / height;
            let roomy = self.axes(bands, (share / (1.0 - share)).clamp(0.0, 1.0));
            let (place, left) = self.legend_corner(&roomy);
            if left < hidden {
                (axes, corner) = (roomy, place);
            }
        }
        let mut canvas = Canvas::default();
        canvas.text([0.5 * PANEL[0], 20.0], Anchor::Middle, 14.0, &self.title);
        self.draw_axes(&mut canvas, &axes);
        bands.iter().for_each(|band| draw_band(&mut canvas, band, &axes));
        for (i, series) in self.series.iter().enumerate() {
            draw_series(&mut canvas, series, &axes, i, joined);
        }
        self.draw_legend(&mut canvas, corner);
        canvas
    }

    /// Axes of x and y. A linear y axis is extended upwards by the fraction `room` of its range.
    fn axes(&self, bands: &[Band], room: f64) -> [Axis; 2] {
        let edges = |axis: usize| {
            let at = move |[x, low, high]: &[f64; 3]| if axis == 0 { [*x; 2] } else { [*low, *high] };
            bands.iter().flat_map(move |band| band.edges.iter().flat_map(at))
        };
        let values = |axis: usize| {
            self.series.iter().flat_map(move |s| s.points.iter().map(move |p| p[axis])).chain(edges(axis))
        };
        let x = Axis::spanning(values(0), self.scales[0], [MARGIN[0], PANEL[0] - MARGIN[2]]);
        let finite = values(1).filter(|y| y.is_finite());
        let (low, high) = finite.fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), y| (l.min(y), h.max(y)));
        // [`Axis::spanning`] starts an axis at 0 if its smallest value is positive and below 0.4 times the largest value.
        let low = if low > 0.0 && low < 0.4 * high { 0.0 } else { low };
        let above = (room > 0.0 && self.scales[1] == Scale::Linear).then_some(high + room * (high - low));
        let y = Axis::spanning(values(1).chain(above), self.scales[1], [PANEL[1] - MARGIN[3], MARGIN[1]]);
        [x, y]
    }

    fn draw_axes(&self, canvas: &mut Canvas, axes: &[Axis; 2]) {
        let (left, top) = (MARGIN[0], MARGIN[1]);
        let (right, bottom) = (PANEL[0] - MARGIN[2], PANEL[1] - MARGIN[3]);
        for (value, label) in axes[0].ticks() {
            let Some(x) = axes[0].to_pixel(value) else { continue };
            let shade = if label.is_some() { "#ddd" } else { "#f2f2f2" };
            canvas.add(format_args!(r#"<path d="M{x:.1} {top}V{bottom}" stroke="{shade}"/>"#));
            let Some(label) = label else { continue };
            let middle = x.min(PANEL[0] - 2.0 - 3.5 * label.chars().count() as f64);
            canvas.text([middle, bottom + 17.0], Anchor::Middle, 12.0, &label);
        }
        for (value, label) in axes[1].ticks() {
            let Some(y) = axes[1].to_pixel(value) else { continue };
            let shade = if label.is_some() { "#ddd" } else { "#f2f2f2" };
            canvas.add(format_args!(r#"<path d="M{left} {y:.1}H{right}" stroke="{shade}"/>"#));
            if let Some(label) = label {
                canvas.text([left - 7.0, y + 4.0], Anchor::End, 12.0, &label);
            }
        }
        let (width, height) = (right - left, bottom - top);
        canvas.add(format_args!(
            r##"<rect x="{left}" y="{top}" width="{width}" height="{height}" fill="none" stroke="#555"/>"##
        ));
        let [x_power, y_power] = [0, 1].map(|axis| axes[axis].label_exponent());
        if x_power != 0 {
            canvas.text([right, PANEL[1] - 12.0], Anchor::End, 12.0, &times(x_power));
        }
        if y_power != 0 {
            canvas.text([left - 7.0, top - 8.0], Anchor::End, 12.0, &times(y_power));
        }
        canvas.text([0.5 * (left + right), PANEL[1] - 12.0], Anchor::Middle, 13.0, &self.labels[0]);
        canvas.upward_text([17.0, 0.5 * (top + bottom)], 13.0, &self.labels[1]);
    }

    fn legend_size(&self) -> [f64; 2] {
        let longest = self.series.iter().map(|s| s.name.chars().count()).max().unwrap_or(0);
        [44.0 + 6.6 * longest as f64, 8.0 + 18.0 * self.series.len() as f64]
    }

    /// Upper left corner at which the legend hides the fewest points, and the number of hidden points.
    fn legend_corner(&self, axes: &[Axis; 2]) -> ([f64; 2], usize) {
        let [width, height] = self.legend_size();
        let (left, top) = (MARGIN[0] + 8.0, MARGIN[1] + 8.0);
        let room = [PANEL[0] - MARGIN[2] - width - 8.0 - left, PANEL[1] - MARGIN[3] - height - 8.0 - top];
        let places = (0..5).flat_map(|row| {
            (0..5).map(move |column| {
                [left + room[0] * (1.0 - 0.25 * f64::from(column)), top + room[1] * 0.25 * f64::from(row)]
            })
        });
        let hidden = |[left, top]: [f64; 2]| {
            let inside = |p: &[f64; 2]| match (axes[0].to_pixel(p[0]), axes[1].to_pixel(p[1])) {
                (Some(x), Some(y)) => {
                    (left - 8.0..left + width + 8.0).contains(&x)
                        && (top - 8.0..top + height + 8.0).contains(&y)
                }
                _ => false,
            };
            self.series.iter().flat_map(|s| densify(&s.points, axes)).filter(inside).count()
        };
        let counted = places.map(|place| (place, hidden(place)));
        counted.min_by_key(|(_, hidden)| *hidden).unwrap_or(([left, top], 0))
    }

    fn draw_legend(&self, canvas: &mut Canvas, [left, top]: [f64; 2]) {
        if self.series.len() < 2 {
            return;
        }
        let [width, height] = self.legend_size();
        canvas.add(format_args!(
            r##"<rect x="{left:.1}" y="{top:.1}" width="{width:.1}" height="{height:.1}" fill="white" fill-opacity="0.85" stroke="#ccc"/>"##
        ));
        for (i, series) in self.series.iter().enumerate() {
            let y = top + 13.0 + 18.0 * i as f64;
            let colour = SERIES_COLOURS[i % SERIES_COLOURS.len()];
            let (from, to, dashes) = (left + 6.0, left + 30.0, dashes(i));
            canvas.add(format_args!(
                r#"<path d="M{from:.1} {y:.1}H{to:.1}" stroke="{colour}" stroke-width="1.8"{dashes}/>"#
            ));
            draw_marker(canvas, [left + 18.0, y], i);
            canvas.text([left + 36.0, y + 4.0], Anchor::Start, 12.0, &series.name);
        }
    }
}

/// Points of a series that the axes can show, and intermediate points on every segment. The fewer points the series
/// has, the more intermediate points each segment gets.
fn densify(points: &[[f64; 2]], axes: &[Axis; 2]) -> Vec<[f64; 2]> {
    let shown = |p: &&[f64; 2]| axes[0].to_pixel(p[0]).is_some() && axes[1].to_pixel(p[1]).is_some();
    let shown: Vec<[f64; 2]> = points.iter().filter(shown).copied().collect();
    let few = (60 / shown.len().max(1)).max(2);
    let between = shown.windows(2).flat_map(|w| {
        let at = |k: usize| k as f64 / few as f64;
        (1..few).map(move |k| [0, 1].map(|axis| w[0][axis] + at(k) * (w[1][axis] - w[0][axis])))
    });
    shown.iter().copied().chain(between).collect()
}

fn draw_series(canvas: &mut Canvas, series: &Series, axes: &[Axis; 2], i: usize, joined: bool) {
    let shown: Vec<[f64; 2]> = series
        .points
        .iter()
        .filter_map(|p| Some([axes[0].to_pixel(p[0])?, axes[1].to_pixel(p[1])?]))
        .collect();
    let path: Vec<String> = shown.iter().map(|[x, y]| format!("{x:.1} {y:.1}")).collect();
    let colour = SERIES_COLOURS[i % SERIES_COLOURS.len()];
    if joined && path.len() > 1 {
        canvas.add(format_args!(
            r#"<path d="M{}" fill="none" stroke="{colour}" stroke-width="1.8"{}/>"#,
            path.join("L"),
            dashes(i)
        ));
    }
    if !joined || shown.len() <= 60 {
        shown.iter().for_each(|at| draw_marker(canvas, *at, i));
    }
}

fn times(power: i32) -> String {
    format!("\u{d7}10^{{{power}}}").replace("{-", "{\u{2212}")
}

fn draw_band(canvas: &mut Canvas, band: &Band, axes: &[Axis; 2]) {
    let side = |k: usize| {
        band.edges.iter().filter_map(move |edge| {
            Some(format!("{:.1} {:.1}", axes[0].to_pixel(edge[0])?, axes[1].to_pixel(edge[k])?))
        })
    };
    let low: Vec<String> = side(1).collect();
    let mut around: Vec<String> = side(2).collect();
    around.extend(low.into_iter().rev());
    let colour = SERIES_COLOURS[band.series % SERIES_COLOURS.len()];
    if around.len() > 2 {
        let path = around.join("L");
        canvas.add(format_args!(r#"<path d="M{path}z" fill="{colour}" fill-opacity="0.2"/>"#));
    }
}

fn dashes(i: usize) -> &'static str {
    if i < SERIES_COLOURS.len() { "" } else { r#" stroke-dasharray="6 4""# }
}

/// Draws the marker of series `i`. Markers differ in shape as well as in colour.
fn draw_marker(canvas: &mut Canvas, [x, y]: [f64; 2], i: usize) {
    let colour = SERIES_COLOURS[i % SERIES_COLOURS.len()];
    let path = match i % 4 {
        0 => {
            canvas.add(format_args!(r#"<circle cx="{x:.1}" cy="{y:.1}" r="3.6" fill="{colour}"/>"#));
            return;
        }
        1 => format!("M{:.1} {:.1}h6.4v6.4h-6.4z", x - 3.2, y - 3.2),
        2 => format!("M{x:.1} {:.1}l4.3 7.4h-8.6z", y - 4.6),
        _ => format!("M{x:.1} {:.1}l4.4 4.4l-4.4 4.4l-4.4 -4.4z", y - 4.4),
    };
    canvas.add(format_args!(r#"<path d="{path}" fill="{colour}"/>"#));
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Truth: where lines fill the plot area, the legend lies above them.
    #[test]
    fn legends_hide_no_lines() {
        let line = |i: usize| Series {
            name: format!("series {i}"),
            points: vec![[0.0, i as f64], [1.0, 6.0 - i as f64]],
        };
        let chart = Chart {
            title: String::new(),
            labels: [String::new(), String::new()],
            scales: [Scale::Linear, Scale::Linear],
            series: (0..7).map(line).collect(),
        };
        assert!(chart.legend_corner(&chart.axes(&[], 0.0)).1 > 0);
        let picture = chart.svg();
        let number = |line: &str, key: &str| -> f64 {
            line.split(&format!(" {key}=\""))
                .nth(1)
                .and_then(|rest| rest.split('"').next())
                .unwrap()
                .parse()
                .unwrap()
        };
        let legend = picture.lines().find(|line| line.contains("fill-opacity=\"0.85\"")).unwrap();
        let bottom = number(legend, "y") + number(legend, "height");
        let highest = picture
            .lines()
            .filter(|line| line.contains("<circle") && line.contains("r=\"3.6\""))
            .map(|line| number(line, "cy"))
            .filter(|y| *y > bottom)
            .count();
        // Circles at the ends of the first and fifth series. The circles in the legend lie above its lower edge.
        assert_eq!(highest, 4, "{picture}");
    }

    /// Truth: corners of the band, computed by hand for 0 to 10 mm on 466 pixels and 0 to 10 N on 314.
    #[test]
    fn bands_lie_around_their_series() {
        let chart = Chart {
            title: String::new(),
            labels: [String::new(), String::new()],
            scales: [Scale::Linear, Scale::Linear],
            series: vec![Series { name: "a".into(), points: vec![[0.0, 2.0], [10.0, 8.0]] }],
        };
        let band = Band { series: 0, edges: vec![[0.0, 0.0, 4.0], [10.0, 6.0, 10.0]] };
        let picture = chart.panel_with_bands(&[band]).into_svg(PANEL);
        let path = "M76.0 222.4L542.0 34.0L542.0 159.6L76.0 348.0z";
        assert!(picture.contains(path), "{picture}");
    }
}
