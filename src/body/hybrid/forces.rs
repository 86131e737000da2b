//! Point forces on the patch of a body, and the half-space on which they act.

use std::collections::HashSet;

use nalgebra::Matrix3;

use super::patch::ContactPatch;
use crate::bem::half_space::PointForceField;
use crate::geometry::Point;
use crate::linalg::dense_matrix::DenseMatrix;
use crate::material::Stiffness;
use crate::mesh::faces::SurfaceFace;
use crate::mesh::{CellRef, Mesh};

/// Distance from the plane of the patch up to which a node counts as in the plane, divided by the patch size.
pub(super) const PLANE_TOLERANCE: f64 = 1e-6;

/// Face of a solid element: the element, and the index of the face in the element.
pub type FaceId = (CellRef, usize);

/// Point forces on a patch, and the half-space on which they act.
pub struct PatchForces<'a> {
    /// Patch on which the forces act.
    pub patch: ContactPatch,
    /// Stiffness of the half-space, axes of the patch.
    pub stiffness: &'a Stiffness,
    /// Field of a point force in the half-space.
    pub field: &'a PointForceField,
    /// Positions of the forces in the patch, `[n]`, mm. At each position, unit forces act along x, y and z of the patch.
    pub points: Vec<[f64; 2]>,
    /// Faces of a curved contact surface around the patch. They are treated as part of the patch plane.
    pub curved_faces: &'a [FaceId],
}

impl PatchForces<'_> {
    /// The same half-space with forces only at the outermost point of each quadrant and at the centre.
    pub(super) fn outermost(&self) -> Self {
        let extreme = |sign: [f64; 2]| {
            let along = |point: &&[f64; 2]| sign[0] * point[0] + sign[1] * point[1];
            self.points.iter().max_by(|a, b| along(a).total_cmp(&along(b))).copied()
        };
        let signs = [[1.0, 1.0], [1.0, -1.0], [-1.0, 1.0], [-1.0, -1.0]];
        let points = signs.into_iter().filter_map(extreme).chain([[0.0, 0.0]]).collect();
        Self { points, ..*self }
    }

    /// Vector from the position of force `i` to the point `local`. The point and the vector are in the axes of the
    /// patch.
    pub(super) fn vector_from(&self, i: usize, local: &Point) -> Point {
        let [x, y] = self.points[i];
        Point::new(local.x - x, local.y - y, local.z)
    }

    pub(super) fn position(&self, i: usize) -> Point {
        let [x, y] = self.points[i];
        self.patch.center + self.patch.axes.to_global(&Point::new(x, y, 0.0))
    }

    pub(super) fn distance(&self, x: &Point) -> f64 {
        let local = self.patch.local(x);
        (0..self.points.len()).map(|i| self.vector_from(i, &local).norm()).fold(f64::INFINITY, f64::min)
    }

    /// Returns a test whether a face counts as part of the half-space surface. This surface has no tractions apart from
    /// the point forces.
    pub(super) fn own_faces<'m>(&'m self, mesh: &'m Mesh) -> impl Fn(&SurfaceFace) -> bool + 'm {
        let surface: HashSet<FaceId> = self.curved_faces.iter().copied().collect();
        move |face| in_plane(mesh, face, &self.patch) || surface.contains(&face.id())
    }

    pub(super) fn n_columns(&self) -> usize {
        3 * self.points.len()
    }

    /// Writes the displacement at `x` due to each unit force to rows `3 row` to `3 row + 2` of `out`, in global axes.
    pub(super) fn displacements(&self, x: &Point, row: usize, out: &mut DenseMatrix) {
        let local = self.patch.local(x);
        for i in 0..self.points.len() {
            let value = self.patch.axes.0 * self.field.at(&self.vector_from(i, &local)).value;
            put(&value, (row, i), out);
        }
    }
}

pub(super) fn put(block: &Matrix3<f64>, (row, force): (usize, usize), out: &mut DenseMatrix) {
    let n = out.n_rows();
    for k in 0..3 {
        let first = (3 * force + k) * n + 3 * row;
        out.values_mut()[first..first + 3].copy_from_slice(block.column(k).as_slice());
    }
}

/// Whether all nodes of a face lie in the plane of the patch.
pub(super) fn in_plane(mesh: &Mesh, face: &SurfaceFace, patch: &ContactPatch) -> bool {
    let height = |node: &usize| patch.local(&mesh.points[*node].into()).z.abs();
    face.nodes.iter().all(|node| height(node) <= PLANE_TOLERANCE * patch.size())
}
