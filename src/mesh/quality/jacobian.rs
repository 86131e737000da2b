//! Jacobians of solids at nodes and integration points, in their curved geometry.

use crate::element::ElementKind;
use crate::error::{Error, Result};
use crate::mesh::{CellBlock, Mesh};
use crate::quadrature::{hexahedron, pyramid, tetrahedron, wedge};

/// Scaled Jacobian up to which an element counts as collapsed.
const MIN_SCALED_JACOBIAN: f64 = 1e-8;
const MAX_NAMED_ELEMENTS: usize = 10;

/// Corners of a solid, each with its three neighbouring corners in right-handed order. The tip of a pyramid has four
/// edges and is omitted.
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

struct JacobianPoint {
    /// Derivatives of the shape functions along three directions, `[n_nodes]`: the edges at a corner, the reference coordinates
    /// elsewhere.
    slopes: Vec<[f64; 3]>,
    /// Determinant of the three directions.
    directions: f64,
    /// Weight in an integral over the cell; 0 at nodes.
    weight: f64,
}

impl JacobianPoint {
    fn new(kind: ElementKind, xi: [f64; 3], directions: [[f64; 3]; 3], weight: f64) -> Self {
        let along = |g: [f64; 3], d: [f64; 3]| g[0] * d[0] + g[1] * d[1] + g[2] * d[2];
        let slopes = kind.shape_gradients(xi).into_iter().map(|g| directions.map(|d| along(g, d))).collect();
        Self { slopes, directions: determinant(directions), weight }
    }

    fn jacobian(&self, points: &[[f64; 3]], nodes: &[usize]) -> Jacobian {
        let mut tangents = [[0.0; 3]; 3];
        for (&node, slopes) in nodes.iter().zip(&self.slopes) {
            for (tangent, slope) in tangents.iter_mut().zip(slopes) {
                (0..3).for_each(|k| tangent[k] += slope * points[node][k]);
            }
        }
        let spanned = determinant(tangents);
        let lengths: f64 = tangents.iter().map(|t| t.iter().map(|x| x * x).sum::<f64>().sqrt()).product();
        let scaled = if lengths > 0.0 { spanned / lengths } else { ZERO_LENGTH_EDGE };
        Jacobian { value: spanned / self.directions, scaled }
    }
}

/// Scaled Jacobian of an element with an edge of zero length.
const ZERO_LENGTH_EDGE: f64 = f64::NEG_INFINITY;

/// Jacobian determinant, and the determinant of the mapped directions divided by the product of their lengths.
#[derive(Clone, Copy)]
struct Jacobian {
    value: f64,
    scaled: f64,
}

impl Jacobian {
    const NONE: Self = Self { value: f64::INFINITY, scaled: f64::INFINITY };

    /// The Jacobian with the smaller scaled value. NaN counts as the smallest value.
    fn or_less(self, other: Self) -> Self {
        if other.scaled < self.scaled || other.scaled.is_nan() { other } else { self }
    }
}

fn determinant([a, b, c]: [[f64; 3]; 3]) -> f64 {
    a[0] * (b[1] * c[2] - b[2] * c[1])
        + a[1] * (b[2] * c[0] - b[0] * c[2])
        + a[2] * (b[0] * c[1] - b[1] * c[0])
}

/// Points at which the Jacobian is evaluated: the points of the stiffness rule, which integrates the Jacobian exactly,
/// and the nodes. The tip of a pyramid is omitted, because the map has no derivative there.
fn jacobian_points(kind: ElementKind) -> Vec<JacobianPoint> {
    const AXES: [[f64; 3]; 3] = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
    let rule = match (kind.n_corners(), kind.n_nodes() > kind.n_corners()) {
        (4, false) => tetrahedron(1),
        (4, true) => tetrahedron(3),
        (5, false) => pyramid(2),
        (5, true) => pyramid(3),
        (6, false) => wedge(2, 2),
        (6, true) => wedge(4, 3),
        (_, false) => hexahedron(2),
        (_, true) => hexahedron(3),
    };
    let nodes = kind.reference_nodes();
    let inside = rule.into_iter().map(|(xi, weight)| JacobianPoint::new(kind, xi, AXES, weight));
    let corners = corner_frames(kind).iter().map(|&[at, a, b, c]| {
        let edge = |to: usize| std::array::from_fn(|k| nodes[to][k] - nodes[at][k]);
        JacobianPoint::new(kind, nodes[at], [edge(a), edge(b), edge(c)], 0.0)
    });
    let others = nodes[kind.n_corners()..].iter().map(|&xi| JacobianPoint::new(kind, xi, AXES, 0.0));
    inside.chain(corners).chain(others).collect()
}

struct ElementJacobians {
    kind: ElementKind,
    tag: u64,
    /// Smallest Jacobian at the integration points.
    inside: Jacobian,
    /// Smallest Jacobian at the nodes.
    nodal: Jacobian,
}

impl ElementJacobians {
    fn new(mesh: &Mesh, block: &CellBlock, cell: usize, samples: &[JacobianPoint]) -> (Self, f64) {
        let nodes = block.cell_nodes(cell);
        let (mut inside, mut nodal, mut volume) = (Jacobian::NONE, Jacobian::NONE, 0.0);
        for sample in samples {
            let found = sample.jacobian(&mesh.points, nodes);
            let least = if sample.weight == 0.0 { &mut nodal } else { &mut inside };
            *least = least.or_less(found);
            volume += sample.weight * found.value;
        }
        (Self { kind: block.kind, tag: block.tags[cell], inside, nodal }, volume)
    }

    /// Whether the stiffness can be computed, and no edge has zero length.
    fn is_sound(&self) -> bool {
        self.inside.scaled > MIN_SCALED_JACOBIAN && self.nodal.scaled > ZERO_LENGTH_EDGE
    }

    fn least(&self) -> Jacobian {
        self.inside.or_less(self.nodal)
    }
}

pub(super) struct JacobianSummary {
    /// Smallest scaled Jacobian, and the number of its element in the mesh file.
    pub least: (f64, u64),
    /// Number of solids whose Jacobian is positive at all integration points, but negative or almost zero at a node.
    pub folded_at_nodes: usize,
    pub volume: f64,
}

/// Refuses inverted, folded and collapsed solids.
///
/// A positive Jacobian at the integration points suffices for a valid stiffness and for patch tests. Nodes are checked too, for a
/// warning and for edges of zero length.
pub(super) fn check_jacobians(mesh: &Mesh) -> Result<JacobianSummary> {
    let mut all = JacobianSummary { least: (f64::INFINITY, 0), folded_at_nodes: 0, volume: 0.0 };
    let mut bad = Vec::new();
    for block in mesh.blocks.iter().filter(|block| block.kind.dim() == 3) {
        let samples = jacobian_points(block.kind);
        for cell in 0..block.n_cells() {
            let (found, volume) = ElementJacobians::new(mesh, block, cell, &samples);
            all.volume += volume;
            let least = found.least().scaled;
            if least < all.least.0 {
                all.least = (least, found.tag);
            }
            if !found.is_sound() {
                bad.push(found);
            } else if found.nodal.scaled <= MIN_SCALED_JACOBIAN {
                all.folded_at_nodes += 1;
            }
        }
    }
    if bad.is_empty() { Ok(all) } else { Err(bad_elements_error(mesh, &bad)) }
}

fn bad_elements_error(mesh: &Mesh, bad: &[ElementJacobians]) -> Error {
    let named: Vec<String> = bad
        .iter()
        .take(MAX_NAMED_ELEMENTS)
        .map(|least| format!("{} {}", least.kind.name(), least.tag))
        .collect();
    let worst = bad
        .iter()
        .reduce(|a, b| if b.inside.scaled < a.inside.scaled || b.inside.scaled.is_nan() { b } else { a })
        .expect("at least one");
    let turned = bad.iter().filter(|least| least.inside.value < 0.0).count();
    let worst = match worst.inside {
        // All integration points are sound; only edges have zero length.
        inside if inside.scaled > MIN_SCALED_JACOBIAN => {
            format!("an edge of element {} has zero length", worst.tag)
        }
        Jacobian { value, scaled } => {
            let share = if scaled.is_finite() {
                format!(" ({scaled:.3e} relative to its edge lengths)")
            } else {
                String::new()
            };
            format!("the worst is {value:.3e}{share}, of element {}", worst.tag)
        }
    };
    let states = [(turned, "inverted or folded"), (bad.len() - turned, "collapsed")];
    let states: Vec<String> =
        states.iter().filter(|(n, _)| *n > 0).map(|(n, what)| format!("{n} {what}")).collect();
    Error::input(format!(
        "{} of {} solid elements of {} have no positive Jacobian ({}): {}{}; {worst}. Fix the mesh (inverted: reverse the node order, in gmsh `ReverseMesh`; folded or collapsed: move or refine nodes; curved: straighten or refine, in gmsh `Mesh.HighOrderOptimize = 2`)",
        bad.len(),
        mesh.volume_cells().count(),
        mesh.source,
        states.join(", "),
        named.join(", "),
        if bad.len() > MAX_NAMED_ELEMENTS { ", .." } else { "" },
    ))
}
