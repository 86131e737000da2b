//! Independent checks of a solved state, computed from its tractions and rigid motions alone (docs/theory-contact.md).
//!
//! P are the tractions with components q and p, S is the flexibility operator, and A are the cell areas. g_n is the
//! normal gap and Δg the slip.

use super::{ContactState, Increment};
use crate::linalg::vector::nan_max;

/// Independent checks of a state. Dimensionless checks are 0 for an exact solution.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct StateChecks {
    /// Natural residual ([`Increment::natural_residual`]).
    pub natural_residual: f64,
    /// Smallest normal gap, mm.
    pub min_gap: f64,
    /// Largest max(|q|_μ - p, 0), divided by the largest pressure. |q|_μ is the magnitude of the scaled tangential traction.
    pub max_cone_violation: f64,
    /// Complementarity error Σ A |p g_n|, divided by the elastic energy E. If E <= 1e-12 E_0, the divisor is E_0 = ½ Σ
    /// A p² S_nn, the energy of cells that deform independently. E is zero, for example, under uniform pressure on a
    /// frame that is periodic in both directions.
    pub normal_gap_energy: f64,
    /// Error of the friction law Σ A (p |Δg|*_μ + q·Δg), divided by the denominator of `normal_gap_energy`. |Δg|*_μ is
    /// the magnitude of the scaled slip.
    pub tangential_gap_energy: f64,
    /// Elastic energy ½ Pᵀ A S P, summed over the path points, N mm.
    pub elastic_energy: f64,
    /// Error of S P: its largest difference from a reference in the checked cells, relative to the largest reference
    /// value. The reference is direct summation, or a direct solution of the bodies' equations. `None` without
    /// tractions, reference or comparison.
    pub operator_defect: Option<f64>,
    /// Friction dissipation Σ A p̄ |Δĝ| of one pass through the path points, with the mean pressures p̄, N mm.
    pub dissipation: f64,
}

impl StateChecks {
    /// Combines the checks of two successive states. Elastic energy and dissipation come from `later`. Every other
    /// check is the worse of the two values.
    pub fn worst(&self, later: &Self) -> Self {
        Self {
            natural_residual: self.natural_residual.max(later.natural_residual),
            min_gap: self.min_gap.min(later.min_gap),
            max_cone_violation: self.max_cone_violation.max(later.max_cone_violation),
            normal_gap_energy: self.normal_gap_energy.max(later.normal_gap_energy),
            tangential_gap_energy: self.tangential_gap_energy.max(later.tangential_gap_energy),
            operator_defect: larger(self.operator_defect, later.operator_defect),
            ..*later
        }
    }
}

fn larger(a: Option<f64>, b: Option<f64>) -> Option<f64> {
    a.into_iter().chain(b).reduce(nan_max)
}

/// Ratio E / E_0 (see [`StateChecks::normal_gap_energy`]) up to which E counts as zero. A smaller E is an error of the
/// tractions.
const MIN_ELASTIC_ENERGY_SHARE: f64 = 1e-12;

/// Largest number of kernels integrated for the direct sums of one path point.
const MAX_DIRECT_SUM_KERNELS: usize = 2000;
/// Bounds on the number of checked cells of one path point. The lower bound takes precedence over the limit on kernels.
const DIRECT_SUM_CELL_BOUNDS: [usize; 2] = [1, 50];

fn operator_defect(problem: &Increment, it: &ContactState) -> Option<f64> {
    let n = problem.n();
    let normal_only = problem.normal_only();
    let mut worst: Option<f64> = None;
    for (tractions, elastic) in it.tractions.chunks_exact(3 * n).zip(it.elastic.chunks_exact(3 * n)) {
        let loaded: Vec<usize> = (0..n).filter(|&cell| tractions[2 * n + cell] > 0.0).collect();
        if loaded.is_empty() {
            continue;
        }
        let count = (MAX_DIRECT_SUM_KERNELS / loaded.len())
            .clamp(DIRECT_SUM_CELL_BOUNDS[0], DIRECT_SUM_CELL_BOUNDS[1])
            .min(loaded.len());
        let planes = if normal_only { 2..3 } else { 0..3 };
        let cells: Vec<usize> =
            (0..count).map(|k| loaded[(2 * k + 1) * loaded.len() / (2 * count)]).collect();
        let Some(sums) = problem.flexibility.direct_sums(&cells, tractions) else { continue };
        let (mut difference, mut size) = (0.0_f64, 0.0_f64);
        for (cell, sum) in cells.iter().zip(&sums) {
            for plane in planes.clone() {
                let error = (elastic[plane * n + cell] - sum[plane]).abs();
                difference = nan_max(difference, error);
                size = size.max(sum[plane].abs());
            }
        }
        if size > 0.0 {
            worst = larger(worst, Some(difference / size));
        }
    }
    worst
}

/// Treatment of the tangential gap if the iterations compute only pressures.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum TangentialGap {
    /// Includes the displacement caused by the pressures.
    Complete,
    /// Omits the displacement caused by the pressures, because no output uses it or because wear has removed the
    /// pressures.
    Skip,
}

/// Whether S P is compared with direct sums.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum OperatorCheck {
    /// Compare in some of the loaded cells.
    SampleCells,
    /// Omit the comparison, because another increment includes it.
    Skip,
}

/// Evaluates the state and computes its checks.
pub fn check(
    problem: &Increment,
    it: &mut ContactState,
    gap: TangentialGap,
    sums: OperatorCheck,
) -> StateChecks {
    if problem.normal_only() {
        // Removes tangential displacements of earlier solutions. A resumed run does not have them, but must give the
        // same result.
        let n = problem.n();
        it.elastic.chunks_exact_mut(3 * n).for_each(|planes| planes[..2 * n].fill(0.0));
    }
    problem.evaluate(it);
    // If the operator has a separate tangential part, pressures cause no tangential displacement.
    if problem.normal_only() && gap == TangentialGap::Complete && problem.flexibility.tangential().is_none() {
        fill_tangential(problem, it);
    }
    let n = problem.n();
    let residual = problem.natural_residual(it);
    // The residual is infinite if a solve stopped before any traction existed.
    let natural_residual = if residual == f64::INFINITY { 1.0 } else { residual };
    let mut checks = StateChecks { natural_residual, ..StateChecks::default() };
    checks.min_gap = f64::INFINITY;
    checks.operator_defect =
        if sums == OperatorCheck::SampleCells { operator_defect(problem, it) } else { None };
    let mut p_max: f64 = 0.0;
    let mut alone = 0.0;
    let mut normal = 0.0;
    let mut tangential = 0.0;
    for end in 0..problem.path_points.len() {
        let base = end * 3 * n;
        for i in 0..n {
            let area = problem.areas[i];
            let p = it.tractions[base + 2 * n + i];
            let g = it.gap[base + 2 * n + i];
            p_max = p_max.max(p);
            checks.min_gap = checks.min_gap.min(g);
            normal += area * (p * g).abs();
            if p > 0.0 {
                alone += 0.5 * area * p * p / problem.scales.c_normal[i];
            }
            for plane in 0..3 {
                let k = base + plane * n + i;
                checks.elastic_energy += 0.5 * area * it.tractions[k] * it.elastic[k];
            }
            if problem.friction.is_some() {
                let q = [it.scaled[base + i], it.scaled[base + n + i]];
                let s = [it.gradient[base + i], it.gradient[base + n + i]];
                let work = q[0] * s[0] + q[1] * s[1];
                checks.max_cone_violation = checks.max_cone_violation.max(q[0].hypot(q[1]) - p);
                tangential += area * (p * s[0].hypot(s[1]) + work);
                let path = if problem.sticks(it, end, i) { -work / p } else { s[0].hypot(s[1]) };
                let unworn = g - problem.implicit_passes * it.wear_per_pass[i];
                checks.dissipation += area * problem.mean_pressure(it, end, i, unworn) * path;
            }
        }
    }
    if p_max > 0.0 {
        checks.max_cone_violation /= p_max;
        let deforms = checks.elastic_energy > MIN_ELASTIC_ENERGY_SHARE * alone;
        let energy = if deforms { checks.elastic_energy } else { alone };
        checks.normal_gap_energy = normal / energy;
        checks.tangential_gap_energy = tangential / energy;
    }
    checks
}

fn fill_tangential(problem: &Increment, it: &mut ContactState) {
    let n = problem.n();
    for end in 0..problem.path_points.len() {
        let planes = end * 3 * n..(end + 1) * 3 * n;
        let before = it.elastic[planes.clone()].to_vec();
        problem.flexibility.apply(&it.tractions[planes.clone()], &mut it.elastic[planes]);
        let start = end * 3 * n;
        let changes = it.elastic[start..start + 2 * n].iter().zip(&before).map(|(new, old)| new - old);
        it.gap[start..start + 2 * n].iter_mut().zip(changes).for_each(|(gap, change)| *gap += change);
    }
    problem.fill_slip(it);
}
