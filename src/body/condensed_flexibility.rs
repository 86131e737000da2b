//! Flexibility of a body on the frame, condensed to the body's contact nodes.

use std::sync::Mutex;

use nalgebra::Matrix3;

use crate::error::Result;
use crate::flexibility::Flexibility;
use crate::flexibility::cell_matrix::CellMatrix;
use crate::flexibility::per_cell::PerCell;
use crate::frame::FaceMap;
use crate::geometry::Point;
use crate::linalg::packed::PackedSymmetric;

/// Operator S = I F Iᵀ A. F gives the displacement of the contact nodes due to nodal forces. I averages nodal
/// displacements over the cells. A contains the cell areas.
///
/// The matrix A S is symmetric because F is symmetric.
///
/// # Source
/// docs/theory-coupling.md.
pub struct CondensedFlexibility {
    map: FaceMap,
    nodal: PackedSymmetric,
    normal: NormalOperator,
    scratch: Mutex<[Vec<f64>; 2]>,
    planes: Mutex<[Vec<f64>; 2]>,
}

enum NormalOperator {
    /// Matrix nᵀ F n, `[n_c, n_c]`, with n_c contact nodes, for cells that all have the same normal n.
    SharedNormal(PackedSymmetric),
    Full,
}

impl CondensedFlexibility {
    /// Creates the operator from the symmetric flexibility of the contact nodes of `map`: `entry(i, j)` for i >= j, mm/N. A dof is
    /// 3 node + component, in global axes.
    ///
    /// # Errors
    /// If memory does not suffice.
    pub fn new(map: FaceMap, entry: impl Fn(usize, usize) -> f64) -> Result<Self> {
        let n_nodes = map.nodes().len();
        let nodal = PackedSymmetric::from_lower(3 * n_nodes, entry)?;
        let first = map.triads()[0].normal();
        let common = map.triads().distinct().iter().all(|triad| triad.normal() == first);
        let normal = if common {
            NormalOperator::SharedNormal(normal_flexibility(&nodal, first)?)
        } else {
            NormalOperator::Full
        };
        let n_cells = if common { 0 } else { 3 * map.n_cells() };
        let scratch = Mutex::new([vec![0.0; 3 * n_nodes], vec![0.0; 3 * n_nodes]]);
        let planes = Mutex::new([vec![0.0; n_cells], vec![0.0; n_cells]]);
        Ok(Self { map, nodal, normal, scratch, planes })
    }

    pub(super) fn map(&self) -> &FaceMap {
        &self.map
    }

    /// Displacement of dof `i` due to a force on dof `j` of the contact nodes, global axes, mm/N.
    pub(super) fn entry(&self, i: usize, j: usize) -> f64 {
        self.nodal.at(i, j)
    }

    /// Contact nodes whose displacement enters the mean over one of `cells`: their indices, ascending.
    fn nodes_of(&self, cells: &[usize]) -> Vec<usize> {
        let mut nodes: Vec<usize> =
            cells.iter().flat_map(|&cell| self.map.row(cell).map(|entry| entry.0)).collect();
        nodes.sort_unstable();
        nodes.dedup();
        nodes
    }

    /// Displacements of `nodes` per unit traction along x, y, n (columns) on one cell, global axes, mm/MPa. The entries
    /// of all other contact nodes are zero.
    fn displacement_of(&self, cell: usize, nodes: &[usize]) -> Vec<Matrix3<f64>> {
        let mut displacement = vec![Matrix3::zeros(); self.map.nodes().len()];
        for &i in nodes {
            for (j, weight) in self.map.row(cell) {
                displacement[i] += weight * self.nodal.block(i, j);
            }
            displacement[i] *= self.map.triads()[cell].0 * self.map.areas()[cell];
        }
        displacement
    }

    fn diagonal_block(&self, cell: usize) -> Matrix3<f64> {
        let mut block = Matrix3::zeros();
        for (i, weight_i) in self.map.row(cell) {
            for (j, weight_j) in self.map.row(cell) {
                let weight = weight_i * weight_j;
                block += Matrix3::from_fn(|a, b| weight * self.nodal.at(3 * i + a, 3 * j + b));
            }
        }
        let axes = self.map.triads()[cell].0;
        axes.transpose() * block * axes * self.map.areas()[cell]
    }
}

fn normal_flexibility(nodal: &PackedSymmetric, normal: Point) -> Result<PackedSymmetric> {
    PackedSymmetric::from_lower(nodal.n() / 3, |i, j| {
        let block = Matrix3::from_fn(|a, b| nodal.at(3 * i + a, 3 * j + b));
        normal.dot(&(block * normal))
    })
}

impl Flexibility for CondensedFlexibility {
    fn n_cells(&self) -> usize {
        self.map.n_cells()
    }

    fn apply(&self, tractions: &[f64], gap: &mut [f64]) {
        let mut scratch = self.scratch.lock().expect("no panic while the scratch is held");
        let [forces, displacements] = &mut *scratch;
        self.map.apply_transpose(tractions, forces);
        self.nodal.multiply(forces, displacements);
        self.map.apply(displacements, gap);
    }

    fn apply_normal(&self, pressure: &[f64], normal_gap: &mut [f64]) {
        let n = self.n_cells();
        let NormalOperator::SharedNormal(reduced) = &self.normal else {
            let mut planes = self.planes.lock().expect("no panic while the planes are held");
            let [tractions, gap] = &mut *planes;
            tractions[2 * n..].copy_from_slice(pressure);
            self.apply(tractions, gap);
            normal_gap.copy_from_slice(&gap[2 * n..]);
            return;
        };
        let mut scratch = self.scratch.lock().expect("no panic while the scratch is held");
        let [forces, displacements] = &mut *scratch;
        let n_nodes = reduced.n();
        self.map.integrate_to_nodes(pressure, &mut forces[..n_nodes]);
        reduced.multiply(&forces[..n_nodes], &mut displacements[..n_nodes]);
        self.map.average(&displacements[..n_nodes], normal_gap);
    }

    fn diagonal_blocks(&self) -> PerCell<Matrix3<f64>> {
        (0..self.n_cells()).map(|cell| self.diagonal_block(cell)).collect()
    }

    fn is_condensed(&self) -> bool {
        true
    }

    fn add_entries(&self, cells: &[usize], matrix: &mut CellMatrix) -> bool {
        let axes = |cell: usize| self.map.triads()[cell].0;
        let touched = self.nodes_of(cells);
        matrix.add_columns(|k| {
            let displacement = self.displacement_of(cells[k], &touched);
            move |i| {
                let mut mean = Matrix3::zeros();
                for (node, weight) in self.map.row(cells[i]) {
                    mean += displacement[node] * weight;
                }
                axes(cells[i]).transpose() * mean
            }
        });
        true
    }
}
