//! The skips of a run, known before its operators are made.

use super::bodies::SIDES;
use super::bodies::half_space;
use super::candidates;
use super::failure::Failure;
use super::grow;
use super::memory::compresses;
use super::moving;
use super::near_field::Near;
use super::settings::{cross, options};
use crate::bem::half_space::compressed::DENSE;
use crate::bem::half_space::{CrossBlocks, SurfaceGreen};
use crate::body::BodyEquations::HalfSpace;
use crate::body::{ElasticBody, Estimate};
use crate::contact::Method;
use crate::contact::solver::{is_even, on_halves, on_windows};
use crate::coupling;
use crate::frame::ContactFrame;
use crate::history::ledger::{OperatorSkips, skipped_by_contact};
use crate::results::fields::FieldKind;
use crate::scene::keys::solver::Coupling;
use crate::scene::plan::{BodySpec, Plan};
use crate::skip::{Basis, Saved, Skip, Skipped, Work};

/// The ledger that the run of `plan` on `frame` will have, in its order.
///
/// # Errors
/// If the frame is not plane under a half-space, or a surface Green's function does not converge.
pub(super) fn skips(plan: &Plan, frame: &ContactFrame, near: &[Near; 2]) -> Result<Vec<Skipped>, Failure> {
    let mut skipped = Vec::new();
    let half_space =
        |(body, near): (&BodySpec, &Near)| matches!(body, BodySpec::HalfSpace(_)) || near.site().is_some();
    let half_spaces = plan.bodies.iter().zip(near).all(half_space);
    let summed = plan.solver.skip.skips().has(Skip::SecondHalfSpace) && half_spaces;
    if plan.solver.coupling == Coupling::Schur {
        let rigid = [0, 1].map(|index| matches!(plan.bodies[index], BodySpec::Rigid));
        skipped = coupling::skips(rigid, summed, couples(plan, frame, summed)?);
    }
    let on_grid = on_grid(plan, frame, near);
    let grid = frame.whole_grid().filter(|_| on_grid).map(|grid| grid.cells);
    let options = options(plan);
    let apart = options.method == Method::Auto
        && grid.is_some()
        && options.skip.has(Skip::NormalComponents)
        && !couples(plan, frame, summed)?;
    let operator = OperatorSkips {
        grid: grid.is_some(),
        windows: on_windows(grid, &options),
        apart,
        mirrors: mirrors(plan, frame, (grid.filter(|_| on_halves(grid, &options)), near))?,
    };
    let of_contact = skipped_by_contact(&plan.friction, &plan.wear, &plan.steps, (&options, operator));
    let mut all = skipped;
    all.extend(candidates::skipped(frame));
    all.extend(compression(plan, frame));
    all.extend(skipped_fields(plan));
    all.extend(grow::skipped(plan));
    all.extend(moving::skipped(plan));
    all.extend(of_contact);
    Ok(all)
}

/// Whether the flexibility of both bodies is one operator on a grid: finite and boundary elements, periodic frames, sums of two operators and the
/// block path have none.
pub(super) fn on_grid(plan: &Plan, frame: &ContactFrame, near: &[Near; 2]) -> bool {
    let elastic = || plan.bodies.iter().zip(near).filter(|(body, _)| !matches!(body, BodySpec::Rigid));
    let one = elastic().count() == 1 || plan.solver.skip.skips().has(Skip::SecondHalfSpace);
    plan.solver.coupling == Coupling::Schur
        && frame.grid.is_some_and(|grid| grid.periodic == [false; 2])
        && elastic().all(|(body, near)| matches!(body, BodySpec::HalfSpace(_)) || near.site().is_some())
        && one
}

/// Matrices of half-spaces that are compressed.
pub(super) fn compression(plan: &Plan, frame: &ContactFrame) -> Option<Skipped> {
    let half_space = plan.bodies.iter().any(|body| matches!(body, BodySpec::HalfSpace(_)));
    let tolerance = plan.solver.compression_tolerance;
    (half_space && compresses(plan, frame)).then(|| {
        Skipped::new(
            Skip::DistantEntries,
            "entries of the half-space's operator between distant cells",
            format!(
                "on more than {DENSE} cells it is compressed to {tolerance:e} (solver.compression_tolerance)"
            ),
        )
    })
}

/// Fields that nobody asked for.
pub(super) fn skipped_fields(plan: &Plan) -> Vec<Skipped> {
    let mut skipped = skipped_stress(plan);
    let without_mesh = |body: &BodySpec| matches!(body, BodySpec::HalfSpace(_) | BodySpec::Be(_));
    if plan.inside.is_empty() && plan.bodies.iter().any(without_mesh) {
        skipped.push(Skipped::new(
            Work::Other,
            "displacement and stress inside half-spaces and bodies of boundary elements",
            "output.inside asks for no points",
        ));
    }
    let looked_at = !plan.output.fields.is_empty() || plan.friction.ellipse().is_some();
    if !looked_at && plan.solver.skip.skips().has(Skip::TangentialGap) {
        skipped.push(Skipped::new(
            Skip::TangentialGap,
            "tangential gap of steps without friction and wear",
            "output.fields is empty, and nothing slips against friction",
        ));
    }
    skipped
}

/// Stresses of meshed bodies that nobody asked for.
fn skipped_stress(plan: &Plan) -> Vec<Skipped> {
    let wanted = &plan.output.fields;
    let (what, why) = if !FieldKind::need_stress(wanted) {
        ("stress and its error estimate", "output.fields has none of \"volume\", \"stress\", \"error\"")
    } else if FieldKind::estimate(wanted) == Estimate::Skipped {
        ("error estimate of the stress", "output.fields has neither \"volume\" nor \"error\"")
    } else {
        return Vec::new();
    };
    let meshed = [0, 1].into_iter().filter(|&index| plan.bodies[index].fe().is_some());
    meshed.map(|index| Skipped::new(Work::Other, format!("{what} of body {}", index + 1), why)).collect()
}

/// Whether fields are written that need the factors of meshed bodies.
fn recovers(plan: &Plan) -> bool {
    plan.output.fields.iter().any(|kind| *kind != FieldKind::Svg)
}

/// Whether meshed bodies are solved with after they are condensed, though they have no loads.
pub(super) fn needs_solves(plan: &Plan, frame: &ContactFrame) -> bool {
    recovers(plan) || frame.candidates.is_some()
}

/// The entry of the ledger for a flexibility of body `index` that the cache has, with the factor where `solves` needs
/// it, and that took `seconds` to compute where that is known.
pub(super) fn cached(index: usize, seconds: Option<f64>, solves: bool) -> Skipped {
    let factor = if solves { " and the factor for fields or loads" } else { "" };
    let (what, why) =
        (format!("factorisation of body {}", index + 1), format!("the cache has the flexibility{factor}"));
    let saved = seconds.map(|seconds| Saved { seconds, basis: Basis::Measured });
    Skipped { saved, ..Skipped::new(Work::Other, what, why) }
}

/// Whether the flexibility of both bodies together multiplies normal with tangential components.
fn couples(plan: &Plan, frame: &ContactFrame, summed: bool) -> Result<bool, Failure> {
    let meshed =
        plan.bodies.iter().any(|body| body.meshed().is_some() || matches!(body, BodySpec::Truncated(_)));
    // Grid operators that keep vanishing blocks multiply them; dense ones know theirs.
    if meshed || (frame.grid.is_some() && cross(plan, frame) == CrossBlocks::Keep) {
        return Ok(true);
    }
    let greens = greens(plan, frame)?;
    let greens: Vec<&SurfaceGreen> = greens.iter().collect();
    Ok(if summed {
        SurfaceGreen::sum(&greens).couples_normal_tangential()
    } else {
        greens.iter().any(|green| green.couples_normal_tangential())
    })
}

/// Whether operator and gap are their own mirror images along x and y; `grid`: the cells, if halves are solved of such.
fn mirrors(
    plan: &Plan,
    frame: &ContactFrame,
    (grid, near): (Option<[usize; 2]>, &[Near; 2]),
) -> Result<[bool; 2], Failure> {
    let Some(grid) = grid.filter(|_| near.iter().all(|near| near.site().is_none())) else {
        return Ok([false; 2]);
    };
    let greens = greens(plan, frame)?;
    let green = SurfaceGreen::sum(&greens.iter().collect::<Vec<_>>());
    let between = |across: usize| grid[across].is_multiple_of(2) && green.mirrors(across);
    if ![0, 1].into_iter().any(between) {
        return Ok([false; 2]);
    }
    let gap = candidates::initial_gap(plan, frame, near)?;
    Ok([0, 1].map(|across| between(across) && is_even(&gap, grid, across)))
}

/// Those of the half-spaces.
fn greens(plan: &Plan, frame: &ContactFrame) -> Result<Vec<SurfaceGreen>, Failure> {
    let mut greens = Vec::new();
    for index in 0..SIDES.len() {
        if let BodySpec::HalfSpace(elastic) = &plan.bodies[index]
            && let HalfSpace(green) = half_space(elastic, index, frame)?.equations()
        {
            greens.push(green.clone());
        }
    }
    Ok(greens)
}
