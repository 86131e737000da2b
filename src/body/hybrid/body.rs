//! Finite body with the near field of a half-space. Finite elements compute the correction for the finite size of the
//! body.

use std::collections::BTreeMap;
use std::sync::Arc;

use nalgebra::{Matrix3, Vector6};
use rayon::prelude::*;

use super::applied_loads::AppliedLoadDisplacement;
use super::corrected_flexibility::build_corrected_flexibility;
use super::correction::Correction;
use super::far_field::FarField;
use super::field::HalfSpaceField;
use super::half_space_fit::HalfSpaceFit;
use super::indicators::Indicators;
use super::patch::ContactPatch;
use super::polynomial_order::{self, AppliedLoadError, PatchHalfSpace};
use super::traction_tree::TractionTree;
use crate::bem::half_space::{CrossBlocks, SurfaceGreen};
use crate::body::loads::applied_loads;
use crate::body::{
    BodyEquations, BodyField, BodyLoad, ElasticBody, ErrorEstimation, LoadCase, Loading, StressField,
};
use crate::error::{Context, Error, Result};
use crate::fem::{CondensationResources, FeModel, FeSpec, StressRecovery, surface_stress_points};
use crate::flexibility::Flexibility;
use crate::frame::{ContactFrame, FaceMap, Grid, MeshedSurface, Side};
use crate::geometry::Point;
use crate::material::strength::MaterialStrength;
use crate::material::{Stiffness, strain_of_gradient};
use crate::mesh::Mesh;
use crate::mesh::faces::{SurfaceFace, group_faces, outer_faces};

/// Finite-element body with the near field of a half-space.
pub struct HybridBody {
    side: Side,
    /// Surface Green's function of the half-space, axes of the frame.
    green: SurfaceGreen,
    far_field: FarField,
    correction: Correction,
    indicators: Indicators,
    grid: Grid,
    grid_indices: Option<Vec<usize>>,
    patch: ContactPatch,
    /// Stiffness of the half-space, global axes.
    stiffness: Stiffness,
    field: HalfSpaceField,
    cache_warning: Option<String>,
    model: FeModel,
    recovery: StressRecovery,
    /// Strengths by material name, from which the exposures are computed.
    pub limits: BTreeMap<String, MaterialStrength>,
    surface: MeshedSurface,
    loads: Vec<BodyLoad>,
    applied_load_error: Option<AppliedLoadError>,
    /// Whether each mesh node lies in the plane of the patch, or on a curved face that is treated as part of this
    /// plane.
    on_surface: Vec<bool>,
}

impl HybridBody {
    /// Builds the body of `spec` with the half-space `site`, which must have been found for the same `frame`. Each of
    /// `cases` contains the loads of `spec` that share an amplitude. Without cases, all loads share one amplitude.
    ///
    /// # Errors
    /// If the group or the frame do not fit, or the body cannot be assembled or solved.
    pub fn new(
        spec: FeSpec,
        cases: &[(LoadCase, FeSpec)],
        contact: &str,
        side: Side,
        frame: &ContactFrame,
        site: &HalfSpaceFit,
        resources: &CondensationResources,
    ) -> Result<Self> {
        let name = spec.name.clone();
        let build = || {
            let grid =
                frame.grid.ok_or_else(|| Error::input("a half-space under a mesh needs a grid frame"))?;
            let mesh = spec.mesh.clone();
            let faces = group_faces(&mesh, contact)?;
            let mean_heights = FaceMap::new(frame, &mesh, &faces, side)?.mean_heights(frame, &mesh);
            let in_frame = site.stiffness.rotated(&frame.axes.0.transpose());
            let green = SurfaceGreen::new(&in_frame, side)?;
            let model = FeModel::with_memory_limit(spec, &resources.memory)?;
            let recovery = StressRecovery::new(&model)?;
            let (near, cache_warning) = PatchHalfSpace::new(site, resources)?;
            let (cases, applied) = applied_loads(&model, cases)?;
            let (correction, indicators) =
                polynomial_order::adaptive_correction(&model, &recovery, &near, &resources.memory, &applied)?;
            let far_field = FarField::new(&correction.matrix, indicators.nodes, &site.patch, side);
            let mut loads = Vec::new();
            let mut applied_load_error: Option<AppliedLoadError> = None;
            for (case, own) in cases.into_iter().zip(&correction.applied_loads) {
                let forces = near.forces(indicators.nodes);
                let stress = recovery.stress(&model, &own.displacement)?;
                let points = recovery.points();
                let displacement =
                    AppliedLoadDisplacement::new(&model, &forces, &near.field, own, points, &stress)?;
                let places = (&grid, frame.grid_indices.as_deref());
                let gap = displacement.gap(&far_field, places, &near.field, side)?;
                loads.push(BodyLoad { side: Some(side), case, gap });
                let error = polynomial_order::applied_load_error(
                    &model,
                    &recovery,
                    &forces,
                    &correction,
                    &recovery.estimate_error(&model, &own.displacement, &stress)?,
                    displacement.support_work(),
                )?;
                applied_load_error = Some(applied_load_error.map_or(error, |sum| sum.plus(error)));
            }
            let on_surface = nodes_of(&mesh, near.forces(indicators.nodes).own_faces(&mesh));
            Ok(Self {
                side,
                green,
                far_field,
                correction,
                indicators,
                grid,
                grid_indices: frame.grid_indices.clone(),
                patch: site.patch,
                stiffness: site.stiffness.clone(),
                field: near.field,
                cache_warning,
                recovery,
                model,
                limits: BTreeMap::new(),
                surface: MeshedSurface { mesh, faces, side, mean_heights, curved_gap: true },
                loads,
                applied_load_error,
                on_surface,
            })
        };
        build().context(|| name)
    }

    /// Quality indicators of the correction.
    pub fn indicators(&self) -> &Indicators {
        &self.indicators
    }

    /// Warning of the cache of the point-force field, if any.
    pub fn cache_warning(&self) -> Option<&str> {
        self.cache_warning.as_deref()
    }

    /// Estimated errors of the displacement under the frame due to loads and prescribed displacements of the body;
    /// `None` for a body without them.
    pub fn applied_load_error(&self) -> Option<AppliedLoadError> {
        self.applied_load_error
    }

    /// Correction of the half-space between the nodes of the patch, with its fields in the mesh.
    pub fn correction(&self) -> &Correction {
        &self.correction
    }

    /// Polynomial correction of the half-space operator on the frame.
    pub fn far_field(&self) -> &FarField {
        &self.far_field
    }

    fn flexibility(&self, cross: CrossBlocks) -> Result<Arc<dyn Flexibility>> {
        let far = vec![self.far_field.clone()];
        build_corrected_flexibility(&self.green, far, &self.grid, self.grid_indices.as_deref(), cross)
    }

    /// Square root of twice the strain energy due to the `tractions` on body 2, without other loads.
    fn energy_norm(&self, tractions: &[f64]) -> Result<f64> {
        let operator = self.flexibility(CrossBlocks::Keep)?;
        let mut gap = vec![0.0; tractions.len()];
        operator.apply(tractions, &mut gap);
        let area = self.grid.spacing[0] * self.grid.spacing[1];
        let work: f64 = tractions.iter().zip(&gap).map(|(traction, gap)| traction * gap).sum();
        Ok((area * work).max(0.0).sqrt())
    }

    /// Displacement of all nodes due to tractions on body 2 and loads, minus the half-space displacement due to the
    /// tractions.
    fn corrections(&self, loading: Loading) -> Vec<[f64; 3]> {
        let mut displacement = vec![[0.0; 3]; self.model.mesh().n_points()];
        for (k, load) in self.correction.applied_loads.iter().enumerate() {
            let sums = displacement.as_flattened_mut().iter_mut();
            let of_load = load.displacement.as_flattened();
            sums.zip(of_load).for_each(|(sum, u)| *sum += loading.amplitude(k) * u);
        }
        let forces = self.far_field.forces(&self.grid, self.grid_indices.as_deref(), loading.tractions);
        let own: Vec<f64> = forces.iter().map(|force| force * self.side.gap_sign()).collect();
        self.correction.superpose_fields(&own, &mut displacement);
        displacement
    }

    fn traction_tree(&self, tractions: &[f64]) -> TractionTree {
        let n = tractions.len() / 3;
        let sign = self.side.gap_sign();
        // The patch axes of body 2 are the axes of the frame, rotated by half a turn about x.
        let turned = self.side == Side::Upper;
        let cells = self.grid.cells;
        let own = |ix: usize, iy: usize| -> Point {
            let place = ix * cells[1] + if turned { cells[1] - 1 - iy } else { iy };
            let cell = match &self.grid_indices {
                Some(places) => places.binary_search(&place).ok(),
                None => Some(place),
            };
            let Some(cell) = cell else { return Point::zeros() };
            let [x, y, z] = [0, 1, 2].map(|c| sign * tractions[c * n + cell]);
            if turned { Point::new(x, -y, -z) } else { Point::new(x, y, z) }
        };
        TractionTree::new(cells, self.grid.spacing, &own)
    }

    /// Position of a mesh node in the half-space. Nodes on the half-space surface get exactly zero depth.
    fn distribution_point(&self, node: usize) -> Point {
        let local = self.patch.local(&Point::from(self.model.mesh().points[node]));
        Point::new(local.x, local.y, if self.on_surface[node] { 0.0 } else { local.z.min(0.0) })
    }

    fn stress(&self, gradient: &Matrix3<f64>) -> Vector6<f64> {
        self.stiffness.voigt() * strain_of_gradient(gradient)
    }

    /// Memory that the body keeps, bytes.
    pub fn held_bytes(&self) -> usize {
        let operator = 4 * 8 * 16 * self.grid.cells[0] * self.grid.cells[1];
        self.model.resident_bytes() + 8 * self.correction.fields.values().len() + operator
    }

    /// Number of unknowns of the finite elements.
    pub fn n_free(&self) -> usize {
        self.model.n_free()
    }
}

fn nodes_of(mesh: &Mesh, wanted: impl Fn(&SurfaceFace) -> bool) -> Vec<bool> {
    let mut found = vec![false; mesh.n_points()];
    for face in outer_faces(mesh).iter().filter(|face| wanted(face)) {
        face.nodes.iter().for_each(|&node| found[node] = true);
    }
    found
}

impl ElasticBody for HybridBody {
    fn describe(&self) -> String {
        format!("half-space corrected by finite elements, {} unknowns", self.n_free())
    }

    fn equations(&self) -> BodyEquations<'_> {
        BodyEquations::Hybrid(self)
    }

    fn near_field_green(&self) -> Option<&SurfaceGreen> {
        Some(&self.green)
    }

    fn take_flexibility(&mut self, cross: CrossBlocks) -> Result<Option<Arc<dyn Flexibility>>> {
        Ok(Some(self.flexibility(cross)?))
    }

    fn loads(&self) -> &[BodyLoad] {
        &self.loads
    }

    fn surface(&self) -> Option<&MeshedSurface> {
        Some(&self.surface)
    }

    fn recover(&self, loading: Loading) -> Result<BodyField> {
        let mut displacement = self.corrections(loading);
        let distribution = self.traction_tree(loading.tractions);
        displacement.par_iter_mut().enumerate().for_each(|(node, u)| {
            let local = self.distribution_point(node);
            let near = self.patch.axes.to_global(&distribution.at(&local, &self.field).displacement);
            (0..3).for_each(|c| u[c] += near[c]);
        });
        Ok(BodyField { displacement, stress: None })
    }

    /// Recovers the half-space stress at the nodes plus the finite-element stress of the correction. The estimated
    /// error is the error of the correction stress.
    fn recover_stress(
        &self,
        loading: Loading,
        _displacement: &[[f64; 3]],
        estimate: ErrorEstimation,
    ) -> Result<Option<StressField>> {
        let recovery = &self.recovery;
        let correction = self.corrections(loading);
        let mut stress = recovery.stress(&self.model, &correction)?;
        let error = match estimate {
            ErrorEstimation::Estimate => {
                let mut error = recovery.estimate_error(&self.model, &correction, &stress)?;
                // The error is related to the stress of the whole body, not to the stress of the correction.
                error.stress_norm = error.stress_norm.max(self.energy_norm(loading.tractions)?);
                Some(error)
            }
            ErrorEstimation::Skip => None,
        };
        let distribution = self.traction_tree(loading.tractions);
        let points = recovery.points();
        let axes = self.patch.axes.0;
        let near = |node: usize| {
            axes * distribution.at(&self.distribution_point(node), &self.field).gradient * axes.transpose()
        };
        stress.par_iter_mut().zip(&points.mesh_nodes).for_each(|(stress, &node)| {
            let near = self.stress(&near(node));
            (0..6).for_each(|k| stress[k] += near[k]);
        });
        let applied = self.correction.applied_loads.iter().enumerate();
        let loads: Vec<_> = applied.map(|(k, load)| (loading.amplitude(k), &load.loads)).collect();
        let mut contact =
            surface_stress_points(&self.model, points, &self.surface.faces, &correction, &loads);
        contact
            .par_iter_mut()
            .for_each(|contact| contact.add_gradient(&near(points.mesh_nodes[contact.point])));
        Ok(Some(StressField::new(&self.model, points, stress, error, contact, &self.limits)))
    }
}
