//! Nodal forces of pressure, tractions and body forces: f_a = ∫ N_a t dS + ∫ N_a b dV.

use nalgebra::Vector3;

use super::integration::{Sample, map};
use super::regions::Regions;
use super::solids::{Rules, Solid, SolidVisitor, visit};
use super::spec::FeSpec;
use crate::element::{ElementKind, Quad4, Quad8, Quad9, ShapeFunctions, Tri3, Tri6};
use crate::error::{Context, Error, Result};
use crate::mesh::faces::{SurfaceFace, group_faces};
use crate::mesh::{CellRef, Mesh};
use crate::quadrature::{RulePoint, quadrilateral, triangle};

/// Nodal forces, global axes, N, `[n_points]`.
pub(super) type NodalForces = Vec<[f64; 3]>;

/// What acts on a face: along its outward normal, or along a fixed direction.
#[derive(Clone, Copy)]
enum FaceLoad {
    Pressure(f64),
    Traction(Vector3<f64>),
}

/// Nodal forces of all loads of `spec`.
///
/// # Errors
/// If a group is missing or no outer surface, or a value is not finite.
pub(super) fn external_forces(spec: &FeSpec, regions: &Regions, rules: &Rules) -> Result<NodalForces> {
    let mut forces = vec![[0.0; 3]; spec.mesh.n_points()];
    for (group, value) in &spec.pressures {
        finite(&[*value]).context(|| format!("pressure on the group \"{group}\""))?;
        load_faces(&spec.mesh, group, FaceLoad::Pressure(*value), &mut forces)
            .context(|| "pressure".to_string())?;
    }
    for (group, value) in &spec.tractions {
        finite(value).context(|| format!("traction on the group \"{group}\""))?;
        load_faces(&spec.mesh, group, FaceLoad::Traction((*value).into()), &mut forces)
            .context(|| "traction".to_string())?;
    }
    finite(&spec.body_force).context(|| "body force".to_string())?;
    if spec.body_force != [0.0; 3] {
        add_body_force(&spec.mesh, &regions.cells, rules, |_| spec.body_force, &mut forces);
    }
    Ok(forces)
}

fn finite(values: &[f64]) -> Result<()> {
    match values.iter().find(|value| !value.is_finite()) {
        Some(value) => Err(Error::input(format!("the value {value} must be a finite number"))),
        None => Ok(()),
    }
}

fn load_faces(mesh: &Mesh, group: &str, load: FaceLoad, forces: &mut NodalForces) -> Result<()> {
    // N times the area vector, which is bilinear on a quad4 and of degree 2 or 3 along each direction on second order.
    let (square, corner) = (quadrilateral(2), triangle(1));
    let (square2, corner2) = (quadrilateral(4), triangle(5));
    for face in group_faces(mesh, group)? {
        match face.kind {
            ElementKind::Quad4 => load_face::<Quad4, 4>(mesh, &face, load, &square, forces),
            ElementKind::Tri3 => load_face::<Tri3, 3>(mesh, &face, load, &corner, forces),
            ElementKind::Quad8 => load_face::<Quad8, 8>(mesh, &face, load, &square2, forces),
            ElementKind::Quad9 => load_face::<Quad9, 9>(mesh, &face, load, &square2, forces),
            ElementKind::Tri6 => load_face::<Tri6, 6>(mesh, &face, load, &corner2, forces),
            other => unreachable!("{} is no face of a solid", other.name()),
        }
    }
    Ok(())
}

/// Adds the forces of one face, ∫ N_a t dS.
fn load_face<S: ShapeFunctions<N, 2>, const N: usize>(
    mesh: &Mesh,
    face: &SurfaceFace,
    load: FaceLoad,
    rule: &[RulePoint<2>],
    forces: &mut NodalForces,
) {
    for &(xi, weight) in rule {
        let gradients = S::gradients(xi);
        let tangent = |d: usize| {
            face.nodes
                .iter()
                .zip(&gradients)
                .fold(Vector3::zeros(), |sum, (&node, g)| sum + Vector3::from(mesh.points[node]) * g[d])
        };
        let area = tangent(0).cross(&tangent(1)) * weight;
        let force = match load {
            FaceLoad::Pressure(p) => -p * area,
            FaceLoad::Traction(t) => t * area.norm(),
        };
        for (&node, value) in face.nodes.iter().zip(S::values(xi)) {
            (0..3).for_each(|c| forces[node][c] += value * force[c]);
        }
    }
}

/// Adds ∫ N_a b(x) dV over the cells; `b` is the force per volume at a point.
pub(super) fn add_body_force(
    mesh: &Mesh,
    cells: &[CellRef],
    rules: &Rules,
    b: impl Fn([f64; 3]) -> [f64; 3],
    forces: &mut NodalForces,
) {
    for &cell in cells {
        visit(
            mesh.kind(cell),
            LoadOf { mesh, nodes: mesh.cell_nodes(cell), rules, b: &b, forces: &mut *forces },
        );
    }
}

struct LoadOf<'a, B> {
    mesh: &'a Mesh,
    nodes: &'a [usize],
    rules: &'a Rules,
    b: &'a B,
    forces: &'a mut NodalForces,
}

impl<B: Fn([f64; 3]) -> [f64; 3]> SolidVisitor for LoadOf<'_, B> {
    type Output = ();

    fn visit<S: Solid<N>, const N: usize>(self) {
        load_cell(self.mesh, self.nodes, &S::rules(self.rules).loads, self.b, self.forces);
    }
}

fn load_cell<const N: usize>(
    mesh: &Mesh,
    nodes: &[usize],
    rule: &[Sample<N>],
    b: &impl Fn([f64; 3]) -> [f64; 3],
    forces: &mut NodalForces,
) {
    let points: [[f64; 3]; N] = std::array::from_fn(|a| mesh.points[nodes[a]]);
    for sample in rule {
        // An inverted element adds nothing here: the assembly refuses it by name.
        let Ok(mapped) = map(&points, sample) else { continue };
        let x = std::array::from_fn(|c| points.iter().zip(&sample.values).map(|(p, n)| p[c] * n).sum());
        let force = b(x).map(|value| value * mapped.volume);
        for (&node, value) in nodes.iter().zip(&sample.values) {
            (0..3).for_each(|c| forces[node][c] += value * force[c]);
        }
    }
}
