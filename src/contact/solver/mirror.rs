//! Half of an increment whose other half is its mirror image: along the mirror tractions and gaps are even, across it odd.
//!
//! The unknowns of the half are those of its own cells, under half of each prescribed force; the operator adds what the images
//! do. The answer is put together on all cells and judged there.

use super::super::window::{Window, WindowOperator, WindowProblem};
use super::super::{
    ContactState, Increment, NormalControl, PathPoint, Pressures, SlipReference, TangentialControl,
};
use super::{IterationCallback, Method, SolveReport, SolverOptions};
use crate::laws::friction::FrictionEllipse;
use crate::laws::wear::SpecificWearRate;
use crate::omitted::OmittableWork;

/// What differs from its mirror image by this share of the largest is rounding: of transforms, of sums over increments.
const EXACT: f64 = 1e-13;

/// The same of what a solve starts from, which is no part of its answer.
const START: f64 = 1e-3;

/// Share of the tolerance for the half: sums over all cells round otherwise.
const SHARE: f64 = 0.99;

/// Grids of fewer cells along a side are not worth it.
const SMALL: usize = 16;

/// Axes of laws, and what they do along them.
#[derive(Debug, Clone, Copy)]
pub struct LawAxes {
    /// Along the first and the second.
    pub sizes: [f64; 2],
    /// Angle of the first from the frame's x, radians.
    pub angle: f64,
}

impl From<FrictionEllipse> for LawAxes {
    fn from(ellipse: FrictionEllipse) -> Self {
        Self { sizes: ellipse.mu, angle: ellipse.angle }
    }
}

impl From<SpecificWearRate> for LawAxes {
    fn from(wear: SpecificWearRate) -> Self {
        Self { sizes: wear.i, angle: wear.angle }
    }
}

impl LawAxes {
    /// Whether the law is its own mirror image along x, and so along y.
    pub fn mirror(&self) -> bool {
        let [first, second] = self.sizes;
        let (sin, cos) = self.angle.sin_cos();
        (sin * cos).abs() <= EXACT || (first - second).abs() <= EXACT * first.abs()
    }
}

/// Whether halves are solved of increments with an operator on the cells of `grid`, if they are their own mirror images.
pub fn on_halves(grid: Option<[usize; 2]>, options: &SolverOptions) -> bool {
    let skips = options.skip.allows(OmittableWork::MirrorHalf) && options.method == Method::Auto;
    skips && grid.is_some_and(|grid| grid.iter().all(|&cells| cells >= SMALL))
}

/// Whether nothing of a vector along x, y points along axis `across`.
pub fn has_no_component_across(vector: [f64; 2], across: usize) -> bool {
    vector[across].abs() <= EXACT * vector[1 - across].abs()
}

/// Whether a field on a grid is its own mirror image along axis `across`, whose number of cells is even.
pub fn is_even(field: &[f64], grid: [usize; 2], across: usize) -> bool {
    Halves { grid, across }.are_alike([(field, 1.0)], EXACT)
}

/// A grid and the axis across the mirror in its middle.
#[derive(Clone, Copy)]
struct Halves {
    grid: [usize; 2],
    across: usize,
}

impl Halves {
    /// The half of the larger indices.
    fn window(&self) -> Window {
        let (mut origin, mut cells) = ([0; 2], self.grid);
        cells[self.across] /= 2;
        origin[self.across] = cells[self.across];
        Window { frame: self.grid, origin, cells, factor: 1 }
    }

    /// Pairs of a cell of that half and its image.
    fn pairs(self) -> impl Iterator<Item = [usize; 2]> {
        let [nx, ny] = self.grid;
        let Window { origin: [x0, y0], .. } = self.window();
        let image = move |x, y| if self.across == 0 { (nx - 1 - x, y) } else { (x, ny - 1 - y) };
        (x0..nx).flat_map(move |x| {
            (y0..ny).map(move |y| {
                let (mx, my) = image(x, y);
                [x * ny + y, mx * ny + my]
            })
        })
    }

    /// Whether fields `[N]` are their images with the sign that goes with each, within a share of the largest of all.
    fn are_alike<const F: usize>(&self, fields: [(&[f64], f64); F], share: f64) -> bool {
        let values = fields.iter().flat_map(|(field, _)| *field);
        let bound = share * values.fold(0.0_f64, |largest, value| largest.max(value.abs()));
        fields.iter().all(|(field, sign)| {
            self.pairs().all(|[cell, image]| (field[cell] - sign * field[image]).abs() <= bound)
        })
    }

    /// Signs of the images of the components x, y.
    fn signs(&self) -> [f64; 2] {
        [0, 1].map(|axis| if axis == self.across { -1.0 } else { 1.0 })
    }

    /// Whether a vector field in the surface `[2, N]` is its own image.
    fn is_alike(&self, vectors: &[f64]) -> bool {
        let (x, y) = vectors.split_at(vectors.len() / 2);
        let [sx, sy] = self.signs();
        self.are_alike([(x, sx), (y, sy)], EXACT)
    }

    /// Whether the increment is its own image, the state in `it` about so.
    fn suit(&self, problem: &Increment, it: &ContactState) -> bool {
        let n = problem.n();
        let even = |field: &[f64]| self.are_alike([(field, 1.0)], EXACT);
        let laws = [problem.friction.map(LawAxes::from), problem.wear.map(LawAxes::from)];
        // Of pressures alone what happens in the surface is no matter.
        let bare = problem.normal_only() && problem.wear.is_none();
        let gap = |gap: &[f64]| even(&gap[2 * n..]) && (bare || self.is_alike(&gap[..2 * n]));
        let turns = |(k, floating): (usize, &Vec<f64>)| {
            it.mode_amplitudes.iter().all(|f| f[k] == 0.0) || gap(floating)
        };
        laws.iter().flatten().all(LawAxes::mirror)
            && even(problem.areas)
            && gap(problem.initial_gap)
            // Worn depths only ever count beside the gap.
            && self.are_alike([(&problem.initial_gap[2 * n..], 1.0), (problem.wear_depth, 1.0)], EXACT)
            && problem.wear_path_factors.is_none_or(even)
            && problem.mode_gaps.iter().enumerate().all(turns)
            && problem.path_points.iter().enumerate().all(|(k, end)| {
                let level = end.balance.is_none() && end.fixed_normal_offset.as_deref().is_none_or(even);
                level && (bare || self.suit_along(end, it.rigid_motion[k]))
            })
            && self.starts(problem, it)
    }

    /// Makes pressures their own image on this mirror too: their means with it.
    fn even_out(&self, it: &mut ContactState) {
        let n = self.grid[0] * self.grid[1];
        for planes in it.scaled.chunks_exact_mut(3 * n) {
            let pressures = &mut planes[2 * n..];
            for [cell, image] in self.pairs() {
                let mean = 0.5 * (pressures[cell] + pressures[image]);
                (pressures[cell], pressures[image]) = (mean, mean);
            }
        }
    }

    /// Whether an end is moved, or pulled, along the mirror, and its slip measured from what is its own image.
    fn suit_along(&self, end: &PathPoint, rigid: [f64; 3]) -> bool {
        let along = match end.tangential {
            TangentialControl::Shift => has_no_component_across([rigid[0], rigid[1]], self.across),
            TangentialControl::Force(force) => has_no_component_across(force, self.across),
            TangentialControl::ForceAlong { .. } => false,
        };
        along
            && match &end.reference {
                SlipReference::Previous(at) | SlipReference::Prescribed(at) => self.is_alike(at),
                SlipReference::PreviousPoint { stick_mask, stick_gap } => {
                    self.pairs().all(|[cell, image]| stick_mask[cell] == stick_mask[image])
                        && self.is_alike(stick_gap)
                }
                SlipReference::Upstream(upstream) => {
                    let from = &upstream.source_cell;
                    let step = |cell: usize| from[cell] as isize - cell as isize;
                    self.pairs().all(|[cell, image]| step(cell) == step(image))
                        && self.is_alike(&upstream.rigid_slip)
                }
            }
    }

    /// Whether the state is about its own image, pressures that are given exactly so.
    fn starts(&self, problem: &Increment, it: &ContactState) -> bool {
        let (n, [sx, sy]) = (problem.n(), self.signs());
        let share = if problem.pressures == Pressures::Given { EXACT } else { START };
        let mut physical = vec![0.0; 2 * n];
        it.scaled.chunks_exact(3 * n).all(|planes| {
            for i in 0..n {
                let hatted = [planes[i], planes[n + i]];
                [physical[i], physical[n + i]] =
                    problem.friction_scaling().map_or(hatted, |hat| hat.physical_traction(hatted));
            }
            let (x, y) = physical.split_at(n);
            self.are_alike([(&planes[2 * n..], 1.0)], share) && self.are_alike([(x, sx), (y, sy)], START)
        })
    }

    /// An end as the half has it.
    fn halved(&self, end: &mut PathPoint) {
        if let NormalControl::Force(force) = &mut end.normal {
            *force *= 0.5;
        }
        if let TangentialControl::Force(force) = end.tangential {
            let axis = 1 - self.across;
            end.tangential = TangentialControl::ForceAlong { axis, force: 0.5 * force[axis] };
        }
    }

    /// Puts the state of the half and its image into that of all cells.
    fn put_together(&self, problem: &Increment, half: &ContactState, it: &mut ContactState) {
        let (n, hat, [sx, sy]) = (problem.n(), problem.friction_scaling(), self.signs());
        let ends = it.scaled.chunks_exact_mut(3 * n).zip(half.scaled.chunks_exact(3 * n / 2));
        for (planes, of_half) in ends {
            for (k, [cell, image]) in self.pairs().enumerate() {
                let q = [of_half[k], of_half[n / 2 + k]];
                let turned = match hat {
                    Some(hat) => {
                        let [x, y] = hat.physical_traction(q);
                        hat.scaled_traction([sx * x, sy * y])
                    }
                    None => [sx * q[0], sy * q[1]],
                };
                for (at, [x, y]) in [(cell, q), (image, turned)] {
                    (planes[at], planes[n + at], planes[2 * n + at]) = (x, y, of_half[n + k]);
                }
            }
        }
        for (k, end) in problem.path_points.iter().enumerate() {
            let across = it.rigid_motion[k][self.across];
            it.rigid_motion[k] = half.rigid_motion[k];
            if end.tangential == TangentialControl::Shift {
                it.rigid_motion[k][self.across] = across;
            }
        }
        it.mode_amplitudes.clone_from(&half.mode_amplitudes);
    }
}

/// Solves half of the increment from the state in `it`, which takes the answer; `None` if it is not its own mirror image.
pub(super) fn solve(
    problem: &Increment,
    it: &mut ContactState,
    options: &SolverOptions,
    watch: &mut IterationCallback,
    inner: &mut super::coarse_to_fine::InnerSolver,
) -> Option<SolveReport> {
    let grid = problem.flexibility.grid()?;
    if !on_halves(Some(grid), options) || problem.rigid_axes.is_some() {
        return None;
    }
    let halves = [1, 0].into_iter().filter(|&across| problem.flexibility.is_mirror_symmetric(across));
    let mut suiting = halves.map(|across| Halves { grid, across }).filter(|halves| halves.suit(problem, it));
    let halves = suiting.next()?;
    // What follows from pressures alone may be its own image on the other mirror.
    let other = if problem.normal_only() && problem.wear.is_none() { suiting.next() } else { None };
    let operator = WindowOperator::Own(problem.flexibility.mirror_half(halves.across)?);
    let part = WindowProblem::new(problem, halves.window(), operator)?;
    let mut half = part.problem(problem);
    half.path_points.iter_mut().for_each(|end| halves.halved(end));
    let mut state = part.state(it);
    state.rigid_motion.iter_mut().for_each(|rigid| rigid[halves.across] = 0.0);
    let tolerance = SHARE * options.tolerance;
    let report = inner(&half, &mut state, &SolverOptions { tolerance, ..*options }, watch);
    halves.put_together(problem, &state, it);
    if let Some(other) = other {
        other.even_out(it);
    }
    problem.evaluate(it);
    let applications = report.applications + problem.applications();
    Some(SolveReport { applications, residual: problem.natural_residual(it), ..report })
}
