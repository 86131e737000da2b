//! Two-level preconditioner for [`CollocationMatrix`]: dense inverses of diagonal blocks, and a coarse correction by
//! rigid motions of node groups.

use std::ops::Range;

use faer::linalg::matmul::matmul;
use faer::{Accum, MatMut, MatRef, Par};
use nalgebra::{Matrix3, Vector3};
use rayon::prelude::*;

use super::collocation_matrix::{CollocationLayout, CollocationMatrix, RigidGroup};
use crate::cancel;
use crate::error::Result;
use crate::linalg::dense_lu::DenseLu;
use crate::linalg::dense_matrix::DenseMatrix;
use crate::linalg::vector::norm;

/// Largest number of nodes of a diagonal block. Leaves of the cluster tree may be larger.
const MAX_BLOCK_NODES: usize = 160;

/// Largest number of nodes of a rigid group, or the number of nodes divided by [`MAX_GROUPS`] if this quotient is
/// larger.
const NODES_PER_GROUP: usize = 16;
const MAX_GROUPS: usize = 500;

/// Threshold of linear dependence. A motion is omitted if orthogonalisation against earlier motions reduces its norm to
/// at most this share.
const DEPENDENCE_TOLERANCE: f64 = 1e-3;

/// Preconditioner x = P (Pᵀ A P)⁻¹ Pᵀ b + D⁻¹ (b - P Pᵀ b) of A x = b. A is a collocation matrix with a
/// [`DiagonalAndBorder`].
///
/// The columns of P are orthonormal motions of node groups. D contains dense diagonal blocks of A. The blocks of D
/// belong to other groups of nodes than the motions.
pub struct CoarseBlockJacobi {
    n: usize,
    block_inverses: Vec<(Range<usize>, Vec<f32>)>,
    groups: Vec<RigidGroup>,
    /// Inverse of the coarse matrix, which is Pᵀ A P with a border. The border columns are Pᵀ C and the border rows are
    /// R P. C and R are the border columns and rows of A. The corner of the coarse matrix is zero.
    coarse_inverse: DenseMatrix,
}

/// Additions to a collocation matrix `[n, n]`: 3 x 3 blocks on the diagonal, and a border of additional rows and
/// columns.
pub struct DiagonalAndBorder<'a> {
    /// 3 x 3 block of each node i, which is added in the rows and columns 3 i to 3 i + 2.
    pub blocks: &'a [Matrix3<f64>],
    /// Border columns, `[n + border, border]`. The last `border` rows are the corner.
    pub columns: &'a DenseMatrix,
    /// Border rows, stored as columns, `[n, border]`.
    pub rows: &'a DenseMatrix,
}

/// Positions of the nodes of a collocation matrix, and the kind of each unknown (traction or displacement).
#[derive(Clone, Copy)]
pub struct CollocationUnknowns<'a> {
    /// Positions of the nodes, mm.
    pub positions: &'a [Vector3<f64>],
    /// Whether each unknown is a traction. All other unknowns are displacements, which take part in rigid rotations.
    pub is_traction: &'a [bool],
}

impl RigidGroup {
    fn new(places: Range<usize>, first_motion: usize, unknowns: CollocationUnknowns) -> Self {
        let nodes = places.start / 3..places.end / 3;
        let middle = unknowns.positions[nodes.clone()].iter().sum::<Vector3<f64>>() / nodes.len() as f64;
        let translation = |c: usize, traction: bool| -> Vec<f64> {
            let of = |dof: usize| f64::from(u8::from(dof % 3 == c && unknowns.is_traction[dof] == traction));
            places.clone().map(of).collect()
        };
        let rotation = |axis: usize| -> Vec<f64> {
            let of = |dof: usize| {
                let motion = Vector3::ith(axis, 1.0).cross(&(unknowns.positions[dof / 3] - middle));
                if unknowns.is_traction[dof] { 0.0 } else { motion[dof % 3] }
            };
            places.clone().map(of).collect()
        };
        let mut motions: Vec<f64> = Vec::new();
        let translations = [false, true].into_iter().flat_map(|kind| (0..3).map(move |c| (c, kind)));
        let all = translations.map(|(c, kind)| translation(c, kind)).chain((0..3).map(rotation));
        for mut motion in all {
            let size = norm(&motion);
            for _ in 0..2 {
                for before in motions.chunks_exact(places.len()) {
                    let share: f64 = before.iter().zip(&motion).map(|(a, b)| a * b).sum();
                    motion.iter_mut().zip(before).for_each(|(value, before)| *value -= share * before);
                }
            }
            let left = norm(&motion);
            if left > DEPENDENCE_TOLERANCE * size {
                motions.extend(motion.iter().map(|value| value / left));
            }
        }
        Self { places, first_motion, motions }
    }

    pub fn n_motions(&self) -> usize {
        self.motions.len() / self.places.len()
    }

    /// Entries of the motions in the rows `places`, `[places, motions]`. `places` must be a part of the rows of the
    /// group.
    pub fn motions_at(&self, places: &Range<usize>) -> MatRef<'_, f64> {
        MatRef::from_column_major_slice(&self.motions, self.places.len(), self.n_motions())
            .subrows(places.start - self.places.start, places.len())
    }
}

impl CoarseBlockJacobi {
    /// Builds the preconditioner of `matrix` with `additions`.
    ///
    /// # Errors
    /// If memory does not suffice, if a diagonal block or the coarse matrix is singular, or if the run is cancelled.
    pub fn new(
        matrix: &CollocationMatrix,
        additions: &DiagonalAndBorder,
        unknowns: CollocationUnknowns,
    ) -> Result<Self> {
        let n = matrix.n();
        let local = |places: Range<usize>| {
            cancel::check()?;
            let mut values = DenseMatrix::zeros(places.len(), places.len())?;
            matrix.add_diagonal_block(&places, &mut values);
            for (at, dof) in places.clone().enumerate() {
                let own = additions.blocks[dof / 3].column(dof % 3);
                (0..3).for_each(|r| values.column_mut(at)[at - dof % 3 + r] += own[r]);
            }
            let inverse = inverse(values, Par::Seq)?;
            Ok((places, inverse.values().iter().map(|value| *value as f32).collect()))
        };
        let block_inverses = dof_clusters(matrix.layout(), MAX_BLOCK_NODES)
            .into_par_iter()
            .map(local)
            .collect::<Result<Vec<_>>>()?;
        let (mut groups, mut count): (Vec<RigidGroup>, usize) = (Vec::new(), 0);
        for places in dof_clusters(matrix.layout(), NODES_PER_GROUP.max(n / 3 / MAX_GROUPS)) {
            let group = RigidGroup::new(places, count, unknowns);
            count += group.n_motions();
            groups.push(group);
        }
        let border = additions.columns.n_columns();
        let mut means = DenseMatrix::zeros(count + border, count + border)?;
        matrix.add_coarse_products(&groups, &mut means);
        for group in &groups {
            cancel::check()?;
            let size = group.places.len();
            for (j, motion) in group.motions.chunks_exact(size).enumerate() {
                let mut image = vec![0.0; size];
                for (at, value) in motion.iter().enumerate() {
                    let own = additions.blocks[(group.places.start + at) / 3].column(at % 3);
                    (0..3).for_each(|r| image[at - at % 3 + r] += own[r] * value);
                }
                for (i, other) in group.motions.chunks_exact(size).enumerate() {
                    means.column_mut(group.first_motion + j)[group.first_motion + i] +=
                        product(other, &image);
                }
                for b in 0..border {
                    let [column, row] = [additions.columns, additions.rows]
                        .map(|of| product(motion, &of.column(b)[group.places.clone()]));
                    means.column_mut(count + b)[group.first_motion + j] = column;
                    means.column_mut(group.first_motion + j)[count + b] = row;
                }
            }
        }
        Ok(Self { n, block_inverses, groups, coarse_inverse: inverse(means, Par::rayon(0))? })
    }

    /// Expected memory for a layout, bytes: first the peak during construction, then the memory that is kept.
    ///
    /// The estimate assumes six motions per group and six border rows.
    pub fn expected_bytes(layout: &CollocationLayout) -> [usize; 2] {
        let nodes = layout.groups().n_nodes();
        let locals: usize =
            dof_clusters(layout, MAX_BLOCK_NODES).iter().map(|places| 4 * places.len().pow(2)).sum();
        let coarse = 6 * dof_clusters(layout, NODES_PER_GROUP.max(nodes / MAX_GROUPS)).len() + 6;
        let held = locals + 8 * 6 * 3 * nodes;
        [held + 16 * coarse * coarse, held + 8 * coarse * coarse]
    }

    /// Memory of the stored inverses and motions, bytes.
    pub fn bytes(&self) -> usize {
        let locals: usize = self.block_inverses.iter().map(|(_, values)| 4 * values.len()).sum();
        let motions: usize = self.groups.iter().map(|group| 8 * group.motions.len()).sum();
        locals + motions + 8 * self.coarse_inverse.values().len()
    }

    /// Computes x ≈ A⁻¹ b for `count` columns, stored one after the other; overwrites `x`.
    pub fn apply(&self, b: &[f64], x: &mut [f64], count: usize) {
        let (n, n_rows, size) = (self.n, b.len() / count, self.coarse_inverse.n_rows());
        let motions = size - (n_rows - n);
        let zeros = || DenseMatrix::from_values(size, count, vec![0.0; size * count]);
        let (mut shares, mut corrections, mut rest) =
            (zeros(), zeros(), DenseMatrix::from_values(n_rows, count, b.to_vec()));
        for group in &self.groups {
            let to = shares.view_mut().subrows_mut(group.first_motion, group.n_motions());
            let from = MatRef::from_column_major_slice(b, n_rows, count)
                .subrows(group.places.start, group.places.len());
            matmul(to, Accum::Replace, group.motions_at(&group.places).transpose(), from, 1.0, Par::Seq);
        }
        for j in 0..count {
            shares.column_mut(j)[motions..].copy_from_slice(&b[j * n_rows..][n..n_rows]);
        }
        matmul(
            corrections.view_mut(),
            Accum::Replace,
            self.coarse_inverse.view(),
            shares.view(),
            1.0,
            Par::Seq,
        );
        for group in &self.groups {
            let own = group.motions_at(&group.places);
            let of = |all: &DenseMatrix| -> faer::Mat<f64> {
                all.view().subrows(group.first_motion, group.n_motions()).to_owned()
            };
            let to = MatMut::from_column_major_slice_mut(x, n_rows, count)
                .subrows_mut(group.places.start, group.places.len());
            matmul(to, Accum::Replace, own, of(&corrections), 1.0, Par::Seq);
            let to = rest.view_mut().subrows_mut(group.places.start, group.places.len());
            matmul(to, Accum::Add, own, of(&shares), -1.0, Par::Seq);
        }
        let single: Vec<f32> = rest.values().iter().map(|value| *value as f32).collect();
        let single = MatRef::from_column_major_slice(&single, n_rows, count);
        let mut image: Vec<f32> = Vec::new();
        for (places, inverse) in &self.block_inverses {
            let m = places.len();
            image.resize(m * count, 0.0);
            let to = MatMut::from_column_major_slice_mut(&mut image[..m * count], m, count);
            let inverse = MatRef::from_column_major_slice(inverse, m, m);
            matmul(to, Accum::Replace, inverse, single.subrows(places.start, m), 1.0, Par::Seq);
            for (j, values) in image[..m * count].chunks_exact(m).enumerate() {
                let x = &mut x[j * n_rows..][places.clone()];
                x.iter_mut().zip(values).for_each(|(x, value)| *x += f64::from(*value));
            }
        }
        for j in 0..count {
            x[j * n_rows..][n..n_rows].copy_from_slice(&corrections.column(j)[motions..]);
        }
    }
}

fn product(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

fn inverse(matrix: DenseMatrix, par: Par) -> Result<DenseMatrix> {
    let n = matrix.n_rows();
    let mut inverse = DenseMatrix::zeros(n, n)?;
    (0..n).for_each(|i| inverse.column_mut(i)[i] = 1.0);
    DenseLu::new(matrix, par)?.solve_in_place(&mut inverse, par)?;
    Ok(inverse)
}

/// Row ranges of the largest clusters with at most `nodes` nodes, ascending. Leaves of the tree may be larger.
fn dof_clusters(layout: &CollocationLayout, nodes: usize) -> Vec<Range<usize>> {
    let (tree, groups) = (layout.tree(), layout.groups());
    let (mut parts, mut waiting) = (Vec::new(), vec![0]);
    while let Some(index) = waiting.pop() {
        let cluster = &tree.clusters[index];
        let unknowns = groups.dofs(&cluster.range);
        match cluster.children {
            Some([first, second]) if unknowns.len() > 3 * nodes => waiting.extend([second, first]),
            _ => parts.push(unknowns),
        }
    }
    parts
}
