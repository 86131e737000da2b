//! Jacobians of solids at their corners and Gauss points.

use super::corners;
use crate::element::ElementKind;
use crate::error::{Error, Result};
use crate::geometry::Point;
use crate::mesh::{CellRef, Mesh};

/// The least Jacobian at a corner, as a share of the product of the three edge lengths there, that is not
/// taken for a collapsed element.
const COLLAPSED: f64 = 1e-8;

/// For corner by corner of a solid: the corner and its three neighbours, right-handed seen from it. The
/// apex of a pyramid has four edges and is left out.
fn corner_frames(kind: ElementKind) -> &'static [[usize; 4]] {
    match (kind.dim(), kind.n_corners()) {
        (3, 4) => &[[0, 1, 2, 3], [1, 2, 0, 3], [2, 0, 1, 3], [3, 0, 2, 1]],
        (3, 8) => &[
            [0, 1, 3, 4],
            [1, 2, 0, 5],
            [2, 3, 1, 6],
            [3, 0, 2, 7],
            [4, 7, 5, 0],
            [5, 4, 6, 1],
            [6, 5, 7, 2],
            [7, 6, 4, 3],
        ],
        (3, 6) => &[[0, 1, 2, 3], [1, 2, 0, 4], [2, 0, 1, 5], [3, 5, 4, 0], [4, 3, 5, 1], [5, 4, 3, 2]],
        (3, 5) => &[[0, 1, 3, 4], [1, 2, 0, 4], [2, 3, 1, 4], [3, 0, 2, 4]],
        _ => &[],
    }
}

/// Least Jacobian over the corners of a cell: as it is (of the three edges), and by the product of their lengths.
fn corner_jacobian(mesh: &Mesh, cell: CellRef) -> (f64, f64) {
    let x = corners(mesh, cell);
    let mut least = (f64::INFINITY, f64::INFINITY);
    for &[at, a, b, c] in corner_frames(mesh.kind(cell)) {
        let (u, v, w) = (x[a] - x[at], x[b] - x[at], x[c] - x[at]);
        let jacobian = u.dot(&v.cross(&w));
        let lengths = u.norm() * v.norm() * w.norm();
        let scaled = if lengths > 0.0 { jacobian / lengths } else { 0.0 };
        if scaled < least.1 {
            least = (jacobian, scaled);
        }
    }
    least
}

/// Refuses inverted and collapsed solids; the least scaled Jacobian and its element.
///
/// At the corners of hex8 and tet4 these are the Jacobians of the element's own map; a hexahedron is tested at
/// its Gauss points besides. Curved elements are tested as if their edges were straight.
pub(super) fn check_jacobians(mesh: &Mesh) -> Result<(f64, u64)> {
    let mut least = (f64::INFINITY, 0);
    let mut bad = 0_usize;
    let mut first_bad = None;
    for cell in mesh.volume_cells() {
        let (jacobian, scaled) = corner_jacobian(mesh, cell);
        let inside =
            if mesh.kind(cell).n_corners() == 8 { least_gauss_jacobian(mesh, cell) } else { jacobian };
        if scaled < least.0 {
            least = (scaled, mesh.tag(cell));
        }
        // Written so that a Jacobian that is not a number counts as bad.
        let fit = scaled > COLLAPSED && inside > 0.0;
        if !fit {
            bad += 1;
            first_bad.get_or_insert((cell, jacobian.min(inside), scaled));
        }
    }
    match first_bad {
        None => Ok(least),
        Some((cell, jacobian, scaled)) => Err(Error::input(format!(
            "{} {} of {} is {}: its least Jacobian is {jacobian:.3e} ({scaled:.3e} of its edge lengths), it must be \
             positive; {bad} elements are so. Mend the mesh (turned solids: reverse the node order, in gmsh \
             `ReverseMesh`; folded ones: move or refine nodes)",
            mesh.kind(cell).name(),
            mesh.tag(cell),
            mesh.source,
            if jacobian < 0.0 { "turned inside out or folded" } else { "collapsed" },
        ))),
    }
}

/// Least Jacobian of a trilinear hexahedron over the eight Gauss points, in the scale of the edges' product.
fn least_gauss_jacobian(mesh: &Mesh, cell: CellRef) -> f64 {
    let x = corners(mesh, cell);
    let g = 0.5 - 0.5 / 3.0_f64.sqrt();
    let mut least = f64::INFINITY;
    for point in 0..8 {
        let [r, s, t] = [1, 2, 4].map(|bit| if point & bit == 0 { g } else { 1.0 - g });
        let mix = |a: Point, b: Point, w: f64| a * (1.0 - w) + b * w;
        let along = |p: [usize; 8], w: f64, v: f64| {
            let edge = |i: usize| x[p[2 * i + 1]] - x[p[2 * i]];
            mix(mix(edge(0), edge(1), w), mix(edge(2), edge(3), w), v)
        };
        let dr = along([0, 1, 3, 2, 4, 5, 7, 6], s, t);
        let ds = along([0, 3, 1, 2, 4, 7, 5, 6], r, t);
        let dt = along([0, 4, 1, 5, 3, 7, 2, 6], r, s);
        least = least.min(dr.dot(&ds.cross(&dt)));
    }
    least
}
