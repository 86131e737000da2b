//! An increment on a part of a grid frame, or on coarser cells: a window.
//!
//! Cells outside the window carry no traction. On coarser cells gaps and depths are means over the cells they are made of:
//! only good for a start.

use std::ops::Range;
use std::sync::Arc;

use super::scales::ContactScales;
use super::{ContactState, Increment, PathPoint, SlipReference, Upstream};
use crate::flexibility::Flexibility;

/// A rectangle of cells of a grid frame, each of `factor` x `factor` cells of the frame.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Window {
    /// Cells of the frame along x and y.
    pub frame: [usize; 2],
    /// First cell of the frame.
    pub origin: [usize; 2],
    /// Cells of the window.
    pub cells: [usize; 2],
    /// Cells of the frame along the side of one of the window's.
    pub factor: usize,
}

impl Window {
    /// Number of cells.
    pub fn n(&self) -> usize {
        self.cells[0] * self.cells[1]
    }

    /// The frame's cells along `axis` in the window's `index`.
    fn span(&self, axis: usize, index: usize) -> Range<usize> {
        let first = self.origin[axis] + index * self.factor;
        first..first + self.factor
    }

    /// Calls `with(cell of the window, cell of the frame)` for all pairs that belong together.
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

    /// Means over the window's cells of a field on the frame, plane by plane.
    pub fn restrict(&self, field: &[f64]) -> Vec<f64> {
        let (from, to) = (self.frame[0] * self.frame[1], self.n());
        let share = 1.0 / (self.factor * self.factor) as f64;
        let mut means = vec![0.0; field.len() / from * to];
        for (plane, means) in field.chunks_exact(from).zip(means.chunks_exact_mut(to)) {
            self.pairs(|cell, of_frame| means[cell] += share * plane[of_frame]);
        }
        means
    }

    /// Writes a field on the window to the frame, plane by plane, bilinear between the centres of those cells that `count`; what
    /// is not covered stays.
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

    /// The four cells about a cell of the frame, counted from the window's first, and their weights in bilinear interpolation.
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

    /// Writes a field on the window to the frame, zero outside, plane by plane.
    pub fn prolong(&self, field: &[f64], out: &mut [f64]) {
        let (to, from) = (self.frame[0] * self.frame[1], self.n());
        out.fill(0.0);
        for (plane, out) in field.chunks_exact(from).zip(out.chunks_exact_mut(to)) {
            self.pairs(|cell, of_frame| out[of_frame] = plane[cell]);
        }
    }
}

/// The operator on a window.
pub(super) enum WindowOperator<'a> {
    /// That of the frame, all of which the window covers.
    Frame(&'a dyn Flexibility),
    /// Its own.
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

/// What the increment on a window is made of.
pub(super) struct WindowProblem<'a> {
    pub window: Window,
    operator: WindowOperator<'a>,
    scales: Arc<ContactScales>,
    areas: Vec<f64>,
    pub initial_gap: Vec<f64>,
    rigid_axes: Option<Vec<nalgebra::Matrix3<f64>>>,
    floating: Vec<Vec<f64>>,
    worn: Vec<f64>,
    path_factors: Option<Vec<f64>>,
    ends: Vec<PathPoint>,
}

impl<'a> WindowProblem<'a> {
    /// The part of `problem` on `window`, with the operator on it; `None` if one of its ends knows the frame's cells only.
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

    /// Its equations.
    pub fn problem<'b>(&'b self, whole: &'b Increment) -> Increment<'b> {
        Increment {
            flexibility: self.operator.flexibility(),
            areas: &self.areas,
            initial_gap: &self.initial_gap,
            rigid_axes: self.rigid_axes.as_deref(),
            mode_gaps: &self.floating,
            scales: self.scales.clone(),
            wear_depth: &self.worn,
            wear_path_factors: self.path_factors.as_deref(),
            path_points: self.ends.clone(),
            ..*whole
        }
    }

    /// A state on the window with the tractions and motions of one on the frame.
    pub fn state(&self, whole: &ContactState) -> ContactState {
        let mut it = ContactState::new(self.window.n(), whole.rigid_motion.clone());
        it.mode_amplitudes.clone_from(&whole.mode_amplitudes);
        it.scaled = self.window.restrict(&whole.scaled);
        it
    }

    /// Takes tractions and motions back to the frame.
    pub fn write_back(&self, it: &ContactState, whole: &mut ContactState) {
        self.window.prolong(&it.scaled, &mut whole.scaled);
        whole.rigid_motion.clone_from(&it.rigid_motion);
        whole.mode_amplitudes.clone_from(&it.mode_amplitudes);
    }
}

/// Rolling on a window: what comes from outside enters there, and the passage of a longer cell takes longer.
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

/// What is prescribed at an end, on a window.
fn on_window(end: &PathPoint, window: &Window) -> Option<PathPoint> {
    let reference = match &end.reference {
        SlipReference::Previous(at) => SlipReference::Previous(window.restrict(at)),
        SlipReference::PreviousPoint { stick_mask, stick_gap } if window.factor == 1 => {
            let mut picked = vec![false; window.n()];
            window.pairs(|cell, of_frame| picked[cell] = stick_mask[of_frame]);
            SlipReference::PreviousPoint { stick_mask: picked, stick_gap: window.restrict(stick_gap) }
        }
        SlipReference::Upstream(upstream) => SlipReference::Upstream(upstream_on(upstream, window)),
        SlipReference::Prescribed(slip) => SlipReference::Prescribed(window.restrict(slip)),
        SlipReference::PreviousPoint { .. } => return None,
    };
    let mut pairs = vec![0; window.n()];
    window.pairs(|cell, of_frame| pairs[cell] = of_frame);
    let balance = end.balance.as_ref().map(|balance| balance.restricted_to(&pairs));
    Some(PathPoint { normal: end.normal, tangential: end.tangential, balance, reference })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Truth: means of a linear field are its values at the middle; what goes out comes back the same.
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
