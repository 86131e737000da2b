//! A finite body in contact on several of its faces: a half-space on each, and one correction between the forces on all of them.
//!
//! Its frames stand one after the other: a vector over them holds, in each of the components x, y, n, the cells of the first frame, then
//! those of the second.

use std::ops::Range;
use std::sync::Mutex;

use nalgebra::Matrix3;

use super::corrected_flexibility::build_corrected_flexibility;
use super::correction::Correction;
use super::far_field::{FarField, FarFieldOnGrid, FarFieldScratch, by_planes};
use super::half_space_fit::{HalfSpaceFit, MIN_EDGE_DISTANCE};
use super::indicators::Indicators;
use super::polynomial_order::{self, PatchHalfSpace};
use crate::bem::half_space::{CrossBlocks, SurfaceGreen};
use crate::error::{Context, Error, Result};
use crate::fem::{CondensationResources, FeModel, FeSpec, StressRecovery};
use crate::flexibility::Flexibility;
use crate::flexibility::per_cell::PerCell;
use crate::frame::{ContactFrame, Grid, Side};
use crate::geometry::{Point, format_number};
use crate::linalg::dense_matrix::DenseMatrix;

/// Where a body may come into contact.
#[derive(Clone, Copy)]
pub struct FaceContact<'a> {
    /// The group of its faces.
    pub group: &'a str,
    /// Side of the frame that the body is on.
    pub side: Side,
    /// A grid, not repeated and without an outline.
    pub frame: &'a ContactFrame,
}

/// What one frame sees of the body.
struct FramePatch {
    side: Side,
    grid: Grid,
    green: SurfaceGreen,
    far: FarField,
    indicators: Indicators,
}

/// A finite-element body with the near fields of half-spaces on several of its faces.
pub struct MultiPatchBody {
    patches: Vec<FramePatch>,
    correction: Correction,
    model: FeModel,
}

impl MultiPatchBody {
    /// The body of `spec` in contact on each of `contacts`.
    ///
    /// # Errors
    /// If a frame has no place for a half-space or its correction is not good enough, if the patches have different materials or one is
    /// too near to the other, if the body has loads or displacements of its own; if it cannot be assembled or solved.
    pub fn new(spec: FeSpec, contacts: &[FaceContact], resources: &CondensationResources) -> Result<Self> {
        let name = spec.name.clone();
        Self::build(spec, contacts, resources).context(|| name)
    }

    fn build(spec: FeSpec, contacts: &[FaceContact], resources: &CondensationResources) -> Result<Self> {
        let mut grids = Vec::with_capacity(contacts.len());
        let mut sites = Vec::with_capacity(contacts.len());
        for contact in contacts {
            let grid = contact.frame.whole_grid();
            grids.push(grid.ok_or_else(|| Error::input("each patch needs a grid frame without an outline"))?);
            let site = HalfSpaceFit::find(&spec, contact.group, contact.side, contact.frame)?;
            let why = |unsuited: super::Unsuitable| {
                Error::input(format!("`{}` has no place for a half-space: {}", contact.group, unsuited.0))
            };
            sites.push(site.map_err(why)?);
        }
        ensure_apart(&sites)?;
        let model = FeModel::with_memory_limit(spec, &resources.memory)?;
        let recovery = StressRecovery::new(&model)?;
        let nears: Vec<PatchHalfSpace> =
            sites.iter().map(|site| Ok(PatchHalfSpace::new(site, resources)?.0)).collect::<Result<_>>()?;
        let (correction, indicators) =
            polynomial_order::adaptive_correction(&model, &recovery, &nears, &resources.memory)?;
        if correction.applied_loads.is_some() {
            return Err(Error::input(
                "loads and prescribed displacements of a body in contact on several patches are not taken into account: leave them \
                 away, or condense the mesh",
            ));
        }
        for (contact, indicators) in contacts.iter().zip(&indicators) {
            if let Some(why) = indicators.rejection_reason() {
                return Err(Error::input(format!(
                    "the half-space under `{}` is not good enough: {why}",
                    contact.group
                )));
            }
        }
        let mut patches = Vec::with_capacity(contacts.len());
        let mut first = 0;
        for (i, contact) in contacts.iter().enumerate() {
            let columns = first..first + columns(&indicators[i]);
            first = columns.end;
            let block = correction.matrix.block(columns.clone(), columns)?;
            let in_frame = sites[i].stiffness.rotated(&contact.frame.axes.0.transpose());
            patches.push(FramePatch {
                side: contact.side,
                grid: grids[i],
                green: SurfaceGreen::new(&in_frame, contact.side)?,
                far: FarField::new(&block, indicators[i].nodes, &sites[i].patch, contact.side),
                indicators: indicators[i],
            });
        }
        Ok(Self { patches, correction, model })
    }

    /// How good the correction is, patch by patch.
    pub fn indicators(&self) -> impl Iterator<Item = &Indicators> {
        self.patches.iter().map(|patch| &patch.indicators)
    }

    /// The correction between the forces on all patches.
    pub fn correction(&self) -> &Correction {
        &self.correction
    }

    /// Number of unknowns of its finite elements.
    pub fn n_free(&self) -> usize {
        self.model.n_free()
    }

    /// Its flexibility on all frames, one after the other.
    ///
    /// # Errors
    /// If memory does not suffice.
    pub fn flexibility(&self, cross: CrossBlocks) -> Result<MultiFrameFlexibility> {
        let own = self.patches.iter().map(|patch| {
            build_corrected_flexibility(
                &patch.green,
                vec![patch.far.clone()],
                (&patch.grid, None),
                (cross, None),
            )
        });
        let mut whole = MultiFrameFlexibility::new(own.collect::<Result<_>>()?);
        let mut firsts = vec![0];
        for patch in &self.patches {
            firsts.push(firsts[firsts.len() - 1] + columns(&patch.indicators));
        }
        for (i, to) in self.patches.iter().enumerate() {
            for (j, from) in self.patches.iter().enumerate().filter(|(j, _)| *j != i) {
                let mut block =
                    self.correction.matrix.block(firsts[i]..firsts[i + 1], firsts[j]..firsts[j + 1])?;
                let sign = to.side.gap_sign() * from.side.gap_sign();
                block.values_mut().iter_mut().for_each(|value| *value *= sign);
                whole.between.push(CrossPatchOperator::new([to, from], [i, j], &block));
            }
        }
        Ok(whole)
    }
}

/// Number of columns of a patch.
fn columns(indicators: &Indicators) -> usize {
    3 * indicators.nodes[0] * indicators.nodes[1]
}

/// Refuses patches of different materials, and those on one plane that are too near to each other.
fn ensure_apart(sites: &[HalfSpaceFit]) -> Result<()> {
    for (i, site) in sites.iter().enumerate() {
        for other in &sites[..i] {
            if !super::inclusions::is_same_stiffness(site.stiffness.voigt(), other.stiffness.voigt()) {
                return Err(Error::input(
                    "the material under the patches differs: give those parts of the body that touch one material, or condense \
                     the mesh",
                ));
            }
            // Points along both axes and all edges, near enough to each other to miss no crossing of two rectangles.
            let spread = |site: &HalfSpaceFit| {
                let half = site.patch.half_width;
                let shortest = half.into_iter().chain(other.patch.half_width).fold(f64::INFINITY, f64::min);
                let steps = half.map(|half| (8.0 * half / shortest).ceil().min(400.0) as usize);
                let along = |axis: usize, k: usize| half[axis] * (2.0 * k as f64 / steps[axis] as f64 - 1.0);
                let mut points = Vec::new();
                for line in [-1.0, 0.0, 1.0] {
                    points.extend((0..=steps[0]).map(|k| Point::new(along(0, k), line * half[1], 0.0)));
                    points.extend((0..=steps[1]).map(|k| Point::new(line * half[0], along(1, k), 0.0)));
                }
                points
                    .into_iter()
                    .map(|x| site.patch.center + site.patch.axes.to_global(&x))
                    .collect::<Vec<_>>()
            };
            let from = |a: &HalfSpaceFit, b: &HalfSpaceFit| -> f64 {
                spread(b).iter().map(|x| a.patch.distance(&a.patch.local(x))).fold(f64::INFINITY, f64::min)
            };
            let apart = from(site, other).min(from(other, site));
            let least = |site: &HalfSpaceFit| {
                MIN_EDGE_DISTANCE * site.patch.half_width[0].min(site.patch.half_width[1])
            };
            let least = least(site).max(least(other));
            if apart < least {
                return Err(Error::input(format!(
                    "two patches are {} apart; at least {MIN_EDGE_DISTANCE} of half a side, {}, are needed: one frame can hold both",
                    format_number(apart),
                    format_number(least)
                )));
            }
        }
    }
    Ok(())
}

/// Gap on one frame by tractions on another, Σ L_a(x) L_b(y) Ĉ_ab,cd L_c(x') L_d(y').
struct CrossPatchOperator {
    to: usize,
    from: usize,
    grids: [FarFieldOnGrid; 2],
    /// Axes of the frames, components by planes, row by row.
    matrix: Vec<f64>,
    work: Mutex<[FarFieldScratch; 2]>,
}

impl CrossPatchOperator {
    fn new(patches: [&FramePatch; 2], [to, from]: [usize; 2], block: &DenseMatrix) -> Self {
        let grids = patches.map(|patch| {
            let first = patch.grid.half_width().map(|half| -half);
            patch.far.on_grid(patch.grid.cells, patch.grid.spacing, first)
        });
        let work = Mutex::new(grids.each_ref().map(FarFieldScratch::new));
        Self { to, from, matrix: by_planes(block, patches.map(|patch| patch.side)), work, grids }
    }

    /// Adds the gaps by `tractions`, both by planes of the components `planes`.
    fn add(&self, planes: Range<usize>, tractions: &[f64], gap: &mut [f64]) {
        let mut work = self.work.lock().expect("no panic while the work is held");
        let [to, from] = &mut *work;
        let [n_to, n_from] = self.grids.each_ref().map(FarFieldOnGrid::n_nodes);
        let cells = self.grids.each_ref().map(|grid| grid.cells[0] * grid.cells[1]);
        for (plane, forces) in tractions.chunks_exact(cells[1]).zip(from.forces.chunks_exact_mut(n_from)) {
            self.grids[1].gather(plane, &mut from.rows, forces);
        }
        let used = n_from * planes.len();
        for (row, gap) in to.gaps[..n_to * planes.len()].iter_mut().enumerate() {
            let first = (planes.start * n_to + row) * 3 * n_from + planes.start * n_from;
            let entries = &self.matrix[first..first + used];
            *gap = entries.iter().zip(&from.forces[..used]).map(|(entry, force)| entry * force).sum();
        }
        for (plane, gaps) in gap.chunks_exact_mut(cells[0]).zip(to.gaps.chunks_exact(n_to)) {
            self.grids[0].scatter(gaps, &mut to.rows, plane);
        }
    }
}

/// Operators on frames one after the other, and what one frame has by tractions on another.
pub struct MultiFrameFlexibility {
    own: Vec<Box<dyn Flexibility>>,
    between: Vec<CrossPatchOperator>,
    /// Tractions and gaps frame by frame.
    scratch: Mutex<[Vec<f64>; 2]>,
}

/// A product with one of the operators.
type Product<'a> = &'a dyn Fn(&dyn Flexibility, &[f64], &mut [f64]);

/// The same that an operator may not have.
type Attempt<'a> = &'a dyn Fn(&dyn Flexibility, &[f64], &mut [f64]) -> bool;

impl MultiFrameFlexibility {
    /// Of operators that have nothing to do with each other.
    pub fn new(own: Vec<Box<dyn Flexibility>>) -> Self {
        let n: usize = own.iter().map(|own| own.n_cells()).sum();
        Self { own, between: Vec::new(), scratch: Mutex::new([vec![0.0; 3 * n], vec![0.0; 3 * n]]) }
    }

    /// The range of the cells of each frame.
    pub fn cells(&self) -> impl Iterator<Item = Range<usize>> {
        self.own.iter().scan(0, |first, own| {
            let start = *first;
            *first += own.n_cells();
            Some(start..*first)
        })
    }

    /// Takes the components `planes` of a vector over all cells apart, frame by frame, and puts together what `product` makes of them.
    fn frame_by_frame(&self, planes: Range<usize>, product: Product, (input, output): (&[f64], &mut [f64])) {
        let n = self.n_cells();
        let mut scratch = self.scratch.lock().expect("no panic while the scratch is held");
        let [tractions, gaps] = &mut *scratch;
        let part = |cells: &Range<usize>| planes.len() * cells.start..planes.len() * cells.end;
        for cells in self.cells() {
            let own = &mut tractions[part(&cells)];
            for (plane, own) in own.chunks_exact_mut(cells.len()).enumerate() {
                own.copy_from_slice(&input[plane * n..][cells.clone()]);
            }
        }
        for (own, cells) in self.own.iter().zip(self.cells()) {
            product(&**own, &tractions[part(&cells)], &mut gaps[part(&cells)]);
        }
        let ranges = |frame: usize| self.cells().nth(frame).map(|cells| part(&cells));
        for between in &self.between {
            if let (Some(to), Some(from)) = (ranges(between.to), ranges(between.from)) {
                between.add(planes.clone(), &tractions[from], &mut gaps[to]);
            }
        }
        for cells in self.cells() {
            for (plane, own) in gaps[part(&cells)].chunks_exact(cells.len()).enumerate() {
                output[plane * n..][cells.clone()].copy_from_slice(own);
            }
        }
    }

    /// The same for products that not all may have, without what is between the frames.
    fn if_all(&self, planes: usize, product: Attempt, (input, output): (&[f64], &mut [f64])) -> bool {
        let n = self.n_cells();
        let mut scratch = self.scratch.lock().expect("no panic while the scratch is held");
        let [from, to] = &mut *scratch;
        for (own, cells) in self.own.iter().zip(self.cells()) {
            let size = planes * cells.len();
            for (plane, part) in from[..size].chunks_exact_mut(cells.len()).enumerate() {
                part.copy_from_slice(&input[plane * n..][cells.clone()]);
            }
            if !product(&**own, &from[..size], &mut to[..size]) {
                return false;
            }
            for (plane, part) in to[..size].chunks_exact(cells.len()).enumerate() {
                output[plane * n..][cells.clone()].copy_from_slice(part);
            }
        }
        true
    }
}

impl Flexibility for MultiFrameFlexibility {
    fn n_cells(&self) -> usize {
        self.own.iter().map(|own| own.n_cells()).sum()
    }

    fn apply(&self, tractions: &[f64], gap: &mut [f64]) {
        self.frame_by_frame(0..3, &|own, tractions, gap| own.apply(tractions, gap), (tractions, gap));
    }

    fn apply_normal(&self, pressure: &[f64], normal_gap: &mut [f64]) {
        let product: Product = &|own, pressure, gap| own.apply_normal(pressure, gap);
        self.frame_by_frame(2..3, product, (pressure, normal_gap));
    }

    fn diagonal_blocks(&self) -> PerCell<Matrix3<f64>> {
        let blocks =
            self.own.iter().flat_map(|own| own.diagonal_blocks().iter().copied().collect::<Vec<_>>());
        PerCell::Each(blocks.collect())
    }

    fn couples_normal_tangential(&self) -> bool {
        !self.between.is_empty() || self.own.iter().any(|own| own.couples_normal_tangential())
    }

    /// Frame by frame: what is between them is small and smooth.
    fn precondition_normal(&self, normal_gap: &[f64], pressure: &mut [f64]) -> bool {
        self.if_all(1, &|own, gap, pressure| own.precondition_normal(gap, pressure), (normal_gap, pressure))
    }

    fn precondition(&self, gap: &[f64], tractions: &mut [f64]) -> bool {
        self.if_all(3, &|own, gap, tractions| own.precondition(gap, tractions), (gap, tractions))
    }

    fn direct_sum(&self, cell: usize, tractions: &[f64]) -> Option<[f64; 3]> {
        let n = self.n_cells();
        let frames: Vec<Range<usize>> = self.cells().collect();
        let frame = frames.iter().position(|cells| cells.contains(&cell))?;
        let of = |frame: usize| -> Vec<f64> {
            (0..3).flat_map(|plane| &tractions[plane * n..][frames[frame].clone()]).copied().collect()
        };
        let own = cell - frames[frame].start;
        let mut gap = self.own[frame].direct_sum(own, &of(frame))?;
        for between in self.between.iter().filter(|between| between.to == frame) {
            let cells = frames[frame].len();
            let mut share = vec![0.0; 3 * cells];
            between.add(0..3, &of(between.from), &mut share);
            (0..3).for_each(|c| gap[c] += share[c * cells + own]);
        }
        Some(gap)
    }
}
