//! Coupling of two bodies on one contact frame: the gap is g = g_0 + Σ_k a_k g_k + S P + w n.
//!
//! g_0 is the initial gap. g_k is the change of the gap due to load k of a body at amplitude a_k = 1. S (mm/MPa) is the
//! flexibility of both bodies, P (MPa) the traction on body 2, w (mm) the wear depth, n the normal. [`couple`] computes
//! S and g_k. [`surface_distance`] computes the distance of the undeformed surfaces. [`BlockSystem`] is the reference
//! implementation of S and g_k.

pub mod block;
mod block_rows;
pub mod distance;

use std::sync::Arc;

use nalgebra::Vector3;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::bem::half_space::{CrossBlocks, SurfaceGreen};
use crate::body::BodyEquations::{FiniteElements, Hybrid};
use crate::body::half_space::half_space_flexibility;
use crate::body::hybrid::FarField;
use crate::body::hybrid::corrected_flexibility::build_corrected_flexibility;
use crate::body::{BodyLoad, ElasticBody, LoadCase, UnconstrainedModes};
use crate::error::{Error, Result};
use crate::flexibility::Flexibility;
use crate::flexibility::composed::SumFlexibility;
use crate::flexibility::constrained::ConstrainedFlexibility;
use crate::frame::{ContactFrame, GapShape, InitialGap, MeshedSurface, Side};
use crate::omitted::{OmittableWork, OmittedWork};

pub use block::BlockSystem;
pub use distance::{MIN_STEEP_COSINE, MeshedGap, as_meshed_distance, mesh_distance};

/// Coupling of finite-element bodies to the contact frame.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Coupling {
    /// Finite-element bodies condensed to the frame once (Schur complement).
    #[default]
    Schur,
    /// Assembled block system of bodies and frame, solved again for every traction. Slow; for comparison.
    Block,
}

/// Flexibility and loads of two bodies on a frame.
pub struct CoupledBodies {
    /// Flexibility S: change of the gap (mm) per traction (MPa) on body 2.
    pub flexibility: Arc<dyn Flexibility>,
    /// Loads of body 1, then of body 2.
    pub loads: Vec<BodyLoad>,
    /// Unconstrained rigid-body modes of the bodies.
    pub floating: Vec<UnconstrainedModes>,
    /// Omitted work, with the reasons.
    pub skipped: Vec<OmittedWork>,
}

impl CoupledBodies {
    /// Gap at zero tractions, zero rigid motion and zero amplitudes of the loads, `[3, N]`, mm. `normal` is the
    /// distance of the undeformed surfaces, `[N]`, mm.
    pub fn initial_gap(&self, normal: &[f64]) -> Vec<f64> {
        let n = self.flexibility.n_cells();
        let mut gap = vec![0.0; 3 * n];
        gap[2 * n..].copy_from_slice(normal);
        gap
    }
}

/// Options of the half-space operators.
#[derive(Clone, Copy)]
pub struct HalfSpaceOperators {
    /// Treatment of vanishing blocks between normal and tangential components.
    pub cross: CrossBlocks,
    /// Whether two half-spaces share one operator, computed from the sum of their Green's functions.
    pub summed: bool,
}

impl From<CrossBlocks> for HalfSpaceOperators {
    fn from(cross: CrossBlocks) -> Self {
        Self { cross, summed: cross == CrossBlocks::SkipVanishing }
    }
}

/// Computes flexibility, loads and unconstrained rigid-body modes of two bodies on `frame`.
///
/// # Errors
/// If both bodies are rigid, or an operator cannot be built. With [`Coupling::Block`], also if a body is unconstrained or not
/// supported.
pub fn couple(
    body1: &mut dyn ElasticBody,
    body2: &mut dyn ElasticBody,
    frame: &ContactFrame,
    coupling: Coupling,
    half_spaces: impl Into<HalfSpaceOperators>,
) -> Result<CoupledBodies> {
    let coupled = match coupling {
        Coupling::Schur => sum_of_bodies(body1, body2, frame, half_spaces.into()),
        Coupling::Block => block_of_bodies(body1, body2, frame),
    }?;
    Ok(constrained(coupled, frame))
}

/// Removes the components across planes of symmetry from flexibility, loads and rigid-body modes. Only cells on these
/// planes change.
fn constrained(coupled: CoupledBodies, frame: &ContactFrame) -> CoupledBodies {
    let projectors = frame.symmetry_projectors();
    if projectors.is_empty() {
        return coupled;
    }
    let n = frame.n_cells();
    let project = |gap: &mut [f64]| {
        for (cell, projector) in &projectors {
            let local = projector * Vector3::new(gap[*cell], gap[n + cell], gap[2 * n + cell]);
            (0..3).for_each(|plane| gap[plane * n + cell] = local[plane]);
        }
    };
    let CoupledBodies { flexibility, mut loads, mut floating, skipped } = coupled;
    loads.iter_mut().for_each(|load| project(&mut load.gap));
    floating.iter_mut().flat_map(|body| &mut body.modes).for_each(|motion| project(&mut motion.gap));
    let flexibility = Arc::new(ConstrainedFlexibility::new(flexibility, &projectors));
    CoupledBodies { flexibility, loads, floating, skipped }
}

fn both_rigid() -> Error {
    Error::input(
        "both bodies are rigid: their contact has no unique tractions; give at least one body the kind \
         \"fe\", \"be\" or \"half-space\"",
    )
}

fn block_of_bodies(
    body1: &dyn ElasticBody,
    body2: &dyn ElasticBody,
    frame: &ContactFrame,
) -> Result<CoupledBodies> {
    if let Some(floating) = body1.rigid_body_modes().or(body2.rigid_body_modes()) {
        return Err(Error::input(format!(
            "{} has unconstrained rigid-body modes ({}), but the block system needs fixed bodies: use solver.coupling = \"schur\"",
            floating.side.name(),
            floating.names.join(", ")
        )));
    }
    let system = BlockSystem::new(body1, body2, frame)?;
    let mut loads = Vec::new();
    for (side, body) in [(Side::Lower, body1), (Side::Upper, body2)] {
        let meshed = matches!(body.equations(), FiniteElements(_));
        loads.extend(body.loads().iter().enumerate().map(|(k, load)| match meshed {
            true => BodyLoad { gap: system.load_gap(side, k), ..load.clone() },
            false => load.clone(),
        }));
    }
    Ok(CoupledBodies { flexibility: Arc::new(system), loads, floating: Vec::new(), skipped: Vec::new() })
}

fn sum_of_bodies(
    body1: &mut dyn ElasticBody,
    body2: &mut dyn ElasticBody,
    frame: &ContactFrame,
    operators: HalfSpaceOperators,
) -> Result<CoupledBodies> {
    let half_spaces = [&*body1, &*body2].map(|body| body.near_field_green().is_some());
    let summed = operators.summed && half_spaces == [true; 2];
    let (flexibility, rigid) = sum_of_flexibilities(body1, body2, frame, operators)?;
    let skipped = omitted_work(rigid, summed, flexibility.couples_normal_tangential());
    let floating =
        [body1.rigid_body_modes(), body2.rigid_body_modes()].into_iter().flatten().cloned().collect();
    let loads = loads_of([&*body1, &*body2]);
    Ok(CoupledBodies { flexibility, loads, floating, skipped })
}

fn loads_of(bodies: [&dyn ElasticBody; 2]) -> Vec<BodyLoad> {
    bodies.iter().flat_map(|body| body.loads()).cloned().collect()
}

/// Flexibility S = S_1 + S_2 of the two bodies. Also returns whether each body is rigid.
fn sum_of_flexibilities(
    body1: &mut dyn ElasticBody,
    body2: &mut dyn ElasticBody,
    frame: &ContactFrame,
    HalfSpaceOperators { cross, summed }: HalfSpaceOperators,
) -> Result<(Arc<dyn Flexibility>, [bool; 2])> {
    if summed && let (Some(lower), Some(upper)) = (body1.near_field_green(), body2.near_field_green()) {
        let green = SurfaceGreen::sum(&[lower, upper]);
        return Ok((with_far_fields(&green, [body1, body2], frame, cross)?, [false; 2]));
    }
    let own = [body1.take_flexibility(cross)?, body2.take_flexibility(cross)?];
    let rigid = [own[0].is_none(), own[1].is_none()];
    let mut parts: Vec<_> = own.into_iter().flatten().collect();
    let flexibility = match parts.len() {
        0 => return Err(both_rigid()),
        1 => parts.remove(0),
        _ => Arc::new(SumFlexibility::new(parts)),
    };
    Ok((flexibility, rigid))
}

fn with_far_fields(
    green: &SurfaceGreen,
    bodies: [&mut dyn ElasticBody; 2],
    frame: &ContactFrame,
    cross: CrossBlocks,
) -> Result<Arc<dyn Flexibility>> {
    let far_field = |body: &&mut dyn ElasticBody| match body.equations() {
        Hybrid(body) => Some(body.far_field().clone()),
        _ => None,
    };
    let far: Vec<FarField> = bodies.iter().filter_map(far_field).collect();
    match frame.grid {
        Some(grid) if !far.is_empty() => {
            build_corrected_flexibility(green, far, &grid, frame.grid_indices.as_deref(), cross)
        }
        _ => half_space_flexibility(green, frame, cross),
    }
}

/// Work that is omitted when the flexibilities of two bodies are summed.
///
/// `rigid` states whether each body is rigid. `summed` states whether one operator contains the sum of the Green's
/// functions. `couples` states whether the summed flexibility couples normal and tangential components.
pub fn omitted_work(rigid: [bool; 2], summed: bool, couples: bool) -> Vec<OmittedWork> {
    let mut skipped = Vec::new();
    if summed {
        skipped.push(OmittedWork::new(
            OmittableWork::SecondHalfSpace,
            "second half-space operator",
            "the Green's functions of both half-spaces are summed into one operator",
        ));
    }
    for (name, _) in ["body 1", "body 2"].into_iter().zip(rigid).filter(|(_, rigid)| *rigid) {
        skipped.push(OmittedWork::new(None, format!("flexibility of {name}"), "it is rigid"));
    }
    if !couples {
        skipped.push(OmittedWork::new(
            OmittableWork::VanishingBlocks,
            "products between normal and tangential components",
            "they vanish for these two materials",
        ));
    }
    skipped
}

/// Gap of the shape "mesh", computed by [`as_meshed_distance`] or [`mesh_distance`].
///
/// # Errors
/// If the distance cannot be computed or is not admissible.
pub fn meshed_gap(
    gap: &InitialGap,
    frame: &ContactFrame,
    surfaces: [Option<&MeshedSurface>; 2],
) -> Result<MeshedGap> {
    if gap.as_meshed { as_meshed_distance(frame, surfaces) } else { mesh_distance(frame, surfaces) }
}

/// Splits the `distance` of bodies as meshed, `[N]`, mm, into a clearance and an interference. Returns the clearance of
/// the cells that do not overlap, and the interference of the overlapping cells as a load.
///
/// At the amplitude a of this load, the gap of each cell is max(distance, 0) + a min(distance, 0).
pub fn clearance_and_interference(distance: &[f64]) -> (Vec<f64>, BodyLoad) {
    let n = distance.len();
    let mut gap = vec![0.0; 3 * n];
    gap[2 * n..].iter_mut().zip(distance).for_each(|(gap, distance)| *gap = distance.min(0.0));
    let clearance = distance.iter().map(|distance| distance.max(0.0)).collect();
    (clearance, BodyLoad { side: None, case: LoadCase::interference(), gap })
}

/// Normal gap of the undeformed surfaces at each cell, `[N]`, mm. For the shape "mesh" see [`meshed_gap`].
///
/// # Errors
/// If the shape is not admissible. If it is "mesh", and neither body has a mesh or [`meshed_gap`] fails.
pub fn surface_distance(
    gap: &InitialGap,
    frame: &ContactFrame,
    body1: &dyn ElasticBody,
    body2: &dyn ElasticBody,
) -> Result<Vec<f64>> {
    let surfaces = [body1.surface(), body2.surface()];
    if gap.shape != GapShape::Mesh || surfaces.iter().all(Option::is_none) {
        return gap.evaluate(frame);
    }
    Ok(meshed_gap(gap, frame, surfaces)?.distance)
}
