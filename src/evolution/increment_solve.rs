//! Solution of one increment.

use crate::contact::certificate::{self, OperatorCheck, StateChecks, TangentialGap};
use crate::contact::solver::{self, SolveReport, SolverOptions, StopReason};
use crate::contact::{ContactState, Increment, PathPoint, Pressures};
use crate::error::{Error, Result};
use crate::evolution::model::PreparedModel;
use crate::evolution::observer::Observer;
use crate::evolution::step::Step;
use crate::omitted::OmittableWork;

#[derive(Debug, Clone, Copy)]
pub(super) struct ActiveLaws<'f> {
    pub friction: bool,
    pub wear: bool,
    pub implicit_passes: f64,
    pub wear_path_factors: Option<&'f [f64]>,
}

impl ActiveLaws<'_> {
    /// Laws of `step`, for an increment whose wear does not change the gap.
    pub fn of(step: &Step) -> Self {
        Self { friction: step.friction, wear: step.wear, implicit_passes: 0.0, wear_path_factors: None }
    }
}

pub(super) fn increment_problem<'b>(
    prepared: &'b PreparedModel,
    options: &SolverOptions,
    wear_depth: &'b [f64],
    laws: ActiveLaws<'b>,
    path_points: Vec<PathPoint>,
) -> Increment<'b> {
    let model = prepared.model;
    Increment {
        flexibility: model.flexibility.as_ref(),
        areas: &model.frame.areas,
        initial_gap: &prepared.loaded_gap,
        cyclic_gap: prepared.cyclic_gap.as_deref(),
        rigid_axes: prepared.rigid_axes.as_deref(),
        mode_gaps: &prepared.mode_gaps,
        friction: if laws.friction { prepared.ellipse } else { None },
        wear: prepared.specific_wear_rate(laws.wear, laws.friction),
        wear_path_factors: laws.wear_path_factors,
        scales: prepared.scales(),
        patches: &prepared.patches,
        wear_depth,
        implicit_passes: laws.implicit_passes,
        pressures: Pressures::Unknown,
        skip: options.skip,
        path_points,
    }
}

/// Name of a stage of the run, with the fractions of the stage that are completed before and after a solve.
pub(super) struct ProgressSpan<'s> {
    pub name: &'s str,
    pub from: f64,
    pub to: f64,
}

fn solve(
    problem: &Increment,
    it: &mut ContactState,
    options: &SolverOptions,
    observer: &mut dyn Observer,
    stage: &ProgressSpan,
) -> Result<SolveReport> {
    let mut first = None;
    let report = solver::solve(problem, it, options, &mut |_, residual| {
        let start: f64 = *first.get_or_insert(residual.max(options.tolerance * 10.0));
        let done = (start / residual).ln() / (start / options.tolerance).ln();
        let done = if done.is_finite() { done.clamp(0.0, 1.0) } else { 0.0 };
        observer.progress(stage.name, stage.from + (stage.to - stage.from) * done, Some(residual));
        observer.cancelled()
    });
    if report.stop == StopReason::NotFinite {
        return Err(Error::numerical(format!(
            "step \"{}\": a traction or a gap is not a finite number",
            stage.name
        )));
    }
    reject_underflowing_pressure(problem, it, stage.name)?;
    Ok(report)
}

/// Smallest allowed peak pressure. Below this value, squares of pressures underflow, and the friction law fails.
const MIN_PEAK_PRESSURE_MPA: f64 = 1e-140;

fn reject_underflowing_pressure(problem: &Increment, it: &ContactState, step: &str) -> Result<()> {
    let n = problem.n();
    let pressures = it.tractions.chunks_exact(3 * n).flat_map(|planes| &planes[2 * n..]);
    let largest = pressures.fold(0.0_f64, |largest, p| largest.max(*p));
    if largest > 0.0 && largest < MIN_PEAK_PRESSURE_MPA {
        return Err(Error::input(format!(
            "step \"{step}\": the largest pressure is {largest:e}, and its square underflows to 0 (smallest allowed pressure: {MIN_PEAK_PRESSURE_MPA:e}): choose units in which the numbers of the scene have usual magnitudes, or increase the load"
        )));
    }
    Ok(())
}

/// Solves the increment and checks the result. The bodies may overlap in cells whose flexibility has not been formed.
/// In this case, forms the flexibility of these and nearby cells and solves again.
pub(super) fn solve_and_check(
    prepared: &PreparedModel,
    problem: &mut Increment,
    it: &mut ContactState,
    options: &SolverOptions,
    observer: &mut dyn Observer,
    stage: &ProgressSpan,
) -> Result<(SolveReport, StateChecks)> {
    let mut spent = [0; 2];
    let mut cells = problem.closed_by_motion(it);
    loop {
        if !cells.is_empty() {
            problem.scales = prepared.form_flexibility(&cells)?;
        }
        let max_iterations = options.max_iterations.saturating_sub(spent[0]);
        let options = SolverOptions { max_iterations, ..*options };
        let mut report = solve(problem, it, &options, observer, stage)?;
        spent = [spent[0] + report.iterations, spent[1] + report.applications];
        [report.iterations, report.applications] = spent;
        let looked_at = prepared.ellipse.is_some() || observer.wants_tangential_gap();
        let looked_at = looked_at || !options.skip.allows(OmittableWork::TangentialGap);
        let gap = if looked_at { TangentialGap::Complete } else { TangentialGap::Skip };
        // Checks the operator only in the increment that completes the step, because all increments of a step have
        // the same operator.
        let sums = if stage.to == 1.0 { OperatorCheck::SampleCells } else { OperatorCheck::Skip };
        let checks = certificate::check(problem, it, gap, sums);
        let overlapping = problem.complete_unformed_cells(it)?;
        // Without contact, nothing supports an unconstrained body, so its position would be arbitrary.
        if report.stop == StopReason::Converged && prepared.normal_is_free() && !it.has_contact() {
            report.stop = StopReason::ContactLost;
        }
        if overlapping.is_empty() || report.stop == StopReason::Interrupted {
            return Ok((report, checks));
        }
        // Also forms the flexibility of all cells whose initial gap is at most the largest initial gap of the
        // overlapping cells.
        let normal = &problem.initial_gap[2 * problem.n()..];
        let reach = overlapping.iter().map(|&cell| normal[cell]).fold(0.0, f64::max);
        cells = problem.flexibility.unformed_cells();
        cells.retain(|&cell| normal[cell] <= reach);
    }
}
