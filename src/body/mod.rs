//! Elastic bodies as the contact sees them: a flexibility on the frame, and the recovery of their fields.

pub mod condensed;

use crate::error::Result;
use crate::linalg::operator::Flexibility;

/// Displacement (and stress) of a body at the points of its own surface or volume, for output.
#[derive(Debug, Clone, Default)]
pub struct BodyField {
    /// Displacement, global axes, `[n_points]`, mm.
    pub displacement: Vec<[f64; 3]>,
    /// Stress in Voigt order 11 22 33 23 13 12, global axes, MPa, `[n_points]`; empty where not computed.
    pub stress: Vec<[f64; 6]>,
}

/// A body tied to a contact frame.
pub trait ElasticBody: Send + Sync {
    /// What the body is, for the plan ("half-space, steel", "finite elements, 12 345 unknowns").
    fn describe(&self) -> String;

    /// Takes the body's flexibility on the frame (gap change per traction on body 2); `None` if rigid.
    /// May be called once.
    fn take_flexibility(&mut self) -> Option<Box<dyn Flexibility>>;

    /// The gap change that the body's own loads and prescribed displacements cause, `[3, N]` by planes, mm;
    /// `None` if there are none.
    fn free_gap(&self) -> Option<&[f64]>;

    /// Fields at the points of the body's output mesh for tractions on body 2, `[3, N]` by planes.
    ///
    /// # Errors
    /// If a back-substitution fails.
    fn recover(&self, tractions: &[f64]) -> Result<BodyField>;
}
