//! Point forces on the patch of a body, and the half-space that carries them.

use std::collections::HashSet;

use nalgebra::Matrix3;

use super::patch::ContactPatch;
use crate::bem::half_space::PointForceField;
use crate::geometry::Point;
use crate::linalg::dense_matrix::DenseMatrix;
use crate::material::Stiffness;
use crate::mesh::faces::SurfaceFace;
use crate::mesh::{CellRef, Mesh};

/// Nodes nearer to the plane of the patch than this share of its size lie in it.
pub(super) const PLANE_TOLERANCE: f64 = 1e-6;

/// A face of a mesh: its solid, and its index among the faces of that.
pub type FaceId = (CellRef, usize);

/// Point forces on a patch, and the half-space that carries them.
pub struct PatchForces<'a> {
    /// The patch.
    pub patch: ContactPatch,
    /// The half-space's material, in the axes of the patch.
    pub stiffness: &'a Stiffness,
    /// Its field of a point force.
    pub field: &'a PointForceField,
    /// Where they act, in the patch, `[n]`; each along x, y, z of the patch.
    pub points: Vec<[f64; 2]>,
    /// Faces off the plane that stand for it: a curved contact surface about the patch.
    pub curved_faces: &'a [FaceId],
}

impl PatchForces<'_> {
    /// Those at the corners and in the middle of the points.
    pub(super) fn outermost(&self) -> Self {
        let extreme = |sign: [f64; 2]| {
            let along = |point: &&[f64; 2]| sign[0] * point[0] + sign[1] * point[1];
            self.points.iter().max_by(|a, b| along(a).total_cmp(&along(b))).copied()
        };
        let signs = [[1.0, 1.0], [1.0, -1.0], [-1.0, 1.0], [-1.0, -1.0]];
        let points = signs.into_iter().filter_map(extreme).chain([[0.0, 0.0]]).collect();
        Self { points, ..*self }
    }

    /// Vector from force `i` to a point in the axes of the patch.
    pub(super) fn vector_from(&self, i: usize, local: &Point) -> Point {
        let [x, y] = self.points[i];
        Point::new(local.x - x, local.y - y, local.z)
    }

    /// Where force `i` acts, global, mm.
    pub(super) fn position(&self, i: usize) -> Point {
        let [x, y] = self.points[i];
        self.patch.center + self.patch.axes.to_global(&Point::new(x, y, 0.0))
    }

    /// Distance of a point from the nearest force.
    pub(super) fn distance(&self, x: &Point) -> f64 {
        let local = self.patch.local(x);
        (0..self.points.len()).map(|i| self.vector_from(i, &local).norm()).fold(f64::INFINITY, f64::min)
    }

    /// Whether a face of the boundary is one of the surface of the half-space, where this has no tractions.
    pub(super) fn own_faces<'m>(&'m self, mesh: &'m Mesh) -> impl Fn(&SurfaceFace) -> bool + 'm {
        let surface: HashSet<FaceId> = self.curved_faces.iter().copied().collect();
        move |face| in_plane(mesh, face, &self.patch) || surface.contains(&face.id())
    }

    /// Number of columns: three for each force.
    pub(super) fn n_columns(&self) -> usize {
        3 * self.points.len()
    }

    /// Displacement at `x` by each force, global rows, written to rows `3 row ..` of `out`.
    pub(super) fn displacements(&self, x: &Point, row: usize, out: &mut DenseMatrix) {
        let local = self.patch.local(x);
        for i in 0..self.points.len() {
            let value = self.patch.axes.0 * self.field.at(&self.vector_from(i, &local)).value;
            put(&value, (row, i), out);
        }
    }
}

/// Writes a block of three rows and three columns.
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
