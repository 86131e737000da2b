//! Assembled block system of two bodies and the frame, a reference for the flexibility of condensed bodies.
//!
//! The unknowns are the displacements x1, x2 of the bodies and the gap k. The tractions P are given. x contains the
//! free displacement components of the nodes of a mesh, or the displacements of a half-space at the cells. K is the
//! stiffness matrix of a mesh. I maps displacements to cells, A is the diagonal matrix of the cell areas, and F are the
//! loads.
//!
//! G is the flexibility of a half-space for the tractions of the cells. k_go is the distance of the undeformed surfaces
//! plus the gap due to prescribed displacements. C_gn w is the wear depth w as a normal gap:
//!
//! ```text
//! | R1   0    0 | | x1 |   | s1 I1^T A P + F1 |          R = K for finite elements, 1 for a half-space, whose
//! | 0    R2   0 | | x2 | = | s2 I2^T A P + F2 |          right-hand side is s G P
//! | I1  -I2   1 | | k  |   | k_go + C_gn w    |          s1 = -1, s2 = +1
//! ```
//!
//! Lengths are scaled by the mean cell side l0, stresses by E0, the geometric mean of the moduli of the elastic bodies at the
//! contact. Rows of finite elements are scaled by 1 / (E0 l0^2), all other rows by 1 / l0.
//!
//! # Source
//! docs/theory-coupling.md.

use std::sync::Mutex;

use nalgebra::Matrix3;

use super::block_rows::{BlockScales, BodyRows, ForcedBodies};
use crate::body::{BodyEquations, ElasticBody};
use crate::error::{Error, Result};
use crate::flexibility::Flexibility;
use crate::flexibility::per_cell::PerCell;
use crate::frame::{ContactFrame, Side};
use crate::linalg::sparse_lu::{LuWorkspace, MAX_RHS, SparseLu};

/// Largest number of unknowns. The LU factors of larger systems of meshed solids take many GiB.
const MAX_UNKNOWNS: usize = 60_000;

/// Factorised block system. As a [`Flexibility`], the system computes the part of the gap k that tractions alone cause.
pub struct BlockSystem {
    n_cells: usize,
    bodies: [BodyRows; 2],
    first_gap: usize,
    scales: BlockScales,
    lu: SparseLu,
    work: Mutex<BlockWorkspace>,
}

struct BlockWorkspace {
    rhs: Vec<f64>,
    memory: LuWorkspace,
    planes: [Vec<f64>; 2],
}

impl BlockSystem {
    /// Assembles and factorises the system.
    ///
    /// # Errors
    /// If both bodies are rigid, the block system does not support a body, or the system has too many unknowns. If a matrix cannot
    /// be assembled or factorised.
    pub fn new(body1: &dyn ElasticBody, body2: &dyn ElasticBody, frame: &ContactFrame) -> Result<Self> {
        let n_cells = frame.n_cells();
        refuse_size(body1, body2, n_cells)?;
        let mut lower = BodyRows::new(body1, Side::Lower, frame)?;
        let mut upper = BodyRows::new(body2, Side::Upper, frame)?;
        lower.place(0);
        upper.place(lower.n());
        let first_gap = lower.n() + upper.n();
        if first_gap == 0 {
            return Err(super::both_rigid());
        }
        let n = first_gap + 3 * n_cells;
        let length = frame.mean_cell_side();
        let moduli: Vec<f64> = [&lower, &upper].into_iter().filter_map(|body| body.modulus(length)).collect();
        let modulus = (moduli.iter().map(|e| e.ln()).sum::<f64>() / moduli.len() as f64).exp();
        let scales = BlockScales { modulus, length };
        let bodies = [lower, upper];
        let gap_rows = (0..3 * n_cells).map(|i| (first_gap + i, first_gap + i, 1.0));
        let body_rows = bodies.iter().flat_map(|body| body.entries(scales));
        let projections = bodies
            .iter()
            .flat_map(|body| body.projection(n_cells))
            .map(|(i, j, value)| (first_gap + i, j, value));
        let lu = SparseLu::new(n, body_rows.chain(projections).chain(gap_rows))?;
        let planes = [vec![0.0; 3 * n_cells], vec![0.0; 3 * n_cells]];
        let work = Mutex::new(BlockWorkspace { rhs: vec![0.0; n], memory: lu.workspace()?, planes });
        Ok(Self { n_cells, bodies, first_gap, scales, lu, work })
    }

    /// Computes the gap k, `[3, N]`, mm, due to `tractions` (MPa on body 2, `[3, N]`), and to loads and prescribed displacements of
    /// meshed bodies at amplitude 1. Adds the distance `normal_gap` and the wear depth `worn`, `[N]` each, mm, to the normal
    /// component of `gap`.
    pub fn gap(&self, tractions: &[f64], normal_gap: &[f64], worn: &[f64], gap: &mut [f64]) {
        let mut work = self.work.lock().expect("no panic while the buffers are held");
        let BlockWorkspace { rhs, memory, .. } = &mut *work;
        self.load(tractions, ForcedBodies::All, rhs);
        for body in &self.bodies {
            (0..body.n_loads()).for_each(|load| self.add_load(body, load, rhs));
        }
        let normal = &mut rhs[self.first_gap + 2 * self.n_cells..];
        for ((row, distance), depth) in normal.iter_mut().zip(normal_gap).zip(worn) {
            *row += (distance + depth) / self.scales.length;
        }
        self.solve(rhs, memory, gap);
    }

    /// The gap k, `[3, N]`, mm, due to load `load` of the meshed body on `side` at amplitude 1.
    pub fn load_gap(&self, side: Side, load: usize) -> Vec<f64> {
        let mut work = self.work.lock().expect("no panic while the buffers are held");
        let BlockWorkspace { rhs, memory, .. } = &mut *work;
        rhs.fill(0.0);
        self.add_load(&self.bodies[usize::from(side == Side::Upper)], load, rhs);
        let mut gap = vec![0.0; 3 * self.n_cells];
        self.solve(rhs, memory, &mut gap);
        gap
    }

    fn load(&self, tractions: &[f64], forced: ForcedBodies, rhs: &mut [f64]) {
        rhs.fill(0.0);
        let rows = &mut rhs[..self.first_gap];
        self.bodies.iter().for_each(|body| body.load(tractions, forced, self.scales, rows));
    }

    fn add_load(&self, body: &BodyRows, load: usize, rhs: &mut [f64]) {
        let (rows, frame_rows) = rhs.split_at_mut(self.first_gap);
        body.add_load(load, self.scales, rows, frame_rows);
    }

    fn solve(&self, rhs: &mut [f64], memory: &mut LuWorkspace, gap: &mut [f64]) {
        self.lu.solve_in_place(rhs, memory);
        for (k, x) in gap.iter_mut().zip(&rhs[self.first_gap..]) {
            *k = x * self.scales.length;
        }
    }
}

fn refuse_size(body1: &dyn ElasticBody, body2: &dyn ElasticBody, n_cells: usize) -> Result<()> {
    let rows = |body: &dyn ElasticBody| match body.equations() {
        BodyEquations::FiniteElements(body) => body.condensed().model().n_free(),
        BodyEquations::HalfSpace(_) => 3 * n_cells,
        BodyEquations::Rigid
        | BodyEquations::Hybrid(_)
        | BodyEquations::BoundaryElements(_)
        | BodyEquations::Unknown => 0,
    };
    let n = rows(body1) + rows(body2) + 3 * n_cells;
    if n <= MAX_UNKNOWNS {
        return Ok(());
    }
    Err(Error::resources(format!(
        "the block system would have {n} unknowns, but this reference method allows at most {MAX_UNKNOWNS}: use solver.coupling = \"schur\", or a coarser mesh or frame"
    )))
}

impl Flexibility for BlockSystem {
    fn n_cells(&self) -> usize {
        self.n_cells
    }

    fn apply(&self, tractions: &[f64], gap: &mut [f64]) {
        let mut work = self.work.lock().expect("no panic while the buffers are held");
        let BlockWorkspace { rhs, memory, .. } = &mut *work;
        self.load(tractions, ForcedBodies::All, rhs);
        self.solve(rhs, memory, gap);
    }

    fn apply_normal(&self, pressure: &[f64], normal_gap: &mut [f64]) {
        let n = self.n_cells;
        let mut work = self.work.lock().expect("no panic while the buffers are held");
        let BlockWorkspace { rhs, memory, planes: [tractions, gap] } = &mut *work;
        tractions[2 * n..].copy_from_slice(pressure);
        self.load(tractions, ForcedBodies::All, rhs);
        self.solve(rhs, memory, gap);
        normal_gap.copy_from_slice(&gap[2 * n..]);
    }

    /// Half-spaces give their blocks without a solution of the system. For meshes, the system is solved for unit
    /// tractions on each cell.
    fn diagonal_blocks(&self) -> PerCell<Matrix3<f64>> {
        let (n, rows) = (self.n_cells, self.lu.n());
        let mut blocks = vec![Matrix3::zeros(); n];
        self.bodies.iter().for_each(|body| body.add_direct_diagonal(&mut blocks));
        if !self.bodies.iter().any(BodyRows::is_meshed) {
            return PerCell::Each(blocks);
        }
        let mut work = self.work.lock().expect("no panic while the buffers are held");
        let BlockWorkspace { memory, planes: [unit, _], .. } = &mut *work;
        let mut rhs = vec![0.0; MAX_RHS * rows];
        let wanted: Vec<usize> = (0..3 * n).collect();
        unit.fill(0.0);
        for batch in wanted.chunks(MAX_RHS) {
            let rhs = &mut rhs[..batch.len() * rows];
            for (&i, column) in batch.iter().zip(rhs.chunks_exact_mut(rows)) {
                unit[i] = 1.0;
                self.load(unit, ForcedBodies::Meshed, column);
                unit[i] = 0.0;
            }
            self.lu.solve_in_place(rhs, memory);
            for (&i, column) in batch.iter().zip(rhs.chunks_exact(rows)) {
                let at = |k: usize| column[self.first_gap + k * n + i % n] * self.scales.length;
                (0..3).for_each(|k| blocks[i % n][(k, i / n)] += at(k));
            }
        }
        PerCell::Each(blocks)
    }
}
