//! Coarse space of the two-level solver. The body is divided into many small parts, and each part has six rigid
//! motions.

use std::ops::Range;

use nalgebra::{Matrix3x6, Matrix6, SymmetricEigen};

use super::super::cholesky::{CholeskyFactor, SymbolicCholesky, SymmetricSolver};
use super::super::ordering::{NodeGraph, nested_dissection, partition};
use super::super::simd::wide;
use super::super::sparse::{SymmetricSparse, SymmetricTriplets};
use super::node_matrix::{Block3x3, LANES, Lanes, NodeMatrix, rows_of_node, rows_of_node_mut};
use crate::error::Result;

/// Eigenvalue above which an eigenvector of the Gram matrix of a part counts as an independent motion. The Gram matrix
/// contains the scalar products of the six rigid motions, scaled to unit diagonal.
///
/// A part with few nodes, or with nodes on a line, has fewer than six independent motions.
const MIN_MOTION_SHARE: f64 = 1e-6;

/// Threshold for rounding errors: a block B of A Z is omitted if max |B| is at most this factor times max |D| max |M|.
/// D is the diagonal block of A at the node of B. M are the motions of this node.
///
/// If a node and all its neighbours move as one rigid body, the force at the node is zero except for rounding.
const MIN_FORCE_SHARE: f64 = 1e-12;

/// Six motions of a part at a node, `[3, 6]` row by row.
type NodeMotions = [f64; 18];

/// Coarse space: the rigid motions Z of the parts, and the factor of Zᵀ A Z.
pub(super) struct CoarseSpace {
    /// Part of each node, `[n]`.
    part_of_node: Vec<u32>,
    /// Z: rigid motions at each node. The motions of a part are orthonormal over its nodes.
    motions: Vec<NodeMotions>,
    forces: MotionForces,
    factor: CholeskyFactor,
}

/// A Z: nodal forces that the motions of the parts cause. Each block belongs to a node and a part.
struct MotionForces {
    /// Offset of the first block of each node, `[n + 1]`.
    offsets: Vec<usize>,
    parts: Vec<u32>,
    values: Vec<NodeMotions>,
}

impl MotionForces {
    fn blocks_of_node(&self, node: usize) -> Range<usize> {
        self.offsets[node]..self.offsets[node + 1]
    }
}

impl CoarseSpace {
    /// Builds the coarse space with parts of about `nodes_per_part` nodes.
    pub fn new(matrix: &NodeMatrix, nodes_per_part: usize) -> Result<Self> {
        let graph = matrix.graph();
        // Strongly coupled nodes should share a part. The coarse space then represents relative motions of weakly
        // coupled nodes.
        let weight = |a: usize, b: usize| 1 + (1e3 * matrix.coupling_strength(a, b)) as i32;
        let part = partition(&graph, matrix.n().div_ceil(nodes_per_part), weight)?;
        let n_parts = part.iter().max().map_or(0, |&last| last + 1);
        let motions = motions(matrix, &part, n_parts);
        let forces = forces(matrix, &part, &motions);
        let coarse = coarse_matrix(&part, &motions, &forces, n_parts);
        let pairs = edges(&part, &forces);
        let graph = NodeGraph::from_edges(n_parts, &pairs);
        let order = nested_dissection(&graph, &(0..n_parts).collect::<Vec<_>>(), &[])?;
        let order: Vec<usize> = order.into_iter().flat_map(|p| 6 * p..6 * p + 6).collect();
        let factor = SymbolicCholesky::new(&coarse, &order, 0)?.factorise(&coarse, |row| {
            let nodes = part.iter().filter(|&&p| p == row / 6).count();
            format!("a part of the mesh of {nodes} nodes, moved as a rigid body")
        })?;
        let part_of_node = part.into_iter().map(|p| p as u32).collect();
        Ok(Self { part_of_node, motions, forces, factor })
    }

    pub fn n(&self) -> usize {
        self.factor.n()
    }

    /// Computes `y += Z (Zᵀ A Z)⁻¹ (Zᵀ x - (A Z)ᵀ y)`, both `[3 n]`.
    pub fn add_correction(&self, x: &[Lanes], y: &mut [Lanes], work: &mut CoarseVectors) -> Result<()> {
        restrict(self, x, y, &mut work.lanes);
        let n = self.n();
        for (row, lanes) in work.lanes.iter().enumerate() {
            (0..LANES).for_each(|l| work.columns[l * n + row] = lanes[l]);
        }
        self.factor.solve_in_place(&mut work.columns, LANES)?;
        for (row, lanes) in work.lanes.iter_mut().enumerate() {
            (0..LANES).for_each(|l| lanes[l] = work.columns[l * n + row]);
        }
        prolong(self, &work.lanes, y);
        Ok(())
    }
}

/// Coarse unknowns of [`LANES`] vectors, stored twice: row by row (`lanes`) and vector by vector (`columns`).
pub(super) struct CoarseVectors {
    lanes: Vec<Lanes>,
    columns: Vec<f64>,
}

impl CoarseVectors {
    pub fn new(space: &CoarseSpace) -> Self {
        Self { lanes: vec![[0.0; LANES]; space.n()], columns: vec![0.0; LANES * space.n()] }
    }
}

/// Computes `coarse = Zᵀ x - (A Z)ᵀ y`.
fn restrict(space: &CoarseSpace, x: &[Lanes], y: &[Lanes], coarse: &mut [Lanes]) {
    wide!(restrict_in(
        space => space: &CoarseSpace,
        x => x: &[Lanes],
        y => y: &[Lanes],
        coarse => coarse: &mut [Lanes]
    ));
}

#[inline(always)]
fn restrict_in(space: &CoarseSpace, x: &[Lanes], y: &[Lanes], coarse: &mut [Lanes]) {
    coarse.fill([0.0; LANES]);
    for node in 0..space.part_of_node.len() {
        add_motion_products(
            &space.motions[node],
            rows_of_node(x, node),
            1.0,
            rows_of_part(coarse, space.part_of_node[node]),
        );
        for k in space.forces.blocks_of_node(node) {
            add_motion_products(
                &space.forces.values[k],
                rows_of_node(y, node),
                -1.0,
                rows_of_part(coarse, space.forces.parts[k]),
            );
        }
    }
}

/// Computes `coarse += sign Mᵀ x` at a node. M are the `motions` of this node.
#[inline(always)]
fn add_motion_products(motions: &NodeMotions, x: &[Lanes; 3], sign: f64, coarse: &mut [Lanes]) {
    for (m, coarse) in coarse.iter_mut().enumerate() {
        for l in 0..LANES {
            let sum = motions[m] * x[0][l] + motions[6 + m] * x[1][l] + motions[12 + m] * x[2][l];
            coarse[l] += sign * sum;
        }
    }
}

#[inline(always)]
fn rows_of_part(coarse: &mut [Lanes], part: u32) -> &mut [Lanes] {
    &mut coarse[6 * part as usize..6 * part as usize + 6]
}

/// Computes `y += Z coarse`.
fn prolong(space: &CoarseSpace, coarse: &[Lanes], y: &mut [Lanes]) {
    for (node, &part) in space.part_of_node.iter().enumerate() {
        let coarse = &coarse[6 * part as usize..6 * part as usize + 6];
        for (c, own) in rows_of_node_mut(y, node).iter_mut().enumerate() {
            for (m, coarse) in coarse.iter().enumerate() {
                let factor = space.motions[node][6 * c + m];
                (0..LANES).for_each(|l| own[l] += factor * coarse[l]);
            }
        }
    }
}

fn motions(matrix: &NodeMatrix, part: &[usize], n_parts: usize) -> Vec<NodeMotions> {
    let (mut centre, mut count) = (vec![[0.0; 3]; n_parts], vec![0.0; n_parts]);
    for (&part, point) in part.iter().zip(&matrix.points) {
        (0..3).for_each(|c| centre[part][c] += point[c]);
        count[part] += 1.0;
    }
    let rigid: Vec<Matrix3x6<f64>> = (0..matrix.n())
        .map(|node| {
            let p = part[node];
            let [x, y, z] = std::array::from_fn(|c| matrix.points[node][c] - centre[p][c] / count[p]);
            #[rustfmt::skip]
            let mut motions = Matrix3x6::new(
                1.0, 0.0, 0.0, 0.0, z, -y,
                0.0, 1.0, 0.0, -z, 0.0, x,
                0.0, 0.0, 1.0, y, -x, 0.0,
            );
            for c in (0..3).filter(|&c| !matrix.has_component[node][c]) {
                motions.row_mut(c).fill(0.0);
            }
            motions
        })
        .collect();
    let mut gram = vec![Matrix6::zeros(); n_parts];
    for (motions, &part) in rigid.iter().zip(part) {
        gram[part] += motions.transpose() * motions;
    }
    let turn: Vec<Matrix6<f64>> = gram.into_iter().map(orthonormal).collect();
    let row_by_row = |m: Matrix3x6<f64>| std::array::from_fn(|i| m[(i / 6, i % 6)]);
    rigid.iter().zip(part).map(|(motions, &part)| row_by_row(motions * turn[part])).collect()
}

/// Transformation T that makes motions with the Gram matrix G orthonormal: Tᵀ G T = 1. Columns of dependent motions are
/// zero.
fn orthonormal(gram: Matrix6<f64>) -> Matrix6<f64> {
    // The scaling compensates for the different units of translations and rotations.
    let scale = Matrix6::from_diagonal(&gram.diagonal().map(|g| if g > 0.0 { 1.0 / g.sqrt() } else { 0.0 }));
    let eigen = SymmetricEigen::new(scale * gram * scale);
    let factor = eigen.eigenvalues.map(|v| if v > MIN_MOTION_SHARE { 1.0 / v.sqrt() } else { 0.0 });
    scale * eigen.eigenvectors * Matrix6::from_diagonal(&factor)
}

/// Computes A Z, the nodal forces of the motions of the parts.
fn forces(matrix: &NodeMatrix, part: &[usize], motions: &[NodeMotions]) -> MotionForces {
    let mut of_node: Vec<Vec<(u32, NodeMotions)>> = vec![Vec::new(); matrix.n()];
    let mut add = |node: usize, from: usize, block: Block3x3| {
        let own = &mut of_node[node];
        let at = own.iter().position(|(p, _)| *p as usize == part[from]).unwrap_or_else(|| {
            own.push((part[from] as u32, [0.0; 18]));
            own.len() - 1
        });
        for (i, value) in own[at].1.iter_mut().enumerate() {
            let (r, m) = (i / 6, i % 6);
            *value += (0..3).map(|c| block[3 * r + c] * motions[from][6 * c + m]).sum::<f64>();
        }
    };
    for i in 0..matrix.n() {
        add(i, i, matrix.diagonal[i]);
        for (j, block) in matrix.row(i) {
            add(i, j, *block);
            add(j, i, std::array::from_fn(|k| block[3 * (k % 3) + k / 3]));
        }
    }
    let mut forces = MotionForces { offsets: vec![0], parts: Vec::new(), values: Vec::new() };
    let size = |values: &[f64]| values.iter().fold(0.0f64, |most, v| most.max(v.abs()));
    for (i, mut own) in of_node.into_iter().enumerate() {
        let least = MIN_FORCE_SHARE * size(&matrix.diagonal[i]) * size(&motions[i]);
        own.retain(|(_, block)| size(block) > least);
        own.sort_unstable_by_key(|(part, _)| *part);
        forces.parts.extend(own.iter().map(|(part, _)| *part));
        forces.values.extend(own.iter().map(|(_, block)| *block));
        forces.offsets.push(forces.parts.len());
    }
    forces
}

/// Coarse matrix Zᵀ A Z. A motion that a part does not have gets a row of the identity.
fn coarse_matrix(
    part: &[usize],
    motions: &[NodeMotions],
    forces: &MotionForces,
    n_parts: usize,
) -> SymmetricSparse {
    let mut triplets = SymmetricTriplets::new(6 * n_parts);
    let mut there = vec![false; 6 * n_parts];
    for (node, own) in motions.iter().enumerate() {
        let p = part[node];
        (0..18).filter(|&i| own[i] != 0.0).for_each(|i| there[6 * p + i % 6] = true);
        for k in forces.blocks_of_node(node).filter(|&k| forces.parts[k] as usize <= p) {
            let q = forces.parts[k] as usize;
            for (a, b) in (0..36).map(|i| (i / 6, i % 6)).filter(|&(a, b)| q < p || b <= a) {
                let value = (0..3).map(|c| own[6 * c + a] * forces.values[k][6 * c + b]).sum();
                triplets.add(6 * p + a, 6 * q + b, value);
            }
        }
    }
    (0..6 * n_parts).filter(|&i| !there[i]).for_each(|i| triplets.add(i, i, 1.0));
    triplets.build()
}

/// Pairs of coupled parts. Each pair occurs once.
fn edges(part: &[usize], forces: &MotionForces) -> Vec<(usize, usize)> {
    let others = |node: usize| forces.parts[forces.blocks_of_node(node)].iter().map(|&q| q as usize);
    let pairs = part.iter().enumerate().flat_map(|(node, &p)| others(node).map(move |q| (p, q)));
    let mut pairs: Vec<(usize, usize)> = pairs.filter(|(p, q)| q < p).collect();
    pairs.sort_unstable();
    pairs.dedup();
    pairs
}
