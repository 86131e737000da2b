//! Superconvergent patch recovery: nodal stress from polynomials over the elements around each vertex.
//!
//! At a vertex inside a material, a polynomial of the elements' degree is fitted to the stress at the superconvergent points of the
//! surrounding elements. Second-order hexahedra use all monomials of degree up to 2 along each of their axes. The complete
//! quadratic polynomial, with 10 terms, would smooth variations that two elements resolve.
//!
//! A vertex on the border of its material takes the polynomial of the nearest inner vertex of its elements. Without an inner vertex
//! (one layer of elements), the fit uses the integration points of these elements and of their neighbours. A middle node takes the
//! mean of the polynomials of its nearest corners. A patch never crosses a material interface. The weights depend only on mesh and
//! materials.
//!
//! # Source
//! Zienkiewicz and Zhu (1992), Int. J. Numer. Meth. Engng 33, 1331-1364, section 3.

use std::sync::Arc;

use nalgebra::{Matrix3, Vector3};
use rayon::prelude::*;

use super::patch::{PatchFit, PolynomialSpace};
use super::points::{PointTopology, RecoveryPoints, smooth_parts};
use super::samples::{self, RecoveryRules, StressSample};
use crate::error::Result;
use crate::fem::FeModel;
use crate::fem::assembly::ElementContext;
use crate::fem::thermal::ThermoelasticState;
use crate::mesh::faces::solid_faces;

const EQUAL_DISTANCE_TOLERANCE: f64 = 1e-6;

const PATCHES_PER_BATCH: usize = 1024;

/// Stress recovery of a body: weights that map the stress samples in the elements to the recovery points.
pub struct StressRecovery {
    points: Arc<RecoveryPoints>,
    rules: RecoveryRules,
    /// Whether the integration points of each element are additional samples, `[n_cells]`.
    samples_gauss_points: Vec<bool>,
    /// Start of the entries of each point in `samples` and `weights`, `[n_points + 1]`.
    starts: Vec<usize>,
    samples: Vec<u32>,
    weights: Vec<f64>,
}

impl StressRecovery {
    /// Computes the weights of the recovery on the mesh of `model`.
    ///
    /// # Errors
    /// If the Jacobian of an element is not positive at a sample point, or a fit does not converge.
    pub fn new(model: &FeModel) -> Result<Self> {
        let elements = model.elements();
        let faces = solid_faces(elements.mesh);
        let class = smooth_parts(elements, &faces);
        let points = RecoveryPoints::new(elements, &class);
        let topology = PointTopology::new(elements, &class, &faces, &points);
        let rest = vec![[0.0; 3]; elements.mesh.n_points()];
        let sources: Vec<Vec<PatchSource>> = (0..points.n_points())
            .into_par_iter()
            .map(|p| patch_sources(elements, &points, &topology, p))
            .collect();
        let mut samples_gauss_points = vec![false; elements.n_elements()];
        for source in sources.iter().flatten() {
            if let PatchSource::ExtendedRing(vertex) = source {
                extended_ring(&points, &topology, *vertex)
                    .into_iter()
                    .for_each(|cell| samples_gauss_points[cell] = true);
            }
        }
        let rules = RecoveryRules::new();
        let layout = all_samples(elements, &samples_gauss_points, (&rest).into(), &rules)?;
        let builder = RowBuilder { elements, points: &points, topology: &topology, layout: &layout };
        let rows = builder.rows(&sources)?;
        let mut recovery = Self {
            points: Arc::new(points),
            rules,
            samples_gauss_points,
            starts: vec![0],
            samples: Vec::new(),
            weights: Vec::new(),
        };
        for row in rows {
            recovery.samples.extend(row.iter().map(|entry| entry.0));
            recovery.weights.extend(row.iter().map(|entry| entry.1));
            recovery.starts.push(recovery.samples.len());
        }
        Ok(recovery)
    }

    pub(super) fn rules(&self) -> &RecoveryRules {
        &self.rules
    }

    /// Points of the stress recovery.
    pub fn points(&self) -> &Arc<RecoveryPoints> {
        &self.points
    }

    /// Recovered stress at the points for a displacement of all mesh nodes and a change of temperature, Voigt 11 22 33 23 13 12,
    /// global axes, MPa, `[n_points]`.
    ///
    /// # Errors
    /// If the Jacobian of an element is not positive at a sample point.
    pub fn stress<'a>(
        &self,
        model: &FeModel,
        state: impl Into<ThermoelasticState<'a>>,
    ) -> Result<Vec<[f64; 6]>> {
        let layout = all_samples(model.elements(), &self.samples_gauss_points, state.into(), &self.rules)?;
        let value = |point: usize| {
            let range = self.starts[point]..self.starts[point + 1];
            let mut sum = nalgebra::Vector6::zeros();
            for (&sample, weight) in self.samples[range.clone()].iter().zip(&self.weights[range]) {
                sum += layout.samples[sample as usize].stress * *weight;
            }
            sum.into()
        };
        Ok((0..self.points.n_points()).into_par_iter().map(value).collect())
    }
}

/// Patch whose polynomial gives the value at a point.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum PatchSource {
    /// Superconvergent points of the elements around an inner vertex.
    InnerVertex(usize),
    /// Integration points of the elements around a vertex and of their neighbours.
    ExtendedRing(usize),
}

/// Samples of all elements: at the superconvergent points, then in `dense` elements also at the integration points.
fn all_samples(
    elements: ElementContext,
    dense: &[bool],
    state: ThermoelasticState,
    rules: &RecoveryRules,
) -> Result<SampleLayout> {
    let of_element = |i: usize| -> Result<(Vec<StressSample>, usize)> {
        let mut found = samples::superconvergent_samples(elements, i, state, rules)?;
        let n_superconvergent = found.len();
        if dense[i] {
            found.extend(samples::integration_point_samples(elements, i, state)?);
        }
        Ok((found, n_superconvergent))
    };
    let all: Vec<(Vec<StressSample>, usize)> =
        (0..elements.n_elements()).into_par_iter().map(of_element).collect::<Result<_>>()?;
    let mut layout = SampleLayout { starts: Vec::with_capacity(all.len()), samples: Vec::new() };
    for (found, n_superconvergent) in all {
        let first = layout.samples.len();
        layout.starts.push([first, first + n_superconvergent, first + found.len()]);
        layout.samples.extend(found);
    }
    Ok(layout)
}

struct SampleLayout {
    /// For each element: start of its samples, start of its integration points, end.
    starts: Vec<[usize; 3]>,
    samples: Vec<StressSample>,
}

/// Cells around a vertex and the cells that share a point with them.
fn extended_ring(points: &RecoveryPoints, topology: &PointTopology, vertex: usize) -> Vec<usize> {
    let around = topology.cells_at[vertex].iter().flat_map(|&cell| points.points_of_cell(cell));
    let mut cells: Vec<usize> = around.flat_map(|&point| topology.cells_at[point].iter().copied()).collect();
    cells.sort_unstable();
    cells.dedup();
    cells
}

/// Patches for the value at point `p`. The values of several patches are averaged.
fn patch_sources(
    elements: ElementContext,
    points: &RecoveryPoints,
    topology: &PointTopology,
    p: usize,
) -> Vec<PatchSource> {
    if !topology.is_vertex[p] {
        return nearest_corners(elements, points, topology, p)
            .into_iter()
            .flat_map(|corner| patch_sources(elements, points, topology, corner))
            .collect();
    }
    if !topology.on_material_border[p] {
        return vec![PatchSource::InnerVertex(p)];
    }
    let mut inner: Vec<usize> = topology.cells_at[p]
        .iter()
        .flat_map(|&cell| points.points_of_cell(cell))
        .copied()
        .filter(|&q| topology.is_vertex[q] && !topology.on_material_border[q])
        .collect();
    inner.sort_unstable();
    inner.dedup();
    let near = nearest(elements, points, p, &inner);
    if near.is_empty() {
        vec![PatchSource::ExtendedRing(p)]
    } else {
        near.into_iter().map(PatchSource::InnerVertex).collect()
    }
}

/// Corners of the first cell of a middle node that are nearest to the node, for example both ends of an edge.
fn nearest_corners(
    elements: ElementContext,
    points: &RecoveryPoints,
    topology: &PointTopology,
    p: usize,
) -> Vec<usize> {
    let cell = topology.cells_at[p][0];
    let corners = elements.mesh.kind(elements.regions.cells[cell]).n_corners();
    nearest(elements, points, p, &points.points_of_cell(cell)[..corners])
}

fn nearest(elements: ElementContext, points: &RecoveryPoints, p: usize, among: &[usize]) -> Vec<usize> {
    let at = |q: usize| nalgebra::Vector3::from(elements.mesh.points[points.mesh_nodes[q]]);
    let distance = |q: usize| (at(q) - at(p)).norm();
    let least = among.iter().map(|&q| distance(q)).fold(f64::INFINITY, f64::min);
    among.iter().copied().filter(|&q| distance(q) <= least * (1.0 + EQUAL_DISTANCE_TOLERANCE)).collect()
}

fn add_row(row: &mut WeightRow, part: WeightRow) {
    row.extend(part);
    row.sort_by_key(|entry| entry.0);
    row.dedup_by(|next, kept| {
        next.0 == kept.0 && {
            kept.1 += next.1;
            true
        }
    });
}

struct RowBuilder<'a> {
    elements: ElementContext<'a>,
    points: &'a RecoveryPoints,
    topology: &'a PointTopology,
    layout: &'a SampleLayout,
}

/// Samples and their weights, in ascending order of samples.
type WeightRow = Vec<(u32, f64)>;

impl RowBuilder<'_> {
    fn rows(&self, sources: &[Vec<PatchSource>]) -> Result<Vec<WeightRow>> {
        let mut uses: Vec<(PatchSource, usize)> = sources
            .iter()
            .enumerate()
            .flat_map(|(p, of_point)| of_point.iter().map(move |&s| (s, p)))
            .collect();
        uses.sort_unstable();
        let by_source: Vec<&[(PatchSource, usize)]> = uses.chunk_by(|a, b| a.0 == b.0).collect();
        let mut rows = vec![WeightRow::new(); sources.len()];
        for batch in by_source.chunks(PATCHES_PER_BATCH) {
            let parts: Vec<Vec<WeightRow>> =
                batch.par_iter().map(|uses| self.weight_rows(uses, sources)).collect::<Result<_>>()?;
            for (&(_, point), part) in batch.iter().copied().flatten().zip(parts.into_iter().flatten()) {
                add_row(&mut rows[point], part);
            }
        }
        Ok(rows)
    }

    fn weight_rows(
        &self,
        uses: &[(PatchSource, usize)],
        sources: &[Vec<PatchSource>],
    ) -> Result<Vec<WeightRow>> {
        let patch = self.patch(uses[0].0)?;
        let part = |&(_, point): &(PatchSource, usize)| -> WeightRow {
            let weights = patch.weights_at(self.elements.mesh.points[self.points.mesh_nodes[point]]);
            let share = 1.0 / sources[point].len() as f64;
            patch.samples.iter().zip(weights.iter()).map(|(&s, w)| (s as u32, w * share)).collect()
        };
        Ok(uses.iter().map(part).collect())
    }

    fn patch(&self, source: PatchSource) -> Result<PatchFit> {
        let (cells, kinds) = match source {
            PatchSource::InnerVertex(vertex) => (self.topology.cells_at[vertex].clone(), [0, 1]),
            PatchSource::ExtendedRing(vertex) => (extended_ring(self.points, self.topology, vertex), [1, 2]),
        };
        let starts = &self.layout.starts;
        let samples = cells.iter().flat_map(|&cell| starts[cell][kinds[0]]..starts[cell][kinds[1]]);
        let samples: Vec<usize> = samples.collect();
        let terms = self.polynomial_space(&cells, samples.len());
        let axes =
            if terms == PolynomialSpace::Triquadratic { self.axes(cells[0]) } else { Matrix3::identity() };
        PatchFit::new(terms, axes, samples, |sample| self.layout.samples[sample].position)
    }

    /// Smallest polynomial space of the elements. With fewer samples than twice the 27 terms of the triquadratic space, the space
    /// is at most quadratic.
    fn polynomial_space(&self, cells: &[usize], n_samples: usize) -> PolynomialSpace {
        let kind = |&cell: &usize| self.elements.mesh.kind(self.elements.regions.cells[cell]);
        let least = cells
            .iter()
            .map(|cell| samples::recovery_space(kind(cell)))
            .min()
            .unwrap_or(PolynomialSpace::Linear);
        if n_samples < 2 * 27 { least.min(PolynomialSpace::Quadratic) } else { least }
    }

    /// Edge vectors of a hexahedron at its first corner.
    fn axes(&self, cell: usize) -> Matrix3<f64> {
        let cell = self.elements.regions.cells[cell];
        let points = self.elements.node_coordinates(cell);
        let edge = |to: usize| Vector3::from(points[to]) - Vector3::from(points[0]);
        Matrix3::from_columns(&[edge(1), edge(3), edge(4)])
    }
}
