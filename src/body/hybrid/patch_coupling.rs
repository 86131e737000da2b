//! Terms of the boundary between forces on different patches: on the surface of one half-space the displacement of its own forces is
//! singular, and works against the tractions of the other's.
//!
//! The displacement by a force on its own surface is h(θ)/r. On a triangle from the force to an edge of that surface the area
//! element takes the 1/r away, so that sums over the edges, with the sign of their turn about the force, are regular.

use nalgebra::Matrix3;
use rayon::prelude::*;

use super::boundary_terms::BoundaryFace;
use super::face_outline::{edges, outline_loops};
use super::forces::{ForceSet, PatchForces};
use crate::bem::green_tensor::TractionOperator;
use crate::geometry::Point;
use crate::linalg::dense_matrix::DenseMatrix;
use crate::mesh::Mesh;
use crate::quadrature::gauss_legendre;

/// Gauss points on each part of an edge and of a ray.
const GAUSS_POINTS: usize = 6;

/// Length of a part of an edge or of a ray over its distance from what varies along it.
const MAX_LENGTH_TO_DISTANCE: f64 = 0.7;

/// Halvings of an edge or a ray, one after the other, at most.
const MAX_BISECTIONS: usize = 10;

/// Adds, between forces y on one patch and x on another, the displacement at y by x in its half-space and -∫ u_y·t_x over the free surface of
/// y's half-space; rows y, columns x.
pub(super) fn add_patch_coupling(
    mesh: &Mesh,
    sources: ForceSet,
    faces: &[BoundaryFace],
    work: &mut DenseMatrix,
) {
    let patches: Vec<(usize, &PatchForces)> = sources.patches().collect();
    let line: Vec<(f64, f64)> =
        gauss_legendre(GAUSS_POINTS).into_iter().map(|(x, weight)| (0.5 * (1.0 + x), 0.5 * weight)).collect();
    for (p, &(first_y, row_forces)) in patches.iter().enumerate() {
        for (q, &(first_x, column_forces)) in patches.iter().enumerate().filter(|(q, _)| *q != p) {
            let on_surface = faces
                .iter()
                .filter(|face| face.on_patch_surface[p] && !face.on_patch_surface[q] && face.is_free());
            let edges = edges(&outline_loops(mesh, on_surface.map(|face| &face.face), &row_forces.patch));
            let pair = PatchPair { row_forces, column_forces, edges: &edges, line: &line };
            let rows: Vec<Vec<Matrix3<f64>>> =
                (0..row_forces.points.len()).into_par_iter().map(|y| pair.row(y)).collect();
            for (y, row) in rows.iter().enumerate() {
                for (x, block) in row.iter().enumerate() {
                    let n_rows = work.n_rows();
                    for column in 0..3 {
                        let first = (3 * (first_x + x) + column) * n_rows + 3 * (first_y + y);
                        let values = &mut work.values_mut()[first..first + 3];
                        values.iter_mut().zip(block.column(column).iter()).for_each(|(w, b)| *w += b);
                    }
                }
            }
        }
    }
}

/// Forces on two patches.
struct PatchPair<'a> {
    /// Those whose surface is integrated over.
    row_forces: &'a PatchForces<'a>,
    column_forces: &'a PatchForces<'a>,
    /// That bound the surface.
    edges: &'a [[[f64; 2]; 2]],
    /// Gauss points on [0, 1].
    line: &'a [(f64, f64)],
}

impl PatchPair<'_> {
    /// The blocks between force `y` and all of the other patch, rows in the axes of the patch of y.
    fn row(&self, y: usize) -> Vec<Matrix3<f64>> {
        let (by, bx) = (self.row_forces, self.column_forces);
        let turn = by.patch.axes.0.transpose() * bx.patch.axes.0;
        let local = bx.patch.local(&by.position(y));
        let mut row: Vec<Matrix3<f64>> =
            (0..bx.points.len()).map(|x| turn * bx.field.at(&bx.vector_from(x, &local)).value).collect();
        if by.is_coplanar(bx) {
            return row;
        }
        let normal = bx.patch.axes.to_local(&by.patch.axes.normal());
        let map = TractionOperator::new(bx.stiffness, &normal);
        let origin = by.points[y];
        for &[a, b] in self.edges {
            let [a, b] = [a, b].map(|x| [x[0] - origin[0], x[1] - origin[1]]);
            self.edge((a, b), &mut |ray: [f64; 2], double_area: f64| {
                // u_y along the ray is that at its end over the share of its length.
                let end = by.field.at(&Point::new(ray[0], ray[1], 0.0)).value * double_area;
                self.ray(y, ray, &mut |at: &Point, weight: f64| {
                    for (x, block) in row.iter_mut().enumerate() {
                        let traction = turn * map.apply(&bx.field.at(&bx.vector_from(x, at)));
                        *block -= end.transpose() * traction * weight;
                    }
                });
            });
        }
        row
    }

    /// Calls `add` with points on the edge from `a` to `b` (from the force) and twice the area of the triangle that each stands for.
    fn edge(&self, (a, b): ([f64; 2], [f64; 2]), add: &mut dyn FnMut([f64; 2], f64)) {
        let cross = a[0] * b[1] - a[1] * b[0];
        let length = (b[0] - a[0]).hypot(b[1] - a[1]);
        // A force on the line of an edge has no triangle with it.
        if cross == 0.0 || length == 0.0 {
            return;
        }
        let at = |t: f64| [0, 1].map(|c| a[c] + t * (b[c] - a[c]));
        let along = -(a[0] * (b[0] - a[0]) + a[1] * (b[1] - a[1])) / (length * length);
        let distance = |[t0, t1]: [f64; 2]| {
            let nearest = at(along.clamp(t0, t1));
            nearest[0].hypot(nearest[1])
        };
        halved(
            [0.0, 1.0],
            MAX_BISECTIONS,
            &|part| length * (part[1] - part[0]) <= MAX_LENGTH_TO_DISTANCE * distance(part),
            &mut |part| {
                for &(t, weight) in self.line {
                    let share = part[1] - part[0];
                    add(at(part[0] + share * t), cross * share * weight);
                }
            },
        );
    }

    /// Calls `add` with points on the ray from force `y` to its end at `ray`, coordinates in the other patch, and their weights, 1 in all.
    fn ray(&self, y: usize, ray: [f64; 2], add: &mut dyn FnMut(&Point, f64)) {
        let (by, bx) = (self.row_forces, self.column_forces);
        let origin = by.position(y);
        let whole = by.patch.axes.to_global(&Point::new(ray[0], ray[1], 0.0));
        let fine = |part: [f64; 2]| {
            let middle = origin + whole * (0.5 * (part[0] + part[1]));
            whole.norm() * (part[1] - part[0]) <= MAX_LENGTH_TO_DISTANCE * bx.distance(&middle)
        };
        halved([0.0, 1.0], MAX_BISECTIONS, &fine, &mut |part| {
            for &(s, weight) in self.line {
                let share = part[1] - part[0];
                let at = bx.patch.local(&(origin + whole * (part[0] + share * s)));
                add(&at, share * weight);
            }
        });
    }
}

/// Calls `take` with parts of a range that are `fine`.
fn halved(part: [f64; 2], halvings: usize, fine: &dyn Fn([f64; 2]) -> bool, take: &mut dyn FnMut([f64; 2])) {
    if halvings == 0 || fine(part) {
        return take(part);
    }
    let middle = 0.5 * (part[0] + part[1]);
    halved([part[0], middle], halvings - 1, fine, take);
    halved([middle, part[1]], halvings - 1, fine, take);
}
