//! Finite-element bodies, condensed to the nodes under the frame.

use std::collections::BTreeMap;
use std::sync::{Arc, OnceLock};

use super::lazy_flexibility::LazyFlexibility;
use super::rigid_body_modes::{RigidBodyMode, UnconstrainedModes, relative_motion};
use super::{BodyEquations, BodyField, ElasticBody, ErrorEstimation, StressField};
use crate::bem::half_space::CrossBlocks;
use crate::error::{Context, Error, Result};
use crate::fem::{
    CondensationResources, CondensedBody, FeModel, FeSpec, StressRecovery, surface_stress_points,
};
use crate::flexibility::Flexibility;
use crate::frame::{ContactFrame, FaceMap, MeshedSurface, Side};
use crate::material::strength::MaterialStrength;
use crate::mesh::Mesh;
use crate::mesh::faces::group_faces;

/// Finite-element body, tied to a frame through the faces of one physical group.
pub struct FeBody {
    side: Side,
    condensed: Arc<CondensedBody>,
    map: FaceMap,
    /// Cells whose rows of the flexibility are formed at first, `[N]`; `None` for all cells.
    candidates: Option<Vec<bool>>,
    /// Surface of the initial mesh, which defines the gap.
    surface: MeshedSurface,
    free_gap: Option<Vec<f64>>,
    rigid_body_modes: Option<UnconstrainedModes>,
    taken: bool,
    /// Strengths of the materials by name, for the exposures.
    pub limits: BTreeMap<String, MaterialStrength>,
    recovery: OnceLock<StressRecovery>,
}

impl FeBody {
    /// Assembles the body and forms the flexibility of its contact nodes: nodes of faces of the group `contact` under the
    /// (candidate) cells of `frame`.
    ///
    /// # Errors
    /// If the group or the frame does not fit ([`FaceMap::new`]), or the body cannot be assembled or solved.
    pub fn new(spec: FeSpec, contact: &str, side: Side, frame: &ContactFrame) -> Result<Self> {
        Self::with_worn_mesh(spec, contact, side, frame, &CondensationResources::default(), None)
    }

    /// As [`Self::new`], with the cache and the memory of `resources`. If a mesh `worn` is given, the equations are assembled on
    /// this mesh. The contact surface and its map to the cells follow from the initial mesh.
    ///
    /// # Errors
    /// See [`Self::new`].
    pub fn with_worn_mesh(
        spec: FeSpec,
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
            let free = condensed.contact_free_displacement();
            let free_gap =
                condensed.model().has_own_loads().then(|| map.gap_of_displacement(side, |node| free[node]));
            let (limits, recovery) = (BTreeMap::new(), OnceLock::new());
            let rigid_body_modes = rigid_body_modes(&condensed, &map, side, frame);
            let condensed = Arc::new(condensed);
            Ok(Self {
                side,
                condensed,
                map,
                candidates,
                surface,
                free_gap,
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

    /// Map between the contact faces and the frame.
    pub fn map(&self) -> &FaceMap {
        &self.map
    }

    /// Forces on the nodes of the map, `[3 n_c]`, N, global axes, due to tractions on body 2, `[3, N]`.
    pub fn contact_forces(&self, tractions: &[f64]) -> Vec<f64> {
        let mut forces = vec![0.0; 3 * self.map.nodes().len()];
        self.map.apply_transpose(tractions, &mut forces);
        forces.iter_mut().for_each(|f| *f *= self.side.gap_sign());
        forces
    }
}

fn rigid_body_modes(
    condensed: &CondensedBody,
    map: &FaceMap,
    side: Side,
    frame: &ContactFrame,
) -> Option<UnconstrainedModes> {
    let model = condensed.model();
    let free = model.rigid_body_modes()?;
    let sign = side.gap_sign();
    let motions = model.load_work_on_rigid_body_modes().into_iter().enumerate().map(|(j, load_work)| {
        let points = &model.mesh().points;
        let gap = map.mean_displacement(|node| (free.displacement(&points[node].into(), j) * sign).into());
        RigidBodyMode { relative_motion: relative_motion(free, j, frame, side), gap, load_work }
    });
    Some(UnconstrainedModes { side, modes: motions.collect(), names: free.names.clone() })
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

    fn free_gap(&self) -> Option<&[f64]> {
        self.free_gap.as_deref()
    }

    fn rigid_body_modes(&self) -> Option<&UnconstrainedModes> {
        self.rigid_body_modes.as_ref()
    }

    fn surface(&self) -> Option<&MeshedSurface> {
        Some(&self.surface)
    }

    fn recover(&self, tractions: &[f64]) -> Result<BodyField> {
        let displacement =
            self.condensed.solve_with_forces_on(self.map.nodes(), &self.contact_forces(tractions))?;
        Ok(BodyField { displacement, stress: None })
    }

    fn recover_stress(
        &self,
        _tractions: &[f64],
        displacement: &[[f64; 3]],
        estimate: ErrorEstimation,
    ) -> Result<Option<StressField>> {
        let model = self.condensed.model();
        let recovery = self.stress_recovery()?;
        let stress = recovery.stress(model, displacement)?;
        let error = match estimate {
            ErrorEstimation::Estimate => Some(recovery.estimate_error(model, displacement, &stress)?),
            ErrorEstimation::Skip => None,
        };
        let points = recovery.points();
        let contact = surface_stress_points(model, points, &self.surface.faces, displacement);
        Ok(Some(StressField::new(model, points, stress, error, contact, &self.limits)))
    }
}
