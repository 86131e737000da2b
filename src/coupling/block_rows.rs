//! Equations that one body contributes to the block system.

use std::sync::Mutex;

use nalgebra::Matrix3;

use crate::bem::half_space::DenseFlexibility;
use crate::body::half_space::half_space_matrix;
use crate::body::{BodyEquations, ElasticBody, FeBody};
use crate::error::{Error, Result};
use crate::fem::AppliedLoads;
use crate::flexibility::Flexibility;
use crate::frame::{ContactFrame, FaceMap, Side};
use crate::linalg::sparse::SymmetricSparse;

/// Scales of lengths and stresses (docs/theory-coupling.md).
#[derive(Debug, Clone, Copy)]
pub(super) struct BlockScales {
    /// Scale E0 of stresses, MPa.
    pub modulus: f64,
    /// Scale l0 of lengths, mm.
    pub length: f64,
}

/// Bodies on which contact tractions act.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum ForcedBodies {
    All,
    Meshed,
}

/// Equations of one body. `first` is the index of the first row of the body in the system, and of the first unknown of
/// the body.
pub(super) enum BodyRows {
    Rigid,
    HalfSpace { first: usize, side: Side, matrix: DenseFlexibility, scratch: Mutex<Vec<f64>> },
    FiniteElements(Box<MeshRows>),
}

pub(super) struct MeshRows {
    first: usize,
    side: Side,
    stiffness: SymmetricSparse,
    map: FaceMap,
    /// Row of each displacement component of the contact nodes, counted from `first`, `[3 n_c]` for n_c contact nodes; `None` where
    /// prescribed.
    rows: Vec<Option<usize>>,
    loads: Vec<MeshLoad>,
    scratch: Mutex<Vec<f64>>,
}

/// Load of a meshed body at amplitude 1.
struct MeshLoad {
    /// Prescribed displacement of each displacement component of the contact nodes, 0 where free, mm.
    prescribed: Vec<f64>,
    /// Loads F - K_fc u_c on the free components f, with the displacements u_c of the prescribed components c, `[n_free]`, N.
    forces: Vec<f64>,
}

type Entry = (usize, usize, f64);

impl BodyRows {
    pub(super) fn new(body: &dyn ElasticBody, side: Side, frame: &ContactFrame) -> Result<Self> {
        match body.equations() {
            BodyEquations::Rigid => Ok(Self::Rigid),
            BodyEquations::HalfSpace(green) => Ok(Self::HalfSpace {
                first: 0,
                side,
                matrix: half_space_matrix(green, frame)?,
                scratch: Mutex::new(vec![0.0; 3 * frame.n_cells()]),
            }),
            BodyEquations::FiniteElements(body) => {
                Ok(Self::FiniteElements(Box::new(MeshRows::new(body, side))))
            }
            BodyEquations::Hybrid(_) | BodyEquations::BoundaryElements(_) | BodyEquations::Unknown => {
                Err(Error::input(format!(
                    "the block system does not support {} ({}): use solver.coupling = \"schur\"",
                    side.name(),
                    body.describe()
                )))
            }
        }
    }

    pub(super) fn n(&self) -> usize {
        match self {
            Self::Rigid => 0,
            Self::HalfSpace { matrix, .. } => 3 * matrix.n_cells(),
            Self::FiniteElements(mesh) => mesh.stiffness.n(),
        }
    }

    pub(super) fn place(&mut self, start: usize) {
        match self {
            Self::Rigid => {}
            Self::HalfSpace { first, .. } => *first = start,
            Self::FiniteElements(mesh) => mesh.first = start,
        }
    }

    pub(super) fn is_meshed(&self) -> bool {
        matches!(self, Self::FiniteElements(_))
    }

    /// Estimated modulus of the body at the contact, MPa, for cells of size `length`, mm; `None` for a rigid body. The estimate
    /// uses the diagonal of the flexibility of a half-space, or of the stiffness of a mesh.
    pub(super) fn modulus(&self, length: f64) -> Option<f64> {
        match self {
            Self::Rigid => None,
            Self::HalfSpace { matrix, .. } => {
                let blocks = matrix.diagonal_blocks();
                let blocks = blocks.distinct();
                let mean = blocks.iter().map(|block| block.trace() / 3.0).sum::<f64>() / blocks.len() as f64;
                Some(length / mean)
            }
            Self::FiniteElements(mesh) => {
                let diagonal = mesh.stiffness.diagonal();
                let contact: Vec<f64> = mesh.rows.iter().flatten().map(|&row| diagonal[row]).collect();
                let mean = contact.iter().sum::<f64>() / contact.len().max(1) as f64;
                Some(if mean > 0.0 { mean / length } else { diagonal[0] / length })
            }
        }
    }

    /// Scaled entries of the system matrix in the body's own rows.
    pub(super) fn entries(&self, scales: BlockScales) -> Box<dyn Iterator<Item = Entry> + '_> {
        match self {
            Self::Rigid => Box::new(std::iter::empty()),
            Self::HalfSpace { first, matrix, .. } => {
                Box::new((*first..first + 3 * matrix.n_cells()).map(|i| (i, i, 1.0)))
            }
            Self::FiniteElements(mesh) => {
                let scale = 1.0 / (scales.modulus * scales.length);
                Box::new(
                    mesh.stiffness
                        .entries()
                        .map(move |(i, j, value)| (mesh.first + i, mesh.first + j, value * scale)),
                )
            }
        }
    }

    /// Entries -s I of the gap rows in the columns of the body. I maps displacements of the body to the cells, and s is
    /// the gap sign of the body. The first gap row has the index 0.
    pub(super) fn projection(&self, n_cells: usize) -> Box<dyn Iterator<Item = Entry> + '_> {
        match self {
            Self::Rigid => Box::new(std::iter::empty()),
            Self::HalfSpace { first, side, .. } => {
                Box::new((0..3 * n_cells).map(move |i| (i, first + i, -side.gap_sign())))
            }
            Self::FiniteElements(mesh) => Box::new(mesh.projection()),
        }
    }

    /// Adds the contact tractions to the scaled right-hand side of the body in `rows`. `rows` covers the rows of both
    /// bodies.
    pub(super) fn load(
        &self,
        tractions: &[f64],
        forced: ForcedBodies,
        scales: BlockScales,
        rows: &mut [f64],
    ) {
        match self {
            Self::Rigid => {}
            Self::HalfSpace { .. } if forced == ForcedBodies::Meshed => {}
            Self::HalfSpace { first, side, matrix, scratch } => {
                let mut displacement = scratch.lock().expect("no panic while the scratch is held");
                matrix.apply(tractions, &mut displacement);
                for (row, u) in rows[*first..].iter_mut().zip(displacement.iter()) {
                    *row += side.gap_sign() * u / scales.length;
                }
            }
            Self::FiniteElements(mesh) => mesh.load(tractions, scales, rows),
        }
    }

    /// Adds load `load` of a meshed body to the scaled right-hand side in `rows`. Adds the scaled gap due to prescribed
    /// displacements of the contact nodes to `frame_rows`.
    pub(super) fn add_load(
        &self,
        load: usize,
        scales: BlockScales,
        rows: &mut [f64],
        frame_rows: &mut [f64],
    ) {
        if let Self::FiniteElements(mesh) = self {
            let MeshLoad { prescribed, forces } = &mesh.loads[load];
            let scale = mesh.force_scale(scales);
            let rows = &mut rows[mesh.first..mesh.first + forces.len()];
            rows.iter_mut().zip(forces).for_each(|(row, force)| *row += force * scale);
            let mut gap = vec![0.0; frame_rows.len()];
            mesh.map.apply(prescribed, &mut gap);
            for (row, g) in frame_rows.iter_mut().zip(&gap) {
                *row += mesh.side.gap_sign() * g / scales.length;
            }
        }
    }

    /// Number of loads of a meshed body; 0 for other bodies.
    pub(super) fn n_loads(&self) -> usize {
        if let Self::FiniteElements(mesh) = self { mesh.loads.len() } else { 0 }
    }

    pub(super) fn add_direct_diagonal(&self, blocks: &mut [Matrix3<f64>]) {
        if let Self::HalfSpace { matrix, .. } = self {
            blocks.iter_mut().zip(matrix.diagonal_blocks().iter()).for_each(|(sum, block)| *sum += block);
        }
    }
}

impl MeshRows {
    fn new(body: &FeBody, side: Side) -> Self {
        let (model, map) = (body.condensed().model(), body.map().clone());
        let components = || map.nodes().iter().flat_map(|&node| (0..3).map(move |c| (node, c)));
        let load = |loads: &AppliedLoads| MeshLoad {
            prescribed: components().map(|(node, c)| loads.prescribed_displacement(3 * node + c)).collect(),
            forces: model.load_vector(loads),
        };
        Self {
            first: 0,
            side,
            stiffness: model.stiffness().clone(),
            rows: components().map(|(node, c)| model.free_dof(node, c)).collect(),
            loads: body.applied_loads().map(load).collect(),
            scratch: Mutex::new(vec![0.0; 3 * map.nodes().len()]),
            map,
        }
    }

    fn projection(&self) -> impl Iterator<Item = Entry> + '_ {
        let n = self.map.n_cells();
        (0..n).flat_map(move |cell| {
            let axes = self.map.triads()[cell].0;
            self.map.row(cell).flat_map(move |(node, weight)| {
                (0..9).filter_map(move |k| {
                    let (global, local) = (k / 3, k % 3);
                    let column = self.first + self.rows[3 * node + global]?;
                    Some((local * n + cell, column, -self.side.gap_sign() * weight * axes[(global, local)]))
                })
            })
        })
    }

    fn force_scale(&self, scales: BlockScales) -> f64 {
        1.0 / (scales.modulus * scales.length * scales.length)
    }

    fn load(&self, tractions: &[f64], scales: BlockScales, rows: &mut [f64]) {
        let rows = &mut rows[self.first..self.first + self.stiffness.n()];
        let scale = self.force_scale(scales);
        let mut contact = self.scratch.lock().expect("no panic while the scratch is held");
        self.map.apply_transpose(tractions, &mut contact);
        for (force, row) in contact.iter().zip(&self.rows) {
            if let Some(row) = *row {
                rows[row] += self.side.gap_sign() * force * scale;
            }
        }
    }
}
