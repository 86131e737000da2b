//! Finite bodies with boundary elements ([`BeBody`]), condensed to the nodes under the frame.
//!
//! The collocation equations give the displacement u = U t of the nodes under the frame. t are the tractions at these
//! nodes. The operator on the frame is S = I F Iᵀ A with F = U M⁻¹. I averages nodal values over the cells, A contains
//! the cell areas, M the nodal areas. Iᵀ A converts tractions on the cells to nodal forces. M⁻¹ converts nodal forces
//! to nodal tractions. The exact F is symmetric, but collocation gives a symmetric F only in the limit of small
//! elements. `symmetrize.rs` therefore makes F symmetric.

mod spec;
mod stress;
mod symmetrize;

use std::sync::Arc;

use faer::Par;
use nalgebra::Matrix3;

use self::spec::{NodalConditions, build_face_map, refuse_crossing, refuse_held};
use self::symmetrize::Symmetrization;
use super::condensed_flexibility::CondensedFlexibility;
use super::rigid_body_modes::{RigidBodyMode, UnconstrainedModes, relative_motion};
use super::{
    BodyEquations, BodyField, BodyLoad, ElasticBody, ErrorEstimation, LoadCase, Loading, PointState,
    StressField,
};
use crate::bem::finite::{
    BodyForceSolution, BoundaryElements, BoundarySolution, BoundaryValueProblem, BoundaryValues,
    CompressionReport, Domain, Interpolation, SurfaceState,
};
use crate::bem::half_space::CrossBlocks;
use crate::error::{Context, Error, Result};
use crate::fem::RigidBodyModes;
use crate::flexibility::Flexibility;
use crate::frame::{ContactFrame, FaceMap, MeshedSurface, Side};
use crate::geometry::Point;
use crate::linalg::cache::Cache;
use crate::linalg::memory::MemoryLimit;
use crate::material::strength::MaterialStrength;
use crate::mesh::faces::outer_faces;

pub use self::spec::{BeSpec, FrameFit};

/// Boundary-element body, mapped to a frame through the faces of one physical group of the mesh.
pub struct BeBody {
    side: Side,
    surface: MeshedSurface,
    elements: BoundaryElements,
    /// Particular solution for the body force and the thermal strain of each load; `None` if the load has neither.
    weights: Vec<Option<BodyForceSolution>>,
    map: FaceMap,
    solution: BoundarySolution,
    areas: Vec<f64>,
    flexibility: Option<CondensedFlexibility>,
    loads: Vec<BodyLoad>,
    rigid_body_modes: Option<UnconstrainedModes>,
    asymmetry: f64,
    kernel_error: f64,
    cache_warning: Option<String>,
    /// Strength of the material, if known, and the material's axes (columns, global).
    pub limit: Option<(MaterialStrength, Matrix3<f64>)>,
}

impl BeBody {
    /// Advice to the user on how to reduce the memory of a body.
    pub const MEMORY_ADVICE: &'static str =
        "use larger elements away from the contact, or elements of lower order (`element`)";

    /// Solves the body for its loads and for unit tractions at all nodes under the frame, within the available memory.
    /// Each of `cases` contains the loads of `spec` that share an amplitude. Without cases, all loads share one
    /// amplitude.
    ///
    /// # Errors
    /// - A group or the frame does not fit, or faces of the contact group intersect.
    /// - Supports contradict one another or fix faces under the frame.
    /// - A diagonal entry of the flexibility is not positive.
    /// - The equations cannot be solved, memory does not suffice, or the run is cancelled.
    pub fn new(
        spec: &BeSpec,
        cases: &[(LoadCase, BeSpec)],
        contact: &str,
        side: Side,
        frame: &ContactFrame,
        cache: Option<&Cache>,
        memory: &MemoryLimit,
    ) -> Result<Self> {
        let build = || {
            let faces = spec.faces(contact)?;
            refuse_crossing(&spec.mesh, &faces, contact)?;
            let (elements, number, (kernel_error, cache_warning)) = spec.elements(cache)?;
            let map = build_face_map(spec, &elements, &number, frame, side, &faces)?;
            let known = spec.nodal_conditions(&elements, &number)?;
            refuse_held(&map, &known, &elements)?;
            let what = format!("a boundary-element body of {} unknowns", 3 * elements.n_nodes());
            memory.ensure_available(
                spec.bytes(map.nodes().len(), cases.len())?,
                &what,
                Self::MEMORY_ADVICE,
            )?;
            let free = elements.free_motions(&known.held)?;
            let conditions = spec.load_conditions(cases, &elements, &number)?;
            let of_load =
                |(_, known): &(LoadCase, NodalConditions)| known.boundary_values(free.as_ref(), &elements);
            let loads: Vec<BoundaryValues> = conditions.iter().map(of_load).collect();
            let problem = BoundaryValueProblem {
                elements: &elements,
                domain: Domain::Interior,
                displacement_known: &known.held,
                loads: &loads,
                loaded: map.nodes(),
                free_motions: free.as_ref(),
            };
            let solution = problem.solve(Par::rayon(0))?;
            let all = elements.areas();
            let areas: Vec<f64> = map.nodes().iter().map(|&node| all[node]).collect();
            let nodal =
                |i: usize, j: usize| solution.response(3 * map.nodes()[i / 3] + i % 3, j) / areas[j / 3];
            let smooth = Symmetrization::new(&map, frame, &areas, nodal);
            let asymmetry = smooth.asymmetry();
            refuse_negative(3 * areas.len(), &nodal)?;
            let symmetric = |i: usize, j: usize| 0.5 * (nodal(i, j) + nodal(j, i)) + smooth.correction(i, j);
            let flexibility = CondensedFlexibility::new(map.clone(), symmetric)?;
            let mean_heights = FaceMap::new(frame, &spec.mesh, &faces, side)?.mean_heights(frame, &spec.mesh);
            let surface =
                MeshedSurface { mesh: spec.mesh.clone(), faces, side, mean_heights, curved_gap: false };
            let mut body = Self {
                side,
                surface,
                weights: conditions.iter().map(|(_, known)| known.weight.clone()).collect(),
                map,
                solution,
                areas,
                flexibility: Some(flexibility),
                loads: Vec::new(),
                rigid_body_modes: None,
                asymmetry,
                kernel_error,
                cache_warning,
                limit: None,
                elements,
            };
            body.add_loads(&conditions, free, frame)?;
            Ok(body)
        };
        build().context(|| spec.name.clone())
    }

    /// Computes the change of the gap by each load, and the unconstrained rigid-body modes. Refuses a preload that is
    /// not in equilibrium.
    fn add_loads(
        &mut self,
        conditions: &[(LoadCase, NodalConditions)],
        free: Option<RigidBodyModes>,
        frame: &ContactFrame,
    ) -> Result<()> {
        let load = |(k, (case, _)): (usize, &(LoadCase, NodalConditions))| BodyLoad {
            side: Some(self.side),
            case: case.clone(),
            gap: self.load_gap(k),
        };
        self.loads = conditions.iter().enumerate().map(load).collect();
        self.rigid_body_modes = free.map(|free| self.modes_from_free_motions(&free, conditions, frame));
        self.ensure_balanced(conditions)
    }

    fn ensure_balanced(&self, conditions: &[(LoadCase, NodalConditions)]) -> Result<()> {
        let Some(free) = &self.rigid_body_modes else { return Ok(()) };
        let areas = self.elements.areas();
        for (k, (case, known)) in conditions.iter().enumerate() {
            let works: Vec<f64> = free.modes.iter().map(|mode| mode.load_work[k]).collect();
            let size = known.tractions().map(|(dof, value)| value.abs() * areas[dof / 3]).sum();
            case.ensure_balanced(&works, &free.names, size)?;
        }
        Ok(())
    }

    /// Change of the gap by load `k` at amplitude 1.
    fn load_gap(&self, k: usize) -> Vec<f64> {
        let amplitudes: Vec<f64> = (0..=k).map(|load| f64::from(u8::from(load == k))).collect();
        let loading = Loading { tractions: &[], amplitudes: &amplitudes };
        let state = self.solution.state(&amplitudes, &vec![0.0; 3 * self.areas.len()]);
        let positions = self.elements.positions();
        let loaded = |node: usize| {
            (Point::from(state.displacement[node]) + self.displacement_by_weight(&positions[node], loading))
                .into()
        };
        self.map.gap_of_displacement(self.side, loaded)
    }

    fn modes_from_free_motions(
        &self,
        free: &RigidBodyModes,
        conditions: &[(LoadCase, NodalConditions)],
        frame: &ContactFrame,
    ) -> UnconstrainedModes {
        let (positions, areas) = (self.elements.positions(), self.elements.areas());
        let motion = |j: usize| {
            let work = |(dof, value): (usize, f64)| {
                value * free.displacement(&positions[dof / 3], j)[dof % 3] * areas[dof / 3]
            };
            RigidBodyMode {
                relative_motion: relative_motion(free, j, frame, self.side),
                gap: self
                    .map
                    .gap_of_displacement(self.side, |node| free.displacement(&positions[node], j).into()),
                load_work: conditions.iter().map(|(_, known)| known.tractions().map(work).sum()).collect(),
            }
        };
        let modes = (0..free.n_modes()).map(motion).collect();
        UnconstrainedModes { side: self.side, modes, names: free.names.clone() }
    }

    /// Number of elements.
    pub fn n_elements(&self) -> usize {
        self.elements.n_elements()
    }

    /// Number of unknowns.
    pub fn n_unknowns(&self) -> usize {
        3 * self.elements.n_nodes()
    }

    /// Interpolation of displacement and traction over an element.
    pub fn interpolation(&self) -> Interpolation {
        self.elements.interpolation()
    }

    /// Asymmetry |W - Wᵀ| / (2 |W|) of the works W of traction fields over the frame. W_ij is the work of field i on
    /// the displacement due to field j. The fields are constant or linear. The asymmetry measures the discretisation
    /// error.
    pub fn asymmetry(&self) -> f64 {
        self.asymmetry
    }

    /// Residual of some equations that are recomputed after the solution, relative to the magnitude of their terms.
    pub fn residual(&self) -> f64 {
        self.solution.residual()
    }

    /// Report on the compression of the equations; `None` for dense equations.
    pub fn compression(&self) -> Option<&CompressionReport> {
        self.solution.compression()
    }

    /// Error of the tabulated kernels, relative to their largest values; 0 for kernels in closed form.
    pub fn kernel_error(&self) -> f64 {
        self.kernel_error
    }

    /// Warning of the cache of tabulated kernels, if any.
    pub fn cache_warning(&self) -> Option<&str> {
        self.cache_warning.as_deref()
    }

    /// Memory that the body keeps, bytes.
    pub fn held_bytes(&self) -> usize {
        self.solution.bytes() + 9 * 4 * self.areas.len().pow(2)
    }

    /// Tractions on this body at the nodes under the frame, `[3 n_loaded]`, MPa. `tractions` are the tractions of the
    /// cells on body 2.
    fn nodal_tractions(&self, tractions: &[f64]) -> Vec<f64> {
        let mut nodal = vec![0.0; 3 * self.areas.len()];
        self.map.apply_transpose(tractions, &mut nodal);
        for (dof, force) in nodal.iter_mut().enumerate() {
            *force *= self.side.gap_sign() / self.areas[dof / 3];
        }
        nodal
    }

    /// Particular solutions for the body forces and thermal strains of the loads, each with its amplitude.
    fn weights<'a>(&'a self, loading: Loading<'a>) -> impl Iterator<Item = (&'a BodyForceSolution, f64)> {
        let of_load = move |(k, weight): (usize, &'a Option<BodyForceSolution>)| {
            Some((weight.as_ref()?, loading.amplitude(k)))
        };
        self.weights.iter().enumerate().filter_map(of_load)
    }

    /// Displacement at `x` of the particular solutions for body forces and thermal strains.
    fn displacement_by_weight(&self, x: &Point, loading: Loading) -> Point {
        self.weights(loading).map(|(weight, amplitude)| amplitude * weight.displacement(x)).sum()
    }

    fn state(&self, loading: Loading) -> SurfaceState {
        self.solution.state(loading.amplitudes, &self.nodal_tractions(loading.tractions))
    }

    /// Displacement of the mesh points in `state`: the mean over the adjacent elements, plus the particular solutions.
    fn at_points(&self, state: &SurfaceState, loading: Loading) -> Vec<[f64; 3]> {
        let mut sums = vec![(Point::zeros(), 0.0); self.surface.mesh.n_points()];
        for (i, face) in outer_faces(&self.surface.mesh).iter().enumerate() {
            let nodes = self.elements.reference_nodes_of(i);
            for (&point, xi) in face.nodes.iter().zip(face.kind.face_reference_nodes()) {
                let values = nodes.values(*xi);
                let u: Point = self
                    .elements
                    .nodes_of(i)
                    .zip(values)
                    .map(|(node, n)| Point::from(state.displacement[node]) * n)
                    .sum();
                let weight = self.elements.panel(i).area_vector(*xi).norm();
                sums[point].0 += u * weight;
                sums[point].1 += weight;
            }
        }
        let of_weight = |x: &[f64; 3]| self.displacement_by_weight(&Point::from(*x), loading);
        let means = sums.into_iter().zip(&self.surface.mesh.points);
        means.map(|((sum, weight), x)| (sum / weight.max(f64::MIN_POSITIVE) + of_weight(x)).into()).collect()
    }
}

/// Refuses a flexibility with a diagonal entry that is not positive. Far too large elements or an invalid surface cause
/// such an entry.
fn refuse_negative(n: usize, entry: &impl Fn(usize, usize) -> f64) -> Result<()> {
    if (0..n).all(|i| entry(i, i) > 0.0) {
        return Ok(());
    }
    Err(Error::input(
        "the computed displacements of nodes under the frame are opposite to the forces on these nodes: the elements are far too large for the thickness of the body, or their surface is invalid; use smaller elements, or quadratic ones (`element`)",
    ))
}

impl ElasticBody for BeBody {
    fn describe(&self) -> String {
        format!(
            "{} {} boundary elements, {} unknowns, {} contact nodes",
            self.n_elements(),
            self.interpolation().name(),
            self.n_unknowns(),
            self.areas.len()
        )
    }

    fn equations(&self) -> BodyEquations<'_> {
        BodyEquations::BoundaryElements(self)
    }

    fn take_flexibility(&mut self, _cross: CrossBlocks) -> Result<Option<Arc<dyn Flexibility>>> {
        match self.flexibility.take() {
            Some(flexibility) => Ok(Some(Arc::new(flexibility))),
            None => Err(Error::numerical("the flexibility of a boundary-element body was taken twice")),
        }
    }

    fn loads(&self) -> &[BodyLoad] {
        &self.loads
    }

    fn rigid_body_modes(&self) -> Option<&UnconstrainedModes> {
        self.rigid_body_modes.as_ref()
    }

    fn surface(&self) -> Option<&MeshedSurface> {
        Some(&self.surface)
    }

    fn recover(&self, loading: Loading) -> Result<BodyField> {
        let displacement = self.at_points(&self.state(loading), loading);
        Ok(BodyField { displacement, stress: None })
    }

    fn recover_stress(
        &self,
        loading: Loading,
        _displacement: &[[f64; 3]],
        _estimate: ErrorEstimation,
    ) -> Result<Option<StressField>> {
        Ok(Some(self.surface_stress(loading)))
    }

    fn recover_at_points(
        &self,
        _frame: &ContactFrame,
        loading: Loading,
        points: &[Point],
    ) -> Result<Option<Vec<PointState>>> {
        self.inside_points(loading, points).map(Some)
    }
}
