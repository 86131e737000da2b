//! Stress of a meshed body, the exposure (failure index) of its materials, and the estimated error of the stress.

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
    /// Points of the stress values. A node of the mesh has one point per material or, for boundary elements, one per
    /// smooth part of the surface.
    pub points: Arc<RecoveryPoints>,
    /// Recovered stress in Voigt order 11 22 33 23 13 12, global axes, MPa, `[n_points]`.
    pub stress: Vec<[f64; 6]>,
    /// Exposure of each material with known strengths, by failure criterion.
    pub exposures: Vec<ExposureField>,
    /// Strain at points of the contact surface. The stress at these points follows from the strain and the contact
    /// tractions.
    pub contact: Vec<SurfaceStressPoint>,
    /// Estimated error of the element stress before recovery, if requested; `None` for boundary elements.
    pub error: Option<ErrorEstimate>,
}

impl StressField {
    /// Combines the stress at `points` with its estimated error and the exposures. `limits` contains the strengths by
    /// material name.
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
