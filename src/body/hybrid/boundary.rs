//! Loads and work of the half-space's tractions on the boundary of a body.

use std::collections::{HashMap, HashSet};

use nalgebra::Matrix3;
use rayon::prelude::*;

use super::faces::FaceRules;
use super::patch::Patch;
use crate::bem::half_space::{PointForceField, TractionMap};
use crate::error::Result;
use crate::fem::{Bedding, FeModel};
use crate::geometry::Point;
use crate::interrupt;
use crate::linalg::columns::Columns;
use crate::material::Stiffness;
use crate::mesh::faces::{SurfaceFace, outer_faces};
use crate::mesh::{CellRef, Mesh};

/// Faces computed side by side before they are added up: bounds the memory of their shares.
const BATCH: usize = 64;

/// Nodes nearer to the plane of the patch than this share of its size lie in it.
pub(super) const IN_PLANE: f64 = 1e-6;

/// Point forces on a patch, and the half-space that carries them.
pub struct Forces<'a> {
    /// The patch.
    pub patch: Patch,
    /// The half-space's material, in the axes of the patch.
    pub stiffness: &'a Stiffness,
    /// Its field of a point force.
    pub field: &'a PointForceField,
    /// Where they act, in the patch, `[n]`; each along x, y, z of the patch.
    pub points: Vec<[f64; 2]>,
    /// Faces off the plane that stand for it: a curved contact surface about the patch.
    pub surface: &'a [FaceRef],
}

impl Forces<'_> {
    /// Those at the corners and in the middle of the points.
    pub(super) fn outermost(&self) -> Self {
        let extreme = |sign: [f64; 2]| {
            let along = |point: &&[f64; 2]| sign[0] * point[0] + sign[1] * point[1];
            self.points.iter().max_by(|a, b| along(a).total_cmp(&along(b))).copied()
        };
        let signs = [[1.0, 1.0], [1.0, -1.0], [-1.0, 1.0], [-1.0, -1.0]];
        let points = signs.into_iter().filter_map(extreme).chain([[0.0, 0.0]]).collect();
        Self { points, ..*self }
    }

    /// Number of columns: three for each point.
    pub fn n_columns(&self) -> usize {
        3 * self.points.len()
    }

    /// Vector from force `i` to a point in the axes of the patch.
    pub(super) fn from(&self, i: usize, local: &Point) -> Point {
        let [x, y] = self.points[i];
        Point::new(local.x - x, local.y - y, local.z)
    }

    /// Distance of a point from the nearest force.
    pub(super) fn distance(&self, x: &Point) -> f64 {
        let local = self.patch.local(x);
        (0..self.points.len()).map(|i| self.from(i, &local).norm()).fold(f64::INFINITY, f64::min)
    }

    /// Displacement at `x` by each force, global rows, written to rows `3 row ..` of `out`.
    pub(super) fn displacements(&self, x: &Point, row: usize, out: &mut Columns) {
        let local = self.patch.local(x);
        for i in 0..self.points.len() {
            let value = self.patch.axes.0 * self.field.at(&self.from(i, &local)).value;
            put(&value, (row, i), out);
        }
    }
}

/// Writes a block of three rows and three columns.
fn put(block: &Matrix3<f64>, (row, force): (usize, usize), out: &mut Columns) {
    let n = out.n_rows();
    for k in 0..3 {
        let first = (3 * force + k) * n + 3 * row;
        out.values_mut()[first..first + 3].copy_from_slice(block.column(k).as_slice());
    }
}

/// A face of a mesh: its solid, and its index among the faces of that.
pub type FaceRef = (CellRef, usize);

/// A face off the plane of the patch.
struct BoundaryFace {
    face: SurfaceFace,
    /// Components that all of its nodes have prescribed.
    held: [bool; 3],
    bedding: Option<Bedding>,
}

/// What the tractions of the half-space do on the boundary.
pub(super) struct BoundaryTerms {
    /// Forces on all dofs of the mesh, -∫ N t, N per unit force, `[3 n_points, n_columns]`.
    pub loads: Columns,
    /// -∫ u·t over what is free + ∫ t·u over what is held, first factor by the force of the row, mm/N,
    /// `[n_columns, n_columns]`.
    pub work: Columns,
    /// Largest defect of the balance of tractions and force.
    pub imbalance: f64,
    /// Number of quadrature points.
    pub n_points: usize,
}

/// Whether all nodes of a face lie in the plane of the patch.
pub(super) fn in_plane(mesh: &Mesh, face: &SurfaceFace, patch: &Patch) -> bool {
    let height = |node: &usize| patch.local(&mesh.points[*node].into()).z.abs();
    face.nodes.iter().all(|node| height(node) <= IN_PLANE * patch.size())
}

/// The faces of the body that the half-space's tractions act on.
pub(super) struct BoundaryFaces(Vec<BoundaryFace>);

impl BoundaryFaces {
    pub fn new(model: &FeModel, forces: &Forces) -> Self {
        let mesh = model.mesh();
        let surface: HashSet<FaceRef> = forces.surface.iter().copied().collect();
        let bedded: HashMap<FaceRef, Bedding> =
            model.bedded_faces().map(|(owner, local, bedding)| ((owner, local), bedding)).collect();
        let elsewhere = |face: &SurfaceFace| {
            !in_plane(mesh, face, &forces.patch) && !surface.contains(&(face.owner, face.local_face))
        };
        let outer = outer_faces(mesh).into_iter().filter(elsewhere);
        let faces = outer.map(|face| {
            let held = [0, 1, 2].map(|c| face.nodes.iter().all(|&node| model.prescribed(node, c).is_some()));
            let bedding = bedded.get(&(face.owner, face.local_face)).copied();
            BoundaryFace { face, held, bedding }
        });
        Self(faces.collect())
    }

    /// Largest defect of the balance of the tractions and each of the `forces`.
    pub fn imbalance(&self, mesh: &Mesh, forces: &Forces, ratio: f64) -> f64 {
        let rules = FaceRules::new();
        let fluxes: Vec<Vec<Matrix3<f64>>> = self
            .0
            .par_iter()
            .map(|face| {
                let mut flux = vec![Matrix3::zeros(); forces.points.len()];
                for point in rules.points(mesh, &face.face, &|x| forces.distance(x), ratio) {
                    let local = forces.patch.local(&point.at);
                    let map = TractionMap::new(forces.stiffness, &forces.patch.axes.to_local(&point.area));
                    for (i, flux) in flux.iter_mut().enumerate() {
                        *flux += map.of(&forces.field.at(&forces.from(i, &local)));
                    }
                }
                flux
            })
            .collect();
        let mut sums = vec![Matrix3::identity(); forces.points.len()];
        fluxes.iter().for_each(|flux| sums.iter_mut().zip(flux).for_each(|(sum, part)| *sum += part));
        sums.iter().map(Matrix3::amax).fold(0.0, f64::max)
    }
}

impl BoundaryTerms {
    /// Integrates over the boundary, faces divided into parts of at most `ratio` times their distance from the forces.
    ///
    /// # Errors
    /// If memory does not suffice.
    pub fn new(model: &FeModel, forces: &Forces, (faces, ratio): (&BoundaryFaces, f64)) -> Result<Self> {
        let n = forces.n_columns();
        let n_rows = 3 * model.mesh().n_points();
        let mut terms = Self {
            loads: Columns::zeros(n_rows, n)?,
            work: Columns::zeros(n, n)?,
            imbalance: 0.0,
            n_points: 0,
        };
        let mut flux = vec![Matrix3::identity(); forces.points.len()];
        let rules = FaceRules::new();
        for batch in faces.0.chunks(BATCH) {
            interrupt::check()?;
            let shares: Vec<Result<Share>> = batch
                .par_iter()
                .map(|face| Share::new(model.mesh(), face, forces, (&rules, ratio)))
                .collect();
            for (face, share) in batch.iter().zip(shares) {
                terms.add(&face.face, &share?, &mut flux);
            }
        }
        terms.imbalance = flux.iter().map(Matrix3::amax).fold(0.0, f64::max);
        Ok(terms)
    }

    fn add(&mut self, face: &SurfaceFace, share: &Share, flux: &mut [Matrix3<f64>]) {
        self.n_points += share.n_points;
        flux.iter_mut().zip(&share.flux).for_each(|(sum, part)| *sum += part);
        self.add_share(&face.nodes, &share.loads, &share.work);
    }

    /// Adds loads on some nodes, `[n_columns][3 n_nodes]`, and work.
    pub fn add_share(&mut self, nodes: &[usize], loads: &[f64], work: &Columns) {
        self.work.add(1.0, work);
        let n_rows = self.loads.n_rows();
        let columns = self.loads.values_mut().chunks_exact_mut(n_rows);
        for (column, part) in columns.zip(loads.chunks_exact(3 * nodes.len())) {
            for (&node, part) in nodes.iter().zip(part.chunks_exact(3)) {
                (0..3).for_each(|c| column[3 * node + c] += part[c]);
            }
        }
    }
}

/// What one face adds.
struct Share {
    /// `[n_columns][3 n_nodes]`.
    loads: Vec<f64>,
    work: Columns,
    /// Force of the tractions, axes of the patch, `[n]`.
    flux: Vec<Matrix3<f64>>,
    n_points: usize,
}

impl Share {
    fn new(
        mesh: &Mesh,
        BoundaryFace { face, held, bedding }: &BoundaryFace,
        forces: &Forces,
        (rules, ratio): (&FaceRules, f64),
    ) -> Result<Self> {
        let points = rules.points(mesh, face, &|x| forces.distance(x), ratio);
        let (n, n_rows, n_nodes) = (forces.n_columns(), 3 * points.len(), face.nodes.len());
        let axes = forces.patch.axes.0;
        let mut displacements = Columns::zeros(n_rows, n)?;
        // Times the weights.
        let mut tractions = Columns::zeros(n_rows, n)?;
        let mut flux = vec![Matrix3::zeros(); forces.points.len()];
        let mut loads = vec![0.0; n * 3 * n_nodes];
        let flat = points.windows(2).all(|pair| pair[0].area.cross(&pair[1].area).norm() == 0.0);
        let map_of =
            |area: &Point| TractionMap::new(forces.stiffness, &forces.patch.axes.to_local(&area.normalize()));
        let common = points.first().filter(|_| flat).map(|point| map_of(&point.area));
        for (p, point) in points.iter().enumerate() {
            let local = forces.patch.local(&point.at);
            let weight = point.area.norm();
            let own;
            let map = match &common {
                Some(map) => map,
                None => {
                    own = map_of(&point.area);
                    &own
                }
            };
            for (i, flux) in flux.iter_mut().enumerate() {
                let field = forces.field.at(&forces.from(i, &local));
                let traction = map.of(&field) * weight;
                *flux += traction;
                let (value, mut traction) = (axes * field.value, axes * traction);
                if let Some(bedding) = bedding {
                    traction += bed(*bedding, &point.area) * value;
                }
                put(&value, (p, i), &mut displacements);
                put(&traction, (p, i), &mut tractions);
                for column in 0..3 {
                    let load = &mut loads[(3 * i + column) * 3 * n_nodes..][..3 * n_nodes];
                    for (load, value) in load.chunks_exact_mut(3).zip(&point.values) {
                        for c in (0..3).filter(|&c| !held[c]) {
                            load[c] -= value * traction[(c, column)];
                        }
                    }
                }
            }
        }
        let mut work = Columns::zeros(n, n)?;
        let part = |keep: bool| -> Columns {
            let mut part = tractions.clone();
            let dropped = |row: usize| held[row % 3] != keep;
            part.values_mut()
                .iter_mut()
                .enumerate()
                .filter(|(k, _)| dropped(k % n_rows))
                .for_each(|(_, value)| *value = 0.0);
            part
        };
        if held.contains(&false) {
            work.add_transposed_product(-1.0, &displacements, &part(false));
        }
        if held.contains(&true) {
            work.add_transposed_product(1.0, &part(true), &displacements);
        }
        Ok(Self { loads, work, flux, n_points: points.len() })
    }
}

/// Traction of a foundation per displacement, times the area, against it.
fn bed(bedding: Bedding, area: &Point) -> Matrix3<f64> {
    match bedding {
        Bedding::Normal(k) => area * area.transpose() * (k / area.norm()),
        Bedding::Components(k) => Matrix3::from_diagonal(&Point::from(k)) * area.norm(),
    }
}
