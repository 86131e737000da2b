//! Steady rolling: the contact is fixed in the frame, and the material passes through the contact.

use crate::contact::{ContactState, Upstream};
use crate::error::{Error, Result};
use crate::evolution::records::RollingRecord;
use crate::evolution::run::{Advance, Run};
use crate::evolution::step::{Rolling, Tangential};
use crate::frame::ContactFrame;

impl Rolling {
    /// Axis of the frame (0 or 1) along which the contact rolls, and sign of the rolling direction along this axis.
    fn axis(&self) -> (usize, f64) {
        (usize::from(self.quarter_turns % 2), if self.quarter_turns % 4 < 2 { 1.0 } else { -1.0 })
    }

    /// Distance rolled while the material passes through a cell, mm.
    fn passage(&self, frame: &ContactFrame) -> f64 {
        frame.grid.map_or(0.0, |grid| grid.spacing[self.axis().0])
    }

    /// Upstream cells, and the rigid slip during the passage through a cell, for the fraction `share` of creepages and
    /// spin.
    ///
    /// The upstream cell is the neighbour on the leading side. A cell without a neighbour on this side is its own
    /// upstream cell. The rigid slip is evaluated half a cell ahead of the centre.
    fn upstream(&self, frame: &ContactFrame, share: f64) -> Result<Upstream> {
        let grid = frame.grid.ok_or_else(|| {
            Error::input("rolling needs cells in rows along its direction: use frame.kind = \"grid\"")
        })?;
        let ([nx, ny], (axis, sense)) = (grid.cells, self.axis());
        let (n, passage, last) = (frame.n_cells(), self.passage(frame), grid.cells[axis] - 1);
        let (mut source_cell, mut rigid_slip) = (Vec::with_capacity(n), vec![0.0; 2 * n]);
        let mut cells = vec![None; nx * ny];
        (0..n).for_each(|cell| cells[frame.grid_index(cell)] = Some(cell));
        for cell in 0..n {
            let place = frame.grid_index(cell);
            let mut at = [place / ny, place % ny];
            at[axis] = match (sense > 0.0, at[axis]) {
                (true, i) if i == last => {
                    if grid.periodic[axis] {
                        0
                    } else {
                        i
                    }
                }
                (true, i) => i + 1,
                (false, 0) => {
                    if grid.periodic[axis] {
                        last
                    } else {
                        0
                    }
                }
                (false, i) => i - 1,
            };
            // A cell at the leading edge of an outline has no upstream neighbour.
            source_cell.push(cells[at[0] * ny + at[1]].unwrap_or(cell));
            let [x, y] = frame.plane_coordinates(cell);
            // Coordinates along the rolling direction and to the left of this direction.
            let (along, left) = if axis == 0 { (sense * x, sense * y) } else { (sense * y, -sense * x) };
            let along = along + 0.5 * passage;
            let slip = [self.creepage[0] - self.spin * left, self.creepage[1] + self.spin * along]
                .map(|slip| share * slip * passage * sense);
            (rigid_slip[cell], rigid_slip[n + cell]) =
                if axis == 0 { (slip[0], slip[1]) } else { (-slip[1], slip[0]) };
        }
        Ok(Upstream { source_cell, rigid_slip })
    }
}

impl Run<'_> {
    /// Runs the increments. Later steps continue from the tangential displacement at the end of the rolling step.
    pub(super) fn run_rolling_step(&mut self) -> Advance {
        self.run_increments()?;
        self.controls.tangential =
            Tangential::Shift([self.state.rigid_motion[0], self.state.rigid_motion[1]]);
        Ok(())
    }

    pub(super) fn upstream(&self, rolling: &Rolling, number: usize) -> Result<Upstream> {
        rolling.upstream(&self.prepared.model.frame, number as f64 / self.step().increments as f64)
    }

    /// Adds dissipation and wear of increment `number` of a rolling step. Each increment covers an equal part of the
    /// rolled distance.
    ///
    /// The tractions during a passage are the means of the tractions in a cell and in its upstream cell. Without
    /// normal-tangential coupling, friction then dissipates exactly the work of the creepages. The wear volume is
    /// spread over a track of unknown length, so the gap does not change.
    pub(super) fn add_rolling_wear(
        &mut self,
        rolling: &Rolling,
        number: usize,
        it: &ContactState,
    ) -> Result<RollingRecord> {
        let step = self.step();
        let from = self.upstream(rolling, number)?.source_cell;
        let frame = &self.prepared.model.frame;
        let (n, count) = (from.len(), step.increments as f64);
        let passages = rolling.distance / count / rolling.passage(frame);
        let mean =
            |plane: usize, i: usize| 0.5 * (it.tractions[plane * n + i] + it.tractions[plane * n + from[i]]);
        let (mut dissipation, mut worn) = (0.0, 0.0);
        for (i, area) in frame.areas.iter().enumerate() {
            dissipation -= area * (mean(0, i) * it.slip[i] + mean(1, i) * it.slip[n + i]);
            worn += area * mean(2, i) * it.wear_per_pressure[i];
        }
        self.state.rolling_wear_volume += worn * passages;
        self.state.dissipation += dissipation * passages;
        if self.wears() {
            self.state.add_wear_dissipation(dissipation * passages, step.friction);
        }
        let share = number as f64 / count;
        Ok(RollingRecord {
            creepage: rolling.creepage.map(|creepage| share * creepage),
            spin: share * rolling.spin,
            distance: share * rolling.distance,
        })
    }

    pub(super) fn per_distance(&self, rolling: &Rolling, slip: &mut [f64]) {
        let passage = rolling.passage(&self.prepared.model.frame);
        slip.iter_mut().for_each(|slip| *slip /= passage);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Truth: the rigid slip during a passage of length h is h (ξ - φ y', η + φ x'), evaluated half a cell ahead of the
    /// centre. ξ and η are the creepages, φ is the spin. x' points along the rolling direction, y' to the left of it.
    /// The material comes from the cell ahead, if this cell exists.
    #[test]
    fn directions_are_turned_copies() {
        let frame = ContactFrame::grid([1.0, 1.0], [4, 4], [0.0; 2], 0.0).unwrap();
        let (creepage, spin) = ([0.3, -0.1], 0.7);
        for quarter_turns in 0..4 {
            let rolling = Rolling { quarter_turns, creepage, spin, distance: 0.0 };
            let upstream = rolling.upstream(&frame, 1.0).unwrap();
            let angle = f64::from(quarter_turns) * std::f64::consts::FRAC_PI_2;
            let (s, c) = (angle.sin().round(), angle.cos().round());
            for cell in 0..16 {
                let [x, y] = frame.plane_coordinates(cell);
                let (along, left) = (c * x + s * y + 0.25, c * y - s * x);
                let (a, b) = ((0.3 - 0.7 * left) * 0.5, (-0.1 + 0.7 * along) * 0.5);
                let expected = [c * a - s * b, s * a + c * b];
                let found = [upstream.rigid_slip[cell], upstream.rigid_slip[16 + cell]];
                assert!((0..2).all(|k| (found[k] - expected[k]).abs() < 1e-15), "{quarter_turns} {cell}");
                let [fx, fy] = frame.plane_coordinates(upstream.source_cell[cell]);
                let ahead = [x + 0.5 * c, y + 0.5 * s];
                let inside = ahead.iter().all(|a| a.abs() < 1.0);
                let wanted = if inside { ahead } else { [x, y] };
                assert!(
                    (fx - wanted[0]).abs() < 1e-15 && (fy - wanted[1]).abs() < 1e-15,
                    "{quarter_turns} {cell}"
                );
            }
        }
    }
}
