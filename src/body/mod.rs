//! Elastic bodies as the contact sees them: a flexibility on the frame, and the recovery of their fields.

pub mod boundary_elements;
pub mod condensed_flexibility;
pub mod finite_elements;
pub mod half_space;
pub mod hybrid;
mod lazy_flexibility;
pub mod rigid;
pub mod rigid_body_modes;
pub mod stress;
pub mod truncated_half_space;
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
pub use rigid::RigidBody;
pub use rigid_body_modes::{RigidBodyMode, UnconstrainedModes};
pub use stress::{ErrorEstimation, StressField};
pub use truncated_half_space::{TruncatedHalfSpace, TruncatedSpec, Truncation};

/// Displacement, and stress where it was asked for, of a body at the points of its own surface or volume, for output.
#[derive(Debug, Clone, Default)]
pub struct BodyField {
    /// Displacement, global axes, `[n_points]`, mm.
    pub displacement: Vec<[f64; 3]>,
    /// Stress in its volume, where it was recovered.
    pub stress: Option<StressField>,
}

/// The equations a body brings into a coupled system.
pub enum BodyEquations<'a> {
    /// None: it is rigid.
    Rigid,
    /// u = G t at the cells, G being the integrals of the surface Green's function (axes of the frame).
    HalfSpace(&'a SurfaceGreen),
    /// K u = f of a meshed body.
    FiniteElements(&'a FeBody),
    /// u = G t at the cells, and what a finite body lacks of it.
    Hybrid(&'a HybridBody),
    /// Collocation equations, solved for the nodes under the frame.
    BoundaryElements(&'a BeBody),
    /// Nothing but the flexibility is known.
    Unknown,
}

/// A body tied to a contact frame.
pub trait ElasticBody: Send + Sync {
    /// What the body is, for the plan ("half-space", "finite elements, 12 345 unknowns").
    fn describe(&self) -> String;

    /// The body's own equations, for forms of coupling that need more than its flexibility.
    fn equations(&self) -> BodyEquations<'_> {
        BodyEquations::Unknown
    }

    /// The Green's function of the half-space that its flexibility has near a force; `None` if it is not that of one.
    fn near_field_green(&self) -> Option<&SurfaceGreen> {
        None
    }

    /// Takes the body's flexibility on the frame (gap change per traction on body 2); `None` if rigid.
    /// A body whose matrix moves into the operator gives it once. `cross`: whether blocks between normal and tangential
    /// components are left out where they vanish.
    ///
    /// # Errors
    /// If the operator cannot be made (memory), or was taken before.
    fn take_flexibility(&mut self, cross: CrossBlocks) -> Result<Option<Arc<dyn Flexibility>>>;

    /// The gap change that the body's own loads and prescribed displacements cause, `[3, N]` by planes, mm;
    /// `None` if there are none.
    fn free_gap(&self) -> Option<&[f64]> {
        None
    }

    /// The rigid motions that its supports leave free; `None` if it is held. Its flexibility is then the generalised
    /// inverse that leaves its mean motion at rest, and its free gap that of loads and contact in balance.
    fn rigid_body_modes(&self) -> Option<&UnconstrainedModes> {
        None
    }

    /// The body's meshed surface; `None` if its surface is the plane of the frame.
    fn surface(&self) -> Option<&MeshedSurface> {
        None
    }

    /// Displacement at the points of the body's output mesh (cells of the frame where it has none) for tractions on
    /// body 2, `[3, N]` by planes.
    ///
    /// # Errors
    /// If a back-substitution fails.
    fn recover(&self, tractions: &[f64]) -> Result<BodyField>;

    /// Stress in the volume for tractions on body 2, `[3, N]` by planes, and the displacement of all nodes of the body's mesh that
    /// [`Self::recover`] gives for them; `None` for a body without a mesh.
    ///
    /// # Errors
    /// If the stress cannot be recovered.
    fn recover_stress(
        &self,
        _tractions: &[f64],
        _displacement: &[[f64; 3]],
        _estimate: ErrorEstimation,
    ) -> Result<Option<StressField>> {
        Ok(None)
    }

    /// Displacement and stress at points inside (global axes, mm) for tractions on body 2 in the cells of `frame`, `[3, N]` by planes;
    /// `None` for a body that gives them in another way, or not at all.
    ///
    /// # Errors
    /// If a point does not lie in the body, memory does not suffice, or a stop is wished.
    fn recover_at_points(
        &self,
        _frame: &ContactFrame,
        _tractions: &[f64],
        _points: &[Point],
    ) -> Result<Option<Vec<PointState>>> {
        Ok(None)
    }
}
