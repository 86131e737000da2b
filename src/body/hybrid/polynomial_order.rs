//! Correction whose number of polynomial nodes on the patch adapts to the solution.

use super::chebyshev::Chebyshev;
use super::correction::Correction;
use super::field::HalfSpaceField;
use super::forces::PatchForces;
use super::half_space_fit::HalfSpaceFit;
use super::indicators::{Indicators, PatchCorrection, TARGET_TAIL};
use crate::bem::half_space::{PointForceField, SurfaceGreen};
use crate::error::Result;
use crate::fem::{AppliedLoads, ColumnSolver, CondensationResources, ErrorEstimate, FeModel, StressRecovery};
use crate::geometry::Side;
use crate::linalg::memory::MemoryLimit;
use crate::material::Stiffness;

const MAX_NODES_PER_SIDE: usize = 10;

/// Half-space that represents the body under the patch, in the axes of the patch.
pub(super) struct PatchHalfSpace<'a> {
    pub fit: &'a HalfSpaceFit,
    pub stiffness: Stiffness,
    pub field: HalfSpaceField,
    pub green: SurfaceGreen,
}

impl<'a> PatchHalfSpace<'a> {
    /// Creates the half-space of a fit. Also returns a warning about the cache of the point-force field, if any.
    pub fn new(fit: &'a HalfSpaceFit, resources: &CondensationResources) -> Result<(Self, Option<String>)> {
        let stiffness = fit.stiffness.rotated(&fit.patch.axes.0.transpose());
        let (points, note) = PointForceField::load_or_compute(&stiffness, resources.cache)?;
        let green = SurfaceGreen::new(&stiffness, Side::Lower)?;
        let field = HalfSpaceField::new(&stiffness, points, &green)?;
        Ok((Self { fit, stiffness, field, green }, note))
    }

    /// Unit forces at `m` = [m_x, m_y] nodes of the patch. The index runs first along y.
    pub fn forces(&self, m: [usize; 2]) -> PatchForces<'_> {
        let patch = self.fit.patch;
        let [x, y] = [0, 1].map(|axis| Chebyshev::new(m[axis], patch.half_width[axis]));
        let points = x.nodes().iter().flat_map(|&x| y.nodes().iter().map(move |&y| [x, y])).collect();
        PatchForces {
            patch,
            stiffness: &self.stiffness,
            field: &self.field.point_force,
            points,
            curved_faces: &self.fit.curved_faces,
        }
    }
}

/// Correction of the half-space `near` with the responses to `loads`, and its quality indicators. Nodes are added while
/// the polynomials of highest degree are significant and memory suffices, up to [`MAX_NODES_PER_SIDE`].
pub(super) fn adaptive_correction(
    model: &FeModel,
    recovery: &StressRecovery,
    near: &PatchHalfSpace,
    memory: &MemoryLimit,
    loads: &[AppliedLoads],
) -> Result<(Correction, Indicators)> {
    let solver = ColumnSolver::new(model, memory)?;
    let mut m = near.fit.first_nodes();
    let bytes = |m: [usize; 2]| Correction::bytes(model, 3 * m[0] * m[1]) as u128;
    loop {
        let (what, mend) = ("the far field of the half-space", "use a coarser mesh");
        memory.ensure_available(bytes(m), what, mend)?;
        let forces = near.forces(m);
        let correction = Correction::new(model, &solver, &forces, loads)?;
        let judged = PatchCorrection {
            matrix: &correction.matrix,
            direct: &correction.at_mesh_nodes(model, &forces)?,
            imbalance: correction.imbalance,
            asymmetry: correction.asymmetry,
            squared_error: &|uniform: &[f64]| squared_stress_error(model, recovery, &correction, uniform),
        };
        let error = near.field.point_force.error();
        let indicators = Indicators::new(judged, near.fit, m, &near.green, error)?;
        let needs_more = indicators.tail > TARGET_TAIL && m.iter().all(|&m| m < MAX_NODES_PER_SIDE);
        let more = m.map(|m| (m + 2).min(MAX_NODES_PER_SIDE));
        if !needs_more || !memory.allows(bytes(more)) {
            return Ok((correction, indicators));
        }
        m = more;
    }
}

/// Estimated errors of the displacement on the patch due to the body's own loads.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize)]
pub struct AppliedLoadError {
    /// Largest error of a component of the mean displacement, mm.
    pub mean: f64,
    /// Largest error of the normal displacement in the form of a tilt or a curvature over the patch, mm. A rigid
    /// displacement of body 2 along the normal does not remove this error.
    pub shape: f64,
}

impl AppliedLoadError {
    /// Sum of the errors of two loads.
    pub(super) fn plus(self, other: Self) -> Self {
        Self { mean: self.mean + other.mean, shape: self.shape + other.shape }
    }
}

/// Estimates the error of the patch displacement due to the body's own loads. The estimate is a product of two
/// energy-norm errors. One is the error of the field due to the own loads (`by_own`). The second is the error of the
/// field due to forces on the patch. The relative stress error of the first field times the support work `remainder` is
/// added.
pub(super) fn applied_load_error(
    model: &FeModel,
    recovery: &StressRecovery,
    forces: &PatchForces,
    correction: &Correction,
    by_own: &ErrorEstimate,
    remainder: &[f64],
) -> Result<AppliedLoadError> {
    let n = forces.points.len();
    let error = |component: usize, weight: &dyn Fn(&[f64; 2]) -> f64| -> Result<f64> {
        let mut all = vec![0.0; 3 * n];
        let sum: f64 = forces.points.iter().map(|point| weight(point).abs()).sum();
        let mut rest = 0.0;
        for (i, point) in forces.points.iter().enumerate() {
            all[3 * i + component] = weight(point) / sum;
            rest += remainder[3 * i + component] * weight(point) / sum;
        }
        let by_forces = squared_stress_error(model, recovery, correction, &all)?.sqrt();
        Ok(by_own.error_norm() * by_forces + by_own.relative_error() * rest.abs())
    };
    let mut found = AppliedLoadError { mean: 0.0, shape: 0.0 };
    for component in 0..3 {
        found.mean = found.mean.max(error(component, &|_| 1.0)?);
    }
    for axis in 0..2 {
        let square = forces.points.iter().map(|point| point[axis] * point[axis]).sum::<f64>() / n as f64;
        found.shape = found.shape.max(error(2, &|point| point[axis])?);
        found.shape = found.shape.max(error(2, &|point| point[axis] * point[axis] - square)?);
    }
    Ok(found)
}

fn squared_stress_error(
    model: &FeModel,
    recovery: &StressRecovery,
    correction: &Correction,
    forces: &[f64],
) -> Result<f64> {
    let mut displacement = vec![[0.0; 3]; model.mesh().n_points()];
    correction.superpose_fields(forces, &mut displacement);
    let stress = recovery.stress(model, &displacement)?;
    Ok(recovery.estimate_error(model, &displacement, &stress)?.error_norm().powi(2))
}
