//! Stress of a meshed body, the exposure of its materials, and its estimated error.

use std::collections::BTreeMap;
use std::sync::Arc;

use crate::fem::{ErrorEstimate, ExposureField, FeModel, RecoveryPoints, SurfaceStressPoint, exposures};
use crate::material::strength::MaterialStrength;

/// Whether to estimate the error of the stress.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ErrorEstimation {
    /// Estimate the error.
    Estimate,
    /// Skip the estimate.
    Skip,
}

/// Stress of a body, in the volume or, for boundary elements, on the surface.
#[derive(Debug, Clone)]
pub struct StressField {
    /// Nodes of the mesh, doubled where materials meet or, for boundary elements, where smooth parts of the surface meet.
    pub points: Arc<RecoveryPoints>,
    /// Recovered stress in Voigt order 11 22 33 23 13 12, global axes, MPa, `[n_points]`.
    pub stress: Vec<[f64; 6]>,
    /// Exposure of the materials with known strengths, by criterion.
    pub exposures: Vec<ExposureField>,
    /// Strain in the contact surface. The stress of this surface follows from the strain and the contact tractions.
    pub contact: Vec<SurfaceStressPoint>,
    /// Estimated error of the element stress before recovery, if requested; `None` for boundary elements.
    pub error: Option<ErrorEstimate>,
}

impl StressField {
    /// Combines the stress at `points` with its estimated error and the exposures for `limits`, the strengths by material name.
    pub(super) fn new(
        model: &FeModel,
        points: &Arc<RecoveryPoints>,
        stress: Vec<[f64; 6]>,
        error: Option<ErrorEstimate>,
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
