//! Search for the mesh face that contains a point of the patch, and interpolation of nodal values at this point.

use super::forces::PatchForces;
use super::patch::ContactPatch;
use crate::error::{Error, Result};
use crate::geometry::{Point, bounds, format_number};
use crate::mesh::Mesh;
use crate::mesh::faces::{SurfaceFace, outer_faces};

const MAX_NEWTON_STEPS: usize = 30;

/// Largest size of the last Newton step at which the iteration counts as converged, in reference coordinates.
const CONVERGED_STEP: f64 = 1e-9;

/// Distance outside a face, in reference coordinates, up to which a point counts as on the face.
const REFERENCE_TOLERANCE: f64 = 1e-7;

pub(super) struct PatchFaceLocator<'a> {
    mesh: &'a Mesh,
    patch: &'a ContactPatch,
    faces: Vec<SurfaceFace>,
}

impl<'a> PatchFaceLocator<'a> {
    pub fn new(mesh: &'a Mesh, forces: &'a PatchForces) -> Self {
        let own = forces.own_faces(mesh);
        let faces = outer_faces(mesh).into_iter().filter(|face| own(face)).collect();
        Self { mesh, patch: &forces.patch, faces }
    }

    /// Nodes and weights that interpolate the mesh displacement at the point `at` of the patch.
    ///
    /// # Errors
    /// If no face lies at the point.
    pub fn weights(&self, at: [f64; 2]) -> Result<Vec<(usize, f64)>> {
        for face in &self.faces {
            let corners: Vec<Point> = face.nodes.iter().map(|&node| self.local(node)).collect();
            let inside = |axis: usize| {
                let [low, high] = bounds(corners.iter().map(|corner| corner[axis]));
                let border = 0.1 * (high - low);
                (low - border..=high + border).contains(&at[axis])
            };
            if inside(0)
                && inside(1)
                && let Some(xi) = inverse_map(face, &corners, at)
            {
                let values = face.kind.face_values(xi);
                return Ok(face.nodes.iter().copied().zip(values).collect());
            }
        }
        Err(Error::input(format!(
            "no face of the mesh lies at ({}, {}) of the patch",
            format_number(at[0]),
            format_number(at[1])
        )))
    }

    fn local(&self, node: usize) -> Point {
        self.patch.local(&self.mesh.points[node].into())
    }
}

/// Reference coordinates of the point on a face whose projection along the patch normal is `at`. `None` if the face has
/// no such point. `nodes` contains the nodes of the face in the axes of the patch.
pub(super) fn inverse_map(face: &SurfaceFace, nodes: &[Point], at: [f64; 2]) -> Option<[f64; 2]> {
    let triangle = face.kind.n_corners() == 3;
    let mut xi = if triangle { [1.0 / 3.0; 2] } else { [0.0; 2] };
    let mut last_step = f64::INFINITY;
    for _ in 0..MAX_NEWTON_STEPS {
        let (values, gradients) = (face.kind.face_values(xi), face.kind.face_gradients(xi));
        let sum = |weight: &dyn Fn(usize) -> f64, axis: usize| -> f64 {
            nodes.iter().enumerate().map(|(a, node)| weight(a) * node[axis]).sum()
        };
        let off = [0, 1].map(|axis| at[axis] - sum(&|a| values[a], axis));
        let slope = [0, 1].map(|axis| [0, 1].map(|d| sum(&|a| gradients[a][d], axis)));
        let determinant = slope[0][0] * slope[1][1] - slope[0][1] * slope[1][0];
        let step = [
            (off[0] * slope[1][1] - off[1] * slope[0][1]) / determinant,
            (off[1] * slope[0][0] - off[0] * slope[1][0]) / determinant,
        ];
        if !step.iter().all(|value| value.is_finite()) {
            return None;
        }
        (0..2).for_each(|k| xi[k] += step[k]);
        last_step = step[0].abs().max(step[1].abs());
        if last_step < 1e-13 {
            break;
        }
    }
    // If `at` lies outside the face, Newton's method may diverge, or end inside the face without convergence.
    if last_step > CONVERGED_STEP {
        return None;
    }
    let inside = if triangle {
        xi[0] >= -REFERENCE_TOLERANCE
            && xi[1] >= -REFERENCE_TOLERANCE
            && xi[0] + xi[1] <= 1.0 + REFERENCE_TOLERANCE
    } else {
        xi.iter().all(|x| x.abs() <= 1.0 + REFERENCE_TOLERANCE)
    };
    inside.then_some(xi)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::element::ElementKind;
    use crate::mesh::CellRef;

    /// Truth: the reference coordinates map back to the point. The face x = s + 2 s², y = t is folded at x = -1/8.
    /// Points with smaller x are not on the face.
    #[test]
    fn points_beside_a_folded_face_are_not_on_it() {
        let nodes = (0..9).collect();
        let owner = CellRef { block: 0, cell: 0 };
        let face = SurfaceFace { kind: ElementKind::Quad9, nodes, owner, local_face: 0, tag: 1 };
        let map = |[s, t]: [f64; 2]| Point::new(s + 2.0 * s * s, t, 0.0);
        let places: Vec<Point> = face.kind.face_reference_nodes().iter().map(|xi| map(*xi)).collect();
        for k in 1..100 {
            let beyond = [-0.125 - 0.01 * f64::from(k), 0.3];
            assert_eq!(inverse_map(&face, &places, beyond), None, "{beyond:?}");
            let on = [0.03 * f64::from(k), 0.3];
            let found = inverse_map(&face, &places, on).map(map);
            assert!(
                found.is_none_or(|x| (x.x - on[0]).abs() + (x.y - on[1]).abs() < 1e-9),
                "{on:?} {found:?}"
            );
        }
    }
}
