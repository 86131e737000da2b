//! Boundary-value problem of a body, given on its surface.

use super::elements::BoundaryElements;
use crate::fem::RigidBodyModes;

/// Largest number of unknowns that are solved by dense equations by default. For more unknowns, compressed equations
/// take less time.
pub const MAX_DENSE_UNKNOWNS: usize = 10_000;

/// Side of the surface on which the body lies.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Domain {
    /// Body enclosed by the surface.
    Interior,
    /// Infinite body around a cavity. The normals of the surface point into the cavity.
    Exterior,
}

/// Values on the boundary under one load.
#[derive(Debug, Clone, PartialEq)]
pub struct BoundaryValues {
    /// Displacement (mm) of the dofs with prescribed displacement, traction on the body (MPa) of all other dofs,
    /// `[3 n]`.
    pub at_dofs: Vec<f64>,
    /// Mean displacement along each free rigid motion, mm. An empty list means zero.
    pub mean_displacement: Vec<f64>,
}

impl BoundaryValues {
    /// Values with zero mean displacement along the free motions.
    pub fn new(at_dofs: Vec<f64>) -> Self {
        Self { at_dofs, mean_displacement: Vec::new() }
    }
}

/// Boundary-value problem: along each axis at every node, either the displacement or the traction is given. Component c of node i
/// is dof 3 i + c.
pub struct BoundaryValueProblem<'a> {
    /// Boundary elements of the surface.
    pub elements: &'a BoundaryElements,
    /// Side of the surface on which the body lies.
    pub domain: Domain,
    /// Whether the displacement of a dof is prescribed, `[3 n]`.
    pub displacement_known: &'a [bool],
    /// Values under each load at amplitude 1.
    pub loads: &'a [BoundaryValues],
    /// Nodes for which the response to unit tractions is computed. Their displacements must not be prescribed.
    pub loaded: &'a [usize],
    /// Rigid motions that the prescribed displacements leave free, with mean square 1 over the surface.
    pub free_motions: Option<&'a RigidBodyModes>,
}

impl BoundaryValueProblem<'_> {
    /// Number of right-hand sides: the loads, and the unit tractions of the loaded nodes.
    pub(super) fn n_right_sides(&self) -> usize {
        self.loads.len() + 3 * self.loaded.len()
    }
}
