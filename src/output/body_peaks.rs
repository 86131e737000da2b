//! Peaks of stress, failure indices and estimated error of a body, for the summary.

use std::borrow::Cow;

use serde::{Deserialize, Serialize};

use crate::body::StressField;
use crate::fem::{ErrorEstimate, ExposureField, MIN_RELATIVE_ERROR};
use crate::material::strength::{StressExposure, von_mises};
use crate::mesh::Mesh;
use crate::output::surface_stress::SurfaceStress;

/// The reported worst cells contain at least this fraction of the squared error of the body.
const WORST_CELLS_ERROR_SHARE: f64 = 0.5;

/// Largest value and its position.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Peak {
    /// Value.
    pub value: f64,
    /// Undeformed position in global axes.
    pub position: [f64; 3],
}

/// Largest index of a failure criterion.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct IndexPeak {
    /// Name of the criterion, as in the field files.
    pub criterion: Cow<'static, str>,
    /// Stress exposure, 1 at failure.
    pub value: f64,
    /// Failure mode.
    pub mode: Cow<'static, str>,
    /// Undeformed position in global axes.
    pub position: [f64; 3],
}

/// Estimated error of a body in one increment.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ErrorRecord {
    /// Estimated error in the energy norm, relative to the estimated norm of the true stress.
    pub relative: f64,
    /// Error in the energy norm: square root of twice the energy of the difference between recovered stress and element stress.
    pub energy_norm: f64,
    /// Centre of the cell with the largest error.
    pub position: [f64; 3],
    /// Smallest set of cells that contains at least half of the squared error.
    pub worst_cells: WorstCells,
}

/// Cells with the largest errors.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct WorstCells {
    /// Number of cells.
    pub count: usize,
    /// Volume of the cells divided by the volume of the body.
    pub volume_share: f64,
    /// Mean of the cell centres, weighted by the squared errors of the cells.
    pub centre: [f64; 3],
    /// Largest distance of a cell centre from `centre`.
    pub radius: f64,
}

/// Peaks of stress and failure indices of a body, with the estimated error.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct BodyPeaks {
    /// Largest von Mises stress.
    pub von_mises: Peak,
    /// Largest index of each criterion.
    #[serde(skip_serializing_if = "Vec::is_empty", default)]
    pub indices: Vec<IndexPeak>,
    /// Largest principal stress in the tangent planes of the contact surface.
    #[serde(skip_serializing_if = "Option::is_none", default)]
    pub sigma_tangential: Option<Peak>,
    /// Estimated error.
    #[serde(skip_serializing_if = "Option::is_none", default)]
    pub error: Option<ErrorRecord>,
}

/// Peaks of a body after an increment: an entry of `summary.bodies`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct BodyRecord {
    /// Body: "body1" or "body2".
    pub body: Cow<'static, str>,
    /// Name of the step.
    pub name: String,
    /// Number of the increment or jump in its step, from 1.
    pub increment: usize,
    /// Peaks.
    #[serde(flatten)]
    pub peaks: BodyPeaks,
}

impl BodyPeaks {
    pub(crate) fn new(mesh: &Mesh, field: &StressField, surface: &SurfaceStress<'_>) -> Self {
        Self {
            von_mises: von_mises_peak(mesh, field),
            indices: index_peaks(mesh, field),
            sigma_tangential: tangential_peak(mesh, field, surface),
            error: field.error.as_ref().map(ErrorRecord::new),
        }
    }
}

/// Index and value of the largest value; the first one of equal values.
fn largest(values: impl Iterator<Item = f64>) -> Option<(usize, f64)> {
    values.enumerate().fold(None, |best, (i, value)| match best {
        Some((_, found)) if value <= found => best,
        _ => Some((i, value)),
    })
}

fn von_mises_peak(mesh: &Mesh, field: &StressField) -> Peak {
    let (point, value) = largest(field.stress.iter().map(von_mises)).unwrap_or((0, 0.0));
    Peak { value, position: mesh.points[field.points.mesh_nodes[point]] }
}

fn index_peaks(mesh: &Mesh, field: &StressField) -> Vec<IndexPeak> {
    let peak = |exposure: &ExposureField| {
        let (point, _) = largest(exposure.points.iter().map(|e| e.value))?;
        let StressExposure { value, mode } = exposure.points[point];
        let position = mesh.points[field.points.mesh_nodes[point]];
        let (criterion, mode) = (exposure.criterion.name().into(), mode.name().into());
        Some(IndexPeak { criterion, value, mode, position })
    };
    field.exposures.iter().filter_map(peak).collect()
}

impl ErrorRecord {
    /// Summarises an error estimate.
    pub fn new(estimate: &ErrorEstimate) -> Self {
        let worst = estimate.worst_cells(WORST_CELLS_ERROR_SHARE);
        let weight: f64 = worst.iter().map(|&i| estimate.cell_errors[i].powi(2)).sum();
        let mut centre = [0.0; 3];
        for &i in &worst {
            let share = estimate.cell_errors[i].powi(2) / weight;
            (0..3).for_each(|c| centre[c] += share * estimate.cell_centres[i][c]);
        }
        let distance = |i: &usize| {
            (0..3).map(|c| (estimate.cell_centres[*i][c] - centre[c]).powi(2)).sum::<f64>().sqrt()
        };
        let volume: f64 = worst.iter().map(|&i| estimate.cell_volumes[i]).sum();
        Self {
            relative: estimate.relative_error(),
            energy_norm: estimate.error_norm(),
            position: worst.first().map_or([0.0; 3], |&i| estimate.cell_centres[i]),
            worst_cells: WorstCells {
                count: worst.len(),
                volume_share: volume / estimate.cell_volumes.iter().sum::<f64>(),
                centre,
                radius: worst.iter().map(distance).fold(0.0, f64::max),
            },
        }
    }

    /// Message with the estimated error. It names the region to refine, unless the error is at rounding level. `length`
    /// is the unit of length.
    pub fn advice(&self, length: &str) -> String {
        if self.relative < MIN_RELATIVE_ERROR {
            return format!(
                "estimated error {:.1e} in energy norm, at rounding level: nothing to refine",
                self.relative
            );
        }
        let WorstCells { count, volume_share, centre, radius } = &self.worst_cells;
        let at = |x: &[f64; 3]| format!("({:.3}, {:.3}, {:.3})", x[0], x[1], x[2]);
        format!(
            "estimated error {:.1} % in energy norm, largest at {}; half of the squared error lies in {count} elements ({:.1e} of the volume) within {radius:.3} {length} of {}: refine the mesh there",
            100.0 * self.relative,
            at(&self.position),
            volume_share,
            at(centre),
        )
    }
}

fn tangential_peak(mesh: &Mesh, field: &StressField, surface: &SurfaceStress<'_>) -> Option<Peak> {
    let (i, value) = largest(field.contact.iter().map(|contact| surface.at(contact.point).1))?;
    Some(Peak { value, position: mesh.points[field.points.mesh_nodes[field.contact[i].point]] })
}
