//! What the contact stage leaves out.

use super::model::Model;
use super::step::{CycleMotion, Drive, Spin, Step, Tangential, Tilt};
use crate::contact::solver::{Axes, is_along, is_even, on_halves, on_windows};
use crate::contact::{Method, SolverOptions};
use crate::friction::FrictionLaw;
use crate::skip::{Skip, Skipped, Work};
use crate::wear::WearLaw;

/// What the operator allows to leave out.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct OperatorSkips {
    /// Whether it is that of a grid.
    pub grid: bool,
    /// Whether steps are solved on windows of the frame.
    pub windows: bool,
    /// Whether pressures and tractions in the surface are found one after the other.
    pub apart: bool,
    /// Whether operator and gap are their own mirror images along x and y, and halves are solved of what is.
    pub mirrors: [bool; 2],
}

impl OperatorSkips {
    pub(super) fn of(model: &Model, options: &SolverOptions) -> Self {
        let operator = model.flexibility.as_ref();
        let normal = &model.initial_gap[2 * operator.n_cells()..];
        let grid = operator.grid().filter(|_| on_halves(operator.grid(), options));
        let mirrors =
            |across| operator.mirrors(across) && grid.is_some_and(|grid| is_even(normal, grid, across));
        let apart = operator.tangential().is_some() && options.skip.has(Skip::NormalComponents);
        Self {
            grid: operator.grid().is_some(),
            windows: on_windows(operator.grid(), options),
            apart: options.method == Method::Auto && apart,
            mirrors: [0, 1].map(mirrors),
        }
    }
}

/// The skips of the contact stage that apply to these steps.
pub fn skipped_by_contact(
    friction: &FrictionLaw,
    wear: &WearLaw,
    steps: &[Step],
    (options, operator): (&SolverOptions, OperatorSkips),
) -> Vec<Skipped> {
    let mut skipped = Vec::new();
    let frictionless = friction.ellipse().is_none();
    let wearless = wear.intensity(friction.ellipse()).is_none();
    let mut bare: Vec<&str> = steps
        .iter()
        .filter(|step| (frictionless || !step.friction) && (wearless || !step.wear))
        .map(|step| step.name.as_str())
        .collect();
    // The load points of a history are steps of one name.
    bare.dedup();
    if !bare.is_empty() && options.skip.has(Skip::TangentialUnknowns) {
        skipped.push(Skipped::new(
            Skip::TangentialUnknowns,
            format!("tangential unknowns in step {}", bare.join(", ")),
            "without friction and wear only pressures are unknown",
        ));
    }
    let turned = steps
        .iter()
        .any(|step| matches!(step.tilt, Some(Tilt::Moment(_))) || matches!(step.spin, Some(Spin::Moment(_))));
    let rubs = |step: &Step| step.friction && (wearless || !step.wear) && step.cycles.is_none();
    if operator.apart && !frictionless && !turned && steps.iter().any(rubs) {
        skipped.push(Skipped::new(
            Skip::NormalComponents,
            "normal components in products for tractions in the surface",
            "neither moves the gap of the other: pressures are found first, by themselves",
        ));
    }
    let slides = operator.grid && options.method == Method::Auto && options.skip.has(Skip::SlidingFriction);
    if slides && !frictionless && steps.iter().any(|step| step.friction && strokes(step)) {
        skipped.push(Skipped::new(
            Skip::SlidingFriction,
            "unknown friction of cycles in which all of the contact slips",
            "it is the limit, against the slip: only pressures are unknown",
        ));
    }
    if operator.windows {
        skipped.push(Skipped::new(
            Skip::DistantCells,
            "cells away from the contact in products with the flexibility",
            "iterations run on coarser cells and on a window about the contact; each state is judged on the whole frame",
        ));
    }
    skipped.extend(halved(friction, wear, steps, operator.mirrors));
    let follows = steps.len() > 1 || steps.iter().any(|step| step.increments > 1 || step.cycles.is_some());
    if follows && options.skip.has(Skip::ColdStarts) {
        skipped.push(Skipped::new(
            Skip::ColdStarts,
            "cold starts",
            "each increment starts from the tractions of the one before",
        ));
    }
    let in_jumps: Vec<&str> =
        steps.iter().filter(|step| jumps(step)).map(|step| step.name.as_str()).collect();
    if !in_jumps.is_empty() {
        skipped.push(Skipped::new(
            Work::Cycles,
            format!("cycles one by one in step {}", in_jumps.join(", ")),
            "wear changes slowly: it is integrated over jumps of many cycles (steps.cycles.jumps, wear.tolerance)",
        ));
    }
    skipped
}

/// Halves of the cells, in the steps before the first that is not its own mirror image.
fn halved(friction: &FrictionLaw, wear: &WearLaw, steps: &[Step], mirrors: [bool; 2]) -> Option<Skipped> {
    let ellipse = friction.ellipse();
    let laws = [ellipse.map(Axes::from), wear.intensity(ellipse).map(Axes::from)];
    if !laws.iter().flatten().all(Axes::mirror) {
        return None;
    }
    let first = |across: usize| steps.iter().take_while(|step| mirrors_itself(step, across)).count();
    let counts = [1, 0].into_iter().filter(|&across| mirrors[across]).map(|across| (first(across), across));
    let (count, across) = counts.reduce(|most, next| if next.0 > most.0 { next } else { most })?;
    let mut names: Vec<&str> = steps[..count].iter().map(|step| step.name.as_str()).collect();
    names.dedup();
    (count > 0).then(|| {
        Skipped::new(
            Skip::MirrorHalf,
            format!("half of the cells in the iterations of step {}", names.join(", ")),
            format!(
                "bodies, gap and loads are their own mirror images along {}; each state is judged on the whole frame",
                ["x", "y"][across]
            ),
        )
    })
}

/// Whether what a step prescribes is its own mirror image along axis `across`.
fn mirrors_itself(step: &Step, across: usize) -> bool {
    let along = |vector: [f64; 2]| is_along(vector, across);
    let shifted = match step.tangential {
        Some(Tangential::Shift(vector) | Tangential::Force(vector)) => along(vector),
        None => true,
    };
    let turned = match step.tilt {
        Some(Tilt::Rotation(about)) => about[1 - across] != 0.0,
        Some(Tilt::Moment(_)) => true,
        None => false,
    };
    let spun = step.spin.is_some_and(|spin| spin != Spin::Twist(0.0));
    let cycled = step.cycles.as_ref().is_none_or(|cycles| match &cycles.motion {
        CycleMotion::Closed(closed) => {
            let (sin, cos) = closed.angle.sin_cos();
            closed.amplitude[1] == 0.0 && along([cos, sin])
        }
        CycleMotion::Sliding { angle } => along([angle.cos(), angle.sin()]),
    });
    let rolled = step.rolling.is_none_or(|rolling| {
        let straight = rolling.creepage[1] == 0.0 && rolling.spin == 0.0;
        straight && usize::from(rolling.quarter_turns % 2) != across
    });
    shifted && !turned && !spun && cycled && rolled
}

/// Whether fewer cycles are solved than there are.
fn jumps(step: &Step) -> bool {
    step.cycles.as_ref().is_some_and(|cycles| {
        let closed = matches!(cycles.motion, CycleMotion::Closed(_));
        closed && cycles.usual_solves(step.wear) as f64 <= 0.5 * cycles.count
    })
}

/// Whether body 2 is moved along the surface in cycles.
fn strokes(step: &Step) -> bool {
    step.cycles.as_ref().is_some_and(|cycles| match &cycles.motion {
        CycleMotion::Closed(closed) => closed.drive == Drive::Shift,
        CycleMotion::Sliding { .. } => true,
    })
}
