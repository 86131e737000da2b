//! Checks of a state that do not depend on how it was found (docs/theory-contact.md), from the tractions alone.

use super::increment::{Increment, Iterate};

/// Independent checks of a state; all are relative and all are 0 for an exact solution.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct StateChecks {
    /// Natural residual (7.1).
    pub natural_residual: f64,
    /// Smallest normal gap, mm.
    pub min_gap: f64,
    /// Largest |q|_μ - p over the largest pressure, not below 0.
    pub max_cone_violation: f64,
    /// Σ A |p g_n| over the elastic energy.
    pub normal_gap_energy: f64,
    /// Σ A (p |Δg|*_μ + q·Δg) over the elastic energy (2.1).
    pub tangential_gap_energy: f64,
    /// Elastic energy ½ Pᵀ A S P, summed over the ends, N mm.
    pub elastic_energy: f64,
    /// Friction dissipation -Σ A q·Δg of one pass through the ends, N mm.
    pub dissipation: f64,
}

impl StateChecks {
    /// The worse of each check, for answers that consist of several solved states; the energies are those of
    /// `later`.
    pub fn worst(&self, later: &Self) -> Self {
        Self {
            natural_residual: self.natural_residual.max(later.natural_residual),
            min_gap: self.min_gap.min(later.min_gap),
            max_cone_violation: self.max_cone_violation.max(later.max_cone_violation),
            normal_gap_energy: self.normal_gap_energy.max(later.normal_gap_energy),
            tangential_gap_energy: self.tangential_gap_energy.max(later.tangential_gap_energy),
            ..*later
        }
    }
}

/// Evaluates the state afresh and checks it; without friction the tangential elastic gap is filled in too.
pub fn check(problem: &Increment, it: &mut Iterate) -> StateChecks {
    problem.evaluate(it);
    if problem.normal_only() {
        fill_tangential(problem, it);
    }
    let n = problem.n();
    let residual = problem.natural_residual(it);
    // Infinite where tractions are due and none is there yet (a solve stopped at its start): all of them are missing.
    let natural_residual = if residual == f64::INFINITY { 1.0 } else { residual };
    let mut checks = StateChecks { natural_residual, ..StateChecks::default() };
    checks.min_gap = f64::INFINITY;
    let mut p_max: f64 = 0.0;
    let mut normal = 0.0;
    let mut tangential = 0.0;
    for end in 0..problem.ends.len() {
        let base = end * 3 * n;
        for i in 0..n {
            let area = problem.areas[i];
            let p = it.tractions[base + 2 * n + i];
            let g = it.gap[base + 2 * n + i];
            p_max = p_max.max(p);
            checks.min_gap = checks.min_gap.min(g);
            normal += area * (p * g).abs();
            for plane in 0..3 {
                let k = base + plane * n + i;
                checks.elastic_energy += 0.5 * area * it.tractions[k] * it.elastic[k];
            }
            if problem.friction.is_some() {
                let q = [it.hatted[base + i], it.hatted[base + n + i]];
                let s = [it.gradient[base + i], it.gradient[base + n + i]];
                let work = q[0] * s[0] + q[1] * s[1];
                checks.max_cone_violation = checks.max_cone_violation.max(q[0].hypot(q[1]) - p);
                tangential += area * (p * s[0].hypot(s[1]) + work);
            }
            let k = end * 2 * n + i;
            checks.dissipation -=
                area * (it.tractions[base + i] * it.slip[k] + it.tractions[base + n + i] * it.slip[k + n]);
        }
    }
    if p_max > 0.0 {
        checks.max_cone_violation /= p_max;
        checks.normal_gap_energy = normal / checks.elastic_energy;
        checks.tangential_gap_energy = tangential / checks.elastic_energy;
    }
    checks
}

/// Without friction only normal planes are computed while iterating; the slip for output needs all.
fn fill_tangential(problem: &Increment, it: &mut Iterate) {
    let n = problem.n();
    for end in 0..problem.ends.len() {
        let planes = end * 3 * n..(end + 1) * 3 * n;
        let before = it.elastic[planes.clone()].to_vec();
        problem.flexibility.apply(&it.tractions[planes.clone()], &mut it.elastic[planes]);
        let start = end * 3 * n;
        let changes = it.elastic[start..start + 2 * n].iter().zip(&before).map(|(new, old)| new - old);
        it.gap[start..start + 2 * n].iter_mut().zip(changes).for_each(|(gap, change)| *gap += change);
    }
    problem.fill_slip(it);
}
