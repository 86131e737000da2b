//! Stress exposure of a body for each failure criterion, at points and in cells: 0 without stress, 1 at failure.

use rayon::prelude::*;

use super::points::RecoveryPoints;
use crate::material::strength::{FailureCriterion, MaterialStrength, StressExposure, stress_in_axes};

/// Exposure field of one failure criterion.
#[derive(Debug, Clone, PartialEq)]
pub struct ExposureField {
    /// Failure criterion.
    pub criterion: FailureCriterion,
    /// Largest exposure at each recovery point over the adjacent cells, `[n_points]`.
    pub points: Vec<StressExposure>,
    /// Largest exposure over the nodes of each cell, `[n_cells]`.
    pub cells: Vec<StressExposure>,
}

/// Exposures for each criterion that applies to at least one cell, from the recovered `stress` at the points. `limit`
/// returns the strength and the material axes (columns, global) of a cell. In cells for which `limit` returns `None`,
/// the exposure is zero.
pub(crate) fn exposures<'a>(
    points: &RecoveryPoints,
    stress: &[[f64; 6]],
    limit: impl Fn(usize) -> Option<(&'a MaterialStrength, nalgebra::Matrix3<f64>)> + Sync,
) -> Vec<ExposureField> {
    let mut criteria: Vec<FailureCriterion> = (0..points.n_cells())
        .filter_map(&limit)
        .flat_map(|(limit, _)| limit.criteria().iter().copied())
        .collect();
    criteria.sort_unstable();
    criteria.dedup();
    let field = |criterion| {
        let of_cell = |cell: usize| -> Vec<StressExposure> {
            let Some((limit, axes)) = limit(cell) else {
                return vec![StressExposure::ZERO; points.points_of_cell(cell).len()];
            };
            let nodes = points.points_of_cell(cell).iter();
            nodes.map(|&point| limit.exposure(criterion, &stress_in_axes(&axes, &stress[point]))).collect()
        };
        let at_nodes: Vec<Vec<StressExposure>> = (0..points.n_cells()).into_par_iter().map(of_cell).collect();
        let mut at_points = vec![StressExposure::ZERO; points.n_points()];
        for (cell, found) in at_nodes.iter().enumerate() {
            for (&point, &exposure) in points.points_of_cell(cell).iter().zip(found) {
                at_points[point] = at_points[point].max(exposure);
            }
        }
        let cells = at_nodes
            .into_iter()
            .map(|found| found.into_iter().fold(StressExposure::ZERO, StressExposure::max));
        ExposureField { criterion, points: at_points, cells: cells.collect() }
    };
    criteria.into_iter().map(field).collect()
}
