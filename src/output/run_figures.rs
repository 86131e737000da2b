//! Figures of a run: maps and profiles of the last entry of each step, and the history.

use serde::{Deserialize, Serialize};

use crate::error::Result;
use crate::evolution::records::{FrameState, IncrementRecord};
use crate::frame::ContactFrame;
use crate::output::line_profile::{ProfileLine, profile_along};
use crate::output::output_dir::OutputDir;
use crate::output::plot::axis::Scale;
use crate::output::plot::chart::{Chart, Series};
use crate::output::plot::frame_map::{MapKind, StepEndFields, maps_svg};
use crate::output::plot::history::history_svg;
use crate::output::plot::{Canvas, PANEL, arrange_panels};
use crate::output::summary::{Summary, Units};
use crate::output::surface_properties::SurfaceProperties;

const MAPS: [(MapKind, &str); 4] = [
    (MapKind::Pressure, "pressure.svg"),
    (MapKind::Slip, "slip.svg"),
    (MapKind::Zones, "zones.svg"),
    (MapKind::Wear, "wear.svg"),
];

/// A step has wear profiles if its largest wear depth is at least this fraction of the largest wear depth of all steps.
const MIN_RELATIVE_WEAR_DEPTH: f64 = 1e-6;

/// Collects the data of the figures and draws them.
#[derive(Debug, Clone, Default, Serialize, Deserialize)]
pub struct RunFigures {
    steps: Vec<StepEndFields>,
}

impl RunFigures {
    /// Stores an entry on a frame of `n` cells, in place of the previous entry of a step with the same name.
    pub fn record_entry(&mut self, n: usize, record: &IncrementRecord, state: &FrameState) {
        let cycles = match (record.cycles_done, record.stroke_ends) {
            (0, _) => String::new(),
            (cycles, None) => format!(", {cycles} cycles"),
            (cycles, Some(_)) => format!(", {cycles} cycles, + reversal point"),
        };
        let title = format!("{}{cycles}", record.name);
        let kept = StepEndFields::new([&record.name, &title], n, state, record.rolling.is_some());
        match self.steps.iter_mut().find(|known| known.name == record.name) {
            Some(known) => *known = kept,
            None => self.steps.push(kept),
        }
    }

    /// Transfers the fields to a frame of `n` cells, as [`StepEndFields::transfer_to`].
    pub fn transfer_to(&mut self, places: &[usize], n: usize) {
        self.steps.iter_mut().for_each(|step| step.transfer_to(places, n));
    }

    /// Writes the figures that have something to show.
    ///
    /// # Errors
    /// If a file cannot be written (kind `Resources`).
    pub fn write(
        &self,
        frame: &ContactFrame,
        surface: &SurfaceProperties,
        output: &mut OutputDir,
        summary: &Summary,
    ) -> Result<()> {
        if self.steps.is_empty() {
            return Ok(());
        }
        let units = &summary.units;
        for (kind, name) in MAPS {
            if let Some(picture) = maps_svg(frame, surface, &self.steps, kind, units) {
                output.write_text(name, &picture)?;
            }
        }
        // In a bore, several cells have the same x and y, and a profile would mix them.
        if frame.is_single_valued() {
            output.write_text("profiles.svg", &self.profiles(frame, surface, units))?;
        }
        output.write_text("history.svg", &history_svg(&summary.steps, units))
    }

    fn profiles(&self, frame: &ContactFrame, surface: &SurfaceProperties, units: &Units) -> String {
        let mut panels = Vec::new();
        for kept in &self.steps {
            let through = profile_center(frame, surface, kept);
            let lines = [0.0, std::f64::consts::FRAC_PI_2]
                .map(|turn| ProfileLine { through, angle: surface.e1_angle + turn });
            for (line, axis) in lines.iter().zip(["e1", "e2"]) {
                panels.push(traction_panel(frame, surface, kept, line, axis, units));
            }
            let worn = deepest(kept);
            if worn > 0.0
                && worn >= MIN_RELATIVE_WEAR_DEPTH * self.steps.iter().map(deepest).fold(0.0, f64::max)
            {
                for (line, axis) in lines.iter().zip(["e1", "e2"]) {
                    panels.push(wear_panel(frame, surface, kept, line, axis, units));
                }
            }
        }
        arrange_panels(&panels, PANEL, 2)
    }
}

fn deepest(kept: &StepEndFields) -> f64 {
    kept.wear_depth.iter().copied().fold(0.0, f64::max)
}

/// Point at which the two profiles of a step intersect. It is the origin of the frame if a profile through the origin
/// reaches half of the peak pressure, or if there is no pressure. Otherwise, it is the centre of the cell with the peak
/// pressure.
fn profile_center(frame: &ContactFrame, surface: &SurfaceProperties, kept: &StepEndFields) -> [f64; 2] {
    let n = frame.n_cells();
    let Some(pressure) = kept.tractions.get(2 * n..3 * n) else { return [0.0; 2] };
    let peak = (0..n).max_by(|a, b| pressure[*a].total_cmp(&pressure[*b]));
    let Some(peak) = peak.filter(|&cell| pressure[cell] > 0.0) else { return [0.0; 2] };
    let seen = [0.0, std::f64::consts::FRAC_PI_2].into_iter().any(|turn| {
        let line = ProfileLine { through: [0.0; 2], angle: surface.e1_angle + turn };
        profile_along(frame, pressure, &line).iter().any(|point| point[1] >= 0.5 * pressure[peak])
    });
    if seen { [0.0; 2] } else { frame.plane_coordinates(peak) }
}

fn distance_label(line: &ProfileLine, axis: &str, units: &Units) -> String {
    let [x, y] = line.through;
    let from = if line.through == [0.0; 2] { "the centre".to_owned() } else { format!("({x:.4}, {y:.4})") };
    format!("distance along {axis} from {from}, {}", units.length)
}

fn traction_panel(
    frame: &ContactFrame,
    surface: &SurfaceProperties,
    kept: &StepEndFields,
    line: &ProfileLine,
    axis: &str,
    units: &Units,
) -> Canvas {
    let n = frame.n_cells();
    let plane = |k: usize| kept.tractions.get(k * n..(k + 1) * n).map_or(vec![0.0; n], <[f64]>::to_vec);
    let [x, y, pressure] = [plane(0), plane(1), plane(2)];
    let (sin, cos) = surface.e1_angle.sin_cos();
    // The tractions on body 1 are opposite to the stored tractions on body 2.
    let turned = |a: f64, b: f64| x.iter().zip(&y).map(|(x, y)| 0.0 - a * x - b * y).collect::<Vec<f64>>();
    let fields = [("pressure", pressure), ("q1", turned(cos, sin)), ("q2", turned(-sin, cos))];
    let rubs = x.iter().chain(&y).any(|q| *q != 0.0);
    let shown = if rubs { 3 } else { 1 };
    let series = fields.iter().take(shown).map(|(name, values)| Series {
        name: (*name).to_owned(),
        points: profile_along(frame, values, line),
    });
    let what = if rubs { "traction on body 1" } else { "pressure" };
    Chart {
        title: format!("{}: {what} along {axis}", kept.title),
        labels: [distance_label(line, axis, units), format!("{what}, {}", units.stress())],
        scales: [Scale::Linear, Scale::Linear],
        series: series.collect(),
    }
    .panel()
}

fn wear_panel(
    frame: &ContactFrame,
    surface: &SurfaceProperties,
    kept: &StepEndFields,
    line: &ProfileLine,
    axis: &str,
    units: &Units,
) -> Canvas {
    let [body1, body2] = surface.wear_depth_by_body(&kept.wear_depth);
    let fields = [("body 1", body1), ("body 2", body2), ("both", kept.wear_depth.clone())];
    let wears = |values: &Vec<f64>| values.iter().any(|depth| *depth > 0.0);
    let shared = wears(&fields[0].1) && wears(&fields[1].1);
    let shown = fields[..if shared { 3 } else { 2 }].iter().filter(|(_, values)| wears(values));
    let series: Vec<Series> = shown
        .map(|(name, values)| Series { name: (*name).to_owned(), points: profile_along(frame, values, line) })
        .collect();
    let whose = if shared {
        String::new()
    } else {
        series.first().map_or(String::new(), |s| format!(" of {}", s.name))
    };
    Chart {
        title: format!("{}: wear depth{whose} along {axis}", kept.title),
        labels: [distance_label(line, axis, units), format!("wear depth, {}", units.length)],
        scales: [Scale::Linear, Scale::Linear],
        series,
    }
    .panel()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::Side;
    use crate::output::surface_properties::SurfaceFibre;

    fn kept(n: usize, tractions: impl Fn(usize) -> [f64; 3], frame: &ContactFrame) -> StepEndFields {
        let mut planes = vec![0.0; 3 * n];
        (0..n).for_each(|cell| (0..3).for_each(|k| planes[k * n + cell] = tractions(cell)[k]));
        let state = FrameState { tractions: planes, ..FrameState::default() };
        let mut pictures = RunFigures::default();
        pictures.record_entry(
            frame.n_cells(),
            &IncrementRecord { name: "a".into(), ..Default::default() },
            &state,
        );
        pictures.steps.remove(0)
    }

    /// Truth (definition): profiles cross at the origin if a profile through the origin reaches half of the peak
    /// pressure, otherwise at the peak.
    #[test]
    fn profiles_go_through_the_contact() {
        let frame = ContactFrame::grid([2.0, 2.0], [9, 9], [1.0, 0.0], 0.0).unwrap();
        let at = |x: f64, y: f64, pressure: f64| {
            let cell = (0..81).min_by(|a, b| {
                let from = |cell: &usize| {
                    let [cx, cy] = frame.plane_coordinates(*cell);
                    (cx - x).hypot(cy - y)
                };
                from(a).total_cmp(&from(b))
            });
            let cell = cell.unwrap();
            kept(81, |i| if i == cell { [0.0, 0.0, pressure] } else { [0.0; 3] }, &frame)
        };
        let surface = SurfaceProperties::default();
        assert_eq!(profile_center(&frame, &surface, &at(0.0, 1.3, 5.0)), [0.0, 0.0]);
        let [x, y] = profile_center(&frame, &surface, &at(-0.9, 1.3, 5.0));
        assert!((x + 8.0 / 9.0).abs() < 1e-12 && (y - 12.0 / 9.0).abs() < 1e-12, "{x} {y}");
        assert_eq!(profile_center(&frame, &surface, &at(-0.9, 1.3, 0.0)), [0.0, 0.0]);
    }

    /// Truth: a traction of 20 MPa on body 2, opposite to the fibre direction, gives q1 = 20 MPa and q2 = 0 on body 1.
    /// In the figure, q1 is a level line at a proportional height.
    #[test]
    fn tractions_are_those_on_body_1_along_the_fibre() {
        let frame = ContactFrame::grid([2.0, 2.0], [8, 8], [0.0, 0.0], 0.0).unwrap();
        // In axes at 30 degrees, the traction on body 2 is (-20, 0).
        let (sin, cos) = 30_f64.to_radians().sin_cos();
        let kept = kept(64, |_| [-20.0 * cos, -20.0 * sin, 100.0], &frame);
        let fibre = SurfaceFibre { side: Side::Lower, tilt: 0.3, azimuth: 30_f64.to_radians() };
        let surface = SurfaceProperties { e1_angle: fibre.azimuth, fibres: vec![fibre], wear_share: 1.0 };
        let pictures = RunFigures { steps: vec![kept] };
        let text = pictures.profiles(&frame, &surface, &Units::default());
        let levels: Vec<f64> = text
            .lines()
            .filter(|line| line.contains("stroke-width=\"1.8\"") && line.contains('L'))
            .map(|line| {
                let path = line.split('"').nth(1).unwrap();
                let heights: Vec<f64> = path
                    .trim_start_matches('M')
                    .split('L')
                    .map(|point| point.split_once(' ').unwrap().1.parse().unwrap())
                    .collect();
                assert!(heights.iter().all(|y| *y == heights[0]), "{path}");
                heights[0]
            })
            .collect();
        // Each panel shows pressure 100, q1 = 20 and q2 = 0 on an axis from 0 to at least 100.
        assert_eq!(levels.len(), 6, "{text}");
        for panel in levels.chunks(3) {
            let share = (panel[2] - panel[1]) / (panel[2] - panel[0]);
            assert!((share - 0.2).abs() < 1e-3, "{panel:?}");
        }
    }
}
