//! Half-space of which only a part of the surface around the frame is meshed. The boundary integrals use full-space
//! kernels. The displacement of the surface beyond the elements is taken as zero.
//!
//! This model reproduces results of other programs that have no exact half-space. [`Truncation`] measures the
//! difference from the exact operator.

use std::sync::Arc;

use faer::Par;
use nalgebra::Matrix3;

use super::half_space::surface_displacement;
use super::{BodyField, ElasticBody, HalfSpaceBody, Loading};
use crate::bem::finite::{BoundaryElements, Interpolation, Panel};
use crate::bem::full_space::FullSpaceField;
use crate::bem::half_space::{CrossBlocks, DenseFlexibility};
use crate::element::ElementKind;
use crate::error::{Error, Result};
use crate::flexibility::Flexibility;
use crate::frame::{ContactFrame, Grid};
use crate::geometry::{Point, Side, Triad, format_number};
use crate::linalg::cache::Cache;
use crate::linalg::dense_lu;
use crate::linalg::memory::MemoryLimit;
use crate::material::Stiffness;

/// Accuracy of the integrals, relative to their largest values.
const INTEGRATION_TOLERANCE: f64 = 1e-6;

/// Admissible half-side of the meshed square, divided by half of the longer side of the frame. Above the upper limit,
/// elements become too slender.
pub(crate) const HALF_SIZE_TO_FRAME_RANGE: [f64; 2] = [1.1, 1000.0];
const ROUNDING: f64 = 1e-9;

/// Largest ratio of the lengths of adjacent elements beyond the frame.
const MAX_ELEMENT_GROWTH: f64 = 1.4;

/// Half-space below or above a plane frame. The surface is meshed in a square with the half-side `half_size` along the
/// frame's x and y.
#[derive(Debug, Clone)]
pub struct TruncatedSpec<'a> {
    /// Stiffness of the material, global axes.
    pub stiffness: &'a Stiffness,
    /// Half of the side of the meshed square, mm.
    pub half_size: f64,
}

/// Deviation of the truncated model from the exact half-space.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Truncation {
    /// Number of elements.
    pub n_elements: usize,
    /// Mean normal displacement of the frame under uniform unit pressure, mm/MPa: first by the truncated model, then by
    /// the exact half-space.
    pub compliance: [f64; 2],
    /// Relative error |W - W_exact| / |W_exact|. W_ab is the work of a uniform unit traction along a on the
    /// displacements due to a uniform unit traction along b. W follows from the truncated model, W_exact from the
    /// half-space.
    pub difference: f64,
    /// Residual of some equations that are recomputed after the solution, relative to the magnitude of their terms.
    pub residual: f64,
}

/// Half-space with a meshed surface on a frame.
pub struct TruncatedHalfSpace {
    side: Side,
    axes: Triad,
    flexibility: Arc<dyn Flexibility>,
    truncation: Truncation,
    cache_warning: Option<String>,
}

/// Edges of the cells and of the elements beyond them, relative to the centre of the frame, mm. Beyond the frame, the
/// lengths of adjacent elements have a constant ratio of at most [`MAX_ELEMENT_GROWTH`].
fn element_edges(cells: usize, spacing: f64, half_size: f64) -> Vec<f64> {
    let half = 0.5 * cells as f64 * spacing;
    let length = half_size - half;
    let sum = |q: f64, k: i32| (1..=k).map(|i| spacing * q.powi(i)).sum::<f64>();
    let k = (1..).find(|&k| sum(MAX_ELEMENT_GROWTH, k) >= length).unwrap_or(1);
    let (mut low, mut high) = (0.0, MAX_ELEMENT_GROWTH);
    for _ in 0..60 {
        let q = 0.5 * (low + high);
        if sum(q, k) < length { low = q } else { high = q }
    }
    let beyond = |i: i32| half + sum(high, i);
    let outer = (1..=k).rev().map(|i| -beyond(i));
    let inner = (0..=cells).map(|i| i as f64 * spacing - half);
    outer.chain(inner).chain((1..=k).map(beyond)).collect()
}

fn element_ends(grid: &Grid, half_size: f64) -> [Vec<f64>; 2] {
    [0, 1].map(|axis| element_edges(grid.cells[axis], grid.spacing[axis], half_size))
}

impl TruncatedSpec<'_> {
    /// Number of surface elements.
    ///
    /// # Errors
    /// If the frame is not a grid or is periodic, or `half_size` is out of range.
    pub fn n_elements(&self, frame: &ContactFrame) -> Result<usize> {
        let grid = self.grid(frame)?;
        Ok(element_ends(&grid, self.half_size).iter().map(|ends| ends.len() - 1).product())
    }

    /// Memory needed to build the body, bytes.
    ///
    /// # Errors
    /// As [`Self::n_elements`].
    pub fn bytes(&self, frame: &ContactFrame) -> Result<u128> {
        let (n, loaded) = (3 * self.n_elements(frame)? as u128, 3 * frame.n_cells() as u128);
        // Sum of the equations, two copies of the solution, and the used part of the buffers of dense products.
        let equations = 8 * n * n;
        Ok(equations + 16 * n * loaded + dense_lu::product_buffer_bytes(equations))
    }

    fn grid(&self, frame: &ContactFrame) -> Result<Grid> {
        let grid = frame.grid.ok_or_else(|| {
            Error::input("a truncated half-space needs a grid frame (frame.kind = \"grid\")")
        })?;
        if grid.periodic != [false; 2] {
            return Err(Error::input(
                "a truncated half-space does not support periodic frames: remove frame.periodic, or `truncated`",
            ));
        }
        let half = grid.half_width();
        let most = half[0].max(half[1]);
        let [least, farthest] = HALF_SIZE_TO_FRAME_RANGE.map(|times| times * most);
        if !(least * (1.0 - ROUNDING)..=farthest).contains(&self.half_size) {
            return Err(Error::input(format!(
                "`truncated` is {}, but the half-width of the frame is {}: use a value from {} to {}",
                format_number(self.half_size),
                format_number(most),
                format_number(least),
                format_number(farthest)
            )));
        }
        Ok(grid)
    }
}

impl TruncatedHalfSpace {
    /// Builds the body on `side` of `frame`, within the available memory.
    ///
    /// # Errors
    /// As [`TruncatedSpec::n_elements`], and if memory does not suffice.
    pub fn new(
        spec: &TruncatedSpec,
        side: Side,
        frame: &ContactFrame,
        cache: Option<&Cache>,
        memory: &MemoryLimit,
    ) -> Result<Self> {
        let grid = spec.grid(frame)?;
        let n_elements = spec.n_elements(frame)?;
        let what = format!("a truncated half-space with {n_elements} surface elements");
        memory.ensure_available(
            spec.bytes(frame)?,
            &what,
            "use fewer cells in the frame, or a smaller surface (`truncated`)",
        )?;
        let [x, y] = element_ends(&grid, spec.half_size);
        let (field, cache_warning) = FullSpaceField::load_or_compute(spec.stiffness, cache)?;
        let panels = panels(frame, [&x, &y], side);
        let elements = BoundaryElements::new(
            panels,
            Interpolation::Constant,
            spec.stiffness,
            field,
            INTEGRATION_TOLERANCE,
        );
        let outer = [(x.len() - 1 - grid.cells[0]) / 2, (y.len() - 1 - grid.cells[1]) / 2];
        let element = |cell: usize| {
            let place = frame.grid_index(cell);
            let [ix, iy] = grid.cell_indices(place);
            (ix + outer[0]) * (y.len() - 1) + iy + outer[1]
        };
        let n = frame.n_cells();
        let loaded: Vec<usize> = (0..n).map(element).collect();
        let response = elements.plane_response(&loaded, Par::rayon(0))?;
        let axes = frame.axes.0;
        let mut k = vec![0.0; 9 * n * n];
        for (i, &node) in loaded.iter().enumerate() {
            for j in 0..n {
                let block = Matrix3::from_fn(|a, b| response.displacement.at(3 * node + a, 3 * j + b));
                let local = axes.transpose() * block * axes;
                for (a, b) in (0..9).map(|k| (k % 3, k / 3)) {
                    k[(a * n + i) * 3 * n + b * n + j] = local[(a, b)];
                }
            }
        }
        let flexibility: Arc<dyn Flexibility> = Arc::new(DenseFlexibility::of_displacements(k, &frame.areas));
        let exact = HalfSpaceBody::new(spec.stiffness, side, frame)?.take_flexibility(CrossBlocks::Keep)?;
        let exact = exact.ok_or_else(|| Error::numerical("a half-space without a flexibility"))?;
        let [found, wanted] =
            [flexibility.as_ref(), exact.as_ref()].map(|operator| uniform_traction_works(operator, frame));
        let area: f64 = frame.areas.iter().sum();
        let truncation = Truncation {
            n_elements,
            compliance: [found, wanted].map(|works| works[(2, 2)] / area),
            difference: (found - wanted).norm() / wanted.norm(),
            residual: response.residual,
        };
        Ok(Self { side, axes: frame.axes, flexibility, truncation, cache_warning })
    }

    /// Deviation from the exact half-space.
    pub fn truncation(&self) -> &Truncation {
        &self.truncation
    }

    /// Warning of the cache of tabulated kernels, if any.
    pub fn cache_warning(&self) -> Option<&str> {
        self.cache_warning.as_deref()
    }

    /// Memory that the body keeps, bytes.
    pub fn held_bytes(&self) -> usize {
        72 * self.flexibility.n_cells().pow(2)
    }
}

/// Works W_ab of uniform unit tractions along a = x, y, n (rows) on the displacements due to tractions along b
/// (columns).
fn uniform_traction_works(operator: &dyn Flexibility, frame: &ContactFrame) -> Matrix3<f64> {
    let n = frame.n_cells();
    let mut sums = Matrix3::zeros();
    for b in 0..3 {
        let tractions: Vec<f64> = (0..3 * n).map(|k| if k / n == b { 1.0 } else { 0.0 }).collect();
        let mut gap = vec![0.0; 3 * n];
        operator.apply(&tractions, &mut gap);
        for a in 0..3 {
            sums[(a, b)] = gap[a * n..(a + 1) * n].iter().zip(&frame.areas).map(|(g, area)| g * area).sum();
        }
    }
    sums
}

/// Surface elements between the edges `x` and `y` along the frame's axes. Their normals point out of the body.
fn panels(frame: &ContactFrame, [x, y]: [&[f64]; 2], side: Side) -> Vec<Panel> {
    let at = |x: f64, y: f64| frame.origin + frame.axes.to_global(&Point::new(x, y, 0.0));
    let mut panels = Vec::with_capacity((x.len() - 1) * (y.len() - 1));
    for along_x in x.windows(2) {
        for along_y in y.windows(2) {
            let [a, b] = [along_x[0], along_x[1]];
            let [c, d] = [along_y[0], along_y[1]];
            let mut nodes = vec![at(a, c), at(b, c), at(b, d), at(a, d)];
            if side == Side::Upper {
                nodes.reverse();
            }
            panels.push(Panel { kind: ElementKind::Quad4, nodes });
        }
    }
    panels
}

impl ElasticBody for TruncatedHalfSpace {
    fn describe(&self) -> String {
        format!("truncated half-space, {} surface elements", self.truncation.n_elements)
    }

    fn take_flexibility(&mut self, _cross: CrossBlocks) -> Result<Option<Arc<dyn Flexibility>>> {
        Ok(Some(self.flexibility.clone()))
    }

    fn recover(&self, loading: Loading) -> Result<BodyField> {
        Ok(surface_displacement(self.flexibility.as_ref(), loading.tractions, &[], &self.axes, self.side))
    }
}
