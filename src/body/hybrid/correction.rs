//! Correction of a half-space for a finite body: the matrix between point forces and displacements on the patch.
//!
//! A force on the patch causes the displacement u = u_hs + u_c, half-space displacement plus correction. The correction
//! u_c solves the equations of the finite body with loads -t_hs on the free boundary and displacements -u_hs on the
//! fixed boundary. t_hs are the half-space tractions. On the patch u_c is smooth, so that polynomials through a few
//! Chebyshev nodes represent it.
//!
//! # Source
//! docs/theory-hybrid.md. Let u_x and t_x be the half-space displacements and tractions due to a unit force at the
//! patch point x. Betti's theorem gives the correction at x due to a unit force at y,
//!
//! Ĉ(x, y) = -∫_free u_x·t_y dS + ∫_fixed t_x·u_y dS + r_xᵀ K⁻¹ r_y - g_xᵀ K_bb g_y + f_bxᵀ g_y + g_xᵀ f_by,
//!
//! where r = f_f - K_fb g. K is the stiffness matrix; K⁻¹ is the inverse of its free part. f are the nodal loads, and
//! g = -u_hs are the prescribed displacements. Indices f and b mark free and prescribed dofs. Ĉ is symmetric. Its order
//! of convergence is the order of the strain energy, twice the order of the energy norm.

use super::applied_loads::AppliedLoadResponse;
use super::boundary_terms::{BoundaryFaces, BoundaryTerms};
use super::forces::PatchForces;
use super::half_space_fit::HalfSpaceFit;
use super::inclusions;
use super::locate::PatchFaceLocator;
use crate::error::Result;
use crate::fem::{AppliedLoads, ColumnSolver, FeModel, PrescribedMotion};
use crate::geometry::Point;
use crate::linalg::dense_matrix::DenseMatrix;
use crate::linalg::vector::dot;

/// Imbalance ([`Correction::imbalance`]) above which faces are subdivided further.
pub const TARGET_IMBALANCE: f64 = 1e-4;

/// Ratio of the size of face parts to their distance from the forces. The subdivision starts with the first value and
/// ends at the second value.
const FACE_RATIO_RANGE: [f64; 2] = [1.0, 1.0 / 16.0];

const FACE_RATIO_FACTOR: f64 = 0.7;

/// Largest imbalance of the outermost forces, as a fraction of [`TARGET_IMBALANCE`].
const OUTER_IMBALANCE_SHARE: f64 = 0.3;

/// Fixed ratio of the size of face parts to their distance from the forces, for bodies with a curved contact surface.
const CURVED_FACE_RATIO: f64 = 0.35;

/// Correction u_c due to unit forces on a patch: its values at the positions of the forces, and its fields at all mesh
/// nodes.
pub struct Correction {
    /// Ĉ by Betti's theorem, symmetrised, axes of the patch, mm/N, `[3 n, 3 n]`; component j of force i has index 3 i + j.
    pub matrix: DenseMatrix,
    /// u_c at all nodes per unit force, global axes, mm/N, `[3 n_points, 3 n]`.
    pub fields: DenseMatrix,
    /// Largest component, among all forces, of the sum of a unit force and the resultant of its half-space tractions.
    pub imbalance: f64,
    /// Asymmetry of the boundary terms, divided by the norm of the matrix.
    pub asymmetry: f64,
    /// Response of the body to each of its loads.
    pub(super) applied_loads: Vec<AppliedLoadResponse>,
}

impl Correction {
    /// Computes the correction for `forces` on the patch of the body, and the responses to its `loads`.
    ///
    /// # Errors
    /// If memory does not suffice, the equations cannot be solved, or the run is cancelled.
    pub fn new(
        model: &FeModel,
        solver: &ColumnSolver,
        forces: &PatchForces,
        loads: &[AppliedLoads],
    ) -> Result<Self> {
        let faces = BoundaryFaces::new(model, forces);
        let mut ratio = FACE_RATIO_RANGE[0];
        // Tractions on curved faces are missing from the balance, so the imbalance cannot control the subdivision.
        let curved = !forces.curved_faces.is_empty();
        if curved {
            ratio = CURVED_FACE_RATIO;
        } else {
            // The outermost forces are closest to the boundary. The loop below this block checks all forces.
            let outermost = forces.outermost();
            while faces.imbalance(model.mesh(), &outermost, ratio) > OUTER_IMBALANCE_SHARE * TARGET_IMBALANCE
                && ratio > FACE_RATIO_RANGE[1]
            {
                ratio *= FACE_RATIO_FACTOR;
            }
        }
        let mut boundary = BoundaryTerms::new(model, forces, &faces, ratio)?;
        while boundary.imbalance > TARGET_IMBALANCE && ratio > FACE_RATIO_RANGE[1] && !curved {
            ratio *= FACE_RATIO_FACTOR;
            boundary = BoundaryTerms::new(model, forces, &faces, ratio)?;
        }
        let mut found = Self::of_terms(model, solver, forces, (boundary, loads))?;
        let transposed = found.matrix.transposed();
        found.matrix.add_scaled(1.0, &transposed);
        found.matrix.values_mut().iter_mut().for_each(|value| *value *= 0.5);
        Ok(found)
    }

    /// Computes the correction without symmetrisation. Face parts are no larger than `ratio` times their distance from
    /// the forces. The rows of forces outside the body have no meaning.
    ///
    /// # Errors
    /// As [`Self::new`].
    pub fn unsymmetric(
        model: &FeModel,
        solver: &ColumnSolver,
        forces: &PatchForces,
        ratio: f64,
    ) -> Result<Self> {
        let boundary = BoundaryTerms::new(model, forces, &BoundaryFaces::new(model, forces), ratio)?;
        Self::of_terms(model, solver, forces, (boundary, &[]))
    }

    fn of_terms(
        model: &FeModel,
        solver: &ColumnSolver,
        forces: &PatchForces,
        (mut boundary, loads): (BoundaryTerms, &[AppliedLoads]),
    ) -> Result<Self> {
        inclusions::add_inclusions(model, forces, &mut boundary)?;
        let n = forces.n_columns();
        let prescribed = model.prescribed_dofs();
        let held = held_displacements(model, forces, &prescribed)?;
        let reactions = model.forces_of_prescribed_displacements(&prescribed, held.values())?;
        let reactions_of_held = DenseMatrix::from_values(prescribed.len(), n, reactions.on_prescribed_dofs);
        let (free_loads, held_loads) = split(model, &prescribed, &boundary.loads)?;
        let mut rhs = free_loads;
        rhs.values_mut()
            .iter_mut()
            .zip(&reactions.on_free_dofs)
            .for_each(|(load, reaction)| *load -= reaction);
        let mut columns = rhs.values().to_vec();
        loads.iter().for_each(|loads| columns.extend(model.load_vector(loads)));
        solver.solve(&mut columns)?;
        let free = columns.split_off(n * model.n_free());
        let displacement = DenseMatrix::from_values(model.n_free(), n, columns);
        let mut applied_loads = Vec::with_capacity(loads.len());
        for (loads, free) in loads.iter().zip(free.chunks_exact(model.n_free())) {
            let prescribed_motion = PrescribedMotion::new(model, loads, &prescribed);
            let works = WorksOfFields { free: &displacement, held: &held, held_loads: &held_loads };
            let work = works.of_loads(model, loads, &prescribed_motion, &prescribed)?;
            let displacement = model.expand(free, loads);
            applied_loads.push(AppliedLoadResponse {
                loads: loads.clone(),
                displacement,
                work,
                prescribed_motion,
            });
        }
        let mut matrix = boundary.work;
        let defect = {
            let mut defect = matrix.transposed();
            defect.add_scaled(-1.0, &matrix);
            defect.norm()
        };
        matrix.add_transposed_product(1.0, &rhs, &displacement);
        matrix.add_transposed_product(-1.0, &held, &reactions_of_held);
        matrix.add_transposed_product(1.0, &held_loads, &held);
        matrix.add_transposed_product(1.0, &held, &held_loads);
        let asymmetry = defect / matrix.norm();
        let fields = expand_to_all_dofs(model, &prescribed, &displacement, &held)?;
        Ok(Self { matrix, fields, imbalance: boundary.imbalance, asymmetry, applied_loads })
    }

    /// Peak memory of `columns` correction fields of a model, bytes. A quarter of this memory is kept.
    pub fn bytes(model: &FeModel, columns: usize) -> usize {
        4 * 8 * 3 * model.mesh().n_points() * columns
    }

    /// Number of quadrature points in elements whose material differs from the material under the patch of `site`.
    pub fn inclusion_points(model: &FeModel, site: &HalfSpaceFit) -> usize {
        inclusions::n_points(model, site.stiffness.voigt(), &site.patch)
    }

    pub(super) fn superpose_fields(&self, forces: &[f64], displacement: &mut [[f64; 3]]) {
        for (column, force) in forces.iter().enumerate().filter(|(_, force)| **force != 0.0) {
            let field = self.fields.column(column);
            displacement.as_flattened_mut().iter_mut().zip(field).for_each(|(u, f)| *u += force * f);
        }
    }

    /// Mesh displacement u_c at the points of `at` due to each force of this correction, axes of the patch, mm/N. For
    /// quadratic elements, this matrix converges more slowly than [`Self::matrix`].
    ///
    /// # Errors
    /// If a point of `at` lies on no face of the mesh.
    pub fn at_mesh_nodes(&self, model: &FeModel, at: &PatchForces) -> Result<DenseMatrix> {
        let n = at.n_columns();
        let mut displacement = DenseMatrix::zeros(n, self.fields.n_columns())?;
        let locator = PatchFaceLocator::new(model.mesh(), at);
        for (i, point) in at.points.iter().enumerate() {
            let weights = locator.weights(*point)?;
            for column in 0..self.fields.n_columns() {
                let values = self.fields.column(column);
                let sum =
                    |c: usize| weights.iter().map(|&(node, weight)| weight * values[3 * node + c]).sum();
                let local = at.patch.axes.to_local(&Point::from([0, 1, 2].map(sum)));
                displacement.values_mut()[column * n + 3 * i..][..3].copy_from_slice(local.as_slice());
            }
        }
        Ok(displacement)
    }
}

/// Prescribed values -u_hs of the correction at the prescribed dofs, `[n_prescribed, n_columns]`.
fn held_displacements(model: &FeModel, forces: &PatchForces, prescribed: &[usize]) -> Result<DenseMatrix> {
    let mut held = DenseMatrix::zeros(prescribed.len(), forces.n_columns())?;
    let mut at_node = DenseMatrix::zeros(3, forces.n_columns())?;
    let mut node = usize::MAX;
    for (i, dof) in prescribed.iter().enumerate() {
        if dof / 3 != node {
            node = dof / 3;
            forces.displacements(&model.mesh().points[node].into(), 0, &mut at_node);
        }
        for column in 0..forces.n_columns() {
            held.values_mut()[column * prescribed.len() + i] = -at_node.at(dof % 3, column);
        }
    }
    Ok(held)
}

/// Correction fields of all forces: `free` at the free dofs, `held` at the prescribed dofs. `held_loads` contains the
/// nodal loads of the half-space tractions on the prescribed dofs.
struct WorksOfFields<'a> {
    free: &'a DenseMatrix,
    held: &'a DenseMatrix,
    held_loads: &'a DenseMatrix,
}

impl WorksOfFields<'_> {
    /// Work of `loads` on the correction field of each force. `supports` contains the prescribed displacements at the
    /// dofs `prescribed`.
    fn of_loads(
        &self,
        model: &FeModel,
        loads: &AppliedLoads,
        supports: &PrescribedMotion,
        prescribed: &[usize],
    ) -> Result<Vec<f64>> {
        let Self { free, held, held_loads } = self;
        let forces = model.forces_of_prescribed_displacements(prescribed, &supports.deformation)?;
        let external = loads.forces();
        let mut on_free: Vec<f64> = forces.on_free_dofs.iter().map(|force| -force).collect();
        for dof in 0..3 * external.len() {
            if let Some(row) = model.free_dof(dof / 3, dof % 3) {
                on_free[row] += external[dof / 3][dof % 3];
            }
        }
        let on_held: Vec<f64> = prescribed
            .iter()
            .zip(&forces.on_prescribed_dofs)
            .map(|(&dof, force)| external[dof / 3][dof % 3] - force)
            .collect();
        let work = |column: usize| {
            dot(&on_free, free.column(column))
                + dot(&on_held, held.column(column))
                + dot(&supports.deformation, held_loads.column(column))
        };
        Ok((0..free.n_columns()).map(work).collect())
    }
}

fn split(model: &FeModel, prescribed: &[usize], loads: &DenseMatrix) -> Result<(DenseMatrix, DenseMatrix)> {
    let n = loads.n_columns();
    let mut free = DenseMatrix::zeros(model.n_free(), n)?;
    let mut held = DenseMatrix::zeros(prescribed.len(), n)?;
    let rows: Vec<(usize, usize)> =
        (0..loads.n_rows()).filter_map(|dof| Some((dof, model.free_dof(dof / 3, dof % 3)?))).collect();
    for column in 0..n {
        let all = loads.column(column);
        let of_free = &mut free.values_mut()[column * model.n_free()..][..model.n_free()];
        rows.iter().for_each(|&(dof, row)| of_free[row] = all[dof]);
        let of_held = &mut held.values_mut()[column * prescribed.len()..][..prescribed.len()];
        of_held.iter_mut().zip(prescribed).for_each(|(load, &dof)| *load = all[dof]);
    }
    Ok((free, held))
}

/// Displacement of all dofs: `free` at the free dofs, `held` at the dofs `prescribed`, zero at nodes without elements.
fn expand_to_all_dofs(
    model: &FeModel,
    prescribed: &[usize],
    free: &DenseMatrix,
    held: &DenseMatrix,
) -> Result<DenseMatrix> {
    let n_rows = 3 * model.mesh().n_points();
    let mut all = DenseMatrix::zeros(n_rows, free.n_columns())?;
    for (column, values) in all.values_mut().chunks_exact_mut(n_rows).enumerate() {
        let (free, held) = (free.column(column), held.column(column));
        for (dof, value) in values.iter_mut().enumerate() {
            if let Some(row) = model.free_dof(dof / 3, dof % 3) {
                *value = free[row];
            }
        }
        prescribed.iter().zip(held).for_each(|(&dof, value)| values[dof] = *value);
    }
    Ok(all)
}
