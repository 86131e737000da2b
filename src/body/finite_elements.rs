//! Finite-element bodies, condensed to the nodes under the frame.

use std::collections::BTreeMap;
use std::sync::{Arc, OnceLock};

use super::lazy_flexibility::LazyFlexibility;
use super::loads::applied_loads;
use super::rigid_body_modes::{RigidBodyMode, UnconstrainedModes, relative_motion};
use super::{
    BodyEquations, BodyField, BodyLoad, ElasticBody, ErrorEstimation, LoadCase, Loading, StressField,
};
use crate::bem::half_space::CrossBlocks;
use crate::error::{Context, Error, Result};
use crate::fem::{
    AppliedLoads, CondensationResources, CondensedBody, FeModel, FeSpec, StressRecovery, ThermoelasticState,
    surface_stress_points,
};
use crate::flexibility::Flexibility;
use crate::frame::{ContactFrame, FaceMap, MeshedSurface, Side};
use crate::material::strength::MaterialStrength;
use crate::mesh::Mesh;
use crate::mesh::faces::group_faces;

/// Finite-element body, mapped to a frame through the faces of one physical group of the mesh.
pub struct FeBody {
    side: Side,
    condensed: Arc<CondensedBody>,
    map: FaceMap,
    /// Cells whose rows of the flexibility are formed when the body is built, `[N]`; `None` for all cells.
    candidates: Option<Vec<bool>>,
    /// Surface of the initial mesh, which defines the gap.
    surface: MeshedSurface,
    loads: Vec<BodyLoad>,
    /// Each load at amplitude 1, with the displacement of all mesh nodes that it causes, mm.
    applied: Vec<(AppliedLoads, Vec<[f64; 3]>)>,
    rigid_body_modes: Option<UnconstrainedModes>,
    taken: bool,
    /// Strengths by material name, from which the exposures are computed.
    pub limits: BTreeMap<String, MaterialStrength>,
    recovery: OnceLock<StressRecovery>,
}

impl FeBody {
    /// Assembles the body and forms the flexibility of its contact nodes. These are the nodes of the group `contact`
    /// under the candidate cells of `frame`, or under all cells without candidates.
    ///
    /// # Errors
    /// If the group or the frame does not fit ([`FaceMap::new`]), or the body cannot be assembled or solved.
    pub fn new(spec: FeSpec, contact: &str, side: Side, frame: &ContactFrame) -> Result<Self> {
        Self::with_worn_mesh(spec, &[], contact, side, frame, &CondensationResources::default(), None)
    }

    /// Builds the body as [`Self::new`] does, with the cache and the memory limit of `resources`. Each of `cases`
    /// contains the loads of `spec` that share an amplitude. Without cases, all loads share one amplitude. If a mesh
    /// `worn` is given, the equations are assembled on `worn`. The contact surface and its map to the cells always
    /// follow from the initial mesh.
    ///
    /// # Errors
    /// See [`Self::new`].
    pub fn with_worn_mesh(
        spec: FeSpec,
        cases: &[(LoadCase, FeSpec)],
        contact: &str,
        side: Side,
        frame: &ContactFrame,
        resources: &CondensationResources,
        worn: Option<Arc<Mesh>>,
    ) -> Result<Self> {
        let name = spec.name.clone();
        let build = || {
            let initial_mesh = spec.mesh.clone();
            let faces = group_faces(&initial_mesh, contact)?;
            let map = FaceMap::new(frame, &initial_mesh, &faces, side)?;
            let mean_heights = map.mean_heights(frame, &initial_mesh);
            let spec = FeSpec { mesh: worn.unwrap_or_else(|| initial_mesh.clone()), ..spec };
            let surface = MeshedSurface { mesh: initial_mesh, faces, side, mean_heights, curved_gap: false };
            let model = FeModel::with_memory_limit(spec, &resources.memory)?;
            let candidates = frame.candidates.clone();
            let formed = candidates.as_ref().map(|cells| map.restrict(cells));
            let condensed = model.condense_with(formed.as_ref().unwrap_or(&map).nodes(), resources)?;
            let (cases, applied) = applied_loads(condensed.model(), cases)?;
            let applied = with_displacements(&condensed, applied)?;
            let load = |(case, (_, u)): (&LoadCase, &(AppliedLoads, Vec<[f64; 3]>))| BodyLoad {
                side: Some(side),
                case: case.clone(),
                gap: map.gap_of_displacement(side, |node| u[node]),
            };
            let loads = cases.iter().zip(&applied).map(load).collect();
            let (limits, recovery) = (BTreeMap::new(), OnceLock::new());
            let rigid_body_modes = rigid_body_modes(&condensed, &cases, &applied, (&map, side, frame))?;
            let condensed = Arc::new(condensed);
            Ok(Self {
                side,
                condensed,
                map,
                candidates,
                surface,
                loads,
                applied,
                rigid_body_modes,
                taken: false,
                limits,
                recovery,
            })
        };
        build().context(|| name)
    }

    fn stress_recovery(&self) -> Result<&StressRecovery> {
        if let Some(recovery) = self.recovery.get() {
            return Ok(recovery);
        }
        let recovery = StressRecovery::new(self.condensed.model())?;
        Ok(self.recovery.get_or_init(|| recovery))
    }

    /// Body condensed to its contact nodes.
    pub fn condensed(&self) -> &CondensedBody {
        &self.condensed
    }

    /// Loads and prescribed displacements at amplitude 1, in the order of [`ElasticBody::loads`].
    pub fn applied_loads(&self) -> impl Iterator<Item = &AppliedLoads> {
        self.applied.iter().map(|(loads, _)| loads)
    }

    /// Map between the contact faces and the frame.
    pub fn map(&self) -> &FaceMap {
        &self.map
    }

    /// Forces on the nodes of the map, `[3 n_c]`, N, global axes, due to tractions on body 2, `[3, N]`. n_c is the
    /// number of nodes.
    pub fn contact_forces(&self, tractions: &[f64]) -> Vec<f64> {
        let mut forces = vec![0.0; 3 * self.map.nodes().len()];
        self.map.apply_transpose(tractions, &mut forces);
        forces.iter_mut().for_each(|f| *f *= self.side.gap_sign());
        forces
    }
}

/// Each load with the displacement of all mesh nodes that it causes. If there is only one load, the condensed body
/// already contains its displacement.
fn with_displacements(
    condensed: &CondensedBody,
    loads: Vec<AppliedLoads>,
) -> Result<Vec<(AppliedLoads, Vec<[f64; 3]>)>> {
    let single = loads.len() == 1;
    let displacement = |loads: &AppliedLoads| {
        if single {
            Ok(condensed.contact_free_displacement().to_vec())
        } else {
            condensed.displacement_of_loads(loads)
        }
    };
    loads.into_iter().map(|loads| displacement(&loads).map(|u| (loads, u))).collect()
}

fn rigid_body_modes(
    condensed: &CondensedBody,
    cases: &[LoadCase],
    applied: &[(AppliedLoads, Vec<[f64; 3]>)],
    (map, side, frame): (&FaceMap, Side, &ContactFrame),
) -> Result<Option<UnconstrainedModes>> {
    let model = condensed.model();
    let Some(free) = model.rigid_body_modes() else { return Ok(None) };
    let mut works = Vec::with_capacity(cases.len());
    for (case, (loads, _)) in cases.iter().zip(applied) {
        let work = model.work_on_rigid_body_modes(loads);
        let size = model.load_vector(loads).iter().map(|force| force.abs()).sum();
        case.ensure_balanced(&work, &free.names, size)?;
        works.push(work);
    }
    let sign = side.gap_sign();
    let motions = (0..free.n_modes()).map(|j| {
        let points = &model.mesh().points;
        let gap = map.mean_displacement(|node| (free.displacement(&points[node].into(), j) * sign).into());
        let load_work = works.iter().map(|work| work[j]).collect();
        RigidBodyMode { relative_motion: relative_motion(free, j, frame, side), gap, load_work }
    });
    Ok(Some(UnconstrainedModes { side, modes: motions.collect(), names: free.names.clone() }))
}

impl ElasticBody for FeBody {
    fn describe(&self) -> String {
        format!(
            "finite elements, {} unknowns, {} contact nodes",
            self.condensed.model().n_free(),
            self.condensed.contact_nodes().len()
        )
    }

    fn equations(&self) -> BodyEquations<'_> {
        BodyEquations::FiniteElements(self)
    }

    fn take_flexibility(&mut self, _cross: CrossBlocks) -> Result<Option<Arc<dyn Flexibility>>> {
        if std::mem::replace(&mut self.taken, true) {
            return Err(Error::numerical("the flexibility of a finite-element body was taken twice"));
        }
        let nodal = Arc::get_mut(&mut self.condensed)
            .expect("only its flexibility shares the body, and is taken once")
            .take_flexibility();
        let cells = self.candidates.clone().unwrap_or_else(|| vec![true; self.map.n_cells()]);
        let body = self.condensed.clone();
        Ok(Some(Arc::new(LazyFlexibility::new(self.map.clone(), cells, body, &nodal)?)))
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
        let forces = self.contact_forces(loading.tractions);
        let mut displacement = self.condensed.solve_with_forces_on(self.map.nodes(), &forces)?;
        for (k, (_, by_load)) in self.applied.iter().enumerate() {
            let sums = displacement.as_flattened_mut().iter_mut().zip(by_load.as_flattened());
            sums.for_each(|(u, by)| *u += loading.amplitude(k) * by);
        }
        Ok(BodyField { displacement, stress: None })
    }

    fn recover_stress(
        &self,
        loading: Loading,
        displacement: &[[f64; 3]],
        estimate: ErrorEstimation,
    ) -> Result<Option<StressField>> {
        let model = self.condensed.model();
        let recovery = self.stress_recovery()?;
        let applied = self.applied.iter().enumerate();
        let loads: Vec<_> = applied.map(|(k, (loads, _))| (loading.amplitude(k), loads)).collect();
        let temperature_change =
            loads.iter().map(|(amplitude, loads)| amplitude * loads.temperature_change()).sum();
        let state = ThermoelasticState { displacement, temperature_change };
        let stress = recovery.stress(model, state)?;
        let error = match estimate {
            ErrorEstimation::Estimate => Some(recovery.estimate_error(model, state, &stress)?),
            ErrorEstimation::Skip => None,
        };
        let points = recovery.points();
        let contact = surface_stress_points(model, points, &self.surface.faces, displacement, &loads);
        Ok(Some(StressField::new(model, points, stress, error, contact, &self.limits)))
    }
}
