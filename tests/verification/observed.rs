//! An observer that keeps the fields of all increments, and quantities computed from these fields.

use std::f64::consts::PI;

use orthowear::contact::SolverOptions;
use orthowear::error::Result;
use orthowear::evolution::observer::Observer;
use orthowear::evolution::records::{FrameState, IncrementRecord};
use orthowear::evolution::step::{Normal, Step, Tangential};
use orthowear::evolution::{Model, RunResult, run};
use orthowear::frame::ContactFrame;

pub use crate::audit::audit;
use crate::common::step;

#[derive(Default)]
pub struct Kept(pub Vec<FrameState>);

impl Observer for Kept {
    fn progress(&mut self, _: &str, _: f64, _: Option<f64>) {}

    fn increment_done(&mut self, _: &IncrementRecord, state: &FrameState) -> Result<()> {
        self.0.push(state.clone());
        Ok(())
    }
}

pub fn follow(model: &Model, steps: &[Step], options: &SolverOptions) -> (RunResult, Vec<FrameState>) {
    let mut kept = Kept::default();
    let result = run(model, steps, options, None, &mut kept).expect("a run without errors");
    (result, kept.0)
}

/// Sum over cells and increments of (area) x (mean pressure) x (path of the slip). The mean pressure is the mean of the pressures
/// at both ends of the increment. The first of `states` is the state at the start, and each further state is the end of an
/// increment. With the path μ |Δg|, the sum is the energy that friction with coefficient μ dissipates.
pub fn pressure_times_path(
    frame: &ContactFrame,
    states: &[FrameState],
    path: impl Fn([f64; 2]) -> f64,
) -> f64 {
    let n = frame.n_cells();
    let increment = |pair: &[FrameState]| -> f64 {
        let mean = |i: usize| 0.5 * (pair[0].tractions[2 * n + i] + pair[1].tractions[2 * n + i]);
        let slip = |i: usize| [pair[1].slip[i], pair[1].slip[n + i]];
        (0..n).map(|i| frame.areas[i] * mean(i) * path(slip(i))).sum()
    };
    states.windows(2).map(increment).sum()
}

pub fn pull(force: [f64; 2]) -> Step {
    Step { tangential: Some(Tangential::Force(force)), ..step("pull") }
}

pub fn press_and_pull(normal: f64, tangential: [f64; 2]) -> Step {
    Step { normal: Some(Normal::Force(normal)), ..pull(tangential) }
}

pub fn radius(area: f64) -> f64 {
    (area / PI).sqrt()
}

/// Semi-axes (long, short) of the Hertzian ellipse with the same second moments as `pressure`. The third value is the angle of
/// the long axis from x in degrees, in (-90, 90]. Let X be the coordinate along a semi-axis of length a. The mean of X², weighted
/// by Hertzian pressure, is a² / 5.
pub fn hertz_ellipse(frame: &ContactFrame, pressure: &[f64]) -> (f64, f64, f64) {
    let mut moments = [0.0; 4];
    for ((center, area), p) in frame.centers.iter().zip(&frame.areas).zip(pressure) {
        let force = p * area;
        let parts = [1.0, center.x * center.x, center.x * center.y, center.y * center.y];
        moments.iter_mut().zip(parts).for_each(|(m, part)| *m += force * part);
    }
    let [xx, xy, yy] = [1, 2, 3].map(|k| moments[k] / moments[0]);
    let (mean, apart) = (0.5 * (xx + yy), (0.5 * (xx - yy)).hypot(xy));
    let angle = 0.5 * (2.0 * xy).atan2(xx - yy).to_degrees();
    ((5.0 * (mean + apart)).sqrt(), (5.0 * (mean - apart)).sqrt(), angle)
}
