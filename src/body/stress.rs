//! Stress in the volume of a meshed body, what it means for its materials, and how far it may be trusted.

use std::collections::BTreeMap;
use std::sync::Arc;

use crate::fem::{ErrorEstimate, ExposureField, FeModel, RecoveryPoints, SurfaceStressPoint, exposures};
use crate::material::strength::MaterialStrength;

/// Whether the error of the stress is estimated too.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ErrorEstimation {
    /// It is.
    Estimate,
    /// It is not.
    Skip,
}

/// Stress in the volume of a body.
#[derive(Debug, Clone)]
pub struct StressField {
    /// Where: nodes of the mesh, doubled where materials meet.
    pub points: Arc<RecoveryPoints>,
    /// Recovered stress in Voigt order 11 22 33 23 13 12, global axes, MPa, `[n_points]`.
    pub stress: Vec<[f64; 6]>,
    /// Exposure of the materials whose limits are known, by criterion.
    pub exposures: Vec<ExposureField>,
    /// The strain in the contact surface, which with the tractions gives the stress there.
    pub contact: Vec<SurfaceStressPoint>,
    /// Estimated error of the elements' own stress, where it was asked for.
    pub error: Option<ErrorEstimate>,
}

impl StressField {
    /// The stress of a model at `points`, its error if that was estimated, judged by the limits of the materials, by their names.
    pub(super) fn new(
        (model, points): (&FeModel, &Arc<RecoveryPoints>),
        (stress, error): (Vec<[f64; 6]>, Option<ErrorEstimate>),
        contact: Vec<SurfaceStressPoint>,
        limits: &BTreeMap<String, MaterialStrength>,
    ) -> Self {
        let limit = |cell: usize| {
            let regions = model.regions();
            Some((limits.get(&regions.material(cell).name)?, *regions.axes(cell)))
        };
        let exposures = exposures(points, &stress, limit);
        Self { points: points.clone(), stress, exposures, contact, error }
    }
}
