//! Unconstrained rigid-body modes of a body. The contact must balance the loads of the body along these modes.

use nalgebra::{Matrix6, SymmetricEigen, Vector3, Vector6};

use crate::fem::{RigidBodyModes, SUBSPACE_TOLERANCE, translations_in};
use crate::frame::ContactFrame;
use crate::geometry::Side;

/// Rigid-body mode that the supports leave unconstrained.
#[derive(Debug, Clone, PartialEq)]
pub struct RigidBodyMode {
    /// Motion of body 2 relative to body 1 per unit amplitude: translation of the frame's origin along x, y, n of the
    /// frame, then rotation about these axes, radians. At unit amplitude, the mean square displacement of the body
    /// is 1.
    pub relative_motion: [f64; 6],
    /// Change of the gap per unit amplitude, `[3, N]`, component by component.
    pub gap: Vec<f64>,
    /// Work of each load at amplitude 1 per unit amplitude of the mode, N mm/mm.
    pub load_work: Vec<f64>,
}

/// Unconstrained rigid-body modes of one body.
#[derive(Debug, Clone, PartialEq)]
pub struct UnconstrainedModes {
    /// Side of the body.
    pub side: Side,
    /// Modes of the body.
    pub modes: Vec<RigidBodyMode>,
    /// Names of the modes, in global axes ("translation x").
    pub names: Vec<String>,
}

/// Computes [`RigidBodyMode::relative_motion`] of mode `j` of `free`, for the body at `side` of `frame`.
pub(crate) fn relative_motion(free: &RigidBodyModes, j: usize, frame: &ContactFrame, side: Side) -> [f64; 6] {
    let [shift, turn] =
        free.motion_about(&frame.origin, j).map(|global| frame.axes.to_local(&global) * side.gap_sign());
    [shift.x, shift.y, shift.z, turn.x, turn.y, turn.z]
}

/// Orthonormal basis of the pure translations in the span of the relative `motions`, in the frame's x, y, n. `size` is
/// the length by which rotations are multiplied.
pub fn unconstrained_translations(motions: &[[f64; 6]], size: f64) -> Vec<Vector3<f64>> {
    let Some(projector) = projector(motions, size) else { return Vec::new() };
    translations_in(&projector)
}

/// Whether the spans of two sets of motions have a common motion other than zero. `size` is the length by which
/// rotations are multiplied.
pub fn have_common_motion(a: &[[f64; 6]], b: &[[f64; 6]], size: f64) -> bool {
    let (Some(p), Some(q)) = (projector(a, size), projector(b, size)) else { return false };
    SymmetricEigen::new(p + q).eigenvalues.max() > 2.0 - SUBSPACE_TOLERANCE
}

fn projector(motions: &[[f64; 6]], size: f64) -> Option<Matrix6<f64>> {
    let mut basis: Vec<Vector6<f64>> = Vec::new();
    for motion in motions {
        let mut v = Vector6::from_fn(|i, _| if i < 3 { motion[i] } else { motion[i] * size });
        let length = v.norm();
        // The second pass removes the rounding errors of the first pass.
        for _ in 0..2 {
            basis.iter().for_each(|b| v -= b * b.dot(&v));
        }
        if v.norm() > SUBSPACE_TOLERANCE * length {
            basis.push(v.normalize());
        }
    }
    (!basis.is_empty()).then(|| basis.iter().fold(Matrix6::zeros(), |sum, b| sum + b * b.transpose()))
}
