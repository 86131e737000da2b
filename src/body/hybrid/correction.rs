//! What a finite body lacks of its half-space: the correction matrix between point forces and displacements on the patch.
//!
//! The displacement by a force on the patch is u = u_hs + u_c; u_c solves the body's own equations with the loads -t_hs on what is
//! free of its boundary and the displacements -u_hs where it is held. On the patch u_c is smooth, however sharp the traction: its
//! values between a few Chebyshev nodes are all the contact needs.
//!
//! # Source
//! docs/theory-hybrid.md. The matrix follows from Betti's theorem with the half-space's field of the target,
//! Ĉ(x, y) = -∫ u_x·t_y over the free + ∫ t_x·u_y over the held boundary + b_xᵀ K⁻¹ b_y - g_xᵀ K_bb g_y + f_bxᵀ g_y + g_xᵀ f_by,
//! b = f_f - K_fb g: symmetric, and of twice the order of the displacements at the nodes.

use super::boundary::{BoundaryTerms, Forces};
use super::locate::Locator;
use crate::error::Result;
use crate::fem::{FeModel, Solved};
use crate::geometry::Point;
use crate::linalg::columns::Columns;
use crate::linalg::memory::MemoryLimit;

/// Defect of the balance of tractions and force above which faces are divided further.
pub const BALANCE: f64 = 1e-4;

/// Parts of faces against their distance from the forces: at first, and at last.
const RATIOS: [f64; 2] = [1.0, 1.0 / 16.0];

/// The correction between point forces, and the fields that belong to it.
pub struct Correction {
    /// Ĉ by Betti's theorem, made symmetric, axes of the patch, mm/N, `[3 n, 3 n]`; component j of force i at 3 i + j.
    pub matrix: Columns,
    /// u_c at all nodes, global axes, `[3 n_points, 3 n]`.
    pub fields: Columns,
    /// Largest defect of the balance of the half-space's tractions on the boundary and the force, per unit force.
    pub imbalance: f64,
    /// Asymmetry of the terms of the boundary over the norm of the matrix.
    pub asymmetry: f64,
    /// Displacement of all nodes by the body's own loads and prescribed displacements, global axes, mm, `[n_points]`; `None` where
    /// there are none.
    pub free_displacement: Option<Vec<[f64; 3]>>,
    /// How the body's equations were solved.
    pub solved: Solved,
}

impl Correction {
    /// Solves for `forces` on the body.
    ///
    /// # Errors
    /// If a force does not act on a face of the mesh; if memory does not suffice or the equations cannot be solved.
    pub(super) fn new(model: &FeModel, forces: &Forces, memory: &MemoryLimit) -> Result<Self> {
        let mut ratio = RATIOS[0];
        let mut boundary = BoundaryTerms::new(model, forces, ratio)?;
        while boundary.imbalance > BALANCE && ratio > RATIOS[1] {
            ratio *= 0.5;
            boundary = BoundaryTerms::new(model, forces, ratio)?;
        }
        let mut found = Self::of_terms(model, forces, boundary, memory)?;
        let transposed = found.matrix.transposed();
        found.matrix.add(1.0, &transposed);
        found.matrix.values_mut().iter_mut().for_each(|value| *value *= 0.5);
        Ok(found)
    }

    /// The same as Betti's theorem gives it, symmetric but for the quadrature.

    fn of_terms(
        model: &FeModel,
        forces: &Forces,
        boundary: BoundaryTerms,
        memory: &MemoryLimit,
    ) -> Result<Self> {
        let n = forces.n_columns();
        let prescribed = model.prescribed_dofs();
        let held = held_displacements(model, forces, &prescribed)?;
        let reactions = model.support_forces_by(&prescribed, held.values())?;
        let reactions_of_held = Columns::from_values(prescribed.len(), n, reactions.prescribed);
        let (free_loads, held_loads) = split(model, &prescribed, &boundary.loads)?;
        let mut rhs = free_loads;
        rhs.values_mut().iter_mut().zip(&reactions.free).for_each(|(load, reaction)| *load -= reaction);
        let mut columns = rhs.values().to_vec();
        if model.is_loaded() {
            columns.extend(model.load_vector());
        }
        let solved = model.solve_columns(&mut columns, memory)?;
        let free = columns.split_off(n * model.n_free());
        let free_displacement = (!free.is_empty()).then(|| model.expand(&free));
        let displacement = Columns::from_values(model.n_free(), n, columns);
        let mut matrix = boundary.work;
        let defect = {
            let mut defect = matrix.transposed();
            defect.add(-1.0, &matrix);
            defect.norm()
        };
        matrix.add_transposed_product(1.0, &rhs, &displacement);
        matrix.add_transposed_product(-1.0, &held, &reactions_of_held);
        matrix.add_transposed_product(1.0, &held_loads, &held);
        matrix.add_transposed_product(1.0, &held, &held_loads);
        let asymmetry = defect / matrix.norm();
        let fields = spread(model, &prescribed, (&displacement, &held))?;
        Ok(Self { matrix, fields, imbalance: boundary.imbalance, asymmetry, free_displacement, solved })
    }

    /// The matrix as the displacement of the mesh where the forces act, which is not symmetric and of half the order.
    ///
    /// # Errors
    /// If a force does not act on a face of the mesh.
    pub(super) fn direct(&self, model: &FeModel, forces: &Forces) -> Result<Columns> {
        at_forces(model, forces, &self.fields)
    }
}

/// -u_hs at the prescribed dofs, `[n_prescribed, n_columns]`.
fn held_displacements(model: &FeModel, forces: &Forces, prescribed: &[usize]) -> Result<Columns> {
    let mut held = Columns::zeros(prescribed.len(), forces.n_columns())?;
    let mut at_node = Columns::zeros(3, forces.n_columns())?;
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

/// Loads on all dofs as those on the free and on the prescribed ones.
fn split(model: &FeModel, prescribed: &[usize], loads: &Columns) -> Result<(Columns, Columns)> {
    let n = loads.n_columns();
    let mut free = Columns::zeros(model.n_free(), n)?;
    let mut held = Columns::zeros(prescribed.len(), n)?;
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

/// Displacement of all dofs, zero on no solid.
fn spread(model: &FeModel, prescribed: &[usize], (free, held): (&Columns, &Columns)) -> Result<Columns> {
    let n_rows = 3 * model.mesh().n_points();
    let mut all = Columns::zeros(n_rows, free.n_columns())?;
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

/// Displacement of the mesh where the forces act, in the axes of the patch.
fn at_forces(model: &FeModel, forces: &Forces, fields: &Columns) -> Result<Columns> {
    let n = forces.n_columns();
    let mut at = Columns::zeros(n, n)?;
    let locator = Locator::new(model.mesh(), &forces.patch);
    for (i, point) in forces.points.iter().enumerate() {
        let weights = locator.weights(*point)?;
        for column in 0..n {
            let values = fields.column(column);
            let sum = |c: usize| weights.iter().map(|&(node, weight)| weight * values[3 * node + c]).sum();
            let local = forces.patch.axes.to_local(&Point::from([0, 1, 2].map(sum)));
            at.values_mut()[column * n + 3 * i..][..3].copy_from_slice(local.as_slice());
        }
    }
    Ok(at)
}

#[cfg(test)]
mod tests {
    use super::super::Patch;
    use super::super::sources::Chebyshev;
    use super::*;
    use crate::bem::half_space::{PointForceField, Side};
    use crate::fem::{FeSpec, HexFormulation, Support};
    use crate::geometry::Triad;
    use crate::material::{Orientation, Placed, Placement, Stiffness};
    use crate::mesh::structured::GradedBlock;

    /// A block of half-width and depth `w`, held at its base.
    fn block(stiffness: &Stiffness, w: f64, cells: usize) -> FeModel {
        let mesh = GradedBlock::uniform([w; 2], w, [cells; 3]).mesh().unwrap();
        let spec = FeSpec {
            name: "block".into(),
            mesh: mesh.into(),
            regions: vec![(
                None,
                Placement::Single(Box::new(Placed {
                    name: "m".into(),
                    stiffness: stiffness.clone(),
                    orientation: Orientation::Uniform(nalgebra::Matrix3::identity()),
                })),
            )],
            formulation: HexFormulation::Standard,
            supports: vec![Support {
                group: "base".into(),
                components: [true; 3],
                value: [0.0; 3],
                gradient: [[0.0; 3]; 3],
            }],
            foundations: vec![],
            pressures: vec![],
            tractions: vec![],
            body_force: [0.0; 3],
        };
        FeModel::new(spec).unwrap()
    }

    /// Truth: a force on z = 0 beside the body makes a field that is regular in it, so that u_c = -u_hs.
    #[test]
    fn forces_beside_the_body() {
        let stiffness = Stiffness::isotropic(210e3, 0.3).unwrap();
        let field = PointForceField::new(&stiffness).unwrap();
        let nodes = Chebyshev::new(4, 1.2);
        let mut points: Vec<[f64; 2]> =
            nodes.nodes().iter().flat_map(|&x| nodes.nodes().iter().map(move |&y| [x, y])).collect();
        points.push([5.0, 1.0]);
        let patch = Patch::under(&Triad::horizontal(0.0), Side::Lower, Point::zeros(), [1.2; 2]);
        let forces = Forces { patch, stiffness: &stiffness, field: &field, points };
        for cells in [6, 12] {
            let model = block(&stiffness, 3.0, cells);
            let found = Correction::of_terms(
                &model,
                &forces,
                BoundaryTerms::new(&model, &forces, 1.0).unwrap(),
                &MemoryLimit::of_machine(),
            )
            .unwrap();
            let mut sums = [0.0, 0.0];
            for i in 0..16 {
                let from = Point::new(forces.points[i][0] - 5.0, forces.points[i][1] - 1.0, 0.0);
                let exact = -field.at(&from).value;
                for c in 0..9 {
                    let (a, b) = (c % 3, c / 3);
                    sums[0] += (found.matrix.at(3 * i + a, 48 + b) - exact[(a, b)]).powi(2);
                    sums[1] += exact[(a, b)].powi(2);
                }
            }
            println!(
                "{cells} {:.2e} balance {:.1e} asym {:.1e} {:?}",
                (sums[0] / sums[1]).sqrt(),
                found.imbalance,
                found.asymmetry,
                found.solved
            );
        }
        panic!();
    }
}
