//! Pressure along the axes of the frame, the variants of a scene on each other.

use super::plot::axis::Scale;
use super::plot::chart::{Chart, Series};
use super::plot::{PANEL, arranged};
use super::summary::Units;
use crate::error::Result;
use crate::frame::ContactFrame;
use crate::history::record::{FrameState, IncrementRecord, Observer};

/// Keeps the pressure at the end of each step, along the frame's axes.
#[derive(Debug, Clone)]
pub struct Profiles {
    frame: ContactFrame,
    /// By step: name and (coordinate, pressure) along x and along y.
    steps: Vec<(String, [Vec<[f64; 2]>; 2])>,
}

impl Profiles {
    /// Nothing yet, on `frame`.
    pub fn new(frame: &ContactFrame) -> Self {
        Self { frame: frame.clone(), steps: Vec::new() }
    }

    /// Pressure along an axis through the frame's origin: means over the cells that lie on it at the same coordinate.
    fn along(&self, pressure: &[f64], axis: usize) -> Vec<[f64; 2]> {
        let half = |cell: usize| match self.frame.grid {
            Some(grid) => 0.5 * grid.spacing[1 - axis],
            None => 0.5 * self.frame.areas[cell].sqrt(),
        };
        let mut found: Vec<[f64; 2]> = (0..self.frame.n_cells())
            .filter_map(|cell| {
                let at = self.frame.plane_coordinates(cell);
                (at[1 - axis].abs() <= 1.000_001 * half(cell)).then(|| [at[axis], pressure[cell]])
            })
            .collect();
        found.sort_by(|a, b| a[0].total_cmp(&b[0]));
        let width = found.last().map_or(0.0, |last| last[0] - found[0][0]);
        let together = |a: &[f64; 2], b: &[f64; 2]| b[0] - a[0] <= 1e-9 * width;
        found
            .chunk_by(together)
            .map(|group| {
                let n = group.len() as f64;
                [group[0][0], group.iter().map(|point| point[1]).sum::<f64>() / n]
            })
            .collect()
    }
}

impl Observer for Profiles {
    fn progress(&mut self, _stage: &str, _fraction: f64, _residual: Option<f64>) {}

    fn wants_tangential_gap(&self) -> bool {
        false
    }

    fn increment_done(&mut self, record: &IncrementRecord, state: &FrameState) -> Result<()> {
        let n = self.frame.n_cells();
        let pressure = &state.tractions[2 * n..];
        let lines = [self.along(pressure, 0), self.along(pressure, 1)];
        match self.steps.iter_mut().find(|(name, _)| *name == record.name) {
            Some((_, known)) => *known = lines,
            None => self.steps.push((record.name.clone(), lines)),
        }
        Ok(())
    }
}

/// Pressure along the frame's x and y at the end of each step, the variants on each other, as one picture.
pub fn profiles_svg(variants: &[(String, Profiles)], units: &Units) -> String {
    let names: Vec<&String> = variants
        .iter()
        .max_by_key(|v| v.1.steps.len())
        .iter()
        .flat_map(|v| &v.1.steps)
        .map(|s| &s.0)
        .collect();
    let mut panels = Vec::new();
    for name in names {
        for (axis, letter) in ["x", "y"].into_iter().enumerate() {
            let series = variants.iter().filter_map(|(variant, profiles)| {
                let (_, lines) = profiles.steps.iter().find(|(step, _)| step == name)?;
                Some(Series { name: variant.clone(), points: lines[axis].clone() })
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
    arranged(&panels, PANEL, 2)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Truth: the cells' own coordinates and pressures; on an even grid the axis lies between two rows.
    #[test]
    fn profiles_run_along_the_axes() {
        let frame = ContactFrame::grid([2.0, 1.0], [4, 2], [5.0, 5.0], 0.0).unwrap();
        let mut profiles = Profiles::new(&frame);
        let mut tractions = vec![0.0; 24];
        (0..8).for_each(|cell| tractions[16 + cell] = cell as f64);
        let state = FrameState { tractions, gap: vec![], slip: vec![], status: vec![], wear_depth: vec![] };
        let record = IncrementRecord { name: "a".into(), ..Default::default() };
        profiles.increment_done(&record, &state).unwrap();
        let [x, y] = &profiles.steps[0].1;
        assert_eq!(*x, [[-1.5, 0.5], [-0.5, 2.5], [0.5, 4.5], [1.5, 6.5]]);
        assert_eq!(*y, [[-0.5, 3.0], [0.5, 4.0]]);
    }
}
