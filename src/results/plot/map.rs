//! Maps of the contact frame: pressure by colour, with the border between stick and slip.

use nalgebra::Vector2;

use super::axis::{Axis, label};
use super::{Anchor, Canvas, arranged, colour};
use crate::frame::ContactFrame;
use crate::history::step::FrameState;

/// Width and height of the panel of a map.
const PANEL: [f64; 2] = [400.0, 370.0];
/// The plot area in it: left, top, width, height.
const AREA: [f64; 4] = [58.0, 40.0, 270.0, 270.0];
/// Grids with more cells along a side are drawn in blocks, each with the mean of its cells.
const MOST_CELLS: usize = 96;
/// Colours are rounded to so many.
const COLOURS: usize = 64;

/// What a map shows of one state.
#[derive(Debug, Clone)]
pub struct Panel {
    title: String,
    pressure: Vec<f64>,
    stick: Vec<bool>,
}

impl Panel {
    /// The pressure and the stick zone of `state`, on a frame of `n` cells.
    pub fn new(title: &str, n: usize, state: &FrameState) -> Self {
        Self {
            title: title.to_owned(),
            pressure: state.tractions.get(2 * n..3 * n).unwrap_or_default().to_vec(),
            stick: state.status.iter().map(|status| *status == 1).collect(),
        }
    }
}

/// Pressure maps side by side, each with its own colour bar; `length` and `stress` are the names of the units.
pub fn pressure_maps(frame: &ContactFrame, panels: &[Panel], length: &str, stress: &str) -> String {
    let shapes = Shapes::new(frame);
    let drawn: Vec<Canvas> = panels.iter().map(|panel| draw(&shapes, panel, length, stress)).collect();
    arranged(&drawn, PANEL, 3)
}

/// The cells as they are drawn, in frame coordinates.
struct Shapes {
    /// Corners of each drawn cell.
    corners: Vec<Vec<Vector2<f64>>>,
    /// The frame's cells that each drawn cell stands for.
    cells: Vec<Vec<usize>>,
}

impl Shapes {
    fn new(frame: &ContactFrame) -> Self {
        let (s, c) = frame.azimuth.sin_cos();
        let flat = |p: &crate::geometry::Point| {
            let arm = p - frame.origin;
            Vector2::new(c * arm.x + s * arm.y, c * arm.y - s * arm.x)
        };
        let corners: Vec<Vec<Vector2<f64>>> =
            frame.all_corners().map(|cell| cell.iter().map(flat).collect()).collect();
        let large = frame.whole_grid().filter(|grid| grid.cells.iter().any(|n| *n > MOST_CELLS));
        match large {
            Some(grid) => Self::blocks(&corners, grid.cells),
            None => Self { cells: (0..corners.len()).map(|i| vec![i]).collect(), corners },
        }
    }

    /// Blocks of a large grid.
    fn blocks(corners: &[Vec<Vector2<f64>>], cells: [usize; 2]) -> Self {
        let [bx, by] = cells.map(|n| n.div_ceil(MOST_CELLS));
        let mut shapes = Self { corners: Vec::new(), cells: Vec::new() };
        for x0 in (0..cells[0]).step_by(bx) {
            for y0 in (0..cells[1]).step_by(by) {
                let (x1, y1) = ((x0 + bx).min(cells[0]), (y0 + by).min(cells[1]));
                let at = |ix: usize, iy: usize| ix * cells[1] + iy;
                shapes.cells.push((x0..x1).flat_map(|ix| (y0..y1).map(move |iy| at(ix, iy))).collect());
                shapes.corners.push(vec![
                    corners[at(x0, y0)][0],
                    corners[at(x1 - 1, y0)][1],
                    corners[at(x1 - 1, y1 - 1)][2],
                    corners[at(x0, y1 - 1)][3],
                ]);
            }
        }
        shapes
    }

    fn all(&self) -> impl Iterator<Item = &Vector2<f64>> {
        self.corners.iter().flatten()
    }
}

fn draw(shapes: &Shapes, panel: &Panel, length: &str, stress: &str) -> Canvas {
    let peak = panel.pressure.iter().copied().fold(0.0, f64::max);
    let [x, y] = axes(shapes);
    let mut canvas = Canvas::default();
    canvas.text([AREA[0], 20.0], Anchor::Start, 14.0, &panel.title);
    let to_pixels = |p: &Vector2<f64>| Some(format!("{:.1} {:.1}", x.at(p.x)?, y.at(p.y)?));
    let mut by_colour = vec![String::new(); COLOURS];
    let mut dots = String::new();
    for (corners, cells) in shapes.corners.iter().zip(&shapes.cells) {
        let sum: f64 = cells.iter().filter_map(|&i| panel.pressure.get(i)).sum();
        if sum <= 0.0 || peak <= 0.0 {
            continue;
        }
        let share = sum / cells.len() as f64 / peak;
        let outline: Vec<String> = corners.iter().filter_map(to_pixels).collect();
        by_colour[((share * COLOURS as f64) as usize).min(COLOURS - 1)] +=
            &format!("M{}z", outline.join("L"));
        let sticking = cells.iter().filter(|&&i| panel.stick.get(i) == Some(&true)).count();
        let middle = corners.iter().sum::<Vector2<f64>>() / corners.len() as f64;
        if 2 * sticking > cells.len() {
            dots += &format!("M{}h0", to_pixels(&middle).unwrap_or_default());
        }
    }
    for (i, outlines) in by_colour.iter().enumerate().filter(|(_, outlines)| !outlines.is_empty()) {
        // The stroke closes the hairlines between neighbours.
        let fill = colour::of_share((i as f64 + 0.5) / COLOURS as f64);
        canvas
            .add(format_args!(r#"<path d="{outlines}" fill="{fill}" stroke="{fill}" stroke-width="0.6"/>"#));
    }
    canvas.add(format_args!(
        r##"<path d="{dots}" stroke="#d55e00" stroke-width="{:.1}" stroke-linecap="round" fill="none"/>"##,
        dot_size(shapes, &x)
    ));
    draw_axes(&mut canvas, &[x, y], length);
    draw_bar(&mut canvas, peak, stress);
    canvas
}

/// Width of the dot in a cell that sticks, pixels: to be seen on few cells, and not to cover many.
fn dot_size(shapes: &Shapes, x: &Axis) -> f64 {
    let doubled = |corners: &Vec<Vector2<f64>>| -> f64 {
        let next = corners.iter().cycle().skip(1);
        corners.iter().zip(next).map(|(a, b)| a.perp(b)).sum()
    };
    let area = 0.5 * shapes.corners.iter().map(|corners| doubled(corners).abs()).sum::<f64>();
    let side = (area / shapes.corners.len() as f64).sqrt();
    let pixels = x.at(side).zip(x.at(0.0)).map_or(0.0, |(to, from)| to - from);
    (0.25 * pixels).clamp(1.6, 6.0)
}

/// Axes of equal scale around all cells.
fn axes(shapes: &Shapes) -> [Axis; 2] {
    let range = |axis: usize| {
        shapes.all().fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), p| (l.min(p[axis]), h.max(p[axis])))
    };
    let (rx, ry) = (range(0), range(1));
    let half = 0.5 * (rx.1 - rx.0).max(ry.1 - ry.0);
    let around = |(low, high): (f64, f64)| [0.5 * (low + high) - half, 0.5 * (low + high) + half];
    [
        Axis::exactly(around(rx), [AREA[0], AREA[0] + AREA[2]]),
        Axis::exactly(around(ry), [AREA[1] + AREA[3], AREA[1]]),
    ]
}

fn draw_axes(canvas: &mut Canvas, axes: &[Axis; 2], length: &str) {
    let [left, top, width, height] = AREA;
    let bottom = top + height;
    for (value, label) in axes[0].ticks() {
        let Some(x) = axes[0].at(value) else { continue };
        canvas.add(format_args!(r##"<path d="M{x:.1} {bottom}v4" stroke="#555"/>"##));
        canvas.text([x, bottom + 17.0], Anchor::Middle, 11.0, &label.unwrap_or_default());
    }
    for (value, label) in axes[1].ticks() {
        let Some(y) = axes[1].at(value) else { continue };
        canvas.add(format_args!(r##"<path d="M{left} {y:.1}h-4" stroke="#555"/>"##));
        canvas.text([left - 7.0, y + 4.0], Anchor::End, 11.0, &label.unwrap_or_default());
    }
    canvas.add(format_args!(
        r##"<rect x="{left}" y="{top}" width="{width}" height="{height}" fill="none" stroke="#555"/>"##
    ));
    canvas.text([left + 0.5 * width, bottom + 36.0], Anchor::Middle, 12.0, &format!("x, {length}"));
    canvas.upward_text([16.0, top + 0.5 * height], 12.0, &format!("y, {length}"));
    let note = "\u{2022} sticking";
    canvas.add(format_args!(r##"<g fill="#d55e00">"##));
    canvas.text([left + width, top - 6.0], Anchor::End, 11.0, note);
    canvas.add(format_args!("</g>"));
}

fn draw_bar(canvas: &mut Canvas, peak: f64, stress: &str) {
    let (left, top, width, height) = (AREA[0] + AREA[2] + 12.0, AREA[1], 12.0, AREA[3]);
    let steps = 60;
    for i in 0..steps {
        let fill = colour::of_share((f64::from(i) + 0.5) / f64::from(steps));
        let step = height / f64::from(steps);
        let y = top + height - f64::from(i + 1) * step;
        canvas.add(format_args!(
            r#"<rect x="{left}" y="{y:.2}" width="{width}" height="{:.2}" fill="{fill}" shape-rendering="crispEdges"/>"#,
            step + 0.5
        ));
    }
    canvas.text([left, top - 8.0], Anchor::Start, 11.0, stress);
    if peak > 0.0 {
        let axis = Axis::exactly([0.0, peak], [top + height, top]);
        for (value, label) in axis.ticks() {
            let Some(y) = axis.at(value) else { continue };
            canvas.text([left + width + 4.0, y + 4.0], Anchor::Start, 11.0, &label.unwrap_or_default());
        }
        canvas.text(
            // Below the labels of x, whose last one reaches under the bar.
            [left, top + height + 34.0],
            Anchor::Start,
            11.0,
            &format!("max {}", label(peak, peak / 100.0)),
        );
    }
}
