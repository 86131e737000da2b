//! Maps from the nodes of a body's contact faces to the cells of the frame. The maps pass the patch test.
//!
//! The entry I_Ij = (1 / A_I) int_{cell I} N_j dS is the average of the shape function N_j of node j over cell I. A_I
//! is the area of the cell. In frames without a grid, A_I is the part of this area that faces cover.
//!
//! The integral is exact on the intersections of the cell with the faces, projected along the cell normal. Hence sum_I
//! A_I I_Ij = int N_j dS wherever the cells tile the faces.
//!
//! # Source
//! docs/theory-coupling.md.

use std::collections::HashMap;

use rayon::prelude::*;
use sprs::CsMat;

use super::cell_coverage::{CellCoverage, FacetIndex, is_covered, refuse_uncovered};
use super::{ContactFrame, Side};
use crate::error::Result;
use crate::flexibility::per_cell::PerCell;
use crate::geometry::{Point, Triad};
use crate::mesh::Mesh;
use crate::mesh::faces::SurfaceFace;

/// Sparse map I from nodal values on the contact faces to cell averages, and its transpose.
#[derive(Debug, Clone, PartialEq)]
pub struct FaceMap {
    nodes: Vec<usize>,
    /// I, one row per cell, `[N, n_c]`.
    rows: CsMat<f64>,
    columns: CsMat<f64>,
    triads: PerCell<Triad>,
    areas: Vec<f64>,
}

fn matrix(lists: &[Vec<(usize, f64)>], n_columns: usize) -> CsMat<f64> {
    let mut starts = vec![0];
    let (mut indices, mut weights) = (Vec::new(), Vec::new());
    for list in lists {
        indices.extend(list.iter().map(|entry| entry.0));
        weights.extend(list.iter().map(|entry| entry.1));
        starts.push(indices.len());
    }
    CsMat::new((lists.len(), n_columns), starts, indices, weights)
}

fn entries(matrix: &CsMat<f64>, row: usize) -> impl Iterator<Item = (usize, f64)> + '_ {
    let range = matrix.indptr().outer_inds_sz(row);
    matrix.indices()[range.clone()].iter().copied().zip(matrix.data()[range].iter().copied())
}

/// Whether the faces of body `side` cover each cell sufficiently for contact, `[N]`. A cell of a grid must be covered
/// completely up to rounding. Other cells must be covered to nine tenths.
pub fn covered_cells(frame: &ContactFrame, mesh: &Mesh, faces: &[SurfaceFace], side: Side) -> Vec<bool> {
    let faces = FacetIndex::new(mesh, faces, side);
    let cover = |cell: usize| is_covered(frame, cell, &faces.cover(frame, cell));
    (0..frame.n_cells()).into_par_iter().map(cover).collect()
}

impl FaceMap {
    /// Map between `frame` and the outward contact `faces` of body `side` in `mesh`.
    ///
    /// # Errors
    /// If the faces cover a cell more than once, or not sufficiently for contact (as in `covered_cells`). Faces that are folded in
    /// the projection along the cell's normal do not count.
    pub fn new(frame: &ContactFrame, mesh: &Mesh, faces: &[SurfaceFace], side: Side) -> Result<Self> {
        let own_node = |face: usize, local: usize| vec![(faces[face].nodes[local], 1.0)];
        Self::with_basis(frame, mesh, faces, side, own_node)
    }

    /// As [`Self::new`], for other basis functions that span the same space. `parts(face, local)` expresses the shape function of a
    /// local node by pairs (basis function, coefficient).
    ///
    /// # Errors
    /// As [`Self::new`].
    pub fn with_basis(
        frame: &ContactFrame,
        mesh: &Mesh,
        faces: &[SurfaceFace],
        side: Side,
        parts: impl Fn(usize, usize) -> Vec<(usize, f64)> + Sync,
    ) -> Result<Self> {
        let space = FacetIndex::new(mesh, faces, side);
        let cover = |cell: usize| space.cover_of(frame, cell, &parts);
        let found: Vec<CellCoverage> = (0..frame.n_cells()).into_par_iter().map(cover).collect();
        refuse_uncovered(frame, &found, faces, side)?;
        let mut nodes: Vec<usize> = found.iter().flat_map(|c| c.weights.iter().map(|w| w.0)).collect();
        nodes.sort_unstable();
        nodes.dedup();
        let local: HashMap<usize, usize> = nodes.iter().enumerate().map(|(i, &node)| (node, i)).collect();
        let lists: Vec<Vec<(usize, f64)>> = found
            .into_iter()
            .map(|c| c.weights.into_iter().map(|(node, w)| (local[&node], w)).collect())
            .collect();
        let rows = matrix(&lists, nodes.len());
        let columns = rows.transpose_view().to_csr();
        Ok(Self { nodes, rows, columns, triads: frame.triads.clone(), areas: frame.areas.clone() })
    }

    /// Map restricted to the selected `cells` and their nodes. The rows of other cells are empty.
    pub fn restrict(&self, cells: &[bool]) -> Self {
        let mut used = vec![false; self.nodes.len()];
        for cell in (0..self.n_cells()).filter(|&cell| cells[cell]) {
            self.row(cell).for_each(|(node, _)| used[node] = true);
        }
        let kept: Vec<usize> = (0..self.nodes.len()).filter(|&node| used[node]).collect();
        let mut local = vec![usize::MAX; self.nodes.len()];
        kept.iter().enumerate().for_each(|(i, &node)| local[node] = i);
        let row = |cell: usize| self.row(cell).map(|(node, weight)| (local[node], weight)).collect();
        let lists: Vec<Vec<(usize, f64)>> =
            (0..self.n_cells()).map(|cell| if cells[cell] { row(cell) } else { Vec::new() }).collect();
        let rows = matrix(&lists, kept.len());
        let columns = rows.transpose_view().to_csr();
        let nodes = kept.iter().map(|&node| self.nodes[node]).collect();
        Self { nodes, rows, columns, triads: self.triads.clone(), areas: self.areas.clone() }
    }

    /// Contact nodes: mesh nodes (or basis functions of [`Self::with_basis`]) with a weight in a cell, ascending, `[n_c]`.
    pub fn nodes(&self) -> &[usize] {
        &self.nodes
    }

    /// Number of cells N.
    pub fn n_cells(&self) -> usize {
        self.rows.rows()
    }

    /// Local axes of the cells.
    pub fn triads(&self) -> &PerCell<Triad> {
        &self.triads
    }

    /// Areas of the cells, mm2.
    pub fn areas(&self) -> &[f64] {
        &self.areas
    }

    /// Entries (cell, weight) of a contact node's column.
    pub fn column(&self, node: usize) -> impl Iterator<Item = (usize, f64)> + '_ {
        entries(&self.columns, node)
    }

    /// Entries (contact node, weight) of a cell's row.
    pub fn row(&self, cell: usize) -> impl Iterator<Item = (usize, f64)> + '_ {
        entries(&self.rows, cell)
    }

    /// Cell averages in local axes, `[3, N]` (all x, all y, all n), of nodal vectors `[n_c, 3]` in global axes.
    pub fn apply(&self, nodal: &[f64], local: &mut [f64]) {
        let n = self.n_cells();
        for cell in 0..n {
            let mut mean = Point::zeros();
            for (node, weight) in entries(&self.rows, cell) {
                mean += weight * Point::new(nodal[3 * node], nodal[3 * node + 1], nodal[3 * node + 2]);
            }
            let mean = self.triads[cell].to_local(&mean);
            (0..3).for_each(|k| local[k * n + cell] = mean[k]);
        }
    }

    /// Cell averages in local axes, `[3, N]`, of the displacement that `of_node` gives at mesh nodes.
    pub fn mean_displacement(&self, of_node: impl Fn(usize) -> [f64; 3]) -> Vec<f64> {
        let nodal: Vec<f64> = self.nodes.iter().flat_map(|&node| of_node(node)).collect();
        let mut local = vec![0.0; 3 * self.n_cells()];
        self.apply(&nodal, &mut local);
        local
    }

    /// Gap due to the nodal displacement of the body at `side`, `[3, N]`, mm.
    pub fn gap_of_displacement(&self, side: Side, of_node: impl Fn(usize) -> [f64; 3]) -> Vec<f64> {
        let mut gap = self.mean_displacement(of_node);
        gap.iter_mut().for_each(|g| *g *= side.gap_sign());
        gap
    }

    /// Nodal forces I^T A t, `[n_c, 3]` in global axes (N), of tractions t in local axes, `[3, N]` (MPa). A are the cell areas.
    pub fn apply_transpose(&self, tractions: &[f64], forces: &mut [f64]) {
        let n = self.n_cells();
        for (node, force) in forces.chunks_exact_mut(3).enumerate() {
            let mut sum = Point::zeros();
            for (cell, weight) in entries(&self.columns, node) {
                let local = Point::new(tractions[cell], tractions[n + cell], tractions[2 * n + cell]);
                sum += self.triads[cell].to_global(&local) * (weight * self.areas[cell]);
            }
            force.copy_from_slice(sum.as_slice());
        }
    }

    /// Cell averages `[N]` of nodal scalars `[n_c]`.
    pub fn average(&self, nodal: &[f64], cells: &mut [f64]) {
        for (cell, mean) in cells.iter_mut().enumerate() {
            *mean = entries(&self.rows, cell).map(|(node, weight)| weight * nodal[node]).sum();
        }
    }

    /// Nodal sums `[n_c]`, sum_I A_I I_Ij p_I, of cell values p `[N]`.
    pub fn integrate_to_nodes(&self, cells: &[f64], nodal: &mut [f64]) {
        for (node, sum) in nodal.iter_mut().enumerate() {
            *sum = entries(&self.columns, node)
                .map(|(cell, weight)| weight * self.areas[cell] * cells[cell])
                .sum();
        }
    }

    /// Mean height of the faces over each cell, along the cell normal from the cell centre, `[N]`, mm.
    pub fn mean_heights(&self, frame: &ContactFrame, mesh: &Mesh) -> Vec<f64> {
        (0..self.n_cells())
            .map(|cell| {
                let mean: Point =
                    self.row(cell).map(|(j, weight)| weight * Point::from(mesh.points[self.nodes[j]])).sum();
                frame.triads[cell].normal().dot(&(mean - frame.centers[cell]))
            })
            .collect()
    }
}
