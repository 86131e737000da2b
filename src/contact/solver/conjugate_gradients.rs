//! Projected conjugate gradients for pressures alone.
//!
//! Minimises the energy ½ pᵀ A S p + g₀ᵀ A p over pressures p >= 0, with cell areas A, normal flexibility S and gap g₀ at zero
//! pressure. Under a prescribed force the sum of A p is fixed.
//!
//! Each step minimises the energy along a direction that is conjugate to the previous direction on the cells in
//! contact. Negative pressures are set to zero. Cells with overlap enter the contact. The residual is preconditioned
//! with the approximate inverse of S, or with the inverse of its diagonal.
//!
//! # Source
//! Polonsky and Keer 1999, "A numerical method for solving rough contact problems based on the multi-level multi-summation and
//! conjugate gradient techniques"; with a preconditioner: Vollebregt 2014.

use super::super::balance::StepSizes;
use super::super::projection::{RigidMotions, project};
use super::super::{ContactState, Increment, NormalControl, TangentialControl};
use super::control::SolveControl;
use super::report::SolveReport;

/// Number of iterations without a new best residual after which the solve ends.
const MAX_STEPS_WITHOUT_GAIN: usize = 200;

/// Factor on the step length if setting negative pressures to zero raised the energy.
const BACKTRACK_FACTOR: f64 = 0.25;
const MAX_BACKTRACKS: usize = 8;

/// Returns whether only pressures are unknown, with a rigid motion that is given or follows from a positive normal force.
pub(super) fn is_applicable(problem: &Increment) -> bool {
    let [end] = problem.path_points.as_slice() else { return false };
    let pulled = matches!(end.normal, NormalControl::Force(force) if force <= 0.0);
    let free = end.balance.is_some() || end.tangential != TangentialControl::Shift;
    problem.friction.is_none() && problem.wear.is_none() && !pulled && !free
}

/// Work vectors over the cells, `[N]`.
struct CgWorkspace {
    /// Whether a cell carries pressure or overlaps.
    active: Vec<bool>,
    /// Negative normal gap -g in the active cells, zero elsewhere, mm.
    residual: Vec<f64>,
    residual_before: Vec<f64>,
    preconditioned: Vec<f64>,
    direction: Vec<f64>,
    /// S times the search direction.
    image: Vec<f64>,
    pressures_before: Vec<f64>,
    elastic_before: Vec<f64>,
    /// Product of the previous residual with the preconditioned previous residual; `None` at a restart.
    product_before: Option<f64>,
}

impl CgWorkspace {
    fn new(n: usize) -> Self {
        let zeros = || vec![0.0; n];
        Self {
            active: vec![false; n],
            residual: zeros(),
            residual_before: zeros(),
            preconditioned: zeros(),
            direction: zeros(),
            image: zeros(),
            pressures_before: zeros(),
            elastic_before: zeros(),
            product_before: None,
        }
    }
}

pub(super) fn solve(problem: &Increment, it: &mut ContactState, control: &mut SolveControl) -> SolveReport {
    let n = problem.n();
    let mut work = CgWorkspace::new(n);
    let mut report = SolveReport { applications: 2, ..SolveReport::default() };
    start(problem, it);
    let mut best = (f64::INFINITY, 0);
    // Whether S p was computed from the pressures and not by updates.
    let mut fresh = true;
    loop {
        let mut residual = update_active_set(problem, it, &mut work);
        if residual <= control.options.tolerance {
            // Updates of S p accumulate rounding errors. If the residual is within the tolerance, S p is therefore
            // computed from the pressures.
            report.applications += usize::from(!fresh);
            if fresh {
                it.tractions[2 * n..].copy_from_slice(&it.scaled[2 * n..]);
                problem.fill_from_elastic(it);
            } else {
                problem.evaluate(it);
            }
            work.product_before = None;
            residual = problem.natural_residual(it);
        }
        report.residual = residual;
        if residual < best.0 {
            best = (residual, report.iterations);
        }
        let limit = control.options.max_iterations.min(best.1 + MAX_STEPS_WITHOUT_GAIN);
        if let Some(stop) = control.stop_reason(report.iterations, residual, report.iterations >= limit) {
            report.stop = stop;
            return report;
        }
        let Some(CgStep { products, cut }) = step(problem, it, &mut work) else {
            if work.product_before.take().is_none() {
                return report;
            }
            // The previous direction is not conjugate on the present contact. The next step starts without it.
            report.applications += 1;
            continue;
        };
        report.iterations += 1;
        report.applications += products;
        fresh = cut;
    }
}

/// Sets and evaluates the initial pressures: the pressures of `it`, or one projected gradient step from zero tractions.
/// A factor then scales the pressures to the prescribed force. Under a given approach, the factor for a start from zero
/// minimises the energy.
fn start(problem: &Increment, it: &mut ContactState) {
    let n = problem.n();
    let normal = 2 * n..3 * n;
    let sum = |p: &[f64]| -> f64 { p.iter().zip(problem.areas).map(|(p, area)| area * p).sum() };
    problem.evaluate(it);
    let mut given = sum(&it.scaled[normal.clone()]);
    let cold = given <= 0.0;
    if cold {
        let step = 1.0 / problem.scales.max_normal_eigenvalue(problem.flexibility, problem.areas);
        let (from, gap) = (it.scaled.clone(), it.gap.clone());
        let motions = RigidMotions { rigid: &mut it.rigid_motion, floating: &mut it.mode_amplitudes };
        let steps = StepSizes { normal: step, tangential: step };
        project(problem, steps, &from, &gap, &mut it.scaled, motions);
        problem.evaluate(it);
        given = sum(&it.scaled[normal.clone()]);
    }
    if given <= 0.0 {
        return;
    }
    let factor = match problem.path_points[0].normal {
        NormalControl::Force(force) => force / given,
        NormalControl::Approach if cold => {
            // Energy as a function of the factor t: ½ t² pᵀ A S p + t pᵀ A (g - S p).
            let product = |values: &[f64]| -> f64 {
                let pressures = it.scaled[normal.clone()].iter().zip(problem.areas);
                pressures.zip(&values[normal.clone()]).map(|((p, area), value)| area * p * value).sum()
            };
            let (elastic, gap) = (product(&it.elastic), product(&it.gap));
            1.0 - gap / elastic
        }
        NormalControl::Approach => 1.0,
    };
    if factor.is_finite() && factor > 0.0 {
        it.scaled[normal.clone()].iter_mut().for_each(|p| *p *= factor);
        it.elastic[normal].iter_mut().for_each(|u| *u *= factor);
    }
}

/// Updates the normal gap, the rigid motion under a prescribed force, the active cells and their residual. Returns the natural
/// residual without the force defect.
fn update_active_set(problem: &Increment, it: &mut ContactState, work: &mut CgWorkspace) -> f64 {
    let n = problem.n();
    problem.fill_normal_gap(it, 0);
    if let NormalControl::Force(_) = problem.path_points[0].normal {
        let (mut sum, mut area) = (0.0, 0.0);
        for i in (0..n).filter(|&i| it.scaled[2 * n + i] > 0.0) {
            sum += problem.areas[i] * it.gap[2 * n + i];
            area += problem.areas[i];
        }
        if area > 0.0 {
            let lift = sum / area;
            it.rigid_motion[0][2] -= lift;
            it.gap[2 * n..].iter_mut().for_each(|gap| *gap -= lift);
        }
    }
    let (mut change, mut p_max, mut sum) = (0.0_f64, 0.0_f64, 0.0);
    for (i, (p, gap)) in it.scaled[2 * n..].iter().zip(&it.gap[2 * n..]).enumerate() {
        work.active[i] = *p > 0.0 || *gap < 0.0;
        work.residual[i] = if work.active[i] { -gap } else { 0.0 };
        let after = (p - problem.scales.c_normal[i] * gap).max(0.0);
        change = change.max((p - after).abs());
        p_max = p_max.max(*p);
        // The sum is NaN if any gap is NaN.
        sum += gap;
    }
    let residual = if change == 0.0 { 0.0 } else { change / p_max };
    if sum.is_nan() { f64::NAN } else { residual }
}

struct CgStep {
    /// Number of products with S.
    products: usize,
    /// Whether negative pressures were set to zero, so that S p was computed again.
    cut: bool,
}

/// Takes a step. Returns `None` if the step length is not positive and finite.
fn step(problem: &Increment, it: &mut ContactState, work: &mut CgWorkspace) -> Option<CgStep> {
    let n = problem.n();
    work.pressures_before.copy_from_slice(&it.scaled[2 * n..]);
    let areas = problem.areas;
    let product =
        |a: &[f64], b: &[f64]| -> f64 { areas.iter().zip(a).zip(b).map(|((area, a), b)| area * a * b).sum() };
    if !problem.flexibility.precondition_normal(&work.residual, &mut work.preconditioned) {
        let scaled = work.residual.iter().zip(&problem.scales.c_normal).map(|(r, c)| r * c);
        work.preconditioned.iter_mut().zip(scaled).for_each(|(z, value)| *z = value);
    }
    let held = matches!(problem.path_points[0].normal, NormalControl::Force(_));
    restrict(&mut work.preconditioned, &work.active, areas, held);
    let now = product(&work.residual, &work.preconditioned);
    let memory = match work.product_before {
        Some(before) => ((now - product(&work.residual_before, &work.preconditioned)) / before).max(0.0),
        None => 0.0,
    };
    for (d, z) in work.direction.iter_mut().zip(&work.preconditioned) {
        *d = z + memory * *d;
    }
    restrict(&mut work.direction, &work.active, areas, held);
    problem.flexibility.apply_normal(&work.direction, &mut work.image);
    let curvature = product(&work.direction, &work.image);
    let length = product(&work.residual, &work.direction) / curvature;
    if !(curvature > 0.0 && length.is_finite() && length > 0.0) {
        return None;
    }
    work.residual_before.copy_from_slice(&work.residual);
    work.product_before = Some(now);
    let cut = advance(&mut it.scaled[2 * n..], &work.direction, length);
    if cut {
        Some(CgStep { products: 1 + backtrack(problem, it, work, length), cut })
    } else {
        it.elastic[2 * n..].iter_mut().zip(&work.image).for_each(|(u, s)| *u += length * s);
        Some(CgStep { products: 1, cut })
    }
}

/// Adds `length` times `direction` and sets negative pressures to zero. Returns whether any pressure was negative.
fn advance(pressures: &mut [f64], direction: &[f64], length: f64) -> bool {
    let mut cut = false;
    for (p, d) in pressures.iter_mut().zip(direction) {
        *p += length * d;
        cut |= *p < 0.0;
        *p = p.max(0.0);
    }
    cut
}

/// Applies S to the pressures after a step of `length` in which negative pressures were set to zero. Shortens the step while this
/// cut raises the energy. Returns the number of products with S.
fn backtrack(problem: &Increment, it: &mut ContactState, work: &mut CgWorkspace, length: f64) -> usize {
    let (normal, mut length) = (2 * problem.n().., length);
    work.elastic_before.copy_from_slice(&it.elastic[normal.clone()]);
    // Energy up to a constant: Σ A p (g - S p_before + ½ S p), with g the gap before the step.
    let energy = |pressures: &[f64], elastic: &[f64], gap: &[f64], before: &[f64]| -> f64 {
        let gaps =
            gap.iter().zip(before).zip(elastic).map(|((gap, before), elastic)| gap - before + 0.5 * elastic);
        problem.areas.iter().zip(pressures).zip(gaps).map(|((area, p), gap)| area * p * gap).sum()
    };
    let (gap, before) = (&it.gap[normal.clone()], &work.elastic_before);
    let start = energy(&work.pressures_before, before, gap, before);
    for products in 1..=MAX_BACKTRACKS {
        let pressures = &mut it.scaled[normal.clone()];
        if let NormalControl::Force(force) = problem.path_points[0].normal {
            let sum: f64 = pressures.iter().zip(problem.areas).map(|(p, area)| area * p).sum();
            pressures.iter_mut().for_each(|p| *p *= force / sum);
        }
        problem.flexibility.apply_normal(pressures, &mut it.elastic[normal.clone()]);
        if products == MAX_BACKTRACKS || energy(pressures, &it.elastic[normal.clone()], gap, before) <= start
        {
            return products;
        }
        length *= BACKTRACK_FACTOR;
        pressures.copy_from_slice(&work.pressures_before);
        advance(pressures, &work.direction, length);
    }
    MAX_BACKTRACKS
}

/// Sets `values` to zero outside the active cells. Under a prescribed force (`held`), also subtracts the area-weighted mean over
/// the active cells.
fn restrict(values: &mut [f64], active: &[bool], areas: &[f64], held: bool) {
    values.iter_mut().zip(active).filter(|(_, active)| !**active).for_each(|(value, _)| *value = 0.0);
    if !held {
        return;
    }
    let (mut sum, mut area) = (0.0, 0.0);
    for i in (0..values.len()).filter(|&i| active[i]) {
        sum += areas[i] * values[i];
        area += areas[i];
    }
    let mean = if area > 0.0 { sum / area } else { 0.0 };
    values.iter_mut().zip(active).filter(|(_, active)| **active).for_each(|(value, _)| *value -= mean);
}
