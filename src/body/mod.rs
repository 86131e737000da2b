//! Elastic bodies in contact. An [`ElasticBody`] provides its flexibility, loads and rigid-body modes. It also recovers
//! displacement and stress for given tractions and load amplitudes. Vectors `[3, N]` contain the x components of all N
//! cells, then all y components, then all n components.

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
    /// u = G t at the cells. G contains the integrals of this surface Green's function over the cells, in the axes of
    /// the frame.
    HalfSpace(&'a SurfaceGreen),
    /// K u = f of a body with a volume mesh.
    FiniteElements(&'a FeBody),
    /// u = G t at the cells, plus a correction for the finite size of the body.
    Hybrid(&'a HybridBody),
    /// Collocation equations of a boundary-element body, solved for unit tractions at the nodes under the frame.
    BoundaryElements(&'a BeBody),
    /// The body provides no equations, only its flexibility.
    Unknown,
}

/// Body whose contact surface is mapped to the cells of a contact frame.
pub trait ElasticBody: Send + Sync {
    /// Short description of the body ("half-space", "finite elements, 12 345 unknowns").
    fn describe(&self) -> String;

    /// Equations of the body, for couplings that need more than its flexibility.
    fn equations(&self) -> BodyEquations<'_> {
        BodyEquations::Unknown
    }

    /// Green's function of the half-space that approximates the body close to a surface force; `None` if unknown.
    fn near_field_green(&self) -> Option<&SurfaceGreen> {
        None
    }

    /// Returns the flexibility of the body on the frame: gap change per traction on body 2. `None` if the body is
    /// rigid. `cross` states whether the operator omits vanishing blocks between normal and tangential components.
    ///
    /// # Errors
    /// If the operator cannot be built, for example because memory does not suffice. Also if the body keeps no copy of
    /// the flexibility, and an earlier call has returned it.
    fn take_flexibility(&mut self, cross: CrossBlocks) -> Result<Option<Arc<dyn Flexibility>>>;

    /// Loads and prescribed displacements, with amplitudes.
    fn loads(&self) -> &[BodyLoad] {
        &[]
    }

    /// Unconstrained rigid-body modes; `None` if the supports fix the body. The flexibility of an unconstrained body is
    /// the generalised inverse of its stiffness with zero mean motion along the modes. Added distributed forces balance
    /// the loads of the body and the contact tractions. These forces act over the volume, or over the surface of a
    /// boundary-element body. They vanish once the contact tractions balance the loads.
    fn rigid_body_modes(&self) -> Option<&UnconstrainedModes> {
        None
    }

    /// Meshed contact surface of the body; `None` for rigid bodies and for half-spaces without a mesh.
    fn surface(&self) -> Option<&MeshedSurface> {
        None
    }

    /// Displacement due to contact tractions and loads, at the points of the mesh. A body without a mesh returns the
    /// displacement at the cell centres.
    ///
    /// # Errors
    /// If the equations of the body cannot be solved, or its operator cannot be built.
    fn recover(&self, loading: Loading) -> Result<BodyField>;

    /// Stress due to contact tractions and loads; `None` for a body without a mesh. The argument `_displacement` is the
    /// displacement of all mesh nodes that [`Self::recover`] returns for the same loading.
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

    /// Displacement (mm) and stress (MPa) at interior points due to contact tractions and loads, global axes. `None` if
    /// the body cannot evaluate them.
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
