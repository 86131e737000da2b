//! Elastic bodies in contact. An [`ElasticBody`] provides its flexibility, loads and rigid-body modes, and recovers displacement
//! and stress for given tractions and amplitudes of the loads. Vectors `[3, N]` are stored component by component: the x components
//! of all N cells, then all y, then all n components.

pub mod boundary_elements;
pub mod condensed_flexibility;
pub mod finite_elements;
pub mod half_space;
pub mod hybrid;
mod lazy_flexibility;
mod loads;
pub mod rigid;
pub mod rigid_body_modes;
pub mod stress;
pub mod truncated_half_space;
mod uniform_deformation;
pub mod worn_mesh;

use std::sync::Arc;

use crate::bem::half_space::{CrossBlocks, SurfaceGreen};
use crate::error::Result;
use crate::flexibility::Flexibility;
use crate::frame::{ContactFrame, MeshedSurface};
use crate::geometry::Point;

pub use crate::bem::PointState;
pub use boundary_elements::{BeBody, BeSpec, FrameFit};
pub use finite_elements::FeBody;
pub use half_space::HalfSpaceBody;
pub use hybrid::HybridBody;
pub use loads::{BodyLoad, INTERFERENCE, LoadCase, Loading};
pub use rigid::RigidBody;
pub use rigid_body_modes::{RigidBodyMode, UnconstrainedModes};
pub use stress::{ErrorEstimation, StressField};
pub use truncated_half_space::{TruncatedHalfSpace, TruncatedSpec, Truncation};

/// Displacement of a body and, if recovered, its stress.
#[derive(Debug, Clone, Default)]
pub struct BodyField {
    /// Displacement, global axes, `[n_points]`, mm.
    pub displacement: Vec<[f64; 3]>,
    /// Stress in the volume or, for boundary elements, on the surface, if recovered.
    pub stress: Option<StressField>,
}

/// Equations that a body contributes to a coupled system.
pub enum BodyEquations<'a> {
    /// None: the body is rigid.
    Rigid,
    /// u = G t at the cells. G are the integrals of this surface Green's function over the cells (axes of the frame).
    HalfSpace(&'a SurfaceGreen),
    /// K u = f of a meshed body.
    FiniteElements(&'a FeBody),
    /// u = G t at the cells, plus the correction for a finite body.
    Hybrid(&'a HybridBody),
    /// Collocation equations of a boundary-element body, solved for unit tractions at the nodes under the frame.
    BoundaryElements(&'a BeBody),
    /// Only the flexibility is known.
    Unknown,
}

/// Body tied to a contact frame.
pub trait ElasticBody: Send + Sync {
    /// Short description of the body ("half-space", "finite elements, 12 345 unknowns").
    fn describe(&self) -> String;

    /// Equations of the body, for couplings that need more than its flexibility.
    fn equations(&self) -> BodyEquations<'_> {
        BodyEquations::Unknown
    }

    /// Green's function of the half-space that governs the flexibility near a force; `None` if unknown.
    fn near_field_green(&self) -> Option<&SurfaceGreen> {
        None
    }

    /// Takes the flexibility of the body on the frame (gap change per traction on body 2); `None` if rigid. `cross` states whether
    /// vanishing blocks between normal and tangential components are omitted.
    ///
    /// # Errors
    /// If the operator cannot be built, such as for lack of memory. If the body keeps no copy of its flexibility, and it was taken
    /// before.
    fn take_flexibility(&mut self, cross: CrossBlocks) -> Result<Option<Arc<dyn Flexibility>>>;

    /// Loads and prescribed displacements, with amplitudes.
    fn loads(&self) -> &[BodyLoad] {
        &[]
    }

    /// Unconstrained rigid-body modes; `None` if the supports fix the body. The flexibility of an unconstrained body is the
    /// generalised inverse with zero mean motion. Added forces balance the body's own loads and the contact tractions. They are
    /// spread over the volume, in boundary elements over the surface, and vanish once the contact balances the loads.
    fn rigid_body_modes(&self) -> Option<&UnconstrainedModes> {
        None
    }

    /// Meshed contact surface of the body; `None` for rigid bodies and for half-spaces without a mesh.
    fn surface(&self) -> Option<&MeshedSurface> {
        None
    }

    /// Displacement due to contact tractions and loads, at the points of the mesh, or at the cell centres for a body without a mesh.
    ///
    /// # Errors
    /// If the equations of the body cannot be solved, or its operator cannot be built.
    fn recover(&self, loading: Loading) -> Result<BodyField>;

    /// Stress due to contact tractions and loads; `None` for a body without a mesh. The displacement of all mesh nodes must come
    /// from [`Self::recover`] with the same loading.
    ///
    /// # Errors
    /// If the stress cannot be recovered.
    fn recover_stress(
        &self,
        _loading: Loading,
        _displacement: &[[f64; 3]],
        _estimate: ErrorEstimation,
    ) -> Result<Option<StressField>> {
        Ok(None)
    }

    /// Displacement (mm) and stress (MPa) at interior points, global axes, for the same loading as in
    /// [`Self::recover`]. `None` if the body cannot evaluate them.
    ///
    /// # Errors
    /// For half-spaces, if a point lies outside the body, the frame is periodic, or the field of a point force cannot be computed.
    /// If memory does not suffice, or the run is cancelled.
    fn recover_at_points(
        &self,
        _frame: &ContactFrame,
        _loading: Loading,
        _points: &[Point],
    ) -> Result<Option<Vec<PointState>>> {
        Ok(None)
    }
}
