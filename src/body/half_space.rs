//! Elastic half-spaces below or above a plane frame.

use std::sync::{Arc, OnceLock};

use nalgebra::Matrix3;
use rayon::prelude::*;

use super::uniform_deformation::UniformDeformation;
use super::{BodyEquations, BodyField, BodyLoad, ElasticBody, LoadCase, Loading, PointState};
use crate::bem::half_space::plane::compressed::{DEFAULT_TOLERANCE, MAX_DENSE_CELLS};
use crate::bem::half_space::{
    CompressedFlexibility, CrossBlocks, DenseFlexibility, FftFlexibility, PeriodicFlexibility,
    PointForceField, SubsurfaceField, SurfaceGreen,
};
use crate::cancel;
use crate::error::{Error, Result};
use crate::flexibility::Flexibility;
use crate::flexibility::subset::SubsetFlexibility;
use crate::frame::{ContactFrame, Side};
use crate::geometry::{Point, Triad, format_point, format_short};
use crate::linalg::cache::Cache;
use crate::linalg::memory::MemoryLimit;
use crate::material::Stiffness;

/// Tolerance for a plane frame. It limits the difference between the axes of each cell and of the first cell, in any
/// component. It also limits the distance of cell centres from the plane of the first cell, divided by the square root
/// of the frame's area.
const PLANE_TOLERANCE: f64 = 1e-6;

/// Smallest depth of evaluation, divided by the cell size. At the surface, uniform tractions cause unbounded stress at
/// the border of a cell.
const MIN_DEPTH_CELLS: f64 = 0.02;

/// Height above the surface, divided by the cell size, up to which a point counts as on the surface.
const SURFACE_TOLERANCE_CELLS: f64 = 1e-6;

/// Relative error of the tabulated interior field above which a warning is given.
const FIELD_ERROR_WARNING: f64 = 1e-3;

const POINTS_PER_CANCEL_CHECK: usize = 256;

/// Half-space of any anisotropic material. The plane of the frame is its surface.
pub struct HalfSpaceBody {
    side: Side,
    green: SurfaceGreen,
    axes: Triad,
    cells: PlaneCells,
    tolerance: f64,
    cross: CrossBlocks,
    /// Memory limit for building a compressed operator.
    pub memory: MemoryLimit,
    /// Stiffness in axes whose third axis is the outward normal of the surface.
    stiffness: Stiffness,
    /// Cache that stores the tables of the interior field between runs.
    pub cache: Option<Cache>,
    point_force: OnceLock<PointForceField>,
    operator: OnceLock<Arc<dyn Flexibility>>,
    /// Uniform deformation by each load, in the order of `loads`.
    deformations: Vec<UniformDeformation>,
    loads: Vec<BodyLoad>,
}

impl HalfSpaceBody {
    /// Creates the half-space on `side` of `frame`. `stiffness` is in global axes.
    ///
    /// # Errors
    /// If the frame is not plane, or the surface Green's function of the material does not converge.
    pub fn new(stiffness: &Stiffness, side: Side, frame: &ContactFrame) -> Result<Self> {
        let axes = plane_axes(frame)?;
        let local = stiffness.rotated(&axes.0.transpose());
        let green = SurfaceGreen::new(&local, side)?;
        let (cells, cross) = (PlaneCells::new(frame)?, CrossBlocks::SkipVanishing);
        let memory = MemoryLimit::of_machine();
        Ok(Self {
            side,
            green,
            axes,
            cells,
            tolerance: DEFAULT_TOLERANCE,
            cross,
            memory,
            stiffness: local.rotated(&outward_rotation(side)),
            cache: None,
            point_force: OnceLock::new(),
            operator: OnceLock::new(),
            deformations: Vec::new(),
            loads: Vec::new(),
        })
    }

    /// Adds the uniform stress σ_xx, σ_yy, σ_xy (`value`, MPa, axes of the frame) as a load.
    ///
    /// # Errors
    /// If the surface would be strained along a period of the frame, or moved across a plane of symmetry.
    pub fn with_bulk_stress(mut self, value: [f64; 3], case: LoadCase, frame: &ContactFrame) -> Result<Self> {
        let local = self.stiffness.rotated(&outward_rotation(self.side).transpose());
        let deformation = UniformDeformation::new(value, &local, &self.axes, frame)?;
        self.loads.push(deformation.load(case, self.side, frame)?);
        self.deformations.push(deformation);
        Ok(self)
    }

    /// Adds the uniform thermal strain `strain` (tensor, global axes) as a load.
    ///
    /// # Errors
    /// As [`Self::with_bulk_stress`].
    pub fn with_thermal_strain(
        mut self,
        strain: &Matrix3<f64>,
        case: LoadCase,
        frame: &ContactFrame,
    ) -> Result<Self> {
        let deformation = UniformDeformation::of_thermal_strain(strain, &self.axes, frame)?;
        self.loads.push(deformation.load(case, self.side, frame)?);
        self.deformations.push(deformation);
        Ok(self)
    }

    /// Sets the relative tolerance of a compressed operator.
    pub fn with_tolerance(self, tolerance: f64) -> Self {
        Self { tolerance, ..self }
    }

    /// Sets the treatment of vanishing cross blocks for the operator that [`ElasticBody::recover`] builds if none
    /// exists. With [`CrossBlocks::Keep`], the operator is not compressed.
    pub fn with_blocks(self, cross: CrossBlocks) -> Self {
        Self { cross, ..self }
    }

    /// Estimated memory of the operator, bytes.
    pub fn operator_bytes(&self, cross: CrossBlocks) -> usize {
        match &self.cells {
            // Transformed kernel and padded vectors of one product by the fast Fourier transform (FFT). The padded grid
            // has twice the cells along each side.
            PlaneCells::Grid { cells, .. } => 4 * 8 * 16 * cells[0] * cells[1],
            PlaneCells::Polygons { centers, corners, areas } if uses_compression(areas.len(), cross) => {
                CompressedFlexibility::typical_bytes(centers, corners, areas, &self.green, self.tolerance)
            }
            PlaneCells::Polygons { areas, .. } => {
                72usize.saturating_mul(areas.len()).saturating_mul(areas.len())
            }
        }
    }

    /// Typical build time of a compressed operator, s.
    pub fn building_seconds(&self) -> f64 {
        CompressedFlexibility::typical_build_seconds(self.cells.n(), &self.green, self.tolerance)
    }

    /// Computes the displacement and stress field of a point force, which interior points need. Returns a warning about
    /// its accuracy or about the cache, if any.
    ///
    /// # Errors
    /// As [`PointForceField::load_or_compute`].
    pub fn prepare_interior_field(&self) -> Result<Option<String>> {
        let (field, note) = PointForceField::load_or_compute(&self.stiffness, self.cache.as_ref())?;
        let error = field.error();
        let _ = self.point_force.set(field);
        let doubt = (error > FIELD_ERROR_WARNING).then(|| {
            format!(
                "the tabulated field inside the half-space has errors of up to {:.2} % of the stress around a point force, because the stiffness is strongly anisotropic; stress at interior points may have errors of this size",
                100.0 * error
            )
        });
        let notes: Vec<String> = note.into_iter().chain(doubt).collect();
        Ok((!notes.is_empty()).then(|| notes.join("; ")))
    }

    fn make(&self, cross: CrossBlocks) -> Result<Arc<dyn Flexibility>> {
        self.cells.flexibility(&self.green, cross, self.tolerance, &self.memory)
    }
}

/// Rotation into axes whose third axis is the outward normal.
fn outward_rotation(side: Side) -> Matrix3<f64> {
    Matrix3::from_diagonal(&Point::new(1.0, side.outward(), side.outward()))
}

/// First of `points` above the surface of a half-space on `side` of a plane frame: its index, and its height in mm.
///
/// # Errors
/// If the frame is not plane.
pub fn first_point_above_surface(
    side: Side,
    frame: &ContactFrame,
    points: &[Point],
) -> Result<Option<(usize, f64)>> {
    let axes = plane_axes(frame)?;
    let slack = SURFACE_TOLERANCE_CELLS * cell_size(frame);
    let height = |x: &Point| side.outward() * axes.normal().dot(&(x - frame.centers[0]));
    Ok(points.iter().map(height).enumerate().find(|(_, height)| *height > slack))
}

fn cell_size(frame: &ContactFrame) -> f64 {
    (frame.areas.iter().sum::<f64>() / frame.areas.len().max(1) as f64).sqrt()
}

/// Common axes of the cells of a plane frame.
///
/// # Errors
/// If the frame is not plane.
pub(crate) fn plane_axes(frame: &ContactFrame) -> Result<Triad> {
    let first = frame.triads.first().ok_or_else(|| Error::input("the contact frame has no cells"))?;
    let (origin, size) = (frame.centers[0], frame.areas.iter().sum::<f64>().sqrt());
    for (cell, (triad, center)) in frame.triads.iter().zip(&frame.centers).enumerate() {
        let tilt = (triad.0 - first.0).amax();
        let height = first.normal().dot(&(center - origin)).abs();
        if tilt > PLANE_TOLERANCE || height > PLANE_TOLERANCE * size {
            return Err(Error::input(format!(
                "a half-space needs a plane contact frame, but cell {cell} is rotated by {} degrees relative to the first cell, and its centre lies {} % of the frame's size out of the plane of the first cell. If the surface is nearly flat, use frame.kind = \"grid\". For a bore or a strongly curved surface, mesh both bodies",
                format_short(tilt.to_degrees()),
                format_short(100.0 * height / size)
            )));
        }
    }
    Ok(*first)
}

enum PlaneCells {
    /// All cells of a grid, or only the cells with the indices `places`.
    Grid {
        cells: [usize; 2],
        spacing: [f64; 2],
        periodic: [bool; 2],
        places: Option<Vec<usize>>,
    },
    Polygons {
        centers: Vec<[f64; 2]>,
        corners: Vec<Vec<[f64; 2]>>,
        areas: Vec<f64>,
    },
}

#[allow(clippy::type_complexity)]
fn plane_polygons(frame: &ContactFrame) -> Result<(Vec<[f64; 2]>, Vec<Vec<[f64; 2]>>)> {
    let axes = plane_axes(frame)?;
    let flat = |x: &Point| {
        let local = axes.to_local(&(x - frame.origin));
        [local.x, local.y]
    };
    let corners = frame.all_corners().map(|corners| corners.iter().map(flat).collect()).collect();
    Ok((frame.centers.iter().map(flat).collect(), corners))
}

fn bounding_grid(cells: [usize; 2], places: &[usize]) -> ([usize; 2], Vec<usize>) {
    let at = |place: usize| [place / cells[1], place % cells[1]];
    let mut bounds = [[usize::MAX, 0]; 2];
    for index in places.iter().map(|&place| at(place)) {
        for (range, i) in bounds.iter_mut().zip(index) {
            *range = [range[0].min(i), range[1].max(i)];
        }
    }
    let size = bounds.map(|[low, high]| high + 1 - low);
    let inner = |place: usize| {
        let [ix, iy] = at(place);
        (ix - bounds[0][0]) * size[1] + iy - bounds[1][0]
    };
    (size, places.iter().map(|&place| inner(place)).collect())
}

impl PlaneCells {
    fn new(frame: &ContactFrame) -> Result<Self> {
        if let Some(grid) = frame.grid {
            let (spacing, periodic) = (grid.spacing, grid.periodic);
            let (cells, places) = match &frame.grid_indices {
                // A periodic grid is not reduced to its used cells, because a period spans the whole grid.
                Some(places) if periodic == [false; 2] => {
                    let (cells, places) = bounding_grid(grid.cells, places);
                    (cells, Some(places))
                }
                places => (grid.cells, places.clone()),
            };
            return Ok(Self::Grid { cells, spacing, periodic, places });
        }
        let (centers, corners) = plane_polygons(frame)?;
        Ok(Self::Polygons { centers, corners, areas: frame.areas.clone() })
    }

    fn n(&self) -> usize {
        match self {
            Self::Grid { cells, places, .. } => places.as_ref().map_or(cells[0] * cells[1], Vec::len),
            Self::Polygons { areas, .. } => areas.len(),
        }
    }

    fn flexibility(
        &self,
        green: &SurfaceGreen,
        cross: CrossBlocks,
        tolerance: f64,
        memory: &MemoryLimit,
    ) -> Result<Arc<dyn Flexibility>> {
        Ok(match self {
            Self::Grid { cells, spacing, periodic, places } => {
                let whole: Arc<dyn Flexibility> = match periodic {
                    [false, false] => Arc::new(FftFlexibility::new(*cells, *spacing, green, cross)?),
                    _ => Arc::new(PeriodicFlexibility::new(*cells, *spacing, *periodic, green, cross)?),
                };
                match places {
                    None => whole,
                    Some(places) => Arc::new(SubsetFlexibility::new(whole, places.clone())),
                }
            }
            Self::Polygons { centers, corners, areas } if uses_compression(areas.len(), cross) => Arc::new(
                CompressedFlexibility::within_memory(centers, corners, areas, green, tolerance, memory)?,
            ),
            Self::Polygons { centers, corners, areas } => {
                Arc::new(DenseFlexibility::new(centers, corners, areas, green)?)
            }
        })
    }
}

/// Whether a frame that is not a grid gets a compressed operator. It does if it has many cells and vanishing blocks are
/// omitted.
pub fn uses_compression(n_cells: usize, cross: CrossBlocks) -> bool {
    n_cells > MAX_DENSE_CELLS && cross == CrossBlocks::SkipVanishing
}

/// Flexibility of a half-space. For two half-spaces, `green` is the sum of their Green's functions. Grids use the FFT;
/// other frames use a dense or a compressed matrix.
///
/// # Errors
/// If the frame is not plane, or memory does not suffice.
pub fn half_space_flexibility(
    green: &SurfaceGreen,
    frame: &ContactFrame,
    cross: CrossBlocks,
) -> Result<Arc<dyn Flexibility>> {
    PlaneCells::new(frame)?.flexibility(green, cross, DEFAULT_TOLERANCE, &MemoryLimit::of_machine())
}

/// Computes the operator of [`half_space_flexibility`] as a dense matrix. Each entry is an integral of the Green's
/// function over a cell.
///
/// # Errors
/// If the frame is not plane or is periodic, or memory does not suffice.
pub fn half_space_matrix(green: &SurfaceGreen, frame: &ContactFrame) -> Result<DenseFlexibility> {
    if frame.is_periodic() {
        return Err(Error::input(
            "the block system does not support periodic frames: remove solver.coupling or frame.periodic",
        ));
    }
    let (centers, corners) = plane_polygons(frame)?;
    DenseFlexibility::new(&centers, &corners, &frame.areas, green)
}

/// Displacement of the body at `side`, at the cell centres, in global axes, mm. It contains the displacement due to
/// tractions on body 2 and due to `loads`, each with its amplitude.
pub(super) fn surface_displacement(
    operator: &dyn Flexibility,
    tractions: &[f64],
    loads: &[(f64, &BodyLoad)],
    axes: &Triad,
    side: Side,
) -> BodyField {
    let n = operator.n_cells();
    let mut gap = vec![0.0; 3 * n];
    operator.apply(tractions, &mut gap);
    for (amplitude, load) in loads {
        gap.iter_mut().zip(&load.gap).for_each(|(sum, gap)| *sum += amplitude * gap);
    }
    let at = |i: usize| {
        let share = Point::new(gap[i], gap[n + i], gap[2 * n + i]) * side.gap_sign();
        axes.to_global(&share).into()
    };
    BodyField { displacement: (0..n).map(at).collect(), stress: None }
}

impl ElasticBody for HalfSpaceBody {
    fn describe(&self) -> String {
        "half-space".into()
    }

    fn equations(&self) -> BodyEquations<'_> {
        BodyEquations::HalfSpace(&self.green)
    }

    fn near_field_green(&self) -> Option<&SurfaceGreen> {
        Some(&self.green)
    }

    fn take_flexibility(&mut self, cross: CrossBlocks) -> Result<Option<Arc<dyn Flexibility>>> {
        let shared = self.make(cross)?;
        self.operator = OnceLock::from(shared.clone());
        Ok(Some(shared))
    }

    fn recover(&self, loading: Loading) -> Result<BodyField> {
        if self.operator.get().is_none() {
            let _ = self.operator.set(self.make(self.cross)?);
        }
        let operator = self.operator.get().expect("set above");
        let loads: Vec<_> =
            self.loads.iter().enumerate().map(|(k, load)| (loading.amplitude(k), load)).collect();
        Ok(surface_displacement(operator.as_ref(), loading.tractions, &loads, &self.axes, self.side))
    }

    fn loads(&self) -> &[BodyLoad] {
        &self.loads
    }

    /// The displacements are relative to points at infinite distance.
    fn recover_at_points(
        &self,
        frame: &ContactFrame,
        loading: Loading,
        points: &[Point],
    ) -> Result<Option<Vec<PointState>>> {
        if frame.is_periodic() {
            return Err(Error::input("points inside half-spaces are not available on periodic frames"));
        }
        if let Some((i, height)) = first_point_above_surface(self.side, frame, points)? {
            return Err(Error::input(format!(
                "the point {} lies {height:.3e} outside of the half-space",
                format_point(&points[i].into())
            )));
        }
        if self.point_force.get().is_none() {
            self.prepare_interior_field()?;
        }
        let field = self.point_force.get().expect("set above");
        let turn = outward_rotation(self.side);
        let (_, corners) = plane_polygons(frame)?;
        let (n, tractions) = (corners.len(), loading.tractions);
        let cells = corners.into_iter().enumerate().map(|(i, corners)| {
            let corners = corners.into_iter().map(|[x, y]| [x, self.side.outward() * y]).collect();
            let on_body2 = Point::new(tractions[i], tractions[n + i], tractions[2 * n + i]);
            (corners, turn * on_body2 * self.side.gap_sign())
        });
        let below = SubsurfaceField::new(&self.stiffness, field, cells);
        let least = -MIN_DEPTH_CELLS * cell_size(frame);
        let axes = self.axes.0 * turn;
        let height = self.axes.normal().dot(&(frame.centers[0] - frame.origin)) * self.side.outward();
        let at = |x: &Point| {
            let mut local = axes.transpose() * (x - frame.origin);
            local.z = (local.z - height).min(least);
            let mut state = below.at(&local).rotated(&axes);
            for (k, deformation) in self.deformations.iter().enumerate() {
                let uniform = deformation.state(loading.amplitude(k), x);
                state.displacement += uniform.displacement;
                state.stress += uniform.stress;
            }
            state
        };
        let mut states = Vec::with_capacity(points.len());
        for batch in points.chunks(POINTS_PER_CANCEL_CHECK) {
            cancel::check()?;
            states.extend(batch.par_iter().map(at).collect::<Vec<_>>());
        }
        Ok(Some(states))
    }
}
