//! Nodal loads and work of the half-space tractions on the boundary of a body. The half-space carries point forces on
//! the patch.

use std::collections::HashMap;

use nalgebra::Matrix3;
use rayon::prelude::*;

use super::face_quadrature::{FacePoint, FaceRules};
use super::forces::{FaceId, PatchForces, put};
use crate::bem::green_tensor::TractionOperator;
use crate::cancel;
use crate::error::Result;
use crate::fem::{FeModel, FoundationStiffness};
use crate::geometry::Point;
use crate::linalg::dense_matrix::DenseMatrix;
use crate::mesh::Mesh;
use crate::mesh::faces::{SurfaceFace, outer_faces};

/// Number of faces evaluated in parallel. It limits the memory of their contributions.
const FACES_PER_BATCH: usize = 64;

pub(super) struct BoundaryFace {
    pub face: SurfaceFace,
    /// Components that are prescribed at all nodes of the face.
    pub fixed: [bool; 3],
    bedding: Option<FoundationStiffness>,
}

pub(super) struct BoundaryTerms {
    /// Nodal forces -∫ N_a t dS over the free boundary, N per unit force, `[3 n_points, n_columns]`. N_a are the shape
    /// functions, t the half-space tractions. Each column belongs to one unit force.
    pub loads: DenseMatrix,
    /// Work -∫ u_i·t_j dS over the free boundary plus ∫ t_i·u_j dS over the fixed boundary, mm/N,
    /// `[n_columns, n_columns]`. u_i and t_i are the half-space displacements and tractions due to unit force i. Row i
    /// and column j belong to the unit forces i and j.
    pub work: DenseMatrix,
    /// Quadrature error: the sum of a unit force and the resultant of its half-space tractions. The value is the
    /// largest component among all forces. It is zero for exact quadrature.
    pub imbalance: f64,
}

pub(super) struct BoundaryFaces(Vec<BoundaryFace>);

impl BoundaryFaces {
    pub fn new(model: &FeModel, forces: &PatchForces) -> Self {
        let mesh = model.mesh();
        let bedded: HashMap<FaceId, FoundationStiffness> =
            model.faces_on_foundations().map(|(owner, local, bedding)| ((owner, local), bedding)).collect();
        let is_on_patch_surface = forces.own_faces(mesh);
        let faces = outer_faces(mesh).into_iter().filter(|face| !is_on_patch_surface(face));
        let faces = faces.map(|face| {
            let fixed = [0, 1, 2]
                .map(|c| face.nodes.iter().all(|&node| model.prescribed_displacement(node, c).is_some()));
            let bedding = bedded.get(&face.id()).copied();
            BoundaryFace { face, fixed, bedding }
        });
        Self(faces.collect())
    }

    /// Computes [`BoundaryTerms::imbalance`] for `forces`. Faces are divided until the size of a part is at most
    /// `ratio` times its distance from the forces.
    pub fn imbalance(&self, mesh: &Mesh, forces: &PatchForces, ratio: f64) -> f64 {
        let rules = FaceRules::new();
        let fluxes: Vec<Vec<Matrix3<f64>>> = self
            .0
            .par_iter()
            .map(|face| {
                let mut flux = vec![Matrix3::zeros(); forces.points.len()];
                for point in rules.points(mesh, &face.face, &|x| forces.distance(x), ratio) {
                    let local = forces.patch.local(&point.at);
                    let map =
                        TractionOperator::new(forces.stiffness, &forces.patch.axes.to_local(&point.area));
                    for (i, flux) in flux.iter_mut().enumerate() {
                        *flux += map.apply(&forces.field.at(&forces.vector_from(i, &local)));
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
    /// Integrates the loads and the work over the boundary. Faces are divided until the size of a part is at most
    /// `ratio` times its distance from the forces.
    pub fn new(model: &FeModel, forces: &PatchForces, faces: &BoundaryFaces, ratio: f64) -> Result<Self> {
        let n = forces.n_columns();
        let n_rows = 3 * model.mesh().n_points();
        let mut terms =
            Self { loads: DenseMatrix::zeros(n_rows, n)?, work: DenseMatrix::zeros(n, n)?, imbalance: 0.0 };
        let mut flux = vec![Matrix3::identity(); forces.points.len()];
        let rules = FaceRules::new();
        for batch in faces.0.chunks(FACES_PER_BATCH) {
            cancel::check()?;
            let shares: Vec<Result<FaceContribution>> = batch
                .par_iter()
                .map(|face| FaceContribution::new(model.mesh(), face, forces, &rules, ratio))
                .collect();
            for (face, share) in batch.iter().zip(shares) {
                terms.add(&face.face, &share?, &mut flux);
            }
        }
        terms.imbalance = flux.iter().map(Matrix3::amax).fold(0.0, f64::max);
        Ok(terms)
    }

    fn add(&mut self, face: &SurfaceFace, share: &FaceContribution, flux: &mut [Matrix3<f64>]) {
        flux.iter_mut().zip(&share.flux).for_each(|(sum, part)| *sum += part);
        self.add_share(&face.nodes, &share.loads, &share.work);
    }

    /// Adds `work`, and `loads` on the given nodes, `[n_columns][3 n_nodes]`.
    pub fn add_share(&mut self, nodes: &[usize], loads: &[f64], work: &DenseMatrix) {
        self.work.add_scaled(1.0, work);
        let n_rows = self.loads.n_rows();
        let columns = self.loads.values_mut().chunks_exact_mut(n_rows);
        for (column, part) in columns.zip(loads.chunks_exact(3 * nodes.len())) {
            for (&node, part) in nodes.iter().zip(part.chunks_exact(3)) {
                (0..3).for_each(|c| column[3 * node + c] += part[c]);
            }
        }
    }
}

struct FaceContribution {
    /// Nodal loads of one face, `[n_columns][3 n_nodes]`.
    loads: Vec<f64>,
    work: DenseMatrix,
    /// Resultant of the half-space tractions due to each force, axes of the patch, `[n]`.
    flux: Vec<Matrix3<f64>>,
}

impl FaceContribution {
    fn new(
        mesh: &Mesh,
        boundary: &BoundaryFace,
        forces: &PatchForces,
        rules: &FaceRules,
        ratio: f64,
    ) -> Result<Self> {
        let face = &boundary.face;
        let points = rules.points(mesh, face, &|x| forces.distance(x), ratio);
        let n = forces.n_columns();
        let mut fields = Fields {
            displacements: DenseMatrix::zeros(3 * points.len(), n)?,
            tractions: DenseMatrix::zeros(3 * points.len(), n)?,
            loads: vec![0.0; n * 3 * face.nodes.len()],
            flux: vec![Matrix3::zeros(); forces.points.len()],
        };
        fields.add_forces(boundary, &points, forces);
        let work = fields.work(boundary.fixed)?;
        Ok(Self { loads: fields.loads, work, flux: fields.flux })
    }
}

struct Fields {
    /// Displacements at the quadrature points, global axes, mm/N, `[3 n_points, n_columns]`.
    displacements: DenseMatrix,
    /// Tractions times quadrature weights, in the layout of `displacements`.
    tractions: DenseMatrix,
    loads: Vec<f64>,
    flux: Vec<Matrix3<f64>>,
}

impl Fields {
    fn add_forces(
        &mut self,
        BoundaryFace { face, fixed, bedding, .. }: &BoundaryFace,
        points: &[FacePoint],
        forces: &PatchForces,
    ) {
        let n_nodes = face.nodes.len();
        let axes = forces.patch.axes.0;
        let flat = points.windows(2).all(|pair| pair[0].area.cross(&pair[1].area).norm() == 0.0);
        let map_of = |area: &Point| {
            TractionOperator::new(forces.stiffness, &forces.patch.axes.to_local(&area.normalize()))
        };
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
            for i in 0..forces.points.len() {
                let field = forces.field.at(&forces.vector_from(i, &local));
                let traction = map.apply(&field) * weight;
                self.flux[i] += traction;
                let (value, mut traction) = (axes * field.value, axes * traction);
                if let Some(bedding) = bedding {
                    traction += bedding.over_area(&point.area) * value;
                }
                put(&value, (p, i), &mut self.displacements);
                put(&traction, (p, i), &mut self.tractions);
                for column in 0..3 {
                    let load = &mut self.loads[(3 * i + column) * 3 * n_nodes..][..3 * n_nodes];
                    for (load, value) in load.chunks_exact_mut(3).zip(&point.values) {
                        for c in (0..3).filter(|&c| !fixed[c]) {
                            load[c] -= value * traction[(c, column)];
                        }
                    }
                }
            }
        }
    }

    /// Work -∫ u·t dS of the free components plus ∫ t·u dS of the fixed components. `held` marks the fixed components.
    fn work(&self, held: [bool; 3]) -> Result<DenseMatrix> {
        let (n_rows, n) = (self.tractions.n_rows(), self.tractions.n_columns());
        let mut work = DenseMatrix::zeros(n, n)?;
        let part = |keep: bool| -> DenseMatrix {
            let mut part = self.tractions.clone();
            let dropped = |row: usize| held[row % 3] != keep;
            part.values_mut()
                .iter_mut()
                .enumerate()
                .filter(|(k, _)| dropped(k % n_rows))
                .for_each(|(_, value)| *value = 0.0);
            part
        };
        if held.contains(&false) {
            work.add_transposed_product(-1.0, &self.displacements, &part(false));
        }
        if held.contains(&true) {
            work.add_transposed_product(1.0, &part(true), &self.displacements);
        }
        Ok(work)
    }
}
