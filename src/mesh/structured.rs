//! The built-in mesher: graded blocks of hexahedra or tetrahedra with a patch of small cells at the contact.

use super::{CellBlock, CellRef, Mesh, PhysicalGroup};
use crate::element::ElementKind;
use crate::error::{Error, Result};
use crate::geometry::Side;

/// Which solids a block is made of.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum BlockElements {
    /// Hexahedra of 8 nodes.
    Hex8,
    /// Six tetrahedra of 4 nodes in the place of each hexahedron, faces matching.
    Tet4,
}

/// A block with its contact face in z = 0, centred on the origin: uniform cells in a central patch of that face,
/// cells growing geometrically from it outward and into the depth.
///
/// Groups: surfaces "contact" (the patch), "top" or for an upper body "bottom" (the rest of the contact plane),
/// "sides", "base" (the face opposite to the contact); volume "block".
#[derive(Debug, Clone, PartialEq)]
pub struct GradedBlock {
    /// Half the edges along x and y.
    pub half_width: [f64; 2],
    /// Extent along z.
    pub depth: f64,
    /// Half the edges of the patch along x and y; equal to `half_width` where `outer_cells` is 0.
    pub patch_half_width: [f64; 2],
    /// Cells of the patch along x and y.
    pub patch_cells: [usize; 2],
    /// Cells from the patch to each side.
    pub outer_cells: usize,
    /// Cells along z.
    pub depth_cells: usize,
    /// Height of the cells at the contact face; `None` for equal cells.
    pub first_depth: Option<f64>,
    /// Kind of its solids.
    pub solids: BlockElements,
    /// Lower or upper body.
    pub side: Side,
    /// Interior nodes are moved smoothly by up to about this share of the edges (at most 0.1); 0 for a grid.
    pub distortion: f64,
}

impl GradedBlock {
    /// A lower block of equal hexahedra whose whole top face is the patch; `cells` along x, y, z.
    pub fn uniform(half_width: [f64; 2], depth: f64, cells: [usize; 3]) -> Self {
        Self {
            half_width,
            depth,
            patch_half_width: half_width,
            patch_cells: [cells[0], cells[1]],
            outer_cells: 0,
            depth_cells: cells[2],
            first_depth: None,
            solids: BlockElements::Hex8,
            side: Side::Lower,
            distortion: 0.0,
        }
    }

    /// The mesh.
    ///
    /// # Errors
    /// If a length is not positive and finite, a number of cells is 0 or too large, the patch does not fit, or
    /// the distortion is not between 0 and 0.1.
    pub fn mesh(&self) -> Result<Mesh> {
        self.validate()?;
        let grid = self.grid();
        let mut points = grid.points();
        if self.distortion > 0.0 {
            points.iter_mut().for_each(|x| self.distort(x));
        }
        let mut mesh = Mesh { source: "structured".to_string(), points, ..Mesh::default() };
        let (surface, solid) = match self.solids {
            BlockElements::Hex8 => (ElementKind::Quad4, ElementKind::Hex8),
            BlockElements::Tet4 => (ElementKind::Tri3, ElementKind::Tet4),
        };
        mesh.blocks = [surface, solid].map(|kind| CellBlock { kind, nodes: vec![], tags: vec![] }).to_vec();
        self.add_faces(&grid, &mut mesh);
        self.add_solids(&grid, &mut mesh);
        Ok(mesh)
    }

    fn validate(&self) -> Result<()> {
        let fail = |what: String| Err(Error::input(format!("structured block: {what}")));
        let lengths = [
            self.half_width[0],
            self.half_width[1],
            self.depth,
            self.patch_half_width[0],
            self.patch_half_width[1],
        ];
        if let Some(bad) = lengths.iter().chain(&self.first_depth).find(|l| !(l.is_finite() && **l > 0.0)) {
            return fail(format!("the length {bad} must be positive and finite"));
        }
        if self.patch_cells.contains(&0) || self.depth_cells == 0 {
            return fail("the numbers of cells must be at least 1".to_string());
        }
        let across =
            self.patch_cells.iter().max().unwrap_or(&0).saturating_add(2 * self.outer_cells.min(1 << 20));
        if across > 1 << 20
            || self.depth_cells > 1 << 20
            || (across as u128).pow(2) * self.depth_cells as u128 > 1 << 32
        {
            return fail("more than 2^32 cells".to_string());
        }
        for k in 0..2 {
            let (patch, all) = (self.patch_half_width[k], self.half_width[k]);
            let fits = if self.outer_cells == 0 { patch == all } else { patch < all };
            if !fits {
                return fail(format!(
                    "the patch's half-width {patch} must be smaller than the block's {all}, or equal with no outer cells"
                ));
            }
        }
        if self.first_depth.is_some_and(|first| first >= self.depth && self.depth_cells > 1) {
            return fail(format!("the first cell's height must be smaller than the depth {}", self.depth));
        }
        if !(0.0..=0.1).contains(&self.distortion) {
            return fail(format!("the distortion {} must lie between 0 and 0.1", self.distortion));
        }
        Ok(())
    }

    fn grid(&self) -> Grid {
        let depths = match self.first_depth {
            Some(first) => progression(first, self.depth_cells, self.depth),
            None => (1..=self.depth_cells).map(|i| self.depth * i as f64 / self.depth_cells as f64).collect(),
        };
        let upward = std::iter::once(0.0).chain(depths);
        let z = match self.side {
            Side::Upper => upward.collect(),
            Side::Lower => upward.map(|z| 0.0 - z).collect::<Vec<_>>().into_iter().rev().collect(),
        };
        Grid { axes: [self.across(0), self.across(1), z] }
    }

    /// Coordinates of the grid along x or y, symmetric to the last bit.
    fn across(&self, k: usize) -> Vec<f64> {
        let (patch, cells) = (self.patch_half_width[k], self.patch_cells[k]);
        let width = 2.0 * patch / cells as f64;
        // As if the patch's last cell began the progression.
        let ends = progression(width, self.outer_cells + 1, self.half_width[k] - patch + width);
        let outward: Vec<f64> = ends[1..].iter().map(|end| patch - width + end).collect();
        let outer = |sign: f64| outward.iter().map(move |x| sign * x);
        let inner = (0..=cells).map(|i| patch * (2.0 * i as f64 - cells as f64) / cells as f64);
        outer(-1.0).rev().chain(inner).chain(outer(1.0)).collect()
    }

    /// Moves a point by a smooth field that vanishes on all faces of the block.
    fn distort(&self, x: &mut [f64; 3]) {
        let base = if self.side == Side::Lower { self.depth } else { 0.0 };
        let [r, s, t] = [
            (x[0] + self.half_width[0]) / (2.0 * self.half_width[0]),
            (x[1] + self.half_width[1]) / (2.0 * self.half_width[1]),
            (x[2] + base) / self.depth,
        ];
        let bubble = 64.0 * self.distortion * r * (1.0 - r) * s * (1.0 - s) * t * (1.0 - t);
        x[0] += bubble * 2.0 * self.half_width[0] * (0.9 - 0.5 * s);
        x[1] += bubble * 2.0 * self.half_width[1] * (0.6 * t - 0.7);
        x[2] += bubble * self.depth * (0.5 + 0.4 * r);
    }

    fn add_faces(&self, grid: &Grid, mesh: &mut Mesh) {
        let [nx, ny, nz] = grid.n_cells();
        let (contact, rest, far) = match self.side {
            Side::Lower => (nz, "top", 0),
            Side::Upper => (0, "bottom", nz),
        };
        let in_patch = |i: usize, j: usize| {
            let inner =
                |i: usize, k: usize| (self.outer_cells..self.outer_cells + self.patch_cells[k]).contains(&i);
            inner(i, 0) && inner(j, 1)
        };
        let top = || (0..ny).flat_map(move |j| (0..nx).map(move |i| (i, j)));
        let mut groups = vec![];
        for (name, tag, wanted) in [("contact", 1, true), (rest, 2, false)] {
            let quads = top().filter(|&(i, j)| in_patch(i, j) == wanted);
            groups.push((name, tag, quads.map(|(i, j)| grid.face(2, contact, i, j)).collect::<Vec<_>>()));
        }
        let mut sides = vec![];
        for k in 0..nz {
            sides.extend((0..nx).flat_map(|i| [grid.face(1, 0, i, k), grid.face(1, ny, i, k)]));
            sides.extend((0..ny).flat_map(|j| [grid.face(0, 0, j, k), grid.face(0, nx, j, k)]));
        }
        groups.push(("sides", 3, sides));
        groups.push(("base", 4, top().map(|(i, j)| grid.face(2, far, i, j)).collect()));
        for (name, tag, quads) in groups {
            let first = mesh.blocks[0].n_cells();
            for quad in quads {
                self.add_quad(quad, &mut mesh.blocks[0]);
            }
            let cells = (first..mesh.blocks[0].n_cells()).map(|cell| CellRef { block: 0, cell }).collect();
            mesh.groups.push(PhysicalGroup { name: name.to_string(), dim: 2, tag, cells });
        }
    }

    /// A quadrilateral (first node at the least corner, outward), or the two triangles that the tetrahedra have there.
    fn add_quad(&self, [a, b, c, d]: [usize; 4], block: &mut CellBlock) {
        match self.solids {
            BlockElements::Hex8 => block.nodes.extend([a, b, c, d]),
            BlockElements::Tet4 => block.nodes.extend([a, b, c, a, c, d]),
        }
        let n = block.nodes.len() / block.kind.n_nodes();
        block.tags.extend(block.tags.len() as u64 + 1..=n as u64);
    }

    fn add_solids(&self, grid: &Grid, mesh: &mut Mesh) {
        let [nx, ny, nz] = grid.n_cells();
        let first_tag = mesh.blocks[0].tags.len() as u64 + 1;
        let block = &mut mesh.blocks[1];
        for k in 0..nz {
            for j in 0..ny {
                for i in 0..nx {
                    let corner = |di: usize, dj: usize, dk: usize| grid.node(i + di, j + dj, k + dk);
                    match self.solids {
                        BlockElements::Hex8 => block.nodes.extend(
                            [(0, 0), (1, 0), (1, 1), (0, 1)].iter().map(|&(di, dj)| corner(di, dj, 0)).chain(
                                [(0, 0), (1, 0), (1, 1), (0, 1)].iter().map(|&(di, dj)| corner(di, dj, 1)),
                            ),
                        ),
                        BlockElements::Tet4 => KUHN.iter().flatten().for_each(|&[di, dj, dk]| {
                            block.nodes.push(corner(di, dj, dk));
                        }),
                    }
                }
            }
        }
        let n = block.nodes.len() / block.kind.n_nodes();
        block.tags = (first_tag..first_tag + n as u64).collect();
        let cells = (0..n).map(|cell| CellRef { block: 1, cell }).collect();
        mesh.groups.push(PhysicalGroup { name: "block".to_string(), dim: 3, tag: 5, cells });
    }
}

/// The six tetrahedra of a cube about its diagonal 000-111, all of positive volume (Kuhn's triangulation:
/// neighbouring cubes cut their common face along the same diagonal).
const KUHN: [[[usize; 3]; 4]; 6] = [
    [[0, 0, 0], [1, 0, 0], [1, 1, 0], [1, 1, 1]],
    [[0, 0, 0], [0, 1, 0], [0, 1, 1], [1, 1, 1]],
    [[0, 0, 0], [0, 0, 1], [1, 0, 1], [1, 1, 1]],
    [[0, 0, 0], [1, 1, 0], [0, 1, 0], [1, 1, 1]],
    [[0, 0, 0], [0, 1, 1], [0, 0, 1], [1, 1, 1]],
    [[0, 0, 0], [1, 0, 1], [1, 0, 0], [1, 1, 1]],
];

/// A tensor-product grid.
struct Grid {
    axes: [Vec<f64>; 3],
}

impl Grid {
    fn n_cells(&self) -> [usize; 3] {
        [0, 1, 2].map(|k| self.axes[k].len() - 1)
    }

    fn node(&self, i: usize, j: usize, k: usize) -> usize {
        i + self.axes[0].len() * (j + self.axes[1].len() * k)
    }

    fn points(&self) -> Vec<[f64; 3]> {
        let [x, y, z] = &self.axes;
        z.iter().flat_map(|&z| y.iter().flat_map(move |&y| x.iter().map(move |&x| [x, y, z]))).collect()
    }

    /// Quadrilateral in the plane `at` (first or last) of `axis`, cell (p, q) in the other two axes in their
    /// order: from its least corner, normal outward.
    fn face(&self, axis: usize, at: usize, p: usize, q: usize) -> [usize; 4] {
        let corner = |dp: usize, dq: usize| match axis {
            0 => self.node(at, p + dp, q + dq),
            1 => self.node(p + dp, at, q + dq),
            _ => self.node(p + dp, q + dq, at),
        };
        // (first, second remaining axis, axis) is right-handed but for axis 1.
        let positive = (at > 0) != (axis == 1);
        if positive {
            [corner(0, 0), corner(1, 0), corner(1, 1), corner(0, 1)]
        } else {
            [corner(0, 0), corner(0, 1), corner(1, 1), corner(1, 0)]
        }
    }
}

/// Ends of `n` cells that grow geometrically from the width `first` and fill `length`, `[n]`.
fn progression(first: f64, n: usize, length: f64) -> Vec<f64> {
    if n == 1 {
        return vec![length];
    }
    let sum = |ratio: f64| (0..n).fold((0.0, first), |(s, w), _| (s + w, w * ratio)).0;
    let (mut low, mut high) = (0.0_f64, 1.0_f64);
    while sum(high) < length {
        high *= 2.0;
    }
    for _ in 0..200 {
        let middle = 0.5 * (low + high);
        if sum(middle) < length { low = middle } else { high = middle }
    }
    let ratio = 0.5 * (low + high);
    let scale = length / sum(ratio);
    let mut ends: Vec<f64> = (0..n)
        .scan((0.0, first * scale), |(end, width), _| {
            *end += *width;
            *width *= ratio;
            Some(*end)
        })
        .collect();
    ends[n - 1] = length;
    ends
}
