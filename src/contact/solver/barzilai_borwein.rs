//! Projected gradient with Barzilai-Borwein steps, one for the normal and one for the tangential block
//! (docs/theory-contact.md): alternately s·s / s·y and s·y / y·y, clipped to [1, 1000] / λ_max; nonmonotone, the best
//! state is kept.

use super::super::projection::StepSizes;
use super::super::{Increment, Iterate};
use super::projected::{StepRule, iterate, spectral_bounds};
use super::{SolveReport, Solver, SolverOptions, Watch};

const LONGEST: f64 = 1e3;

struct Rule {
    shortest: StepSizes,
    longest: f64,
    current: StepSizes,
    even: bool,
}

/// s·s, s·y, y·y in the area-weighted product over the planes `planes` of every end.
fn products(problem: &Increment, old: &Iterate, new: &Iterate, planes: std::ops::Range<usize>) -> [f64; 3] {
    let n = problem.n();
    let mut sums = [0.0; 3];
    for end in 0..problem.ends.len() {
        if problem.ends[end].balance.is_some() {
            add_balanced(problem, (old, new), (end, planes.clone()), &mut sums);
            continue;
        }
        for plane in planes.clone() {
            // A uniform rigid shift of the gap is a multiplier, not curvature.
            let shift = if problem.rigid_axes.is_none() && plane == 2 {
                new.rigid[end][2] - old.rigid[end][2]
            } else {
                0.0
            };
            let base = end * 3 * n + plane * n;
            for i in 0..n {
                let s = new.hatted[base + i] - old.hatted[base + i];
                let y = new.gradient[base + i] - old.gradient[base + i] - shift;
                sums[0] += problem.areas[i] * s * s;
                sums[1] += problem.areas[i] * s * y;
                sums[2] += problem.areas[i] * y * y;
            }
        }
    }
    sums
}

/// Adds the products of an end whose rigid motion is the multiplier of a balance: no curvature either, in any plane.
fn add_balanced(
    problem: &Increment,
    (old, new): (&Iterate, &Iterate),
    (end, planes): (usize, std::ops::Range<usize>),
    sums: &mut [f64; 3],
) {
    let n = problem.n();
    let rigid = std::array::from_fn(|k| new.rigid[end][k] - old.rigid[end][k]);
    let floating = std::array::from_fn(|k| new.floating[end][k] - old.floating[end][k]);
    for i in 0..n {
        let mut shift = problem.rigid_gap(i, rigid, &floating);
        let tangential = problem.hat().map_or([0.0; 2], |hat| hat.slip([shift[0], shift[1]]));
        (shift[0], shift[1]) = (tangential[0], tangential[1]);
        for plane in planes.clone() {
            let k = end * 3 * n + plane * n + i;
            let s = new.hatted[k] - old.hatted[k];
            let y = new.gradient[k] - old.gradient[k] - shift[plane];
            sums[0] += problem.areas[i] * s * s;
            sums[1] += problem.areas[i] * s * y;
            sums[2] += problem.areas[i] * y * y;
        }
    }
}

impl Rule {
    fn size(&self, [ss, sy, yy]: [f64; 3], shortest: f64, current: f64) -> f64 {
        if sy.is_nan() || sy <= 0.0 {
            return current;
        }
        let size = if self.even { ss / sy } else { sy / yy };
        size.clamp(shortest, self.longest * shortest)
    }
}

impl StepRule for Rule {
    fn first(&self) -> StepSizes {
        self.shortest
    }

    fn next(&mut self, problem: &Increment, old: &Iterate, new: &Iterate) -> StepSizes {
        self.even = !self.even;
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

/// The method.
pub(super) struct BarzilaiBorwein;

impl Solver for BarzilaiBorwein {
    fn name(&self) -> &'static str {
        "bb"
    }

    fn suits(&self, _: &Increment) -> bool {
        true
    }

    fn solve(
        &self,
        problem: &Increment,
        it: &mut Iterate,
        options: &SolverOptions,
        watch: &mut Watch,
    ) -> SolveReport {
        problem.evaluate(it);
        let (normal, tangential) = spectral_bounds(problem, it);
        let shortest = StepSizes { normal: 1.0 / normal, tangential: 1.0 / tangential };
        let mut rule = Rule { shortest, longest: LONGEST, current: shortest, even: false };
        iterate(problem, it, options, &mut rule, watch)
    }
}
