//! Is a mesh of solids fit for analysis: Jacobians, shared faces, connected parts, unmerged nodes; its size and shape.

use std::fmt;

use super::faces::face_of_three_solids;
use super::{CellRef, Mesh};
use crate::element::ElementKind;
use crate::error::{Error, Result};
use crate::geometry::Point;

/// The least Jacobian at a corner, as a share of the product of the three edge lengths there, that is not
/// taken for a collapsed element.
const COLLAPSED: f64 = 1e-8;

/// Points closer than this share of the diagonal of the bounding box count as unmerged.
const UNMERGED: f64 = 1e-9;

/// What [`check`] found out of a mesh that is fit for analysis.
#[derive(Debug, Clone, PartialEq)]
pub struct Quality {
    /// Number of points.
    pub n_points: usize,
    /// Number of solid cells of each kind.
    pub solids: Vec<(ElementKind, usize)>,
    /// Volume of the solids, edges taken as straight, cubic length unit.
    pub volume: f64,
    /// Least Jacobian at a corner by the product of the three edge lengths there: 1 for a box; and its element.
    pub least_jacobian: (f64, u64),
    /// Largest ratio of the longest to the shortest edge of a solid, and its element.
    pub largest_aspect: (f64, u64),
    /// Mean of those ratios.
    pub mean_aspect: f64,
    /// Number of solids in each connected part (joined by nodes), and the least-numbered element of each,
    /// the largest part first.
    pub parts: Vec<(usize, u64)>,
    /// Number of points that lie where another point lies already.
    pub coincident_points: usize,
}

impl Quality {
    /// Refuses a mesh of several parts, which no support can hold together.
    ///
    /// # Errors
    /// If there is more than one connected part; names their sizes and an element of each.
    pub fn require_connected(&self, source: &str) -> Result<()> {
        if self.parts.len() <= 1 {
            return Ok(());
        }
        let listed: Vec<String> =
            self.parts.iter().take(5).map(|(n, tag)| format!("{n} with element {tag}")).collect();
        let hint = match self.coincident_points {
            0 => String::new(),
            n => {
                format!("; {n} nodes lie where another lies already, merge them (in gmsh: `Coherence Mesh`)")
            }
        };
        Err(Error::input(format!(
            "the solids of {source} fall into {} parts that share no node ({} elements{}){hint}; one connected body \
             is expected",
            self.parts.len(),
            listed.join(", "),
            if self.parts.len() > 5 { ", .." } else { "" },
        )))
    }

    /// What deserves a warning.
    pub fn warnings(&self) -> Vec<String> {
        match self.coincident_points {
            0 => Vec::new(),
            n => vec![format!(
                "{n} nodes lie where another node lies already: the elements there are not joined; merge the nodes \
                 unless a crack is meant (in gmsh: `Coherence Mesh`)"
            )],
        }
    }
}

impl fmt::Display for Quality {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let solids: Vec<String> =
            self.solids.iter().map(|(kind, n)| format!("{n} {}", kind.name())).collect();
        write!(
            f,
            "{} nodes, {}, volume {:.6e}, aspect ratio {:.1} on average and {:.1} at most (element {}), least scaled \
             Jacobian {:.3} (element {})",
            self.n_points,
            solids.join(" + "),
            self.volume,
            self.mean_aspect,
            self.largest_aspect.0,
            self.largest_aspect.1,
            self.least_jacobian.0,
            self.least_jacobian.1
        )
    }
}

/// Checks the solids of a mesh and measures them.
///
/// # Errors
/// If there are no solids; if an element is turned inside out or collapsed (its number and least Jacobian are
/// named); if three solids share a face. Several parts are not an error here: [`Quality::require_connected`].
pub fn check(mesh: &Mesh) -> Result<Quality> {
    if mesh.volume_cells().next().is_none() {
        return Err(Error::input(format!(
            "{} has no solid elements; mesh the volume (`gmsh -3`) and put it into a physical group so that it is saved",
            mesh.source
        )));
    }
    let least_jacobian = check_jacobians(mesh)?;
    if let Some([a, b, c]) = face_of_three_solids(mesh) {
        return Err(Error::input(format!(
            "the elements {}, {} and {} of {} share one face; solids may overlap nowhere",
            mesh.tag(a),
            mesh.tag(b),
            mesh.tag(c),
            mesh.source
        )));
    }
    let (mean_aspect, largest_aspect) = aspect_ratios(mesh);
    let solids = mesh.blocks.iter().filter(|b| b.kind.dim() == 3).map(|b| (b.kind, b.n_cells())).collect();
    Ok(Quality {
        n_points: mesh.n_points(),
        solids,
        volume: mesh.volume_cells().map(|cell| cell_volume(mesh, cell)).sum(),
        least_jacobian,
        largest_aspect,
        mean_aspect,
        parts: connected_parts(mesh),
        coincident_points: coincident_points(&mesh.points),
    })
}

/// Corners of a solid, straight edges between them.
fn corners(mesh: &Mesh, cell: CellRef) -> Vec<Point> {
    let n = mesh.kind(cell).n_corners();
    mesh.cell_nodes(cell)[..n].iter().map(|&node| Point::from(mesh.points[node])).collect()
}

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
fn check_jacobians(mesh: &Mesh) -> Result<(f64, u64)> {
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

/// Volume of a solid with straight edges, V = 1/3 ∮ x·n dS, exact for bilinear faces.
fn cell_volume(mesh: &Mesh, cell: CellRef) -> f64 {
    let x = corners(mesh, cell);
    let origin = x[0];
    let face = |(kind, local): &(ElementKind, &[usize])| {
        let p: Vec<Point> = local[..kind.n_corners()].iter().map(|&i| x[i] - origin).collect();
        if p.len() == 3 { p[0].dot(&p[1].cross(&p[2])) / 6.0 } else { quad_volume(&p) }
    };
    mesh.kind(cell).local_faces().iter().map(face).sum()
}

/// 1/3 ∫ x·n dS over a bilinear quadrilateral by 2 x 2 Gauss points, which integrate it exactly.
fn quad_volume(p: &[Point]) -> f64 {
    let g = 0.5 - 0.5 / 3.0_f64.sqrt();
    let mut sum = 0.0;
    for (s, t) in [(g, g), (1.0 - g, g), (g, 1.0 - g), (1.0 - g, 1.0 - g)] {
        let x = (p[0] * (1.0 - s) + p[1] * s) * (1.0 - t) + (p[3] * (1.0 - s) + p[2] * s) * t;
        let xs = (p[1] - p[0]) * (1.0 - t) + (p[2] - p[3]) * t;
        let xt = (p[3] - p[0]) * (1.0 - s) + (p[2] - p[1]) * s;
        sum += x.dot(&xs.cross(&xt));
    }
    sum / 12.0
}

/// Mean and largest ratio of longest to shortest edge over the solids.
fn aspect_ratios(mesh: &Mesh) -> (f64, (f64, u64)) {
    let mut largest = (0.0, 0);
    let (mut sum, mut n) = (0.0, 0.0);
    for cell in mesh.volume_cells() {
        let x = corners(mesh, cell);
        let (mut short, mut long) = (f64::INFINITY, 0.0_f64);
        for (kind, local) in mesh.kind(cell).local_faces() {
            let m = kind.n_corners();
            for i in 0..m {
                let length = (x[local[i]] - x[local[(i + 1) % m]]).norm();
                (short, long) = (short.min(length), long.max(length));
            }
        }
        let aspect = long / short;
        if aspect > largest.0 {
            largest = (aspect, mesh.tag(cell));
        }
        sum += aspect;
        n += 1.0;
    }
    (sum / n, largest)
}

/// Connected parts: number of solids and least element number of each, the largest first.
fn connected_parts(mesh: &Mesh) -> Vec<(usize, u64)> {
    let mut parent: Vec<usize> = (0..mesh.n_points()).collect();
    fn find(parent: &mut [usize], mut i: usize) -> usize {
        while parent[i] != i {
            parent[i] = parent[parent[i]];
            i = parent[i];
        }
        i
    }
    for cell in mesh.volume_cells() {
        let nodes = mesh.cell_nodes(cell);
        for &node in &nodes[1..] {
            let (a, b) = (find(&mut parent, nodes[0]), find(&mut parent, node));
            parent[a.max(b)] = a.min(b);
        }
    }
    let mut parts = std::collections::BTreeMap::new();
    for cell in mesh.volume_cells() {
        let root = find(&mut parent, mesh.cell_nodes(cell)[0]);
        let part = parts.entry(root).or_insert((0, u64::MAX));
        *part = (part.0 + 1, part.1.min(mesh.tag(cell)));
    }
    let mut parts: Vec<(usize, u64)> = parts.into_values().collect();
    parts.sort_by_key(|&(n, tag)| (std::cmp::Reverse(n), tag));
    parts
}

/// Number of points that lie within [`UNMERGED`] diagonals of an earlier one.
fn coincident_points(points: &[[f64; 3]]) -> usize {
    let bounds = |k: usize| {
        let range =
            points.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |r, x| (r.0.min(x[k]), r.1.max(x[k])));
        (range.0, range.1 - range.0)
    };
    let box_: [(f64, f64); 3] = std::array::from_fn(bounds);
    let tolerance = UNMERGED * box_.iter().map(|(_, l)| l * l).sum::<f64>().sqrt();
    if tolerance <= 0.0 {
        return points.len().saturating_sub(1);
    }
    // Boxes far larger than the tolerance, so that a point near no wall of its box looks into that box alone;
    // their origin is off the round numbers that coordinates like.
    let width = 1000.0 * tolerance;
    let slot = |x: [f64; 3], side: [f64; 3]| -> [i64; 3] {
        std::array::from_fn(|k| ((x[k] - box_[k].0 + side[k] * tolerance) / width + 0.414_213).floor() as i64)
    };
    let mut last_in_slot = std::collections::HashMap::<[i64; 3], usize>::with_capacity(points.len());
    let mut previous = vec![usize::MAX; points.len()];
    let mut count = 0;
    for (i, &x) in points.iter().enumerate() {
        let (low, high) = (slot(x, [-1.0; 3]), slot(x, [1.0; 3]));
        let close = |j: usize| (0..3).all(|k| (points[j][k] - x[k]).abs() <= tolerance);
        let mut found = false;
        for corner in 0..8 {
            let at: [i64; 3] = std::array::from_fn(|k| if corner >> k & 1 == 0 { low[k] } else { high[k] });
            let mut j = last_in_slot.get(&at).copied().unwrap_or(usize::MAX);
            while j != usize::MAX && !found {
                found = close(j);
                j = previous[j];
            }
            if low == high || found {
                break;
            }
        }
        if found {
            count += 1;
        } else {
            previous[i] = last_in_slot.insert(slot(x, [0.0; 3]), i).unwrap_or(usize::MAX);
        }
    }
    count
}
