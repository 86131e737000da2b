//! Displacements of a condensed body for given forces, computed by its solver.

use super::{CondensedBody, solve_in_place};
use crate::error::Result;
use crate::fem::{AppliedLoads, PrescribedMotion};
use crate::linalg::dense::try_zeroed;

impl CondensedBody {
    /// Displacement of all mesh nodes, global axes, mm, `[n_points]`, due to contact forces, own loads and prescribed
    /// displacements. The contact forces, N, `[3 n_c]`, are in global axes and in the order of [`Self::flexibility`].
    /// For an unconstrained body, the forces are first projected onto forces in equilibrium, and the mean rigid-body
    /// motion is zero. The cost is one solve with the stiffness matrix.
    ///
    /// # Errors
    /// If memory does not suffice, or the solver cannot be created or does not converge.
    ///
    /// # Panics
    /// If the number of forces is not 3 n_c.
    pub fn solve(&self, contact_forces: &[f64]) -> Result<Vec<[f64; 3]>> {
        let mut displacement = self.solve_with_forces_on(&self.contact_nodes, contact_forces)?;
        let loaded = self.contact_free_displacement.as_flattened();
        displacement.as_flattened_mut().iter_mut().zip(loaded).for_each(|(u, by)| *u += by);
        Ok(displacement)
    }

    /// Displacement of all mesh nodes, global axes, mm, `[n_points]`, due to forces `[3 n]` on any `n` mesh nodes. Own
    /// loads and prescribed displacements of the body count as zero.
    ///
    /// # Errors
    /// As [`Self::solve`].
    ///
    /// # Panics
    /// If there are not three forces per node.
    pub fn solve_with_forces_on(&self, nodes: &[usize], forces: &[f64]) -> Result<Vec<[f64; 3]>> {
        let mut rhs = self.right_hand_side(nodes, forces);
        solve_in_place(&self.model, self.solver()?, &mut rhs)?;
        let at = |dof: usize| self.model.dof_map().row(dof).map_or(0.0, |row| rhs[row]);
        let n_points = self.model.mesh().n_points();
        Ok((0..n_points).map(|node| [0, 1, 2].map(|c| at(3 * node + c))).collect())
    }

    /// Displacement of all mesh nodes, global axes, mm, `[n_points]`, due to `loads` of the body alone. The mean
    /// rigid-body motion of an unconstrained body is the rigid motion fitted to its prescribed displacements. The cost
    /// is one solve with the stiffness matrix.
    ///
    /// # Errors
    /// As [`Self::solve`].
    pub fn displacement_of_loads(&self, loads: &AppliedLoads) -> Result<Vec<[f64; 3]>> {
        let mut rhs = self.model.load_vector(loads);
        solve_in_place(&self.model, self.solver()?, &mut rhs)?;
        if let Some(floating) = self.model.generalised_inverse() {
            let motion = PrescribedMotion::new(&self.model, loads, &self.model.prescribed_dofs());
            let points = &self.model.mesh().points;
            let rigid = |&dof: &usize| motion.rigid(&points[dof / 3].into())[dof % 3];
            let rigid: Vec<f64> = self.model.dof_map().dofs_of_rows().iter().map(rigid).collect();
            floating.add_mean_motion(&rigid, &mut rhs);
        }
        Ok(self.model.expand(&rhs, loads))
    }

    /// Displacement of `nodes`, mm, `[3 n]`, due to `forces` on these nodes, N, `[3 n]`, global axes. Own loads and prescribed
    /// displacements of the body count as zero. The cost is one solve with the stiffness matrix.
    ///
    /// # Errors
    /// As [`Self::solve`].
    pub fn displacement_of_forces(&self, nodes: &[usize], forces: &[f64]) -> Result<Vec<f64>> {
        let mut rhs = self.right_hand_side(nodes, forces);
        solve_in_place(&self.model, self.solver()?, &mut rhs)?;
        Ok(self.at_nodes(nodes, &rhs))
    }

    /// Displacement as [`Self::displacement_of_forces`], followed by one step of iterative refinement. `None` if the
    /// body has no solver yet. This happens only if the flexibility came from the cache.
    ///
    /// # Errors
    /// As [`Self::solve`].
    pub fn refined_displacement(&self, nodes: &[usize], forces: &[f64]) -> Result<Option<Vec<f64>>> {
        let Some(solver) = self.solver.get() else { return Ok(None) };
        let mut rhs = self.right_hand_side(nodes, forces);
        let refined = |rhs: &mut [f64]| -> Result<()> {
            let mut residual = try_zeroed(rhs.len())?;
            let forces = rhs.to_vec();
            solver.solve_in_place(rhs, 1)?;
            self.model.stiffness().multiply(rhs, &mut residual);
            residual.iter_mut().zip(&forces).for_each(|(r, f)| *r = f - *r);
            solver.solve_in_place(&mut residual, 1)?;
            rhs.iter_mut().zip(&residual).for_each(|(u, correction)| *u += correction);
            Ok(())
        };
        match self.model.generalised_inverse() {
            Some(floating) => floating.solve(&mut rhs, refined)?,
            None => refined(&mut rhs)?,
        }
        Ok(Some(self.at_nodes(nodes, &rhs)))
    }

    fn right_hand_side(&self, nodes: &[usize], forces: &[f64]) -> Vec<f64> {
        assert_eq!(forces.len(), 3 * nodes.len(), "three forces per node");
        let mut rhs = vec![0.0; self.model.n_free()];
        for (force, &node) in forces.chunks_exact(3).zip(nodes) {
            for (component, value) in force.iter().enumerate() {
                if let Some(row) = self.model.free_dof(node, component) {
                    rhs[row] += value;
                }
            }
        }
        rhs
    }

    fn at_nodes(&self, nodes: &[usize], displacement: &[f64]) -> Vec<f64> {
        let free = |node: usize, component: usize| self.model.free_dof(node, component);
        let dofs = nodes.iter().flat_map(|&node| (0..3).map(move |component| free(node, component)));
        dofs.map(|dof| dof.map_or(0.0, |row| displacement[row])).collect()
    }

    /// Displacement of the nodes `at` due to unit forces on the nodes `loaded`, global axes, mm/N, `[3 n_loaded, 3 n_at]` row by
    /// row. The cost is one solve with the stiffness matrix for each dof of `loaded`.
    ///
    /// # Errors
    /// As [`Self::solve`].
    pub fn flexibility_rows(&self, loaded: &[usize], at: &[usize]) -> Result<Vec<f64>> {
        let free = |node: usize, component: usize| self.model.free_dof(node, component);
        let dofs: Vec<_> = loaded.iter().flat_map(|&node| (0..3).map(move |c| free(node, c))).collect();
        let targets: Vec<_> = at.iter().flat_map(|&node| (0..3).map(move |c| free(node, c))).collect();
        let (n, solver) = (self.model.n_free(), self.solver()?);
        let mut rows = try_zeroed(dofs.len() * targets.len())?;
        let mut columns = try_zeroed(n * dofs.len().min(COLUMNS_PER_SOLVE))?;
        for (dofs, rows) in
            dofs.chunks(COLUMNS_PER_SOLVE).zip(rows.chunks_mut((COLUMNS_PER_SOLVE * targets.len()).max(1)))
        {
            let columns = &mut columns[..n * dofs.len()];
            columns.fill(0.0);
            for (column, dof) in columns.chunks_exact_mut(n).zip(dofs) {
                dof.iter().for_each(|&row| column[row] = 1.0);
            }
            match self.model.generalised_inverse() {
                None => solver.solve_in_place(columns, dofs.len())?,
                Some(_) => columns
                    .chunks_exact_mut(n)
                    .try_for_each(|column| solve_in_place(&self.model, solver, column))?,
            }
            for (row, column) in rows.chunks_exact_mut(targets.len()).zip(columns.chunks_exact(n)) {
                row.iter_mut()
                    .zip(&targets)
                    .for_each(|(value, dof)| *value = dof.map_or(0.0, |dof| column[dof]));
            }
        }
        Ok(rows)
    }
}

const COLUMNS_PER_SOLVE: usize = 24;
