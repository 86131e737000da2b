//! Projected gradient with Barzilai-Borwein steps, one step size for the normal and one for the tangential block
//! (docs/theory-contact.md).
//!
//! The step sizes alternate between s·s / s·y and s·y / y·y. s is the change of the scaled tractions, y the change of the gradient.
//! Step sizes are clipped to [1, r] / λ_max, with λ_max the estimated largest eigenvalue of the block. r is 1000 at first; each
//! restart divides it by 4, but not below 2.

use super::super::balance::StepSizes;
use super::super::{ContactState, Increment};
use super::control::SolveControl;
use super::projected_gradient::{StepRule, run_projected_gradient, step_sizes};
use super::report::SolveReport;

const MAX_STEP_RATIO: f64 = 1e3;

struct BarzilaiBorweinRule {
    shortest: StepSizes,
    longest: f64,
    current: StepSizes,
    use_long_step: bool,
}

/// Products s·s, s·y and y·y in the area-weighted inner product, over the components `planes` of every path point.
fn products(
    problem: &Increment,
    old: &ContactState,
    new: &ContactState,
    planes: std::ops::Range<usize>,
) -> [f64; 3] {
    let n = problem.n();
    let mut sums = [0.0; 3];
    for end in 0..problem.path_points.len() {
        if problem.path_points[end].balance.is_some() {
            add_balanced(problem, old, new, end, planes.clone(), &mut sums);
            continue;
        }
        for plane in planes.clone() {
            // A uniform normal motion is a Lagrange multiplier, so the change of gap that it causes is subtracted from y.
            let shift = if problem.rigid_axes.is_none() && plane == 2 {
                new.rigid_motion[end][2] - old.rigid_motion[end][2]
            } else {
                0.0
            };
            let base = end * 3 * n + plane * n;
            for i in 0..n {
                let s = new.scaled[base + i] - old.scaled[base + i];
                let y = new.gradient[base + i] - old.gradient[base + i] - shift;
                sums[0] += problem.areas[i] * s * s;
                sums[1] += problem.areas[i] * s * y;
                sums[2] += problem.areas[i] * y * y;
            }
        }
    }
    sums
}

/// Adds the products of the path point `end`, which has a balance. The change of gap that the rigid motion of this
/// point causes is subtracted from y.
fn add_balanced(
    problem: &Increment,
    old: &ContactState,
    new: &ContactState,
    end: usize,
    planes: std::ops::Range<usize>,
    sums: &mut [f64; 3],
) {
    let n = problem.n();
    let rigid = std::array::from_fn(|k| new.rigid_motion[end][k] - old.rigid_motion[end][k]);
    let floating = std::array::from_fn(|k| new.mode_amplitudes[end][k] - old.mode_amplitudes[end][k]);
    for i in 0..n {
        let mut shift = problem.rigid_gap(i, rigid, &floating);
        let tangential =
            problem.friction_scaling().map_or([0.0; 2], |hat| hat.scaled_slip([shift[0], shift[1]]));
        (shift[0], shift[1]) = (tangential[0], tangential[1]);
        for plane in planes.clone() {
            let k = end * 3 * n + plane * n + i;
            let s = new.scaled[k] - old.scaled[k];
            let y = new.gradient[k] - old.gradient[k] - shift[plane];
            sums[0] += problem.areas[i] * s * s;
            sums[1] += problem.areas[i] * s * y;
            sums[2] += problem.areas[i] * y * y;
        }
    }
}

impl BarzilaiBorweinRule {
    fn size(&self, [ss, sy, yy]: [f64; 3], shortest: f64, current: f64) -> f64 {
        if sy.is_nan() || sy <= 0.0 {
            return current;
        }
        let size = if self.use_long_step { ss / sy } else { sy / yy };
        size.clamp(shortest, self.longest * shortest)
    }
}

impl StepRule for BarzilaiBorweinRule {
    fn first(&self) -> StepSizes {
        self.shortest
    }

    fn next(&mut self, problem: &Increment, old: &ContactState, new: &ContactState) -> StepSizes {
        self.use_long_step = !self.use_long_step;
        self.current.normal =
            self.size(products(problem, old, new, 2..3), self.shortest.normal, self.current.normal);
        if problem.friction.is_some() {
            self.current.tangential = self.size(
                products(problem, old, new, 0..2),
                self.shortest.tangential,
                self.current.tangential,
            );
        }
        self.current
    }

    fn restart(&mut self) -> StepSizes {
        self.longest = (0.25 * self.longest).max(2.0);
        self.current = self.shortest;
        self.current
    }
}

/// Solves the increment from the state in `it`, as [`run_projected_gradient`] describes.
pub(super) fn solve(problem: &Increment, it: &mut ContactState, control: &mut SolveControl) -> SolveReport {
    let shortest = step_sizes(problem, it, 1.0);
    let mut rule =
        BarzilaiBorweinRule { shortest, longest: MAX_STEP_RATIO, current: shortest, use_long_step: false };
    run_projected_gradient(problem, it, &mut rule, control)
}
