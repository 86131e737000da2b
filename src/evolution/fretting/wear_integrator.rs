//! Integration of wear over a jump of ΔN cycles (docs/theory-wear.md).
//!
//! A jump integrates dw/dN = F(w) with wear depth w and number of cycles N. F = Σ_k p_k |s_k|_i is the sum over the
//! increments k of a cycle. p_k is the mean pressure and s_k the slip of increment k. The norm |s|_i = √((i1·s1)² +
//! (i2·s2)²) contains the specific wear rates i1, i2 along the wear axes.
//!
//! The path points of a cycle are solved together. The slip of an increment is the difference of the tangential gaps at
//! its path points, so it includes the elastic recovery. All path points have the same wear depth, which is implicit
//! except in explicit Euler. Cells that stick through the whole cycle keep their stick gap. A resolved cycle corrects F
//! in each cell to f F + a ([`RateCorrection`]) with the same f and a in the whole jump.

use crate::contact::Increment;
use crate::contact::SolverOptions;
use crate::contact::certificate::StateChecks;
use crate::contact::solver::{SolveReport, StopReason};
use crate::error::Result;
use crate::evolution::field_measures::{root_mean_square, volume};
use crate::evolution::fretting::cycle_state::CycleState;
use crate::evolution::fretting::rate_correction::RateCorrection;
use crate::evolution::fretting::settings::WEAR_STEP;
use crate::evolution::fretting::wear_step_state::WearStepState;
use crate::evolution::increment_solve::{ActiveLaws, ProgressSpan, increment_problem};
use crate::evolution::run::Run;
use crate::evolution::solve_work::SolveWork;
use crate::evolution::state;
use crate::evolution::step::Integrator;

/// γ of the L-stable two-stage SDIRK method.
const GAMMA: f64 = 1.0 - std::f64::consts::FRAC_1_SQRT_2;

/// Stage of an integrator. The stage is evaluated at the wear depth w_stage = w + `implicit_weight` ΔN F(w_stage),
/// where w is the wear depth before the stage. The stage adds `solution_weight` ΔN F(w_stage) to the wear of the jump.
#[derive(Debug, Clone, Copy)]
struct StageWeights {
    implicit_weight: f64,
    solution_weight: f64,
    abscissa: f64,
}

/// Runge-Kutta scheme. An embedded quadrature of one order higher gives the error estimate.
struct Scheme {
    stages: &'static [StageWeights],
    start_weight: f64,
    /// Differences b - b̃ between the weights of the method and of the embedded quadrature. The first difference belongs
    /// to the rate at the start, the others to the rates of the stages.
    error_weights: &'static [f64],
}

/// L-stable SDIRK method of order 2 with an embedded third-order quadrature. The weights b̃ of the quadrature for the rates at the
/// abscissae c = 0, γ, 1 satisfy Σb̃ = 1, Σb̃c = 1/2, Σb̃c² = 1/3. The estimate contains only a part of the error of a rate that is
/// linear in the depth (docs/theory-wear.md).
const SDIRK2: Scheme = Scheme {
    stages: &[
        StageWeights { implicit_weight: GAMMA, solution_weight: 1.0 - GAMMA, abscissa: GAMMA },
        StageWeights { implicit_weight: GAMMA, solution_weight: GAMMA, abscissa: 1.0 },
    ],
    start_weight: 0.0,
    error_weights: &[SDIRK2_ERROR[0], SDIRK2_ERROR[1], SDIRK2_ERROR[2]],
};

/// Differences b - b̃ with b̃1 = (1/6) / (γ - γ²), b̃2 = 1/2 - γ b̃1, b̃0 = 1 - b̃1 - b̃2.
const SDIRK2_ERROR: [f64; 3] = {
    let first = (1.0 / 6.0) / (GAMMA - GAMMA * GAMMA);
    let second = 0.5 - GAMMA * first;
    [first + second - 1.0, 1.0 - GAMMA - first, GAMMA - second]
};

/// Backward Euler with the trapezoidal rule as error estimate.
const BACKWARD_EULER: Scheme = Scheme {
    stages: &[StageWeights { implicit_weight: 1.0, solution_weight: 1.0, abscissa: 1.0 }],
    start_weight: 0.0,
    error_weights: &[-0.5, 0.5],
};

/// Explicit Euler with the trapezoidal rule as error estimate. The rate at the end is also the first rate of the next jump.
const EXPLICIT: Scheme = Scheme {
    stages: &[StageWeights { implicit_weight: 0.0, solution_weight: 0.0, abscissa: 1.0 }],
    start_weight: 1.0,
    error_weights: &[0.5, -0.5],
};

impl Integrator {
    fn scheme(self) -> &'static Scheme {
        match self {
            Self::Sdirk2 => &SDIRK2,
            Self::BackwardEuler => &BACKWARD_EULER,
            Self::Explicit => &EXPLICIT,
        }
    }

    /// Allowed error of a jump that covers the part `share` of its step, as a fraction of the allowed error of the
    /// step.
    ///
    /// With SDIRK2 most of the error is in cells that come into contact. These cells differ from jump to jump, so the
    /// squares of their errors add up. With the Euler methods, errors have the same sign, except in cells that come
    /// into contact. A lower bound on the allowed error accounts for these cells.
    pub(super) fn error_budget(self, share: f64) -> f64 {
        if self == Self::Sdirk2 {
            share.sqrt()
        } else {
            share.max(WEAR_STEP.min_error_budget_share * share.sqrt())
        }
    }

    /// Order p of the integrator: the error of a jump grows as length^(p + 1).
    pub(super) fn order(self) -> f64 {
        if self == Self::Sdirk2 { 2.0 } else { 1.0 }
    }
}

/// Trial of a jump that is not yet added to the state of the run.
pub(super) struct WearJump {
    /// Cycles, or sliding distance in mm.
    pub length: f64,
    /// Cycle at the end of the jump.
    pub cycle: CycleState,
    /// Wear depth per cycle (mm), or per mm of sliding, at the end of the jump, `[N]`.
    pub wear_rate: Vec<f64>,
    /// Dissipation per cycle (N mm), or per mm of sliding (N), at the end of the jump.
    pub dissipation_rate: f64,
    /// Correction of the wear by a resolved cycle; `None` without correction.
    pub rate_correction: Option<RateCorrection>,
    /// Iterations and operator applications of all stages; stop reason and residual of the last stage.
    pub report: SolveReport,
    /// Worst checks of all stages.
    pub checks: StateChecks,
    pub solves: usize,
    pub dissipation: f64,
    /// Wear depth of the jump, `[N]`, mm.
    pub wear_depth: Vec<f64>,
    /// Estimated error of the wear depth, `[N]`, mm.
    pub error_field: Vec<f64>,
    /// Root mean square of the estimated error over the contact at the end of the jump, mm.
    pub depth_error: f64,
    /// Estimated error of the wear volume, mm3.
    pub volume_error: f64,
    /// Whether the second stage of SDIRK2 lost too much of the contact.
    pub lost_contact: bool,
    pub reaches_frame_edge: bool,
    /// Estimated error of the wear depth from factors that change during the jump, `[N]`, mm.
    pub path_error: Vec<f64>,
    /// Root mean square of `path_error` over the contact at the end of the jump, mm.
    pub path_depth_error: f64,
}

impl WearJump {
    pub fn new(wear_step: &WearStepState, length: f64) -> Self {
        let n = wear_step.wear_rate.len();
        let resolved = wear_step.path_correction.as_ref().filter(|resolved| resolved.corrects);
        Self {
            length,
            cycle: CycleState::from(&wear_step.cycle),
            wear_rate: wear_step.wear_rate.clone(),
            dissipation_rate: wear_step.dissipation_rate,
            rate_correction: resolved.map(|resolved| resolved.correction.clone()),
            report: SolveReport { stop: StopReason::Converged, residual: 0.0, ..SolveReport::default() },
            checks: StateChecks { min_gap: f64::INFINITY, ..StateChecks::default() },
            solves: 0,
            dissipation: 0.0,
            wear_depth: vec![0.0; n],
            error_field: vec![0.0; n],
            depth_error: 0.0,
            volume_error: 0.0,
            lost_contact: false,
            reaches_frame_edge: false,
            path_error: vec![0.0; n],
            path_depth_error: 0.0,
        }
    }

    pub fn work(&self) -> SolveWork {
        SolveWork { solves: self.solves, ..SolveWork::of(&self.report) }
    }

    /// Adds work that no other record contains: work of first strokes, rejected trials and discarded jumps.
    pub fn charge_work(&mut self, work: SolveWork) {
        self.solves += work.solves;
        self.report.iterations += work.iterations;
        self.report.applications += work.applications;
    }

    /// Estimated error of the wear depth from all sources, mm.
    pub fn whole_depth_error(&self) -> f64 {
        self.depth_error + self.path_depth_error
    }

    pub fn converged(&self) -> bool {
        self.report.stop == StopReason::Converged
    }
}

pub(super) fn add(to: &mut [f64], factor: f64, field: &[f64]) {
    to.iter_mut().zip(field).for_each(|(to, value)| *to += factor * value);
}

#[derive(Clone)]
pub(super) struct JumpSpec {
    pub integrator: Integrator,
    /// Cycles, or sliding distance in mm.
    pub length: f64,
    /// Correction of the wear by a resolved cycle; `None` without correction.
    pub rate_correction: Option<RateCorrection>,
    pub options: SolverOptions,
}

pub(super) struct StageSpec<'s> {
    /// Fraction of the step that determines the loads.
    pub step_fraction: f64,
    /// Wear depth from which the wear of the stage starts, `[N]`, mm.
    pub wear_depth: &'s [f64],
    /// Number of cycles, or sliding distance in mm, whose wear is implicit in the stage.
    pub implicit_passes: f64,
    pub options: &'s SolverOptions,
}

impl Run<'_> {
    /// Integrates the wear over `length` from the present state of the run and of `wear_step`. Does not change these
    /// states.
    pub(super) fn integrate(
        &mut self,
        JumpSpec { integrator, length, rate_correction, options }: JumpSpec,
        wear_step: &WearStepState,
        progress: &ProgressSpan,
    ) -> Result<WearJump> {
        let scheme = integrator.scheme();
        let mut jump = WearJump { rate_correction, ..WearJump::new(wear_step, length) };
        add(&mut jump.wear_depth, scheme.start_weight * length, &wear_step.wear_rate);
        add(&mut jump.error_field, scheme.error_weights[0] * length, &wear_step.wear_rate);
        jump.dissipation = scheme.start_weight * length * wear_step.dissipation_rate;
        for (number, weights) in scheme.stages.iter().enumerate() {
            let mut worn = self.state.wear_depth.clone();
            add(&mut worn, 1.0, &jump.wear_depth);
            if let Some(correction) = &jump.rate_correction {
                add(&mut worn, weights.implicit_weight * length, &correction.added);
            }
            let touched = self.cells_in_contact(&jump.cycle.contact.scaled);
            let spec = StageSpec {
                step_fraction: (wear_step.completed + weights.abscissa * length) / self.cycles().count,
                wear_depth: &worn,
                implicit_passes: weights.implicit_weight * length,
                options: &options,
            };
            self.solve_path_points(spec, wear_step, &mut jump, progress)?;
            if !jump.converged() {
                return Ok(jump);
            }
            jump.reaches_frame_edge |= state::touches_edge(&self.prepared, &jump.cycle.contact.scaled);
            jump.lost_contact = number > 0
                && self.lost_contact_share(&touched, &jump.cycle.contact.scaled)
                    > WEAR_STEP.max_lost_contact_share;
            if jump.lost_contact {
                return Ok(jump);
            }
            jump.wear_rate = self.corrected_rate(&jump);
            jump.dissipation_rate = jump.checks.dissipation * wear_step.dissipation_factor();
            add(&mut jump.wear_depth, weights.solution_weight * length, &jump.wear_rate);
            add(&mut jump.error_field, scheme.error_weights[number + 1] * length, &jump.wear_rate);
            jump.dissipation += weights.solution_weight * length * jump.dissipation_rate;
        }
        jump.depth_error = self.depth_error(&jump.error_field, &jump);
        let areas = &self.prepared.model.frame.areas;
        jump.volume_error = WEAR_STEP.volume_error_factor * volume(&jump.error_field, areas).abs();
        Ok(jump)
    }

    /// Wear per cycle (mm), or per mm of sliding, at the end of a stage of `jump`, `[N]`.
    pub(super) fn corrected_rate(&self, jump: &WearJump) -> Vec<f64> {
        let mut rate = self.worn_per_pass(&jump.cycle.contact);
        if let Some(correction) = &jump.rate_correction {
            add(&mut rate, 1.0, &correction.added);
        }
        rate
    }

    /// Root mean square of `error` over the contact at the end of the jump `jump`, mm.
    pub(super) fn depth_error(&self, error: &[f64], jump: &WearJump) -> f64 {
        let touching = self.cells_in_contact(&jump.cycle.contact.scaled);
        root_mean_square(error, &self.prepared.model.frame.areas, |i| touching[i])
    }

    /// Returns for each cell whether it carries pressure at any path point. `scaled` are the scaled tractions, `[3, N]`
    /// per path point.
    pub(super) fn cells_in_contact(&self, scaled: &[f64]) -> Vec<bool> {
        let n = self.prepared.n();
        (0..n).map(|i| scaled.chunks_exact(3 * n).any(|planes| planes[2 * n + i] > 0.0)).collect()
    }

    fn lost_contact_share(&self, before: &[bool], scaled: &[f64]) -> f64 {
        let (mut lost, mut all) = (0.0, 0.0);
        let areas = &self.prepared.model.frame.areas;
        for ((was, is), area) in before.iter().zip(self.cells_in_contact(scaled)).zip(areas) {
            if *was {
                all += area;
                lost += if is { 0.0 } else { *area };
            }
        }
        if all > 0.0 { lost / all } else { 0.0 }
    }

    pub(super) fn reporting_problem<'b>(
        &'b self,
        wear_step: &WearStepState,
        cycle: &CycleState,
        worn: &'b [f64],
    ) -> Increment<'b> {
        let points = 0..cycle.contact.rigid_motion.len();
        let ends = points.map(|point| wear_step.reported_path_point(point, &cycle.stick_zone)).collect();
        increment_problem(&self.prepared, &self.options, worn, ActiveLaws::of(self.step()), ends)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Truth: dw/dN = λ w with w(0) = 1 gives w = exp(z) after a jump ΔN, with z = λΔN. Error and estimate have the
    /// order of the integrator plus one. For the Euler methods, the ratio of estimate to error tends to 1. For SDIRK2
    /// it tends to (Σb̃Ac - ΣbAc) / (1/6 - ΣbAc), because 1/6 is the exact value of ΣbAc. b and b̃ are the weights of
    /// method and quadrature, A is the Runge-Kutta matrix, and A c = (γ², 1/2).
    #[test]
    fn estimates_of_a_linear_rate() {
        let by_rates = |b: [f64; 2]| b[0] * GAMMA * GAMMA + b[1] * 0.5;
        let companion = [1.0 - GAMMA - SDIRK2_ERROR[1], GAMMA - SDIRK2_ERROR[2]];
        let own = by_rates([1.0 - GAMMA, GAMMA]);
        let share = (by_rates(companion) - own) / (1.0 / 6.0 - own);
        for (integrator, order) in
            [(Integrator::Sdirk2, 2), (Integrator::BackwardEuler, 1), (Integrator::Explicit, 1)]
        {
            let scheme = integrator.scheme();
            let shares: f64 =
                scheme.start_weight + scheme.stages.iter().map(|stage| stage.solution_weight).sum::<f64>();
            assert!((shares - 1.0).abs() < 1e-15, "{integrator:?}: shares");
            let error_and_estimate = |z: f64| {
                let mut worn = 1.0 + scheme.start_weight * z;
                let mut estimate = scheme.error_weights[0] * z;
                for (stage, error) in scheme.stages.iter().zip(&scheme.error_weights[1..]) {
                    let rate = worn / (1.0 - stage.implicit_weight * z);
                    worn += stage.solution_weight * z * rate;
                    estimate += error * z * rate;
                }
                (worn - z.exp(), estimate)
            };
            for z in [-0.02, -0.01] {
                let (error, estimate) = error_and_estimate(z);
                let wanted = if integrator == Integrator::Sdirk2 { share } else { 1.0 };
                let found = estimate / error;
                assert!((found / wanted - 1.0).abs() < 3.0 * z.abs(), "{integrator:?}: {found} {wanted}");
            }
            let observed = (error_and_estimate(-0.02).0 / error_and_estimate(-0.01).0).log2();
            assert!((observed - f64::from(order + 1)).abs() < 0.05, "{integrator:?}: {observed}");
        }
    }

    /// Truth: for the rate N² the exact wear of a jump from N = 0 to 1 is ∫ N² dN = 1/3. The SDIRK2 estimate equals the computed
    /// wear minus 1/3, because the rate depends on N alone.
    #[test]
    fn estimate_of_a_given_rate() {
        let worn: f64 =
            SDIRK2.stages.iter().map(|stage| stage.solution_weight * stage.abscissa * stage.abscissa).sum();
        let estimate = SDIRK2.error_weights[1] * GAMMA * GAMMA + SDIRK2.error_weights[2];
        assert!((estimate - (worn - 1.0 / 3.0)).abs() < 1e-15, "{estimate} {worn}");
        assert!(SDIRK2.error_weights.iter().sum::<f64>().abs() < 1e-15);
    }
}
