//! Stress on the surface of a boundary-element body; displacement and stress at interior points.

use std::sync::Arc;

use rayon::prelude::*;

use super::BeBody;
use crate::bem::finite::Domain;
use crate::body::{Loading, PointState, StressField};
use crate::cancel;
use crate::error::Result;
use crate::fem::{FaceAverages, FaceContribution, RecoveryPoints, exposures};
use crate::geometry::Point;
use crate::mesh::faces::outer_faces;

const POINTS_PER_CANCEL_CHECK: usize = 64;

impl BeBody {
    /// Stress at the points of the surface mesh due to contact tractions and loads. An edge between smooth parts of the
    /// surface has one value for each part. The value is the mean over the adjacent elements of this part.
    pub(super) fn surface_stress(&self, loading: Loading) -> StressField {
        let nodal = self.nodal_tractions(loading.tractions);
        let state = self.solution.state(loading.amplitudes, &nodal);
        let field = self.elements.surface_solution(&state);
        let mut of_contact = vec![[0.0; 3]; self.elements.n_nodes()];
        for (j, &node) in self.map.nodes().iter().enumerate() {
            of_contact[node] = [0, 1, 2].map(|c| nodal[3 * j + c]);
        }
        let faces = outer_faces(&self.surface.mesh);
        let points = RecoveryPoints::on_surface(&self.surface.mesh, &faces);
        let mut in_contact: Vec<_> = self.surface.faces.iter().map(|face| face.owner).collect();
        in_contact.sort_unstable();
        let stiffness = self.elements.stiffness().voigt();
        let (mut whole, mut contact) =
            (FaceAverages::new(points.n_points()), FaceAverages::new(points.n_points()));
        for (i, face) in faces.iter().enumerate() {
            let panel = self.elements.panel(i);
            let reference_area = face.kind.face_reference_area();
            let nodes = face.kind.face_reference_nodes().iter();
            let areas: Vec<Point> = nodes.map(|xi| panel.area_vector(*xi) * reference_area).collect();
            let weight = areas.len() as f64 / areas.iter().map(|area| area.norm()).sum::<f64>();
            let touches = in_contact.binary_search(&face.owner).is_ok();
            for ((&point, xi), area) in
                points.points_of_cell(i).iter().zip(face.kind.face_reference_nodes()).zip(areas)
            {
                let mut gradient = field.surface_gradient(i, *xi);
                let mut own_traction = field.traction(i, *xi);
                let x = panel.position(*xi);
                for (weight, amplitude) in self.weights(loading) {
                    gradient += amplitude * weight.gradient(&x);
                    let normal = area.try_normalize(0.0).unwrap_or_default();
                    own_traction += amplitude * weight.stress(&x) * normal;
                }
                let sample = FaceContribution { area, weight, gradient, stiffness, own_traction };
                whole.add(point, &sample);
                if touches {
                    // The stress at contact points is completed later with the contact tractions, so this sample
                    // excludes them.
                    let load = own_traction - field.interpolate(&of_contact, i, *xi);
                    contact.add(point, &FaceContribution { own_traction: load, ..sample });
                }
            }
        }
        let mut stress = vec![[0.0; 6]; points.n_points()];
        whole.points().iter().for_each(|found| stress[found.point] = found.stress(&[0.0; 3]));
        let limit = self.limit.as_ref();
        let exposures = exposures(&points, &stress, |_| limit.map(|(limit, axes)| (limit, *axes)));
        StressField { points: Arc::new(points), stress, exposures, contact: contact.points(), error: None }
    }

    pub(super) fn inside_points(&self, loading: Loading, points: &[Point]) -> Result<Vec<PointState>> {
        let state = self.state(loading);
        let field = self.elements.interior_solution(&state, Domain::Interior);
        let at = |x: &Point| {
            let mut found = field.at(x);
            for (weight, amplitude) in self.weights(loading) {
                found.displacement += amplitude * weight.displacement(x);
                found.stress += amplitude * weight.stress(x);
            }
            found
        };
        let mut states = Vec::with_capacity(points.len());
        for batch in points.chunks(POINTS_PER_CANCEL_CHECK) {
            cancel::check()?;
            states.extend(batch.par_iter().map(at).collect::<Vec<_>>());
        }
        Ok(states)
    }
}
