//! Omitted work of contact solutions: work that the results do not need.

use crate::contact::solver::solves_windows;
use crate::contact::{Method, SolverOptions};
use crate::evolution::model::Model;
use crate::evolution::step::{Spin, Step, StepKind, Tilt};
use crate::laws::friction::FrictionLaw;
use crate::laws::wear::WearLaw;
use crate::omitted::{OmittableWork, OmittedWork};

/// Properties of the operator that allow the solver to omit work.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct OperatorOmissions {
    /// Whether the operator acts on a regular grid of cells.
    pub grid: bool,
    /// Whether the solver works on windows of the frame.
    pub windows: bool,
    /// Whether pressures are solved before tangential tractions. This requires that neither changes the gap of the
    /// other.
    pub uncoupled: bool,
}

impl OperatorOmissions {
    pub(super) fn of(model: &Model, options: &SolverOptions) -> Self {
        let operator = model.flexibility.as_ref();
        let apart = operator.tangential().is_some() && options.skip.allows(OmittableWork::NormalComponents);
        Self {
            grid: operator.grid().is_some(),
            windows: solves_windows(operator.grid(), options),
            uncoupled: options.method == Method::Auto && apart,
        }
    }
}

/// Lists the omitted work of the contact solutions in `steps`.
pub fn omitted_contact_work(
    friction: &FrictionLaw,
    wear: &WearLaw,
    steps: &[Step],
    options: &SolverOptions,
    operator: OperatorOmissions,
) -> Vec<OmittedWork> {
    let mut skipped = Vec::new();
    let frictionless = friction.ellipse().is_none();
    let wears =
        |step: &Step| step.wear && wear.specific_rate(friction.ellipse().filter(|_| step.friction)).is_some();
    let mut bare: Vec<&str> = steps
        .iter()
        .filter(|step| (frictionless || !step.friction) && !wears(step))
        .map(|step| step.name.as_str())
        .collect();
    // A load history has one step per load point. All these steps have the same name.
    bare.dedup();
    if !bare.is_empty() && options.skip.allows(OmittableWork::TangentialUnknowns) {
        skipped.push(OmittedWork::new(
            OmittableWork::TangentialUnknowns,
            format!("tangential unknowns in step {}", quoted_names(&bare)),
            "without friction and wear only pressures are unknown",
        ));
    }
    let turned = steps
        .iter()
        .any(|step| matches!(step.tilt, Some(Tilt::Moment(_))) || matches!(step.spin, Some(Spin::Moment(_))));
    let rubs = |step: &Step| step.friction && !wears(step) && step.kind.cycles().is_none();
    if operator.uncoupled && !frictionless && !turned && steps.iter().any(rubs) {
        skipped.push(OmittedWork::new(
            OmittableWork::NormalComponents,
            "normal components in products for tangential tractions",
            "pressures do not change the tangential gap, nor tangential tractions the normal gap: pressures are solved first, on their own",
        ));
    }
    if operator.windows {
        skipped.push(OmittedWork::new(
            OmittableWork::DistantCells,
            "cells away from the contact in products with the flexibility",
            "iterations use coarser cells and a window around the contact; each result is checked on the whole frame",
        ));
    }
    let follows =
        steps.len() > 1 || steps.iter().any(|step| step.increments > 1 || step.kind.cycles().is_some());
    if follows && options.skip.allows(OmittableWork::ColdStarts) {
        skipped.push(OmittedWork::new(
            OmittableWork::ColdStarts,
            "cold starts",
            "each increment starts from the tractions of the previous one",
        ));
    }
    let in_jumps: Vec<&str> =
        steps.iter().filter(|step| jumps(step)).map(|step| step.name.as_str()).collect();
    if !in_jumps.is_empty() {
        skipped.push(OmittedWork::new(
            None,
            format!("solutions of single cycles in step {}", quoted_names(&in_jumps)),
            "wear changes slowly: it is integrated over jumps of many cycles (steps.cycles.jumps, wear.tolerance)",
        ));
    }
    skipped
}

/// Returns whether the expected number of contact solutions of a fretting step is at most half its number of cycles.
fn jumps(step: &Step) -> bool {
    matches!(&step.kind, StepKind::Fretting { cycles, .. }
        if cycles.expected_solves(step.wear) as f64 <= 0.5 * cycles.count)
}

pub(super) fn quoted_names(names: &[&str]) -> String {
    names.iter().map(|name| format!("\"{name}\"")).collect::<Vec<_>>().join(", ")
}
