//! Nodal forces of pressure, tractions and body forces: f_a = ∫ N_a t dS + ∫ N_a b dV.

use nalgebra::Vector3;

use super::element_materials::ElementMaterials;
use super::element_rules::{ElementVisitor, RuleSet, SolidElement, visit_element};
use super::integration_points::{ReferencePoint, jacobian};
use super::spec::{FeSpec, FoundationStiffness};
use crate::element::{ElementKind, MAX_FACE_NODES};
use crate::error::{Context, Error, Result};
use crate::mesh::faces::{SurfaceFace, group_faces};
use crate::mesh::{CellRef, Mesh};
use crate::quadrature::{RulePoint, quadrilateral, triangle};

/// Vectors at the nodes, global axes, `[n_points]`; usually forces, N.
pub(super) type NodalForces = Vec<[f64; 3]>;

#[derive(Debug, Clone, Copy)]
pub(super) enum FaceLoad {
    /// Pressure, MPa, positive if it acts against the outward normal.
    Pressure(f64),
    /// Traction in global axes, MPa.
    Traction(Vector3<f64>),
    /// Foundation, whose traction opposes the displacement.
    Foundation(FoundationStiffness),
}

impl FaceLoad {
    /// Traction on the body, MPa, for an outward unit normal and a displacement (mm).
    pub fn traction(&self, normal: &Vector3<f64>, displacement: &Vector3<f64>) -> Vector3<f64> {
        match self {
            Self::Pressure(pressure) => -*pressure * normal,
            Self::Traction(traction) => *traction,
            Self::Foundation(FoundationStiffness::Normal(k)) => -*k * normal.dot(displacement) * normal,
            Self::Foundation(FoundationStiffness::Components(k)) => {
                -Vector3::from(*k).component_mul(displacement)
            }
        }
    }
}

#[derive(Debug, Clone, Copy)]
pub(super) struct LoadedFace {
    pub owner: CellRef,
    pub local_face: usize,
    pub load: FaceLoad,
}

/// Loads and prescribed displacements of a body. Foundations are no loads, because their forces depend on the displacement.
#[derive(Debug, Clone)]
pub struct AppliedLoads {
    /// Nodal forces of pressure, tractions, body forces and thermal strain, global axes, N, `[n_points]`.
    pub(super) forces: NodalForces,
    /// Loaded faces; a face with several loads is listed once per load.
    pub(super) faces: Vec<LoadedFace>,
    /// Uniform force per volume, global axes, N/mm3.
    pub(super) body_force: [f64; 3],
    /// Uniform change of temperature, K.
    pub(super) temperature_change: f64,
    /// Displacement of each dof if it is prescribed, 0 otherwise, mm.
    pub(super) prescribed: Vec<f64>,
    /// Forces -K_fc ū_c on the free dofs f, for the prescribed displacements ū_c, N, `[n_free]`.
    pub(super) prescribed_dof_forces: Vec<f64>,
}

impl AppliedLoads {
    /// Nodal forces of pressure, tractions, body forces and thermal strain, global axes, N, `[n_points]`.
    pub fn forces(&self) -> &[[f64; 3]] {
        &self.forces
    }

    /// Uniform force per volume, global axes, N/mm3.
    pub fn body_force(&self) -> [f64; 3] {
        self.body_force
    }

    /// Uniform change of temperature, K.
    pub fn temperature_change(&self) -> f64 {
        self.temperature_change
    }

    /// Displacement of `dof`, mm, if it is prescribed; 0 otherwise. Component c of node i is dof 3 i + c.
    pub fn prescribed_displacement(&self, dof: usize) -> f64 {
        self.prescribed[dof]
    }

    /// Pressures and tractions on faces: solid element, index of the face in the element, pressure (MPa), traction
    /// (global axes, MPa). A face with several loads is listed once per load.
    pub fn face_loads(&self) -> impl Iterator<Item = ((CellRef, usize), f64, Vector3<f64>)> + '_ {
        self.faces.iter().filter_map(|face| {
            let at = (face.owner, face.local_face);
            match face.load {
                FaceLoad::Pressure(pressure) => Some((at, pressure, Vector3::zeros())),
                FaceLoad::Traction(traction) => Some((at, 0.0, traction)),
                FaceLoad::Foundation(_) => None,
            }
        })
    }
}

/// Loads of `spec`, without its prescribed displacements and its thermal strain.
///
/// # Errors
/// If a group is missing or is no outer surface, or a value is not finite.
pub(super) fn loads(spec: &FeSpec, regions: &ElementMaterials, rules: &RuleSet) -> Result<AppliedLoads> {
    let mut loads = AppliedLoads {
        forces: vec![[0.0; 3]; spec.mesh.n_points()],
        faces: Vec::new(),
        body_force: spec.body_force,
        temperature_change: spec.temperature_change,
        prescribed: Vec::new(),
        prescribed_dof_forces: Vec::new(),
    };
    for (group, value) in &spec.pressures {
        finite(&[*value]).context(|| format!("pressure on the group \"{group}\""))?;
        load_faces(&spec.mesh, group, FaceLoad::Pressure(*value), &mut loads)
            .context(|| "pressure".to_string())?;
    }
    for (group, value) in &spec.tractions {
        finite(value).context(|| format!("traction on the group \"{group}\""))?;
        load_faces(&spec.mesh, group, FaceLoad::Traction((*value).into()), &mut loads)
            .context(|| "traction".to_string())?;
    }
    finite(&spec.body_force).context(|| "body force".to_string())?;
    if spec.body_force != [0.0; 3] {
        add_body_force(&spec.mesh, &regions.cells, rules, |_| spec.body_force, &mut loads.forces);
    }
    Ok(loads)
}

fn finite(values: &[f64]) -> Result<()> {
    match values.iter().find(|value| !value.is_finite()) {
        Some(value) => Err(Error::input(format!("the value {value} must be a finite number"))),
        None => Ok(()),
    }
}

fn load_faces(mesh: &Mesh, group: &str, load: FaceLoad, loads: &mut AppliedLoads) -> Result<()> {
    for face in group_faces(mesh, group)? {
        loads.faces.push(LoadedFace { owner: face.owner, local_face: face.local_face, load });
        add_face_load(mesh, &face, load, &mut loads.forces);
    }
    Ok(())
}

/// Nodal area vectors ∫ N_a n dS of the faces, outward, mm2, `[n_points]`.
pub(crate) fn nodal_area_vectors(mesh: &Mesh, faces: &[SurfaceFace]) -> NodalForces {
    let mut areas = vec![[0.0; 3]; mesh.n_points()];
    faces.iter().for_each(|face| add_face_load(mesh, face, FaceLoad::Pressure(-1.0), &mut areas));
    areas
}

fn add_face_load(mesh: &Mesh, face: &SurfaceFace, load: FaceLoad, forces: &mut NodalForces) {
    // For pressure the rules are exact. The integrand, N_a times the area vector, has total degree 1 on tri3 and 4 on tri6. Along
    // each reference axis it has degree 2 on quad4, and 5 on quad8 and quad9.
    for (values, area) in face_points(mesh, face, &face_rule(face.kind, 1)) {
        let normal = area.try_normalize(0.0).unwrap_or_default();
        let force = load.traction(&normal, &Vector3::zeros()) * area.norm();
        for (&node, value) in face.nodes.iter().zip(values) {
            (0..3).for_each(|c| forces[node][c] += value * force[c]);
        }
    }
}

/// Integration rule of a face. On three-node triangles, it is exact for polynomials of degree `linear_triangle_degree`.
pub(super) fn face_rule(kind: ElementKind, linear_triangle_degree: usize) -> Vec<RulePoint<2>> {
    match kind {
        ElementKind::Tri3 => triangle(linear_triangle_degree),
        ElementKind::Tri6 => triangle(5),
        ElementKind::Quad4 => quadrilateral(2),
        ElementKind::Quad8 | ElementKind::Quad9 => quadrilateral(4),
        other => unreachable!("{} is no face of a solid", other.name()),
    }
}

/// Shape functions, and area vector times weight, at the points of a rule.
pub(super) fn face_points(
    mesh: &Mesh,
    face: &SurfaceFace,
    rule: &[RulePoint<2>],
) -> impl Iterator<Item = ([f64; MAX_FACE_NODES], Vector3<f64>)> {
    rule.iter().map(move |&(xi, weight)| {
        let [a, b] = face_tangents(face, xi, |node| mesh.points[node].into());
        (face.kind.face_values(xi), a.cross(&b) * weight)
    })
}

/// Derivatives of a field along the two reference coordinates of a face, at the reference point `xi`. `at` returns the
/// value of the field at a node.
pub(super) fn face_tangents(
    face: &SurfaceFace,
    xi: [f64; 2],
    at: impl Fn(usize) -> Vector3<f64>,
) -> [Vector3<f64>; 2] {
    let gradients = face.kind.face_gradients(xi);
    let along = |d: usize| {
        face.nodes.iter().zip(&gradients).fold(Vector3::zeros(), |sum, (&node, g)| sum + at(node) * g[d])
    };
    [along(0), along(1)]
}

/// Adds the nodal forces ∫ N_a b(x) dV over the cells; `b` is the force per volume.
pub(super) fn add_body_force(
    mesh: &Mesh,
    cells: &[CellRef],
    rules: &RuleSet,
    b: impl Fn([f64; 3]) -> [f64; 3],
    forces: &mut NodalForces,
) {
    for &cell in cells {
        visit_element(
            mesh.kind(cell),
            BodyForceKernel { mesh, nodes: mesh.cell_nodes(cell), rules, b: &b, forces: &mut *forces },
        );
    }
}

struct BodyForceKernel<'a, B> {
    mesh: &'a Mesh,
    nodes: &'a [usize],
    rules: &'a RuleSet,
    b: &'a B,
    forces: &'a mut NodalForces,
}

impl<B: Fn([f64; 3]) -> [f64; 3]> ElementVisitor for BodyForceKernel<'_, B> {
    type Output = ();

    fn visit_element<S: SolidElement<N>, const N: usize>(self) {
        load_cell(self.mesh, self.nodes, &S::rules(self.rules).loads, self.b, self.forces);
    }
}

fn load_cell<const N: usize>(
    mesh: &Mesh,
    nodes: &[usize],
    rule: &[ReferencePoint<N>],
    b: &impl Fn([f64; 3]) -> [f64; 3],
    forces: &mut NodalForces,
) {
    let points: [[f64; 3]; N] = std::array::from_fn(|a| mesh.points[nodes[a]]);
    for sample in rule {
        // At load points, det J may be negative. Only the stiffness points need a positive det J.
        let volume = sample.weight * jacobian(&points, &sample.gradients).determinant();
        let x = std::array::from_fn(|c| points.iter().zip(&sample.values).map(|(p, n)| p[c] * n).sum());
        let force = b(x).map(|value| value * volume);
        for (&node, value) in nodes.iter().zip(&sample.values) {
            (0..3).for_each(|c| forces[node][c] += value * force[c]);
        }
    }
}
