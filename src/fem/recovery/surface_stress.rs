//! Stress on the contact surface, from the surface strain and the surface traction.
//!
//! The in-plane strain follows from the displacement of the surface. The traction is known: it is the sum of the
//! tractions of contact, own loads and foundations of the body. The index p denotes the in-plane components 11, 22, 12,
//! the index n the components 33, 23, 13. With the thermal strain subtracted from ε, ε_n = C_nn⁻¹ (σ_n - C_np ε_p) and
//! σ_p = C_pp ε_p + C_pn ε_n. No stress is extrapolated from inside the elements, because an extrapolation would smooth
//! the peaks at the edge of a contact.
//!
//! # Source
//! The common recovery of boundary elements: Brebbia, Telles and Wrobel (1984), Boundary Element Techniques, section 6.9.

use std::collections::HashMap;

use nalgebra::{Matrix3, Matrix6, Vector3};

use super::points::RecoveryPoints;
use crate::fem::FeModel;
use crate::fem::loads::{AppliedLoads, FaceLoad, face_tangents};
use crate::fem::thermal::ThermoelasticState;
use crate::material::{Stiffness, tensor_to_voigt};
use crate::mesh::faces::SurfaceFace;
use crate::mesh::{CellRef, Mesh};

const IN_PLANE_VOIGT: [usize; 3] = [0, 1, 5];
const OUT_OF_PLANE_VOIGT: [usize; 3] = [2, 3, 4];

/// Strain, stiffness and own traction at a point of the contact surface.
#[derive(Debug, Clone, PartialEq)]
pub struct SurfaceStressPoint {
    /// Index into the [`RecoveryPoints`].
    pub point: usize,
    /// Two tangents of the surface and its outward normal, columns in global axes.
    pub axes: Matrix3<f64>,
    /// Surface strain 11, 22, 12 (engineering) without the thermal strain, in the axes `axes`.
    strain: Vector3<f64>,
    /// Stiffness in the axes `axes`, MPa.
    stiffness: Matrix6<f64>,
    /// Traction of the body's own loads and foundations, global axes, MPa.
    own_traction: Vector3<f64>,
}

impl SurfaceStressPoint {
    /// Adds the surface strain of the displacement gradient `gradient`, global axes.
    pub(crate) fn add_gradient(&mut self, gradient: &Matrix3<f64>) {
        let local = self.axes.transpose() * gradient * self.axes;
        self.strain += Vector3::new(local[(0, 0)], local[(1, 1)], local[(0, 1)] + local[(1, 0)]);
    }

    /// Stress for a contact traction (global axes, MPa) and the body's own tractions. Voigt 11 22 33 23 13 12, global axes, MPa.
    pub fn stress(&self, traction: &[f64; 3]) -> [f64; 6] {
        let block = |rows: [usize; 3], columns: [usize; 3]| {
            Matrix3::from_fn(|i, j| self.stiffness[(rows[i], columns[j])])
        };
        let local = self.axes.transpose() * (Vector3::from(*traction) + self.own_traction);
        let on_plane = Vector3::new(local.z, local.y, local.x);
        let normal = block(OUT_OF_PLANE_VOIGT, OUT_OF_PLANE_VOIGT)
            .try_inverse()
            .expect("a stiffness is positive definite")
            * (on_plane - block(OUT_OF_PLANE_VOIGT, IN_PLANE_VOIGT) * self.strain);
        let in_plane = block(IN_PLANE_VOIGT, IN_PLANE_VOIGT) * self.strain
            + block(IN_PLANE_VOIGT, OUT_OF_PLANE_VOIGT) * normal;
        let [s11, s22, s12] = in_plane.into();
        let tensor = Matrix3::new(s11, s12, local.x, s12, s22, local.y, local.x, local.y, local.z);
        tensor_to_voigt(&(self.axes * tensor * self.axes.transpose()))
    }
}

/// Contribution of a face to the average at one of its nodes.
pub(crate) struct FaceContribution<'a> {
    /// Area vector of the face at the node.
    pub area: Vector3<f64>,
    /// Weight of the face in the average.
    pub weight: f64,
    /// Surface gradient of the displacement, without the thermal strain.
    pub gradient: Matrix3<f64>,
    /// Stiffness, MPa.
    pub stiffness: &'a Matrix6<f64>,
    /// Traction of the body's own loads and foundations, MPa.
    pub own_traction: Vector3<f64>,
}

#[derive(Clone, Default)]
struct FaceSum {
    area: Vector3<f64>,
    weight: f64,
    gradient: Matrix3<f64>,
    stiffness: Matrix6<f64>,
    load: Vector3<f64>,
}

/// Weighted sums over the faces at each point.
pub(crate) struct FaceAverages(Vec<FaceSum>);

impl FaceAverages {
    /// Creates empty sums for `n_points` points.
    pub fn new(n_points: usize) -> Self {
        Self(vec![FaceSum::default(); n_points])
    }

    /// Adds the contribution of a face at a point.
    pub fn add(&mut self, point: usize, sample: &FaceContribution) {
        let sum = &mut self.0[point];
        sum.area += sample.area;
        sum.weight += sample.weight;
        sum.gradient += sample.gradient * sample.weight;
        sum.stiffness += sample.stiffness * sample.weight;
        sum.load += sample.own_traction * sample.weight;
    }

    /// Averages at the points with at least one face, in ascending order. Points without a normal or a valid mean stiffness are
    /// omitted.
    pub fn points(&self) -> Vec<SurfaceStressPoint> {
        let found = self.0.iter().enumerate().filter(|(_, sum)| sum.weight > 0.0);
        found.filter_map(|(point, sum)| sum.point(point)).collect()
    }
}

/// Points of the contact `faces`, in ascending order, with the surface strain and the own traction. `u` is the
/// displacement of all mesh nodes. `loads` are the loads of the body, each with its amplitude.
///
/// The faces at a point are weighted by their inverse areas. On a graded grid, this average interpolates between the
/// face centres.
pub(crate) fn surface_stress_points(
    model: &FeModel,
    points: &RecoveryPoints,
    faces: &[SurfaceFace],
    u: &[[f64; 3]],
    loads: &[(f64, &AppliedLoads)],
) -> Vec<SurfaceStressPoint> {
    let mesh = model.mesh();
    let temperature_change =
        loads.iter().map(|(amplitude, loads)| amplitude * loads.temperature_change).sum();
    let state = ThermoelasticState { displacement: u, temperature_change };
    let mut sums = FaceAverages::new(points.n_points());
    let applied =
        loads.iter().flat_map(|(amplitude, loads)| loads.faces.iter().map(move |face| (*amplitude, face)));
    let foundations = model.foundations().iter().map(|foundation| (1.0, &foundation.face));
    let mut loads: HashMap<(CellRef, usize), Vec<(f64, FaceLoad)>> = HashMap::new();
    for (factor, loaded) in applied.chain(foundations) {
        loads.entry((loaded.owner, loaded.local_face)).or_default().push((factor, loaded.load));
    }
    for face in faces {
        let loads = loads.get(&face.id()).map_or(&[][..], Vec::as_slice);
        let owner = mesh.volume_index(face.owner);
        let local = mesh.kind(face.owner).local_faces()[face.local_face].1;
        let stiffness = model.regions().stiffness(owner);
        let thermal_strain = state.thermal_strain(model.elements(), owner);
        let at_nodes = face_gradients(mesh, face, u);
        let area: f64 = at_nodes.iter().map(|(area, _)| area.norm()).sum::<f64>() / at_nodes.len() as f64;
        for ((area_vector, gradient), &node) in at_nodes.into_iter().zip(local) {
            let displacement = Vector3::from(u[mesh.cell_nodes(face.owner)[node]]);
            let normal = area_vector.try_normalize(0.0).unwrap_or_default();
            let traction = |(factor, load): &(f64, FaceLoad)| *factor * load.traction(&normal, &displacement);
            let own_traction = loads.iter().map(traction).sum();
            let sample = FaceContribution {
                area: area_vector,
                weight: 1.0 / area,
                gradient: gradient - thermal_strain,
                stiffness: &stiffness,
                own_traction,
            };
            sums.add(points.points_of_cell(owner)[node], &sample);
        }
    }
    sums.points()
}

impl FaceSum {
    fn point(&self, point: usize) -> Option<SurfaceStressPoint> {
        let n = self.area.try_normalize(0.0)?;
        // The tangent `a` is normal to n and to the global axis along which n has its smallest component.
        let least = n.iamin();
        let a = n.cross(&Vector3::ith(least, 1.0)).normalize();
        let axes = Matrix3::from_columns(&[a, n.cross(&a), n]);
        let gradient = axes.transpose() * self.gradient * axes / self.weight;
        let strain = Vector3::new(gradient[(0, 0)], gradient[(1, 1)], gradient[(0, 1)] + gradient[(1, 0)]);
        let stiffness = Stiffness::from_voigt(self.stiffness / self.weight).ok()?;
        let stiffness = *stiffness.rotated(&axes.transpose()).voigt();
        Some(SurfaceStressPoint { point, axes, strain, stiffness, own_traction: self.load / self.weight })
    }
}

/// Area vector (tangents' cross product times the reference area) and surface gradient of the displacement at each node of a face.
fn face_gradients(mesh: &Mesh, face: &SurfaceFace, u: &[[f64; 3]]) -> Vec<(Vector3<f64>, Matrix3<f64>)> {
    let at = |xi: [f64; 2]| {
        let tangents = face_tangents(face, xi, |node| mesh.points[node].into());
        let change = face_tangents(face, xi, |node| u[node].into());
        let area = tangents[0].cross(&tangents[1]);
        // Dual tangents: g^1 = g_2 x n / |g_1 x g_2|, g^2 = n x g_1 / |g_1 x g_2|.
        let squared = area.norm_squared();
        let dual = [tangents[1].cross(&area) / squared, area.cross(&tangents[0]) / squared];
        (
            area * face.kind.face_reference_area(),
            change[0] * dual[0].transpose() + change[1] * dual[1].transpose(),
        )
    };
    face.kind.face_reference_nodes().iter().map(|xi| at(*xi)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::element::ElementKind;
    use crate::mesh::faces::outer_faces;
    use crate::mesh::gmsh;

    /// Truth: the area of a square of side 2 mm is 4 mm^2, and the area of its half is 2 mm^2.
    #[test]
    fn faces_of_both_kinds_count_by_their_areas() {
        let square = "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$Nodes\n4\n1 0 0 0\n2 2 0 0\n3 2 2 0\n4 0 2 0\n$EndNodes\n";
        for (element, kind, area) in
            [("1 3 2 1 1 1 2 3 4", ElementKind::Quad4, 4.0), ("1 2 2 1 1 1 2 3", ElementKind::Tri3, 2.0)]
        {
            let text = format!("{square}$Elements\n1\n{element}\n$EndElements\n");
            let mesh = gmsh::parse(text.as_bytes(), "square").unwrap();
            let faces = outer_faces(&mesh);
            assert_eq!(faces[0].kind, kind);
            for (found, _) in face_gradients(&mesh, &faces[0], &[[0.0; 3]; 4]) {
                assert!((found.norm() - area).abs() < 1e-15, "{found}");
            }
        }
    }
}
