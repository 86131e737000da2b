//! How loads, prescribed displacements and weight of a body move its own surface under the frame.
//!
//! Betti's theorem with the body's response g = G + u_c to a force at x on the patch, which vanishes where the body is held,
//!
//! w(x) = ∫ t·g dS + ∫ b·g dV - ū·R(g),
//!
//! R being the forces of the supports under g, needs no displacement of the mesh at the surface: it is as smooth as the loads are
//! far, and its error is the product of two errors of the mesh. The parts with u_c are sums over nodes. Those with G are integrals over
//! faces, also that of the weight: with u_p = -z²/2 T⁻¹ b, which carries b in the half-space and leaves its surface free,
//! ∫ b·G dV = ∫ (t_G·u_p - t_p·G) dS over what does not lie in the plane of the patch.
//!
//! Loads in that plane near the patch, or on it, are pads on the half-space, whose displacement is integrated exactly for each cell.

use std::collections::HashMap;

use nalgebra::{Matrix3, SMatrix, SVector, Vector3};
use rayon::prelude::*;

use super::correction::OwnResponse;
use super::faces::FaceRules;
use super::far_field::FarField;
use super::field::HalfSpaceField;
use super::forces::{FaceRef, Forces};
use super::patch::Patch;
use crate::bem::half_space::{PointField, TractionMap};
use crate::fem::FeModel;
use crate::frame::Grid;
use crate::geometry::{Point, Side};
use crate::mesh::Mesh;
use crate::mesh::faces::{SurfaceFace, outer_faces};

/// Parts of faces against their distance from the patch.
const RATIO: f64 = 0.35;

/// Loaded faces in the plane of the patch are pads nearer to it than the longer of half its sides.
const NEAR: f64 = 1.0;

/// Singular values of the fit of a rigid motion below this share of the largest are none.
const ROUNDING: f64 = 1e-9;

/// Displacements that a body prescribes, less a rigid motion of all of it.
pub(super) struct Supports {
    origin: Point,
    translation: Point,
    rotation: Point,
    /// By prescribed dofs, mm.
    pub rest: Vec<f64>,
}

/// A loaded part of the plane of a patch.
struct Pad {
    /// Counter-clockwise, in the patch, mm.
    corners: Vec<[f64; 2]>,
    /// Axes of the patch, MPa.
    traction: Point,
}

/// Displacement of the surface under the frame by what acts on the body besides the contact.
pub(super) struct OwnDisplacement {
    /// At the nodes of the polynomials, axes of the patch, mm; component j at node i at 3 i + j.
    at_nodes: Vec<f64>,
    pads: Vec<Pad>,
}

impl Supports {
    /// Of a model with the prescribed dofs `prescribed`. The rigid motion is the one that is nearest to what is prescribed; foundations
    /// would resist it, so that beside them there is none.
    pub fn new(model: &FeModel, prescribed: &[usize]) -> Self {
        let mesh = model.mesh();
        let value = |&dof: &usize| model.prescribed(dof / 3, dof % 3).unwrap_or(0.0);
        let mut supports = Self {
            origin: Point::zeros(),
            translation: Point::zeros(),
            rotation: Point::zeros(),
            rest: prescribed.iter().map(value).collect(),
        };
        let moved = supports.rest.iter().any(|u| *u != 0.0);
        if !moved || model.bedded_faces().next().is_some() {
            return supports;
        }
        let at = |dof: usize| Point::from(mesh.points[dof / 3]);
        supports.origin = prescribed.iter().map(|&dof| at(dof)).sum::<Point>() / prescribed.len() as f64;
        let size = prescribed.iter().map(|&dof| (at(dof) - supports.origin).norm()).fold(0.0, f64::max);
        let size = if size > 0.0 { size } else { 1.0 };
        let (mut matrix, mut rhs) = (SMatrix::<f64, 6, 6>::zeros(), SVector::<f64, 6>::zeros());
        for (&dof, u) in prescribed.iter().zip(&supports.rest) {
            let arm = (at(dof) - supports.origin) / size;
            let along = Vector3::ith(dof % 3, 1.0);
            // (ω x r)·e = ω·(r x e)
            let turn = arm.cross(&along);
            let row = SVector::<f64, 6>::from_fn(|k, _| if k < 3 { along[k] } else { turn[k - 3] });
            matrix += row * row.transpose();
            rhs += row * *u;
        }
        let fit = matrix.svd(true, true);
        let most = fit.singular_values.amax();
        let Ok(motion) = fit.solve(&rhs, ROUNDING * most) else { return supports };
        supports.translation = Point::new(motion[0], motion[1], motion[2]);
        supports.rotation = Point::new(motion[3], motion[4], motion[5]) / size;
        let rigid: Vec<f64> = prescribed.iter().map(|&dof| supports.rigid(&at(dof))[dof % 3]).collect();
        supports.rest.iter_mut().zip(rigid).for_each(|(u, rigid)| *u -= rigid);
        supports
    }

    /// The rigid motion of a point, global axes, mm.
    fn rigid(&self, x: &Point) -> Point {
        self.translation + self.rotation.cross(&(x - self.origin))
    }
}

/// What acts on a face off the plane of the patch, at one of its points, axes of the patch.
struct Acting {
    /// Traction, MPa.
    traction: Point,
    /// Displacement that the tractions of G work on, mm.
    displacement: Point,
}

/// What acts on the faces of a body.
struct OnFaces<'a> {
    model: &'a FeModel,
    forces: &'a Forces<'a>,
    /// Tractions on faces, global axes, by the outward normal: pressures, and the rest.
    loads: HashMap<FaceRef, (f64, Point)>,
    /// Of [`Supports::rest`], by dofs.
    supports: HashMap<usize, f64>,
    /// Of the weight, axes of the patch: T⁻¹ b.
    weight: Point,
}

impl OwnDisplacement {
    /// Of the response `own` of a body with one patch, for `forces` on it; `field` that of their half-space.
    pub fn new(model: &FeModel, forces: &Forces, own: &OwnResponse, field: &HalfSpaceField) -> Self {
        let on_faces = OnFaces::new(model, (forces, field), &own.supports);
        let own_faces = forces.own_faces(model.mesh());
        let mut pads = Vec::new();
        let mut others = Vec::new();
        for face in outer_faces(model.mesh()) {
            let in_plane = own_faces(&face);
            match on_faces.loads.get(&(face.owner, face.local_face)) {
                Some(load) if in_plane => {
                    let traction = forces.patch.axes.to_local(&load.1) - Point::z() * load.0;
                    let pad = Pad::new(model.mesh(), &face, &forces.patch, traction);
                    pads.push(pad);
                }
                _ if in_plane => {}
                _ => others.push(face),
            }
        }
        let (near, far): (Vec<Pad>, Vec<Pad>) =
            pads.into_iter().partition(|pad| pad.distance(&forces.patch) < NEAR * forces.patch.size());
        let mut at_nodes = own.work.clone();
        let shares: Vec<Vec<Point>> = others.par_iter().map(|face| on_faces.work(face)).collect();
        for share in shares {
            at_nodes.chunks_exact_mut(3).zip(&share).for_each(|(sum, part)| add(sum, part));
        }
        let by_far = forces.points.par_iter().map(|&point| displacement(&far, field, point));
        let by_far: Vec<Point> = by_far.collect();
        for (i, (sum, part)) in at_nodes.chunks_exact_mut(3).zip(&by_far).enumerate() {
            let rigid = own.supports.rigid(&forces.place(i));
            add(sum, &(part + forces.patch.axes.to_local(&rigid)));
        }
        Self { at_nodes, pads: near }
    }

    /// What it adds to the gap of the cells of a frame, axes of the frame by planes, mm.
    pub fn gap(
        &self,
        far: &FarField,
        (grid, places): (&Grid, Option<&[usize]>),
        (field, side): (&HalfSpaceField, Side),
    ) -> Vec<f64> {
        let mut gap = far.on_cells(grid, places, &self.at_nodes);
        let n = gap.len() / 3;
        if !self.pads.is_empty() {
            let turn = if side == Side::Upper { -1.0 } else { 1.0 };
            let by_pads: Vec<Point> = (0..n)
                .into_par_iter()
                .map(|cell| {
                    let place = places.map_or(cell, |places| places[cell]);
                    let index = [place / grid.cells[1], place % grid.cells[1]];
                    let [x, y] = [0, 1].map(|axis| {
                        (index[axis] as f64 + 0.5) * grid.spacing[axis] - grid.half_width()[axis]
                    });
                    displacement(&self.pads, field, [x, turn * y])
                })
                .collect();
            for (cell, u) in by_pads.iter().enumerate() {
                (0..3).for_each(|c| gap[c * n + cell] += if c > 0 { turn * u[c] } else { u[c] });
            }
        }
        gap.iter_mut().for_each(|value| *value *= side.gap_sign());
        gap
    }
}

fn add(sum: &mut [f64], part: &Point) {
    (0..3).for_each(|c| sum[c] += part[c]);
}

/// Displacement at a point of the plane by tractions on it, axes of the patch, mm.
fn displacement(pads: &[Pad], field: &HalfSpaceField, at: [f64; 2]) -> Point {
    pads.iter().map(|pad| field.patches.polygon(&pad.corners, at) * pad.traction).sum()
}

impl Pad {
    /// A face in the plane, or that stands for it; curved edges by two straight ones.
    fn new(mesh: &Mesh, face: &SurfaceFace, patch: &Patch, traction: Point) -> Self {
        let nodes: Vec<Point> = face.nodes.iter().map(|&node| mesh.points[node].into()).collect();
        let n = face.kind.n_corners();
        let corners: &[[f64; 2]] = if n == 3 {
            &[[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]]
        } else {
            &[[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]]
        };
        let at = |xi: [f64; 2]| {
            let x = face.kind.face_values(xi).iter().zip(&nodes).map(|(value, node)| node * *value).sum();
            let local = patch.local(&x);
            [local.x, local.y]
        };
        let linear = face.kind.n_nodes() == n;
        let corner = |k: usize| {
            let (a, b) = (corners[k], corners[(k + 1) % n]);
            let middle = [0, 1].map(|c| 0.5 * (a[c] + b[c]));
            if linear { vec![at(a)] } else { vec![at(a), at(middle)] }
        };
        Self { corners: (0..n).flat_map(corner).collect(), traction }
    }

    /// Distance from the patch, at least.
    fn distance(&self, patch: &Patch) -> f64 {
        let n = self.corners.len() as f64;
        let middle = [0, 1].map(|c| self.corners.iter().map(|corner| corner[c]).sum::<f64>() / n);
        let radius = self.corners.iter().map(|c| (c[0] - middle[0]).hypot(c[1] - middle[1]));
        patch.distance(&Point::new(middle[0], middle[1], 0.0)) - radius.fold(0.0, f64::max)
    }
}

impl<'a> OnFaces<'a> {
    fn new(model: &'a FeModel, (forces, field): (&'a Forces, &HalfSpaceField), supports: &Supports) -> Self {
        let mut loads: HashMap<FaceRef, (f64, Point)> = HashMap::new();
        for (face, pressure, traction) in model.face_loads() {
            let sum = loads.entry(face).or_insert((0.0, Point::zeros()));
            sum.0 += pressure;
            sum.1 += traction;
        }
        let moved = model.prescribed_dofs().into_iter().zip(supports.rest.iter().copied());
        let weight = field.slope(&forces.patch.axes.to_local(&Point::from(model.body_force())));
        Self { model, forces, loads, supports: moved.filter(|(_, u)| *u != 0.0).collect(), weight }
    }

    /// Work of what acts on a face on the field of each force, N mm per N, axes of the patch.
    fn work(&self, face: &SurfaceFace) -> Vec<Point> {
        let forces = self.forces;
        let mut work = vec![Point::zeros(); forces.points.len()];
        let load = self.loads.get(&(face.owner, face.local_face));
        let (mesh, patch) = (self.model.mesh(), &forces.patch);
        // Where only some nodes are prescribed the loads of u_c count what is missing here.
        let held = [0, 1, 2].map(|c| face.nodes.iter().all(|&node| self.model.prescribed(node, c).is_some()));
        let moved = |node: usize, c: usize| {
            if held[c] { self.supports.get(&(3 * node + c)).copied().unwrap_or(0.0) } else { 0.0 }
        };
        let moves: Vec<Point> =
            face.nodes.iter().map(|&node| Point::from([0, 1, 2].map(|c| moved(node, c)))).collect();
        let none = Point::zeros();
        if load.is_none() && self.weight == none && moves.iter().all(|u| *u == none) {
            return work;
        }
        for point in FaceRules::new().points(mesh, face, &|x| forces.distance(x), RATIO) {
            let local = patch.local(&point.at);
            let area = point.area.norm();
            let normal = patch.axes.to_local(&point.area) / area;
            let map = TractionMap::new(forces.stiffness, &normal);
            let mut acting = Acting { traction: none, displacement: none };
            if let Some((pressure, traction)) = load {
                acting.traction += patch.axes.to_local(traction) - normal * *pressure;
            }
            let moved: Point = moves.iter().zip(&point.values).map(|(u, value)| u * *value).sum();
            // Work of a support's force is that of the traction on the body against the displacement.
            acting.displacement -= patch.axes.to_local(&moved);
            if self.weight != none {
                let slope = self.weight * -local.z;
                let gradient =
                    [Matrix3::zeros(), Matrix3::zeros(), Matrix3::from_columns(&[slope, none, none])];
                acting.traction -= map.of(&PointField { value: Matrix3::zeros(), gradient }).column(0);
                acting.displacement += self.weight * (-0.5 * local.z * local.z);
            }
            for (i, work) in work.iter_mut().enumerate() {
                let field = forces.field.at(&forces.from(i, &local));
                *work += field.value.transpose() * acting.traction * area;
                if acting.displacement != none {
                    *work += map.of(&field).transpose() * acting.displacement * area;
                }
            }
        }
        work
    }
}
