//! Element sizes of the next mesh of a body, from estimated stress errors.

use crate::error::{Error, Result};
use crate::fem::{ErrorEstimate, SIZE_RATIO_BOUNDS, size_ratios};
use crate::mesh::Mesh;
use crate::mesh::size_field::{SizeBounds, edge_length, nodal_sizes};

/// Requirements on the next mesh.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RefinementTarget {
    /// Target of the relative error of the stress in the energy norm. `None` stands for half of the present error.
    pub error: Option<f64>,
    /// Smallest element size.
    pub least: Option<f64>,
    /// Largest element size.
    pub largest: Option<f64>,
    /// Largest increase of the element size per distance.
    pub growth: f64,
}

/// Element sizes of the next mesh.
#[derive(Debug, Clone, PartialEq)]
pub struct SizeField {
    /// Size at each corner node of the solids, 0 at other points, `[n_points]`.
    pub nodal: Vec<f64>,
    /// Target of the relative stress error in the energy norm.
    pub error: f64,
    /// Whether one refinement with the smallest admissible ratio of next to present size reaches the target.
    pub reaches_target: bool,
    /// Number of elements of the present mesh.
    pub elements: usize,
    /// Expected number of elements of the next mesh, with the present element types.
    pub next_elements: f64,
    /// Bounds of the size field.
    pub bounds: SizeBounds,
}

/// Default bounds: ratio of the smallest next size to the smallest present size, and ratio of the largest next size to
/// the largest present size.
const BOUNDS: [f64; 2] = [SIZE_RATIO_BOUNDS[0], SIZE_RATIO_BOUNDS[1]];

/// Computes the size field that reduces the errors of all `estimates` of a body to the target.
///
/// # Errors
/// If there is no stress, or the bounds contradict one another.
pub fn size_field(mesh: &Mesh, estimates: &[ErrorEstimate], wanted: &RefinementTarget) -> Result<SizeField> {
    let largest_error = estimates.iter().map(ErrorEstimate::relative_error).fold(0.0, f64::max);
    if largest_error == 0.0 {
        return Err(Error::input("the body has no stress, so that there is nothing to refine"));
    }
    let error = wanted.error.unwrap_or(0.5 * largest_error);
    let cells: Vec<_> = mesh.volume_cells().collect();
    let volumes = &estimates[0].cell_volumes;
    let sizes: Vec<f64> =
        cells.iter().zip(volumes).map(|(&cell, &volume)| edge_length(mesh.kind(cell), volume)).collect();
    let degree =
        cells.iter().map(|&c| if mesh.kind(c).n_nodes() > mesh.kind(c).n_corners() { 2 } else { 1 }).min();
    let degree = degree.unwrap_or(1);
    let reaches_target = largest_error * SIZE_RATIO_BOUNDS[0].powi(degree) <= error;
    let mut ratios = vec![f64::INFINITY; cells.len()];
    for estimate in estimates {
        for (least, ratio) in ratios.iter_mut().zip(size_ratios(estimate, degree as usize, error)) {
            *least = least.min(ratio);
        }
    }
    let next: Vec<f64> = sizes.iter().zip(&ratios).map(|(size, ratio)| size * ratio).collect();
    let smallest = sizes.iter().copied().fold(f64::INFINITY, f64::min);
    let biggest = sizes.iter().copied().fold(0.0, f64::max);
    let bounds = SizeBounds {
        least: wanted.least.unwrap_or(BOUNDS[0] * smallest),
        largest: wanted.largest.unwrap_or(BOUNDS[1] * biggest),
        growth: wanted.growth,
    };
    if bounds.least > bounds.largest {
        return Err(Error::input(format!(
            "the smallest size {:.4} exceeds the largest {:.4}; change --min-size or --max-size",
            bounds.least, bounds.largest
        )));
    }
    let nodal = nodal_sizes(mesh, &next, &bounds);
    let next_elements = expected(mesh, &nodal, &sizes, volumes);
    Ok(SizeField { nodal, error, reaches_target, elements: cells.len(), next_elements, bounds })
}

/// Expected number of elements of the next mesh: sum of (size / next size)³ over the present elements.
fn expected(mesh: &Mesh, nodal: &[f64], sizes: &[f64], volumes: &[f64]) -> f64 {
    let of_cell = |((cell, size), volume): ((crate::mesh::CellRef, &f64), &f64)| {
        let corners = &mesh.cell_nodes(cell)[..mesh.kind(cell).n_corners()];
        let mean = corners.iter().map(|&node| nodal[node].ln()).sum::<f64>() / corners.len() as f64;
        if *volume > 0.0 { (size / mean.exp()).powi(3) } else { 0.0 }
    };
    mesh.volume_cells().zip(sizes).zip(volumes).map(of_cell).sum()
}
