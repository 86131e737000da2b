//! Displacement of a body's surface under the frame due to its own surface loads, body force and prescribed
//! displacements.
//!
//! Let g = G + u_c be the body's displacement due to a unit force at x on the patch: half-space field G plus correction
//! u_c. Betti's theorem gives the surface displacement w due to surface tractions t, the body force b and prescribed
//! displacements ū,
//!
//! w(x) = ∫ t·g dS + ∫ b·g dV - ū·R(g),
//!
//! where R(g) are the support forces under the unit force. Two mesh errors determine the error of w: the error of g,
//! and the error of the stress due to the body's own loads. The error of w is of the order of their product.
//!
//! Let T = C(e3, e3) be the matrix C_i3k3 of the stiffness C. The displacement u_p = -z²/2 T⁻¹ b balances b and leaves
//! the surface free of traction. Hence ∫ b·G dV = ∫ (t_G·u_p - t_p·G) dS over the boundary outside the plane of the
//! patch. t_G and t_p are the tractions of G and u_p.
//!
//! On fixed faces, u_c equals -G only at the nodes. Between the nodes, the support tractions do the work ∫ (σ n)·g dS.
//! σ is the recovered stress due to the body's own loads, n the normal.
//!
//! Loads in the plane of the patch act on the half-space. Exact integrals over the loaded faces give their
//! displacement. For loads on or near the patch, the integrals are evaluated at the cells. For other loads they are
//! evaluated at the nodes of the polynomials.

use std::collections::{BTreeMap, HashMap};

use nalgebra::Matrix3;
use rayon::prelude::*;

use super::face_outline::outline_loops;
use super::face_quadrature::FaceRules;
use super::far_field::FarField;
use super::field::HalfSpaceField;
use super::forces::{FaceId, PatchForces};
use super::patch::ContactPatch;
use crate::bem::green_tensor::{GreenTensor, TractionOperator};
use crate::bem::half_space::SurfaceGreen;
use crate::bem::half_space::integrals::polygon;
use crate::cancel;
use crate::error::Result;
use crate::fem::{AppliedLoads, FeModel, PrescribedMotion, RecoveryPoints};
use crate::frame::Grid;
use crate::geometry::{Point, Side, bounds};
use crate::material::voigt_to_tensor;
use crate::mesh::Mesh;
use crate::mesh::faces::{SurfaceFace, outer_faces};

/// Largest ratio of the size of a face part to its distance from the forces.
const MAX_SIZE_TO_DISTANCE: f64 = 0.35;

/// Distance from the patch up to which loads in its plane count as near, divided by the longer half-side of the patch.
const NEAR_LOAD_DISTANCE: f64 = 1.0;

const FACES_PER_BATCH: usize = 64;

const CELLS_PER_CANCEL_CHECK: usize = 4096;

/// Loaded faces in the plane of a patch that have the same traction.
struct PatchLoad {
    /// Closed polygons around the faces, axes of the patch, relative to its centre, mm.
    outline: Vec<Vec<[f64; 2]>>,
    /// Traction, axes of the patch, MPa.
    traction: Point,
}

pub(super) struct AppliedLoadDisplacement {
    /// Displacement at the nodes of the polynomials without near loads, axes of the patch, mm. Component j at node i
    /// has index 3 i + j.
    at_nodes: Vec<f64>,
    /// Part of `at_nodes` due to the work of the support tractions between the nodes of the mesh.
    support_work: Vec<f64>,
    near_loads: Vec<PatchLoad>,
}

/// Response of a body to its own loads and prescribed displacements.
pub(super) struct AppliedLoadResponse {
    pub loads: AppliedLoads,
    /// Displacement of all nodes, global axes, mm, `[n_points]`.
    pub displacement: Vec<[f64; 3]>,
    /// Work of the loads and the prescribed displacements on u_c, N mm per N, `[3 n]`. u_c is the correction due to
    /// each unit force; the forces act along the axes of the patch.
    pub work: Vec<f64>,
    pub prescribed_motion: PrescribedMotion,
}

/// Traction and displacement that act at a point of a face, axes of the patch.
struct FaceAction {
    /// Traction, MPa.
    traction: Point,
    /// Displacement whose product with the tractions of the half-space field G enters the work, mm.
    displacement: Point,
}

struct FaceLoads<'a> {
    model: &'a FeModel,
    forces: &'a PatchForces<'a>,
    /// Loads on faces: pressure (positive into the body), and traction in global axes.
    loads: HashMap<FaceId, (f64, Point)>,
    supports: HashMap<usize, f64>,
    /// T⁻¹ b of the body force b, axes of the patch.
    weight: Point,
    points: &'a RecoveryPoints,
    /// Stress at `points` due to the body's own loads, global axes, MPa.
    stress: &'a [[f64; 6]],
    rules: FaceRules,
}

impl AppliedLoadDisplacement {
    /// Computes the surface displacement from the response `own` of a body and its recovered `stress` at `points`.
    pub fn new(
        model: &FeModel,
        forces: &PatchForces,
        field: &HalfSpaceField,
        own: &AppliedLoadResponse,
        points: &RecoveryPoints,
        stress: &[[f64; 6]],
    ) -> Result<Self> {
        let on_faces = FaceLoads::new(model, forces, field, own, points, stress);
        let own_faces = forces.own_faces(model.mesh());
        let (mut loaded, mut others) = (Vec::new(), Vec::new());
        for face in outer_faces(model.mesh()) {
            let in_plane = own_faces(&face);
            if let Some(load) = on_faces.loads.get(&face.id()).filter(|_| in_plane) {
                let traction = forces.patch.axes.to_local(&load.1) - Point::z() * load.0;
                // Adding zero replaces -0 by 0, so that equal tractions have equal bits.
                loaded.push((face.clone(), traction + Point::zeros()));
            }
            others.push((face, in_plane));
        }
        let pads = PatchLoad::all(model.mesh(), &loaded, &forces.patch);
        let (near, far): (Vec<PatchLoad>, Vec<PatchLoad>) =
            pads.into_iter().partition(|pad| pad.is_near(&forces.patch));
        let mut at_nodes = own.work.clone();
        let mut support_work = vec![0.0; at_nodes.len()];
        for batch in others.chunks(FACES_PER_BATCH) {
            cancel::check()?;
            let shares: Vec<[Vec<Point>; 2]> = batch.par_iter().map(|face| on_faces.work(face)).collect();
            for [work, rest] in shares {
                at_nodes.chunks_exact_mut(3).zip(&work).for_each(|(sum, part)| add(sum, part));
                support_work.chunks_exact_mut(3).zip(&rest).for_each(|(sum, part)| add(sum, part));
            }
        }
        let by_far: Vec<Point> =
            forces.points.par_iter().map(|&point| displacement(&far, field, point)).collect();
        for (i, sum) in at_nodes.chunks_exact_mut(3).enumerate() {
            let rigid = forces.patch.axes.to_local(&own.prescribed_motion.rigid(&forces.position(i)));
            add(sum, &(by_far[i] + rigid + Point::from_row_slice(&support_work[3 * i..3 * i + 3])));
        }
        Ok(Self { at_nodes, support_work, near_loads: near })
    }

    /// Part of the displacement due to the work of the support tractions between the nodes of the mesh, mm.
    pub fn support_work(&self) -> &[f64] {
        &self.support_work
    }

    /// Change of the gap of the cells due to the loads, axes of the frame, mm: all x components, then all y and all n
    /// components.
    pub fn gap(
        &self,
        far: &FarField,
        (grid, places): (&Grid, Option<&[usize]>),
        field: &HalfSpaceField,
        side: Side,
    ) -> Result<Vec<f64>> {
        let mut gap = far.cell_means(grid, places, &self.at_nodes);
        let n = gap.len() / 3;
        let turn = if side == Side::Upper { -1.0 } else { 1.0 };
        let at = |cell: usize| {
            let place = places.map_or(cell, |places| places[cell]);
            let index = grid.cell_indices(place);
            let [x, y] =
                [0, 1].map(|axis| (index[axis] as f64 + 0.5) * grid.spacing[axis] - grid.half_width()[axis]);
            displacement(&self.near_loads, field, [x, turn * y])
        };
        for first in (0..if self.near_loads.is_empty() { 0 } else { n }).step_by(CELLS_PER_CANCEL_CHECK) {
            cancel::check()?;
            let cells = first..(first + CELLS_PER_CANCEL_CHECK).min(n);
            let by_pads: Vec<Point> = cells.into_par_iter().map(at).collect();
            for (cell, u) in (first..).zip(&by_pads) {
                (0..3).for_each(|c| gap[c * n + cell] += if c > 0 { turn * u[c] } else { u[c] });
            }
        }
        gap.iter_mut().for_each(|value| *value *= side.gap_sign());
        Ok(gap)
    }
}

fn add(sum: &mut [f64], part: &Point) {
    (0..3).for_each(|c| sum[c] += part[c]);
}

fn displacement(pads: &[PatchLoad], field: &HalfSpaceField, at: [f64; 2]) -> Point {
    pads.iter().map(|pad| pad.displacement(field.patch_integrals.green(), at)).sum()
}

impl PatchLoad {
    fn all(mesh: &Mesh, faces: &[(SurfaceFace, Point)], patch: &ContactPatch) -> Vec<Self> {
        let mut by_traction: BTreeMap<[u64; 3], Vec<&(SurfaceFace, Point)>> = BTreeMap::new();
        for loaded in faces {
            let bits = [loaded.1.x, loaded.1.y, loaded.1.z].map(f64::to_bits);
            by_traction.entry(bits).or_default().push(loaded);
        }
        let pad = |faces: Vec<&(SurfaceFace, Point)>| Self {
            outline: outline_loops(mesh, faces.iter().map(|loaded| &loaded.0), patch),
            traction: faces[0].1,
        };
        by_traction.into_values().map(pad).collect()
    }

    fn displacement(&self, green: &SurfaceGreen, at: [f64; 2]) -> Point {
        let lines = self.outline.iter().map(|line| polygon::integrate(green, line, at));
        lines.sum::<Matrix3<f64>>() * self.traction
    }

    /// Whether the load is so close to the patch that polynomials cannot represent its displacement on the patch.
    fn is_near(&self, patch: &ContactPatch) -> bool {
        let reach = patch.half_width.map(|half| half + NEAR_LOAD_DISTANCE * patch.size());
        (0..2).all(|axis| {
            let [low, high] = bounds(self.outline.iter().flatten().map(|corner| corner[axis]));
            low < reach[axis] && high > -reach[axis]
        })
    }
}

impl<'a> FaceLoads<'a> {
    fn new(
        model: &'a FeModel,
        forces: &'a PatchForces,
        field: &HalfSpaceField,
        own: &AppliedLoadResponse,
        points: &'a RecoveryPoints,
        stress: &'a [[f64; 6]],
    ) -> Self {
        let mut loads: HashMap<FaceId, (f64, Point)> = HashMap::new();
        for (face, pressure, traction) in own.loads.face_loads() {
            let sum = loads.entry(face).or_insert((0.0, Point::zeros()));
            sum.0 += pressure;
            sum.1 += traction;
        }
        let moved =
            model.prescribed_dofs().into_iter().zip(own.prescribed_motion.deformation.iter().copied());
        let weight =
            field.normal_derivative(&forces.patch.axes.to_local(&Point::from(own.loads.body_force())));
        let supports = moved.filter(|(_, u)| *u != 0.0).collect();
        Self { model, forces, loads, supports, weight, points, stress, rules: FaceRules::new() }
    }

    /// Work per unit force over a face, N mm per N, axes of the patch. The first result is the work of the
    /// [`FaceAction`] with the half-space field G. The second result is the work of the support tractions on G + u_c.
    fn work(&self, (face, in_plane): &(SurfaceFace, bool)) -> [Vec<Point>; 2] {
        let forces = self.forces;
        let none = Point::zeros();
        let [mut work, mut rest] = [0, 1].map(|_| vec![none; forces.points.len()]);
        let (mesh, patch) = (self.model.mesh(), &forces.patch);
        // Components that are prescribed at all nodes of the face. Along the other components, the tractions of G are
        // loads of u_c.
        let held = [0, 1, 2]
            .map(|c| face.nodes.iter().all(|&node| self.model.prescribed_displacement(node, c).is_some()));
        let is_held = held.contains(&true);
        // On faces in the plane of the patch, G has no traction, and each load is a [`PatchLoad`].
        let load = self.loads.get(&face.id()).filter(|_| !in_plane);
        let moves: Vec<Point> =
            face.nodes.iter().map(|&node| self.prescribed_displacement(node, held)).collect();
        let acts = load.is_some() || self.weight != none || moves.iter().any(|u| *u != none);
        if !is_held && (*in_plane || !acts) {
            return [work, rest];
        }
        let at_nodes = if is_held { self.at_nodes(face, *in_plane) } else { Vec::new() };
        for point in self.rules.points(mesh, face, &|x| forces.distance(x), MAX_SIZE_TO_DISTANCE) {
            let mut local = patch.local(&point.at);
            let area = point.area.norm();
            let normal = patch.axes.to_local(&point.area) / area;
            let map = TractionOperator::new(forces.stiffness, &normal);
            let moved: Point = moves.iter().zip(&point.values).map(|(u, value)| u * *value).sum();
            let acting = self.acting(load, &patch.axes.to_local(&moved), &local, &map, &normal);
            if *in_plane {
                local.z = 0.0;
            }
            let support: Point =
                at_nodes.iter().zip(&point.values).map(|(node, n)| node.stress * point.area * *n).sum();
            let support = Point::from_fn(|c, _| if held[c] { support[c] } else { 0.0 });
            let support = patch.axes.to_local(&support);
            for i in 0..forces.points.len() {
                let field = forces.field.at(&forces.vector_from(i, &local));
                if !in_plane {
                    work[i] += field.value.transpose() * acting.traction * area;
                    if acting.displacement != none {
                        work[i] += map.apply(&field).transpose() * acting.displacement * area;
                    }
                }
                if is_held {
                    let between = at_nodes.iter().zip(&point.values).map(|(node, n)| node.fields[i] * *n);
                    rest[i] += (field.value - between.sum::<Matrix3<f64>>()).transpose() * support;
                }
            }
        }
        [work, rest]
    }

    fn prescribed_displacement(&self, node: usize, held: [bool; 3]) -> Point {
        let along = |c: usize| self.supports.get(&(3 * node + c)).copied().filter(|_| held[c]).unwrap_or(0.0);
        Point::from([0, 1, 2].map(along))
    }

    /// Traction and displacement at the point `local` of a face with the unit `normal` and the prescribed displacement
    /// `moved`. These three arguments are in the axes of the patch; `load` is in global axes.
    fn acting(
        &self,
        load: Option<&(f64, Point)>,
        moved: &Point,
        local: &Point,
        map: &TractionOperator,
        normal: &Point,
    ) -> FaceAction {
        let mut acting = FaceAction { traction: Point::zeros(), displacement: Point::zeros() };
        if let Some((pressure, traction)) = load {
            acting.traction += self.forces.patch.axes.to_local(traction) - normal * *pressure;
        }
        // The traction of G on the fixed face is a part of the support force R(g). The term with R(g) has a minus sign
        // in w.
        acting.displacement -= moved;
        if self.weight != Point::zeros() {
            let none = Point::zeros();
            let gradient = [
                Matrix3::zeros(),
                Matrix3::zeros(),
                Matrix3::from_columns(&[self.weight * -local.z, none, none]),
            ];
            acting.traction -= map.apply(&GreenTensor { value: Matrix3::zeros(), gradient }).column(0);
            acting.displacement += self.weight * (-0.5 * local.z * local.z);
        }
        acting
    }

    fn at_nodes(&self, face: &SurfaceFace, in_plane: bool) -> Vec<FixedFaceNode> {
        let mesh = self.model.mesh();
        let places = self.points.points_of_cell(mesh.volume_index(face.owner));
        let local_nodes = mesh.kind(face.owner).local_faces()[face.local_face].1;
        let node = |(&node, &place): (&usize, &usize)| {
            let mut local = self.forces.patch.local(&mesh.points[node].into());
            if in_plane {
                local.z = 0.0;
            }
            let field = |i: usize| self.forces.field.at(&self.forces.vector_from(i, &local)).value;
            FixedFaceNode {
                stress: voigt_to_tensor(&self.stress[places[place]]),
                fields: (0..self.forces.points.len()).map(field).collect(),
            }
        };
        face.nodes.iter().zip(local_nodes).map(node).collect()
    }
}

struct FixedFaceNode {
    /// Stress due to the body's own loads, global axes, MPa.
    stress: Matrix3<f64>,
    /// Half-space displacement per unit force, one matrix for each position of a force, axes of the patch, mm/N.
    fields: Vec<Matrix3<f64>>,
}
