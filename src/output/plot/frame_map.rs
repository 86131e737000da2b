//! Maps of fields on the contact frame, with the fibre directions.

use nalgebra::Vector2;
use serde::{Deserialize, Serialize};

use crate::evolution::records::FrameState;
use crate::frame::ContactFrame;
use crate::frame::grid::extend_field;
use crate::output::plot::axis::Axis;
use crate::output::plot::bar::draw_bar;
use crate::output::plot::cell_shapes::CellShapes;
use crate::output::plot::{Anchor, Canvas, arrange_panels, colour, fibres};
use crate::output::summary::Units;
use crate::output::surface_properties::SurfaceProperties;

/// Width and height of the panel of a map, without the text on the fibres.
const MAP_PANEL_PX: [f64; 2] = [400.0, 370.0];
/// Plot area within the panel: left, top, width, height.
const MAP_AREA_PX: [f64; 4] = [58.0, 40.0, 270.0, 270.0];
const COLOUR_LEVELS: usize = 64;
const MAX_ARROWS_PER_SIDE: usize = 15;
const STICK_SLIP_COLOURS: [&str; 2] = ["#0072b2", "#f0b45a"];

/// Quantity of a map.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum MapKind {
    /// Pressure.
    Pressure,
    /// Magnitude of the slip of body 2 relative to body 1 (in rolling: per rolled distance), with arrows. Cells without pressure
    /// show no slip.
    Slip,
    /// Stick zone, slip zone and open cells.
    Zones,
    /// Wear depth, sum of both bodies.
    Wear,
}

/// Fields of the last entry of a step, as the figures show them.
#[derive(Debug, Clone, Default, Serialize, Deserialize)]
pub struct StepEndFields {
    /// Name of the step.
    pub name: String,
    /// Title of the panels: name of the step and number of cycles.
    pub title: String,
    /// Tractions on body 2, `[3, N]`, component by component.
    pub tractions: Vec<f64>,
    slip: Vec<[f64; 2]>,
    is_rolling: bool,
    status: Vec<u8>,
    /// Wear depth, sum of both bodies, `[N]`.
    pub wear_depth: Vec<f64>,
}

impl StepEndFields {
    /// Copies the fields of `state` on a frame of `n` cells. Missing slip is zero.
    pub fn new([name, title]: [&str; 2], n: usize, state: &FrameState, is_rolling: bool) -> Self {
        let slip = |cell: usize| match state.slip.get(n + cell) {
            Some(y) => [state.slip[cell], *y],
            None => [0.0; 2],
        };
        Self {
            name: name.to_owned(),
            title: title.to_owned(),
            tractions: state.tractions.clone(),
            slip: (0..n).map(slip).collect(),
            is_rolling,
            status: state.status.clone(),
            wear_depth: state.wear_depth.clone(),
        }
    }

    /// Transfers the fields to a frame of `n` cells. `places[i]` is the new index of cell i; new cells get zero.
    pub fn transfer_to(&mut self, places: &[usize], n: usize) {
        self.tractions = extend_field(&self.tractions, places, n, |_| 0.0);
        self.slip = extend_field(&self.slip, places, n, |_| [0.0; 2]);
        self.status = extend_field(&self.status, places, n, |_| 0);
        self.wear_depth = extend_field(&self.wear_depth, places, n, |_| 0.0);
    }

    fn pressure(&self, cell: usize) -> f64 {
        self.tractions.get(2 * (self.tractions.len() / 3) + cell).copied().unwrap_or(0.0)
    }

    /// Whether a map of this kind shows anything: a map of zones needs a cell that sticks; maps of slip and wear need a value
    /// above 0.
    pub fn has_content(&self, kind: MapKind) -> bool {
        match kind {
            MapKind::Pressure => true,
            MapKind::Slip => (0..self.slip.len()).any(|cell| self.value(MapKind::Slip, cell) > 0.0),
            MapKind::Zones => self.status.contains(&1),
            MapKind::Wear => self.wear_depth.iter().any(|depth| *depth > 0.0),
        }
    }

    fn value(&self, kind: MapKind, cell: usize) -> f64 {
        match kind {
            MapKind::Pressure => self.pressure(cell),
            MapKind::Slip if self.pressure(cell) > 0.0 => {
                self.slip.get(cell).map_or(0.0, |[x, y]| x.hypot(*y))
            }
            MapKind::Slip | MapKind::Zones => 0.0,
            MapKind::Wear => self.wear_depth.get(cell).copied().unwrap_or(0.0),
        }
    }
}

/// Draws the maps of one kind, each with a colour bar or a key of the zones. `None` if no state has anything to show.
pub fn maps_svg(
    frame: &ContactFrame,
    surface: &SurfaceProperties,
    states: &[StepEndFields],
    kind: MapKind,
    units: &Units,
) -> Option<String> {
    let all = kind == MapKind::Zones && states.iter().any(|state| state.has_content(kind));
    let shown: Vec<&StepEndFields> = states.iter().filter(|state| all || state.has_content(kind)).collect();
    if shown.is_empty() {
        return None;
    }
    let words = fibres::fibre_labels(surface, frame.azimuth);
    let picture = MapFigure { shapes: CellShapes::new(frame), surface, kind, units, words };
    let panels: Vec<Canvas> = shown.into_iter().map(|state| picture.panel(state)).collect();
    let size = [MAP_PANEL_PX[0], MAP_PANEL_PX[1] + 14.0 * picture.words.len() as f64];
    Some(arrange_panels(&panels, size, 3))
}

struct MapFigure<'a> {
    shapes: CellShapes,
    surface: &'a SurfaceProperties,
    kind: MapKind,
    units: &'a Units,
    words: Vec<String>,
}

impl MapFigure<'_> {
    fn panel(&self, state: &StepEndFields) -> Canvas {
        let axes = self.shapes.axes(MAP_AREA_PX);
        let mut canvas = Canvas::default();
        canvas.text([MAP_AREA_PX[0], 20.0], Anchor::Start, 14.0, &state.title);
        match self.kind {
            MapKind::Pressure => {
                let peak = self.draw_values(&mut canvas, &axes, state);
                draw_bar(&mut canvas, MAP_AREA_PX, peak, &self.units.stress());
            }
            MapKind::Slip => {
                let peak = self.draw_values(&mut canvas, &axes, state);
                self.arrows(&mut canvas, &axes, state, peak);
                let (caption, unit) = match state.is_rolling {
                    true => ("slip of body 2 over body 1 per rolled distance", ""),
                    false => ("slip of body 2 over body 1", self.units.length.as_str()),
                };
                draw_caption(&mut canvas, caption);
                draw_bar(&mut canvas, MAP_AREA_PX, peak, unit);
            }
            MapKind::Zones => {
                self.zones(&mut canvas, &axes, state);
                draw_zone_key(&mut canvas);
            }
            MapKind::Wear => {
                let peak = self.draw_values(&mut canvas, &axes, state);
                draw_caption(&mut canvas, "wear depth, both bodies");
                draw_bar(&mut canvas, MAP_AREA_PX, peak, &self.units.length);
            }
        }
        draw_axes(&mut canvas, &axes, &self.units.length);
        fibres::draw_fibre_symbols(
            &mut canvas,
            self.surface,
            [MAP_AREA_PX[0] + MAP_AREA_PX[2] - 23.0, MAP_AREA_PX[1] + 23.0],
        );
        fibres::write_words(&mut canvas, &self.words, [MAP_AREA_PX[0], MAP_PANEL_PX[1] + 2.0]);
        canvas
    }

    /// Colours the cells by value and returns the largest value.
    fn draw_values(&self, canvas: &mut Canvas, axes: &[Axis; 2], state: &StepEndFields) -> f64 {
        let value = |cell: &usize| state.value(self.kind, *cell);
        let peak = self.shapes.cells.iter().flatten().map(value).fold(0.0, f64::max);
        let mut by_colour = vec![String::new(); COLOUR_LEVELS];
        for (corners, cells) in self.shapes.corners.iter().zip(&self.shapes.cells) {
            let sum: f64 = cells.iter().map(value).sum();
            if sum <= 0.0 || peak <= 0.0 {
                continue;
            }
            let share = sum / cells.len() as f64 / peak;
            by_colour[((share * COLOUR_LEVELS as f64) as usize).min(COLOUR_LEVELS - 1)] +=
                &outline(corners, axes);
        }
        for (i, outlines) in by_colour.iter().enumerate() {
            paint(canvas, outlines, &colour::map_colour((i as f64 + 0.5) / COLOUR_LEVELS as f64));
        }
        peak
    }

    /// Colours each block of cells in the colour of its larger zone, stick or slip, if at least half of its cells are
    /// in contact.
    fn zones(&self, canvas: &mut Canvas, axes: &[Axis; 2], state: &StepEndFields) {
        let mut by_zone = [String::new(), String::new()];
        for (corners, cells) in self.shapes.corners.iter().zip(&self.shapes.cells) {
            let count =
                |zone: u8| cells.iter().filter(|&&cell| state.status.get(cell) == Some(&zone)).count();
            let [open, stick, slip] = [0, 1, 2].map(count);
            if open <= stick + slip {
                by_zone[usize::from(stick < slip)] += &outline(corners, axes);
            }
        }
        by_zone.iter().zip(STICK_SLIP_COLOURS).for_each(|(outlines, fill)| paint(canvas, outlines, fill));
    }

    /// Draws an arrow of the mean slip in each square of the map. An arrow as long as a square stands for the largest
    /// slip, `peak`.
    fn arrows(&self, canvas: &mut Canvas, axes: &[Axis; 2], state: &StepEndFields, peak: f64) {
        if peak <= 0.0 {
            return;
        }
        let square = MAP_AREA_PX[2] / MAX_ARROWS_PER_SIDE as f64;
        let mut sums =
            vec![(0.0, Vector2::zeros(), Vector2::zeros()); MAX_ARROWS_PER_SIDE * MAX_ARROWS_PER_SIDE];
        for (shape, cells) in self.shapes.cells.iter().enumerate() {
            let middle = self.shapes.middle(shape);
            let Some((x, y)) = axes[0].to_pixel(middle.x).zip(axes[1].to_pixel(middle.y)) else { continue };
            let index = |at: f64| ((at / square).max(0.0) as usize).min(MAX_ARROWS_PER_SIDE - 1);
            let sum = &mut sums[index(x - MAP_AREA_PX[0]) * MAX_ARROWS_PER_SIDE + index(y - MAP_AREA_PX[1])];
            for &cell in cells.iter().filter(|&&cell| state.value(MapKind::Slip, cell) > 0.0) {
                let [sx, sy] = state.slip[cell];
                sum.0 += 1.0;
                sum.1 += Vector2::new(x, y);
                sum.2 += Vector2::new(sx, -sy);
            }
        }
        let mut path = String::new();
        for (count, place, slip) in sums.into_iter().filter(|sum| sum.0 > 0.0) {
            let slip: Vector2<f64> = slip * (square / (count * peak));
            let tip = place / count + slip * 0.5;
            if slip.norm() < 1.0 {
                continue;
            }
            let head = slip.normalize() * (0.4 * slip.norm()).min(4.0);
            let side = Vector2::new(-head.y, head.x) * 0.6;
            let (tail, left, right) = (tip - slip, tip - head + side, tip - head - side);
            path += &format!(
                "M{:.1} {:.1}L{:.1} {:.1}M{:.1} {:.1}L{:.1} {:.1}L{:.1} {:.1}",
                tail.x, tail.y, tip.x, tip.y, left.x, left.y, tip.x, tip.y, right.x, right.y
            );
        }
        for (shade, width) in [("white", 2.6), ("#222", 1.1)] {
            canvas.add(format_args!(
                r#"<path d="{path}" stroke="{shade}" stroke-width="{width}" fill="none"/>"#
            ));
        }
    }
}

fn pixels(p: &Vector2<f64>, axes: &[Axis; 2]) -> Option<String> {
    Some(format!("{:.1} {:.1}", axes[0].to_pixel(p.x)?, axes[1].to_pixel(p.y)?))
}

fn outline(corners: &[Vector2<f64>], axes: &[Axis; 2]) -> String {
    let points: Vec<String> = corners.iter().filter_map(|p| pixels(p, axes)).collect();
    format!("M{}z", points.join("L"))
}

/// Fills outlines with a colour. The stroke hides hairlines between neighbours.
fn paint(canvas: &mut Canvas, outlines: &str, fill: &str) {
    if !outlines.is_empty() {
        canvas
            .add(format_args!(r#"<path d="{outlines}" fill="{fill}" stroke="{fill}" stroke-width="0.6"/>"#));
    }
}

fn draw_caption(canvas: &mut Canvas, text: &str) {
    canvas.add(format_args!(r##"<g fill="#222">"##));
    canvas.text([MAP_AREA_PX[0] + MAP_AREA_PX[2], MAP_AREA_PX[1] - 6.0], Anchor::End, 11.0, text);
    canvas.add(format_args!("</g>"));
}

fn draw_zone_key(canvas: &mut Canvas) {
    let left = MAP_AREA_PX[0] + MAP_AREA_PX[2] + 10.0;
    for (i, (name, fill)) in
        [("stick", STICK_SLIP_COLOURS[0]), ("slip", STICK_SLIP_COLOURS[1]), ("open", "white")]
            .into_iter()
            .enumerate()
    {
        let top = MAP_AREA_PX[1] + 20.0 * i as f64;
        canvas.add(format_args!(
            r##"<rect x="{left}" y="{top}" width="12" height="12" fill="{fill}" stroke="#888"/>"##
        ));
        canvas.text([left + 17.0, top + 10.0], Anchor::Start, 11.0, name);
    }
}

fn draw_axes(canvas: &mut Canvas, axes: &[Axis; 2], length: &str) {
    let [left, top, width, height] = MAP_AREA_PX;
    let bottom = top + height;
    for (value, label) in axes[0].ticks() {
        let Some(x) = axes[0].to_pixel(value) else { continue };
        canvas.add(format_args!(r##"<path d="M{x:.1} {bottom}v4" stroke="#555"/>"##));
        canvas.text([x, bottom + 17.0], Anchor::Middle, 11.0, &label.unwrap_or_default());
    }
    for (value, label) in axes[1].ticks() {
        let Some(y) = axes[1].to_pixel(value) else { continue };
        canvas.add(format_args!(r##"<path d="M{left} {y:.1}h-4" stroke="#555"/>"##));
        canvas.text([left - 7.0, y + 4.0], Anchor::End, 11.0, &label.unwrap_or_default());
    }
    canvas.add(format_args!(
        r##"<rect x="{left}" y="{top}" width="{width}" height="{height}" fill="none" stroke="#555"/>"##
    ));
    canvas.text(
        [left + 0.5 * width, bottom + 36.0],
        Anchor::Middle,
        12.0,
        &format!("x, {}", axes[0].scaled_unit(length)),
    );
    canvas.upward_text([16.0, top + 0.5 * height], 12.0, &format!("y, {}", axes[1].scaled_unit(length)));
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::Side;
    use crate::output::surface_properties::SurfaceFibre;

    /// Frame of 2 x 2 cells and its fields. At negative x, the lower cell is open and the upper cell sticks. At
    /// positive x, the lower cell slips along x and the upper cell along -y.
    fn state() -> (ContactFrame, StepEndFields) {
        let frame = ContactFrame::grid([1.0, 1.0], [2, 2], [0.0, 0.0], 0.0).unwrap();
        let fields = FrameState {
            tractions: [vec![0.0; 8], vec![0.0, 50.0, 100.0, 25.0]].concat(),
            gap: Vec::new(),
            slip: vec![9.0, 0.0, 0.04, 0.0, 9.0, 0.0, 0.0, -0.02],
            status: vec![0, 1, 2, 2],
            wear_depth: vec![0.0, 0.0, 3e-7, 6e-7],
            wear_depth_error: vec![0.0; 4],
            load_amplitudes: Vec::new(),
        };
        (frame, StepEndFields::new(["a"; 2], 4, &fields, false))
    }

    fn drawn(kind: MapKind) -> String {
        let (frame, state) = state();
        let fibre = SurfaceFibre { side: Side::Upper, tilt: 0.5, azimuth: 0.0 };
        let surface = SurfaceProperties { fibres: vec![fibre], ..SurfaceProperties::default() };
        maps_svg(&frame, &surface, &[state], kind, &Units::default()).unwrap()
    }

    /// Whether `fill` colours the cell whose corner (low x, low y) lies at these pixels.
    fn filled(picture: &str, [x, y]: [f64; 2], fill: &str) -> bool {
        let fill = format!("fill=\"{fill}\"");
        picture.lines().any(|line| line.contains(&fill) && line.contains(&format!("M{x:.1} {y:.1}L")))
    }

    /// Truth: positions and colours computed by hand. The sides of 2 mm take 270 pixels each, and the upper left corner
    /// of the map is (58, 40). The largest value is darkest.
    #[test]
    fn cells_have_the_colours_of_their_values() {
        let darkest = colour::map_colour((COLOUR_LEVELS as f64 - 0.5) / COLOUR_LEVELS as f64);
        let half = colour::map_colour((COLOUR_LEVELS as f64 / 2.0 + 0.5) / COLOUR_LEVELS as f64);
        let pressure = drawn(MapKind::Pressure);
        assert!(filled(&pressure, [193.0, 310.0], &darkest), "{pressure}");
        assert!(filled(&pressure, [58.0, 175.0], &half), "{pressure}");
        assert!(pressure.contains("max 100") && pressure.contains("fibres of body 2: tilt 28.65\u{b0}"));
        let zones = drawn(MapKind::Zones);
        assert!(
            filled(&zones, [58.0, 175.0], STICK_SLIP_COLOURS[0])
                && filled(&zones, [193.0, 175.0], STICK_SLIP_COLOURS[1]),
            "{zones}"
        );
        assert!(!zones.contains("M58.0 310.0L"), "an open cell is coloured: {zones}");
        let wear = drawn(MapKind::Wear);
        assert!(filled(&wear, [193.0, 175.0], &darkest) && filled(&wear, [193.0, 310.0], &half), "{wear}");
        assert!(wear.contains("max 600") && wear.contains("\u{2212}9"), "{wear}");
    }

    /// Truth: the slip of rolling is a length per rolled distance (docs/results.md), so its map shows no unit.
    #[test]
    fn slip_of_rolling_has_no_unit() {
        let (frame, mut state) = state();
        let words = |state: &StepEndFields| {
            let surface = SurfaceProperties::default();
            let states = std::slice::from_ref(state);
            let picture = maps_svg(&frame, &surface, states, MapKind::Slip, &Units::default()).unwrap();
            (picture.contains("per rolled distance"), picture.matches("mm").count())
        };
        let (sliding, of_sliding) = words(&state);
        state.is_rolling = true;
        let (rolling, of_rolling) = words(&state);
        assert!(!sliding && rolling);
        assert_eq!(of_rolling, of_sliding - 1);
    }

    /// Truth: arrows computed by hand: a slip of 0.04 along x gives 18 pixels to the right, 0.02 along -y gives 9 down. Cells
    /// without pressure have no arrow.
    #[test]
    fn arrows_have_the_direction_and_length_of_the_slip() {
        let picture = drawn(MapKind::Slip);
        let line =
            picture.lines().find(|line| line.contains("stroke=\"#222\" stroke-width=\"1.1\"")).unwrap();
        let shafts: Vec<[f64; 4]> = line
            .split('"')
            .nth(1)
            .unwrap()
            .split('M')
            .skip(1)
            .step_by(2)
            .map(|shaft| {
                let numbers: Vec<f64> = shaft.split(['L', ' ']).map(|n| n.parse().unwrap()).collect();
                numbers.try_into().unwrap()
            })
            .collect();
        let lengths: Vec<[f64; 2]> = shafts.iter().map(|s| [s[2] - s[0], s[3] - s[1]]).collect();
        assert_eq!(lengths.len(), 2, "{shafts:?}");
        assert!(lengths.contains(&[18.0, 0.0]) && lengths.contains(&[0.0, 9.0]), "{shafts:?}");
        assert!(picture.contains("max 0.0400"), "{picture}");
    }
}
