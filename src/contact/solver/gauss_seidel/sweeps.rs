//! Sweeps over the cells in reach of contact.

use std::ops::Range;

use nalgebra::Matrix3;

use super::super::super::scales::FrictionScaling;
use super::super::super::{ContactState, Increment, NormalControl, SlipReference};
use super::cell_problem::{clipped, largest, solve_pressures};
use crate::flexibility::cell_matrix::CellMatrix;

/// Share of the mean gap of the cells in contact that the bodies move by under a prescribed force after a sweep.
const GAP_CORRECTION_SHARE: f64 = 0.5;

/// One end of the increment on the cells.
struct PathPointState {
    /// Hatted tractions (1, 2, n) by cell.
    tractions: Vec<[f64; 3]>,
    /// Hatted gap, `[3, m]` by planes, wear of this increment aside.
    gap: Vec<f64>,
    /// The same without tractions.
    unloaded_gap: Vec<f64>,
    /// Hatted tangential gap that the slip is measured from; `None`: from the end before.
    reference: Vec<Option<[f64; 2]>>,
    /// Normal motion of body 2 since the state was taken.
    normal_motion: f64,
}

/// The state of an increment on some cells, with the hatted flexibility between them.
pub(super) struct Sweeps<'s, 'p> {
    pub problem: &'s Increment<'p>,
    /// Ascending.
    pub cells: Vec<usize>,
    matrix: CellMatrix,
    /// Rows of the gap that are kept.
    rows: Range<usize>,
    sides: Vec<PathPointState>,
    count: usize,
}

/// D of P = D P̂ in a cell; slips go with its transpose.
fn hatting(hat: &Option<FrictionScaling>) -> Matrix3<f64> {
    let Some(hat) = hat else { return Matrix3::identity() };
    let (first, second) = (hat.physical_traction([1.0, 0.0]), hat.physical_traction([0.0, 1.0]));
    Matrix3::new(first[0], second[0], 0.0, first[1], second[1], 0.0, 0.0, 0.0, 1.0)
}

impl<'s, 'p> Sweeps<'s, 'p> {
    /// From an evaluated state; `matrix`: S between the `cells`, ascending, outside which nothing carries tractions.
    pub fn new(
        problem: &'s Increment<'p>,
        it: &ContactState,
        cells: Vec<usize>,
        mut matrix: CellMatrix,
    ) -> Self {
        let hatting = hatting(&problem.friction_scaling());
        if problem.friction.is_some() {
            matrix.map_blocks(|_, _, block| hatting.transpose() * block * hatting);
        }
        let m = cells.len();
        let rows = if problem.normal_only() { 2 * m..3 * m } else { 0..3 * m };
        let side = |end: usize| PathPointState {
            tractions: vec![[0.0; 3]; m],
            gap: vec![0.0; 3 * m],
            unloaded_gap: vec![0.0; 3 * m],
            reference: cells.iter().map(|&cell| reference(problem, end, cell)).collect(),
            normal_motion: 0.0,
        };
        let sides = (0..problem.path_points.len()).map(side).collect();
        let mut sweeps = Self { problem, cells, matrix, rows, sides, count: 0 };
        sweeps.load(it);
        sweeps
    }

    /// Takes tractions and gaps of an evaluated state.
    pub fn load(&mut self, it: &ContactState) {
        let (problem, m) = (self.problem, self.cells.len());
        let (n, hat) = (problem.n(), problem.friction_scaling());
        for (end, side) in self.sides.iter_mut().enumerate() {
            for (i, &cell) in self.cells.iter().enumerate() {
                let at = |plane: usize| end * 3 * n + plane * n + cell;
                side.tractions[i] = [0, 1, 2].map(|plane| it.scaled[at(plane)]);
                let along = [it.gap[at(0)], it.gap[at(1)]];
                let along = hat.as_ref().map_or(along, |hat| hat.scaled_slip(along));
                (side.gap[i], side.gap[m + i]) = (along[0], along[1]);
                side.gap[2 * m + i] = it.gap[at(2)] - problem.slip_repeats * it.wear_rate[cell];
                let elastic = [it.elastic[at(0)], it.elastic[at(1)]];
                let elastic = hat.as_ref().map_or(elastic, |hat| hat.scaled_slip(elastic));
                side.unloaded_gap[i] = side.gap[i] - elastic[0];
                side.unloaded_gap[m + i] = side.gap[m + i] - elastic[1];
                side.unloaded_gap[2 * m + i] = side.gap[2 * m + i] - it.elastic[at(2)];
            }
            side.normal_motion = 0.0;
        }
        self.count = 0;
    }

    /// Gives tractions and motions to `it`, and evaluates it.
    pub fn store(&mut self, it: &mut ContactState) {
        let n = self.problem.n();
        it.scaled.fill(0.0);
        for (end, side) in self.sides.iter_mut().enumerate() {
            for (&cell, p) in self.cells.iter().zip(&side.tractions) {
                (0..3).for_each(|plane| it.scaled[end * 3 * n + plane * n + cell] = p[plane]);
            }
            it.rigid_motion[end][2] += std::mem::take(&mut side.normal_motion);
        }
        self.problem.evaluate(it);
    }

    /// Makes the tractions of every cell right for those of the others once, to and fro in turn, then carries prescribed forces;
    /// the largest change of a traction over the largest pressure. Does not allocate.
    pub fn sweep(&mut self) -> f64 {
        let m = self.cells.len();
        let mut change: f64 = 0.0;
        for step in 0..m {
            let i = if self.count.is_multiple_of(2) { step } else { m - 1 - step };
            let moved = if self.sides.len() == 1 { self.relax::<1>(i) } else { self.relax::<2>(i) };
            change = if moved.is_nan() { moved } else { change.max(moved) };
        }
        self.count += 1;
        let mut relative = 0.0;
        for end in 0..self.sides.len() {
            if let NormalControl::Force(force) = self.problem.path_points[end].normal {
                relative = f64::max(relative, self.enforce_normal_force(end, force));
            }
        }
        let pressures = self.sides.iter().flat_map(|side| &side.tractions).map(|p| p[2]);
        let largest = pressures.fold(0.0, f64::max);
        if change == 0.0 { relative } else { (change / largest).max(relative) }
    }

    /// Scales the tractions of an end to its normal force, and moves the bodies by a share of the mean gap in contact, which
    /// would vanish; the relative change. Where nothing touches, they move by what the force would press them in if all cells did.
    fn enforce_normal_force(&mut self, end: usize, force: f64) -> f64 {
        let (m, areas, repeats) = (self.cells.len(), self.problem.areas, self.problem.slip_repeats);
        let area = |i: usize| areas[self.cells[i]];
        let carried: f64 = (0..m).map(|i| area(i) * self.sides[end].tractions[i][2]).sum();
        if carried <= 0.0 {
            let (size, energy) = self.compliance();
            self.move_normal(end, -force * energy / (size * size));
            return 1.0;
        }
        let factor = force / carried;
        let side = &mut self.sides[end];
        side.tractions.iter_mut().flatten().for_each(|t| *t *= factor);
        let gaps = side.gap[self.rows.clone()].iter_mut().zip(&side.unloaded_gap[self.rows.clone()]);
        gaps.for_each(|(gap, bare)| *gap = bare + factor * (*gap - bare));
        let (mut size, mut sum) = (0.0, 0.0);
        for i in (0..m).filter(|&i| self.sides[end].tractions[i][2] > 0.0) {
            let worn: f64 = (0..self.sides.len())
                .map(|end| self.wear_path(end, i) * self.sides[end].tractions[i][2])
                .sum();
            size += area(i);
            sum += area(i) * (self.sides[end].gap[2 * m + i] + repeats * worn);
        }
        self.move_normal(end, -GAP_CORRECTION_SHARE * sum / size);
        (factor - 1.0).abs()
    }

    /// Moves body 2 of an end along the normal.
    fn move_normal(&mut self, end: usize, by: f64) {
        let m = self.cells.len();
        let side = &mut self.sides[end];
        side.normal_motion += by;
        side.gap[2 * m..].iter_mut().chain(&mut side.unloaded_gap[2 * m..]).for_each(|gap| *gap += by);
    }

    /// Area of the cells, and energy of a unit pressure on all: Σ A, Σ A S_nn 1.
    fn compliance(&self) -> (f64, f64) {
        let (m, areas) = (self.cells.len(), self.problem.areas);
        let area = |i: usize| areas[self.cells[i]];
        let moved = |k: usize| {
            let [_, _, normal] = self.matrix.columns(k, &(2 * m..3 * m));
            normal.iter().enumerate().map(|(i, gap)| area(i) * gap).sum::<f64>()
        };
        ((0..m).map(area).sum(), (0..m).map(moved).sum())
    }

    /// Solves the equations of cell `i` for `E` ends; the largest change of a traction.
    fn relax<const E: usize>(&mut self, i: usize) -> f64 {
        let m = self.cells.len();
        let stiffness = [self.matrix.block(i, i)[(2, 2)]; E];
        let old: [f64; E] = std::array::from_fn(|end| self.sides[end].tractions[i][2]);
        let gaps: [f64; E] = std::array::from_fn(|end| self.sides[end].gap[2 * m + i]);
        if old.iter().all(|p| *p == 0.0) && gaps.iter().all(|gap| *gap >= 0.0) {
            return 0.0;
        }
        let path = std::array::from_fn(|end| self.problem.slip_repeats * self.wear_path(end, i));
        let new = solve_pressures(old, gaps, stiffness, path);
        let mut largest: f64 = 0.0;
        for end in 0..E {
            let mut change = [0.0, 0.0, new[end] - old[end]];
            if self.problem.friction.is_some() {
                let before = self.sides[end].tractions[i];
                let q = self.tangential((end, i), change[2], new[end]);
                (change[0], change[1]) = (q[0] - before[0], q[1] - before[1]);
                (self.sides[end].tractions[i][0], self.sides[end].tractions[i][1]) = (q[0], q[1]);
            }
            self.sides[end].tractions[i][2] = new[end];
            largest = largest.max(change[2].abs()).max(change[0].hypot(change[1]));
            if change != [0.0; 3] {
                self.spread((end, i), change);
            }
        }
        if new.iter().any(|p| p.is_nan()) { f64::NAN } else { largest }
    }

    /// New tangential tractions at an end of cell `i` whose pressure has changed by `change` to `p`.
    fn tangential(&self, (end, i): (usize, usize), change: f64, p: f64) -> [f64; 2] {
        let (block, slip) = (self.matrix.block(i, i), self.slip(end, i));
        let gradient = [0, 1].map(|a| slip[a] + block[(a, 2)] * change);
        let stiffness = [0, 1].map(|a| [0, 1].map(|b| block[(a, b)]));
        // A direction that supports hold everywhere has no compliance of its own: the scales have a least one.
        let size = largest(stiffness).max(1.0 / self.problem.scales.c_tangential[self.cells[i]]);
        let q = self.sides[end].tractions[i];
        clipped([q[0] - gradient[0] / size, q[1] - gradient[1] / size], p)
    }

    /// Hatted slip.
    fn slip(&self, end: usize, i: usize) -> [f64; 2] {
        let m = self.cells.len();
        let at = |end: usize| [self.sides[end].gap[i], self.sides[end].gap[m + i]];
        let from = self.sides[end].reference[i].unwrap_or_else(|| at(self.problem.previous_path_point(end)));
        let here = at(end);
        [here[0] - from[0], here[1] - from[1]]
    }

    /// |Δg|_i, mm/MPa.
    fn wear_path(&self, end: usize, i: usize) -> f64 {
        let Some(wear) = &self.problem.wear else { return 0.0 };
        let slip = self.slip(end, i);
        let v = self.problem.friction_scaling().map_or(slip, |hat| hat.physical_slip(slip));
        self.problem.path_factor(self.cells[i]) * wear.path_per_slip()(v)
    }

    /// Adds the gaps of a change of the tractions at an end of cell `i`.
    fn spread(&mut self, (end, i): (usize, usize), change: [f64; 3]) {
        let gap = &mut self.sides[end].gap[self.rows.clone()];
        let [x, y, n] = self.matrix.columns(i, &self.rows);
        if change[0] == 0.0 && change[1] == 0.0 {
            gap.iter_mut().zip(n).for_each(|(gap, n)| *gap += change[2] * n);
        } else {
            for (((gap, x), y), n) in gap.iter_mut().zip(x).zip(y).zip(n) {
                *gap += change[0] * x + change[1] * y + change[2] * n;
            }
        }
    }
}

/// Hatted tangential gap that the slip of a cell is measured from; `None`: from the end before.
fn reference(problem: &Increment, end: usize, cell: usize) -> Option<[f64; 2]> {
    let n = problem.n();
    let at = match &problem.path_points[end].reference {
        SlipReference::Previous(at) => at,
        SlipReference::PreviousPoint { stick_mask, stick_gap } if stick_mask[cell] => stick_gap,
        // Steady rolling and sliding are refused before.
        SlipReference::PreviousPoint { .. } | SlipReference::Upstream(_) | SlipReference::Prescribed(_) => {
            return None;
        }
    };
    let at = [at[cell], at[n + cell]];
    Some(problem.friction_scaling().map_or(at, |hat| hat.scaled_slip(at)))
}
