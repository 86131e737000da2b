//! Window: restricts an increment to a rectangle of cells of a grid frame, or to coarser cells.
//!
//! Cells outside the window carry no traction. On coarser cells, gaps and depths are means over the fine cells.

use std::ops::Range;
use std::sync::Arc;

use super::scales::ContactScales;
use super::{ContactState, Increment, PathPoint, SlipReference, Upstream};
use crate::flexibility::Flexibility;

/// Rectangle of window cells on a grid frame. Each window cell consists of `factor` x `factor` frame cells.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Window {
    /// Number of frame cells along x and y.
    pub frame: [usize; 2],
    /// First frame cell of the window along x and y.
    pub origin: [usize; 2],
    /// Number of window cells along x and y.
    pub cells: [usize; 2],
    pub factor: usize,
}

impl Window {
    pub fn n(&self) -> usize {
        self.cells[0] * self.cells[1]
    }

    fn span(&self, axis: usize, index: usize) -> Range<usize> {
        let first = self.origin[axis] + index * self.factor;
        first..first + self.factor
    }

    /// Calls `with(window cell, frame cell)` for each frame cell in the window.
    fn pairs(&self, mut with: impl FnMut(usize, usize)) {
        for ix in 0..self.cells[0] {
            for x in self.span(0, ix) {
                for iy in 0..self.cells[1] {
                    for y in self.span(1, iy) {
                        with(ix * self.cells[1] + iy, x * self.frame[1] + y);
                    }
                }
            }
        }
    }

    /// Means of a frame field over the window cells, for each component.
    pub fn restrict(&self, field: &[f64]) -> Vec<f64> {
        let (from, to) = (self.frame[0] * self.frame[1], self.n());
        let share = 1.0 / (self.factor * self.factor) as f64;
        let mut means = vec![0.0; field.len() / from * to];
        for (plane, means) in field.chunks_exact(from).zip(means.chunks_exact_mut(to)) {
            self.pairs(|cell, of_frame| means[cell] += share * plane[of_frame]);
        }
        means
    }

    /// Interpolates a window field to the frame cells of the window, component by component. The interpolation is bilinear between
    /// the centres of the window cells marked in `count`. Frame cells without a marked neighbour keep their value.
    pub fn interpolate(&self, field: &[f64], count: &[bool], out: &mut [f64]) {
        let (to, from) = (self.frame[0] * self.frame[1], self.n());
        for ix in 0..self.cells[0] * self.factor {
            for iy in 0..self.cells[1] * self.factor {
                let (near, weights) = self.neighbours([ix, iy]);
                let total: f64 = near.iter().zip(weights).filter(|(k, _)| count[**k]).map(|(_, w)| w).sum();
                if total == 0.0 {
                    continue;
                }
                let of_frame = (self.origin[0] + ix) * self.frame[1] + self.origin[1] + iy;
                for (plane, out) in field.chunks_exact(from).zip(out.chunks_exact_mut(to)) {
                    let known = near.iter().zip(weights).filter(|(k, _)| count[**k]);
                    out[of_frame] = known.map(|(&k, w)| w * plane[k]).sum::<f64>() / total;
                }
            }
        }
    }

    /// The four window cells around a frame cell, and their weights in bilinear interpolation. `at` is the position of
    /// the frame cell along x and y, counted from the first cell of the window.
    fn neighbours(&self, at: [usize; 2]) -> ([usize; 4], [f64; 4]) {
        let along = [0, 1].map(|axis| {
            let last = self.cells[axis] - 1;
            let place = ((at[axis] as f64 + 0.5) / self.factor as f64 - 0.5).clamp(0.0, last as f64);
            let first = (place as usize).min(last.saturating_sub(1));
            (first, (first + 1).min(last), place - first as f64)
        });
        let [(x0, x1, u), (y0, y1, v)] = along;
        let cell = |x: usize, y: usize| x * self.cells[1] + y;
        (
            [cell(x0, y0), cell(x0, y1), cell(x1, y0), cell(x1, y1)],
            [(1.0 - u) * (1.0 - v), (1.0 - u) * v, u * (1.0 - v), u * v],
        )
    }

    /// Writes a window field to the frame, component by component: constant in each window cell, zero outside the window.
    pub fn prolong(&self, field: &[f64], out: &mut [f64]) {
        let (to, from) = (self.frame[0] * self.frame[1], self.n());
        out.fill(0.0);
        for (plane, out) in field.chunks_exact(from).zip(out.chunks_exact_mut(to)) {
            self.pairs(|cell, of_frame| out[of_frame] = plane[cell]);
        }
    }
}

pub(super) enum WindowOperator<'a> {
    /// The operator of the frame, if the window covers the whole frame.
    Frame(&'a dyn Flexibility),
    Own(Arc<dyn Flexibility>),
}

impl WindowOperator<'_> {
    fn flexibility(&self) -> &dyn Flexibility {
        match self {
            Self::Frame(operator) => *operator,
            Self::Own(operator) => operator.as_ref(),
        }
    }
}

pub(super) struct WindowProblem<'a> {
    pub window: Window,
    operator: WindowOperator<'a>,
    scales: Arc<ContactScales>,
    areas: Vec<f64>,
    pub initial_gap: Vec<f64>,
    cyclic_gap: Option<Vec<f64>>,
    rigid_axes: Option<Vec<nalgebra::Matrix3<f64>>>,
    floating: Vec<Vec<f64>>,
    worn: Vec<f64>,
    path_factors: Option<Vec<f64>>,
    ends: Vec<PathPoint>,
}

impl<'a> WindowProblem<'a> {
    /// Restricts the increment `problem` to the window. `None` if the slip reference of a path point cannot be
    /// restricted to coarser cells.
    pub fn new(problem: &Increment, window: Window, operator: WindowOperator<'a>) -> Option<Self> {
        let scales = match &operator {
            WindowOperator::Frame(_) => problem.scales.clone(),
            WindowOperator::Own(own) => Arc::new(ContactScales::new(own.as_ref(), problem.friction.as_ref())),
        };
        let areas = window.restrict(problem.areas);
        let larger = (window.factor * window.factor) as f64;
        Some(Self {
            window,
            operator,
            scales,
            areas: areas.iter().map(|area| area * larger).collect(),
            initial_gap: window.restrict(problem.initial_gap),
            cyclic_gap: problem.cyclic_gap.map(|gap| window.restrict(gap)),
            rigid_axes: problem.rigid_axes.map(|axes| {
                let mut picked = vec![nalgebra::Matrix3::identity(); window.n()];
                window.pairs(|cell, of_frame| picked[cell] = axes[of_frame]);
                picked
            }),
            floating: problem.mode_gaps.iter().map(|gap| window.restrict(gap)).collect(),
            worn: window.restrict(problem.wear_depth),
            path_factors: problem.wear_path_factors.map(|factors| window.restrict(factors)),
            ends: problem.path_points.iter().map(|end| on_window(end, &window)).collect::<Option<_>>()?,
        })
    }

    pub fn problem<'b>(&'b self, whole: &'b Increment) -> Increment<'b> {
        Increment {
            flexibility: self.operator.flexibility(),
            areas: &self.areas,
            initial_gap: &self.initial_gap,
            cyclic_gap: self.cyclic_gap.as_deref(),
            rigid_axes: self.rigid_axes.as_deref(),
            mode_gaps: &self.floating,
            scales: self.scales.clone(),
            patches: &[],
            wear_depth: &self.worn,
            wear_path_factors: self.path_factors.as_deref(),
            path_points: self.ends.clone(),
            ..*whole
        }
    }

    pub fn state(&self, whole: &ContactState) -> ContactState {
        let mut it = ContactState::new(self.window.n(), whole.rigid_motion.clone());
        it.mode_amplitudes.clone_from(&whole.mode_amplitudes);
        it.scaled = self.window.restrict(&whole.scaled);
        it
    }

    /// Writes tractions and motions to `whole`. Tractions outside the window become zero.
    pub fn write_back(&self, it: &ContactState, whole: &mut ContactState) {
        self.window.prolong(&it.scaled, &mut whole.scaled);
        whole.rigid_motion.clone_from(&it.rigid_motion);
        whole.mode_amplitudes.clone_from(&it.mode_amplitudes);
    }
}

/// Restricts the upstream cells of steady rolling to a window. Material from outside enters at the window's edge. The
/// rigid slip of a window cell is `factor` times the mean over its frame cells, because the passage takes `factor`
/// times as long.
fn upstream_on(upstream: &Upstream, window: &Window) -> Upstream {
    let mut place = vec![None; window.frame[0] * window.frame[1]];
    window.pairs(|cell, of_frame| place[of_frame] = Some(cell));
    let ahead = |of_frame: usize| (0..window.factor).fold(of_frame, |cell, _| upstream.source_cell[cell]);
    let mut source_cell: Vec<usize> = (0..window.n()).collect();
    window.pairs(|cell, of_frame| source_cell[cell] = place[ahead(of_frame)].unwrap_or(cell));
    let mut rigid_slip = window.restrict(&upstream.rigid_slip);
    rigid_slip.iter_mut().for_each(|creep| *creep *= window.factor as f64);
    Upstream { source_cell, rigid_slip }
}

fn on_window(end: &PathPoint, window: &Window) -> Option<PathPoint> {
    let reference = match &end.reference {
        SlipReference::Previous { gap, pressures } => {
            SlipReference::Previous { gap: window.restrict(gap), pressures: window.restrict(pressures) }
        }
        SlipReference::PreviousPoint { stick_mask, stick_gap, origin } if window.factor == 1 => {
            let mut picked = vec![false; window.n()];
            window.pairs(|cell, of_frame| picked[cell] = stick_mask[of_frame]);
            SlipReference::PreviousPoint {
                stick_mask: picked,
                stick_gap: window.restrict(stick_gap),
                origin: *origin,
            }
        }
        SlipReference::Upstream(upstream) => SlipReference::Upstream(upstream_on(upstream, window)),
        SlipReference::Prescribed(slip) => SlipReference::Prescribed(window.restrict(slip)),
        SlipReference::PreviousPoint { .. } => return None,
    };
    let mut pairs = vec![0; window.n()];
    window.pairs(|cell, of_frame| pairs[cell] = of_frame);
    let balance = end.balance.as_ref().map(|balance| balance.restricted_to(&pairs));
    Some(PathPoint { balance, reference, ..end.clone() })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Truth: the mean of a linear field over a coarse cell is its value at the centre. For windows of frame cells, restriction and
    /// prolongation reproduce the field inside the window and give zero outside.
    #[test]
    fn means_and_back() {
        let frame = [8, 6];
        let field: Vec<f64> = (0..96).map(|k| f64::from(k / 6 * 10 + k % 6)).collect();
        let coarse = Window { frame, origin: [2, 0], cells: [3, 2], factor: 2 };
        let means = coarse.restrict(&field);
        assert_eq!(means[..6], [25.5, 27.5, 45.5, 47.5, 65.5, 67.5]);
        assert_eq!(means[6], 105.5);
        let part = Window { frame, origin: [1, 2], cells: [4, 3], factor: 1 };
        let mut back = vec![f64::NAN; 96];
        part.prolong(&part.restrict(&field), &mut back);
        for (k, value) in back.iter().enumerate() {
            let (x, y) = (k % 48 / 6, k % 6);
            let inside = (1..5).contains(&x) && (2..5).contains(&y);
            assert_eq!(*value, if inside { field[k] } else { 0.0 });
        }
    }
}
