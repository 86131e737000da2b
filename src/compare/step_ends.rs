//! States of the variants of a scene at the ends of steps: pressure profiles, fields and their differences.

use crate::error::Result;
use crate::evolution::observer::Observer;
use crate::evolution::records::{FrameState, IncrementRecord};
use crate::frame::ContactFrame;
use crate::output::frame_fields::{FRAME_COMPONENTS, FrameMesh, planes_to_triples};
use crate::output::line_profile::{ProfileLine, profile_along};
use crate::output::plot::axis::Scale;
use crate::output::plot::chart::{Chart, Series};
use crate::output::plot::{PANEL, arrange_panels};
use crate::output::summary::Units;
use crate::output::vtu::{DataArray, UnstructuredGrid};

/// Observer that keeps the state of the frame at the end of each step.
#[derive(Debug, Clone, Default)]
pub struct StepEndStates {
    steps: Vec<(String, FrameState)>,
}

impl StepEndStates {
    /// State at the end of the step with the name `step`. `None` if the run did not compute the step.
    pub fn state(&self, step: &str) -> Option<&FrameState> {
        self.steps.iter().find(|(name, _)| name == step).map(|(_, state)| state)
    }

    /// Names of the steps, in order.
    pub fn names(&self) -> impl Iterator<Item = &str> {
        self.steps.iter().map(|(name, _)| name.as_str())
    }
}

impl Observer for StepEndStates {
    fn wants_tangential_gap(&self) -> bool {
        false
    }

    fn increment_done(&mut self, record: &IncrementRecord, state: &FrameState) -> Result<()> {
        match self.steps.iter_mut().find(|(name, _)| *name == record.name) {
            Some((_, known)) => known.clone_from(state),
            None => self.steps.push((record.name.clone(), state.clone())),
        }
        Ok(())
    }
}

/// States of the variants of a scene on their common frame.
pub struct VariantStates<'a> {
    /// Common contact frame of the variants.
    pub frame: &'a ContactFrame,
    /// Name of each variant, and its states at the ends of steps.
    pub ends: &'a [(String, StepEndStates)],
    /// Differences to compute: names of the step, the variant and the reference variant.
    pub differences: &'a [(String, String, String)],
}

impl VariantStates<'_> {
    /// Names of the steps of the variant with the most steps.
    pub fn steps(&self) -> Vec<&str> {
        let longest = self.ends.iter().max_by_key(|(_, ends)| ends.steps.len());
        longest.iter().flat_map(|(_, ends)| ends.names()).collect()
    }

    /// Draws the pressure profiles of the variants as one SVG picture. The profiles run along the frame's x and y
    /// through its origin. Each step has its profiles at its end.
    pub fn profiles_svg(&self, units: &Units) -> String {
        let n = self.frame.n_cells();
        let axes = [("x", 0.0), ("y", std::f64::consts::FRAC_PI_2)];
        let mut panels = Vec::new();
        for name in self.steps() {
            for (letter, angle) in axes {
                let line = ProfileLine { through: [0.0; 2], angle };
                let series = self.ends.iter().filter_map(|(variant, ends)| {
                    let pressure = &ends.state(name)?.tractions[2 * n..];
                    Some(Series { name: variant.clone(), points: profile_along(self.frame, pressure, &line) })
                });
                let chart = Chart {
                    title: format!("Pressure after {name}, along {letter}"),
                    labels: [format!("{letter}, {}", units.length), format!("pressure, {}", units.stress())],
                    scales: [Scale::Linear, Scale::Linear],
                    series: series.collect(),
                };
                panels.push(chart.panel());
            }
        }
        arrange_panels(&panels, PANEL, 2)
    }

    /// Grid of the frame with pressure, traction and wear depth of the variants at the end of `step`, and with the
    /// requested differences.
    ///
    /// Variants that did not compute the step are omitted.
    ///
    /// # Errors
    /// If tractions have the wrong length (kind `Numerical`).
    pub fn difference_grid(&self, step: &str) -> Result<UnstructuredGrid> {
        let mut grid = FrameMesh::new(self.frame).grid();
        let of = |name: &String| {
            self.ends.iter().find(|(own, _)| own == name).and_then(|(_, ends)| ends.state(step))
        };
        for (name, ends) in self.ends {
            let Some(state) = ends.state(step) else { continue };
            self.push(&mut grid, name, state)?;
            let wanted = self.differences.iter().filter(|(own, variant, _)| own == step && variant == name);
            for (reference, first) in wanted.filter_map(|(_, _, first)| Some((first, of(first)?))) {
                let name = format!("{name}_minus_{reference}");
                let minus = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a - b).collect();
                let difference = FrameState {
                    tractions: minus(&state.tractions, &first.tractions),
                    wear_depth: minus(&state.wear_depth, &first.wear_depth),
                    ..FrameState::default()
                };
                self.push(&mut grid, &name, &difference)?;
            }
        }
        Ok(grid)
    }

    fn push(&self, grid: &mut UnstructuredGrid, name: &str, state: &FrameState) -> Result<()> {
        let traction = planes_to_triples(&state.tractions, self.frame.n_cells(), "traction")?;
        let of = |field: &str| format!("{field}_{name}");
        grid.cell_data.extend([
            DataArray::scalar(&of("pressure"), traction.iter().map(|t| t[2]).collect()),
            DataArray::tuples(&of("traction"), FRAME_COMPONENTS, traction.concat()),
            DataArray::scalar(&of("wear_depth"), state.wear_depth.clone()),
        ]);
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::output::vtu::ArrayValues;

    fn ended(pressure: f64) -> StepEndStates {
        let mut ends = StepEndStates::default();
        let tractions = (0..24).map(|k| pressure * if k < 16 { 0.5 } else { (k - 16) as f64 }).collect();
        let state = FrameState { tractions, wear_depth: vec![0.25 * pressure; 8], ..FrameState::default() };
        let record = IncrementRecord { name: "a".into(), ..Default::default() };
        ends.increment_done(&record, &FrameState::default()).unwrap();
        ends.increment_done(&record, &state).unwrap();
        ends
    }

    /// Truth: each difference is the value of a variant minus the value of the reference variant. A variant without the
    /// step is omitted.
    #[test]
    fn differences_are_from_the_first() {
        let frame = ContactFrame::grid([2.0, 1.0], [4, 2], [5.0, 5.0], 0.0).unwrap();
        let ends = [
            ("FE-FE".to_owned(), ended(1.0)),
            ("BE-BE".to_owned(), ended(3.0)),
            ("HS-HS".to_owned(), StepEndStates::default()),
        ];
        let wanted = |variant: &str| ("a".to_owned(), variant.to_owned(), "FE-FE".to_owned());
        let wanted = [wanted("BE-BE"), wanted("HS-HS")];
        let variants = VariantStates { frame: &frame, ends: &ends, differences: &wanted };
        assert_eq!(variants.steps(), ["a"]);
        let grid = variants.difference_grid("a").unwrap();
        let names: Vec<&str> = grid.cell_data.iter().map(|array| array.name.as_str()).collect();
        assert_eq!(names.len(), 9, "{names:?}");
        let values =
            |name: &str| match &grid.cell_data.iter().find(|array| array.name == name).unwrap().values {
                ArrayValues::Float64(values) => values.clone(),
                other => panic!("{other:?}"),
            };
        let twice: Vec<f64> = (0..8).map(|k| 2.0 * f64::from(k)).collect();
        assert_eq!(values("pressure_BE-BE_minus_FE-FE"), twice);
        assert_eq!(values("wear_depth_BE-BE_minus_FE-FE"), [0.5; 8]);
        assert_eq!(values("traction_BE-BE")[..3], [1.5, 1.5, 0.0]);
        let picture = variants.profiles_svg(&Units { length: "mm".into(), force: "N".into() });
        assert!(picture.contains("FE-FE") && picture.contains("BE-BE"), "{picture}");
    }
}
