//! Collocation equations of a boundary-element body.
//!
//! The strongly singular diagonal block of a node follows from rigid translations, which cause no traction. The block
//! is minus the sum of the other blocks of the node. For the body around a cavity, the unit matrix is added.
//!
//! Each free rigid motion adds an unknown and an equation. The unknown is the amplitude of tractions in the shape of
//! the motion. These tractions balance the loads, and act on all dofs without prescribed displacement. The equation
//! prescribes the mean displacement along the motion, zero by default.

use faer::Par;
use nalgebra::{DMatrix, Matrix3};
use rayon::prelude::*;

use super::compressed::{CompressedEquations, CompressionReport};
use super::elements::BoundaryElements;
use super::problem::{BoundaryValueProblem, Domain, MAX_DENSE_UNKNOWNS};
use super::solution::BoundarySolution;
pub(super) use super::solution::SurfaceState;
use crate::cancel;
use crate::error::{Error, Result};
use crate::fem::RigidBodyModes;
use crate::geometry::Point;
use crate::linalg::dense_lu::{self, DenseLu};
use crate::linalg::dense_matrix::DenseMatrix;

const BATCH: usize = 64;

const CHECKED: usize = 24;

/// Default tolerance of compressed equations.
pub const DEFAULT_TOLERANCE: f64 = 1e-5;

/// Largest admissible residual of the equations that are computed again, divided by the tolerance.
const MAX_RESIDUAL_OVER_TOLERANCE: f64 = 100.0;

/// Solution method for the equations.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum SolutionMethod {
    /// Dense LU factorisation.
    Dense,
    /// Compressed to a tolerance, solved by iteration.
    Compressed(f64),
}

impl SolutionMethod {
    /// Default method for this number of unknowns.
    pub fn of(n_unknowns: usize) -> Self {
        if n_unknowns <= MAX_DENSE_UNKNOWNS { Self::Dense } else { Self::Compressed(DEFAULT_TOLERANCE) }
    }
}

/// Coefficients of the displacements and of the tractions of all nodes, in the three equations of one node.
type Rows = (Vec<Matrix3<f64>>, Vec<Matrix3<f64>>);

impl BoundaryElements {
    fn rows(&self, (element, node): (usize, usize), domain: Domain) -> Rows {
        let n = self.n_nodes();
        let (mut h, mut g) = (vec![Matrix3::zeros(); n], vec![Matrix3::zeros(); n]);
        let y = self.panel(element).position(self.reference_nodes_of(element).reference_points()[node]);
        for i in 0..self.n_elements() {
            let influence = if i == element {
                self.influence_on_element(i, node)
            } else {
                self.influence_off_element(i, &y)
            };
            for (a, column) in self.nodes_of(i).enumerate() {
                g[column] = influence.single_layer[a];
                h[column] = influence.double_layer[a];
            }
        }
        let sum: Matrix3<f64> = h.iter().sum();
        h[self.nodes_of(element).start + node] = match domain {
            Domain::Interior => -sum,
            Domain::Exterior => Matrix3::identity() - sum,
        };
        (h, g)
    }

    /// Rigid motions that remain free if the displacements of the dofs marked in `held` are prescribed. Their mean
    /// square over the surface is 1. `None` if no motion remains free.
    ///
    /// # Errors
    /// If all nodes lie on a line.
    pub fn free_motions(&self, held: &[bool]) -> Result<Option<RigidBodyModes>> {
        let points: Vec<[f64; 3]> = self.positions().into_iter().map(Into::into).collect();
        let all: Vec<usize> = (0..points.len()).collect();
        let directions =
            (0..held.len()).filter(|&dof| held[dof]).map(|dof| (dof / 3, Point::ith(dof % 3, 1.0)));
        let free = RigidBodyModes::unconstrained(&points, &all, directions);
        if free.n_modes() == 0 {
            return Ok(None);
        }
        let areas = self.areas();
        let total: f64 = areas.iter().sum();
        let free = free.orthonormal(&points, |node| areas[node] / total);
        let lost = || {
            Error::input(
                "the rigid-body modes of the body cannot be determined, because its nodes lie on a line",
            )
        };
        Ok(Some(free.ok_or_else(lost)?))
    }

    pub(super) fn node_locations(&self) -> Vec<(usize, usize)> {
        (0..self.n_elements()).flat_map(|i| (0..self.nodes_of(i).len()).map(move |node| (i, node))).collect()
    }
}

impl BoundaryValueProblem<'_> {
    /// Memory of the solution by dense equations with `columns` right-hand sides, bytes.
    pub fn dense_bytes(n_nodes: usize, columns: usize) -> u128 {
        let (n, columns) = (3 * n_nodes as u128, columns as u128);
        8 * (n * n + 2 * n * columns) + (BATCH as u128) * n * 48 + dense_lu::product_buffer_bytes(8 * n * n)
    }

    fn assemble_dense(&self, scale: f64) -> Result<(DenseMatrix, DenseMatrix)> {
        let n = 3 * self.elements.n_nodes();
        let motions = self.motions();
        let size = n + motions.ncols();
        let mut left = DenseMatrix::zeros(size, size)?;
        let mut right = DenseMatrix::zeros(size, self.n_right_sides())?;
        let places = self.elements.node_locations();
        for (batch, nodes) in places.chunks(BATCH).enumerate() {
            cancel::check()?;
            let rows: Vec<Rows> =
                nodes.par_iter().map(|&place| self.elements.rows(place, self.domain)).collect();
            for (k, (h, g)) in rows.iter().enumerate() {
                let row = 3 * (batch * BATCH + k);
                let mut known = vec![Point::zeros(); self.loads.len()];
                for (node, (h, g)) in h.iter().zip(g).enumerate() {
                    for c in 0..3 {
                        let column = 3 * node + c;
                        let (unknown, with) =
                            if self.displacement_known[column] { (-g * scale, -h) } else { (*h, *g) };
                        left.column_mut(column)[row..row + 3].copy_from_slice(unknown.column(c).as_slice());
                        for (known, load) in known.iter_mut().zip(self.loads) {
                            *known += with.column(c) * load.at_dofs[column];
                        }
                    }
                }
                for (k, known) in known.iter().enumerate() {
                    right.column_mut(k)[row..row + 3].copy_from_slice(known.as_slice());
                }
                for (j, &node) in self.loaded.iter().enumerate() {
                    for c in 0..3 {
                        let column = right.column_mut(self.loads.len() + 3 * j + c);
                        column[row..row + 3].copy_from_slice(g[node].column(c).as_slice());
                    }
                }
                for j in 0..motions.ncols() {
                    let balance: Point =
                        (0..g.len()).map(|node| g[node] * motions.fixed_view::<3, 1>(3 * node, j)).sum();
                    left.column_mut(n + j)[row..row + 3].copy_from_slice((balance * scale).as_slice());
                }
            }
        }
        let areas = self.elements.areas();
        let mean = areas.iter().sum::<f64>() / areas.len() as f64;
        for j in 0..motions.ncols() {
            for dof in (0..n).filter(|&dof| !self.displacement_known[dof]) {
                left.column_mut(dof)[n + j] = motions[(dof, j)] * areas[dof / 3] / mean;
            }
            for (k, load) in self.loads.iter().enumerate() {
                right.column_mut(k)[n + j] =
                    load.mean_displacement.get(j).map_or(0.0, |u| u * areas.len() as f64);
            }
        }
        Ok((left, right))
    }

    /// Free motions at the dofs, `[3 n, motions]`; zero at dofs with prescribed displacement.
    pub(super) fn motions(&self) -> DMatrix<f64> {
        let Some(free) = self.free_motions else { return DMatrix::zeros(3 * self.elements.n_nodes(), 0) };
        let positions = self.elements.positions();
        DMatrix::from_fn(3 * positions.len(), free.n_modes(), |dof, j| {
            if self.displacement_known[dof] {
                0.0
            } else {
                free.displacement(&positions[dof / 3], j)[dof % 3]
            }
        })
    }

    /// Divisor that gives tractions the magnitude of displacements, MPa/mm.
    pub(super) fn traction_scale(&self) -> f64 {
        let modulus = self.elements.stiffness().voigt().diagonal().max();
        let size = self.elements.areas().into_iter().fold(0.0, f64::max).sqrt();
        modulus / size
    }

    /// Solves the problem by the default method of [`SolutionMethod::of`].
    ///
    /// # Errors
    /// If memory does not suffice, rigid motions are unconstrained, or the run is cancelled. For compressed equations, also if the
    /// iteration does not converge or the equations are too inaccurate.
    pub fn solve(&self, par: Par) -> Result<BoundarySolution> {
        self.solve_by(SolutionMethod::of(3 * self.elements.n_nodes()), par)
    }

    /// Solves the problem by a given method.
    ///
    /// # Errors
    /// In the cases of [`Self::solve`], and if the tolerance of the compressed equations is not admissible.
    pub fn solve_by(&self, equations: SolutionMethod, par: Par) -> Result<BoundarySolution> {
        match equations {
            SolutionMethod::Dense => {
                let (left, mut unknown) = self.assemble_dense(self.traction_scale())?;
                DenseLu::new(left, par)?.solve_in_place(&mut unknown, par)?;
                self.solution(unknown, None)
            }
            SolutionMethod::Compressed(tolerance) => {
                self.solve_compressed(&CompressedEquations::new(self, tolerance)?)
            }
        }
    }

    /// Solves assembled compressed equations.
    ///
    /// # Errors
    /// If the iteration does not converge, the equations are too inaccurate, memory does not suffice, or the run is cancelled.
    pub fn solve_compressed(&self, equations: &CompressedEquations) -> Result<BoundarySolution> {
        let (unknown, report) = equations.solve(self)?;
        let solution = self.solution(unknown, Some(report))?;
        let most = MAX_RESIDUAL_OVER_TOLERANCE * report.tolerance;
        if solution.residual.is_nan() || solution.residual > most {
            return Err(Error::numerical(format!(
                "the relative residual of the compressed boundary-element equations is {:.1e}, more than the limit of {most:.1e}. Use larger elements. Equations with at most {MAX_DENSE_UNKNOWNS} unknowns are not compressed",
                solution.residual
            )));
        }
        Ok(solution)
    }

    fn solution(
        &self,
        unknown: DenseMatrix,
        compression: Option<CompressionReport>,
    ) -> Result<BoundarySolution> {
        let mut solution = BoundarySolution {
            displacement_known: self.displacement_known.to_vec(),
            loads: self.loads.to_vec(),
            loaded: self.loaded.to_vec(),
            unknown,
            traction_scale: self.traction_scale(),
            residual: 0.0,
            compression,
        };
        solution.residual = self.residual(&solution)?;
        Ok(solution)
    }

    /// Largest residual of the equations at up to `CHECKED` nodes. The residual is relative to the largest sum of the
    /// magnitudes of the terms at one of these nodes. Each load and the unit tractions are checked separately, because
    /// their magnitudes may differ strongly.
    fn residual(&self, solution: &BoundarySolution) -> Result<f64> {
        let n = 3 * self.loaded.len();
        let unit = |load: usize| (0..self.loads.len()).map(|k| f64::from(u8::from(k == load))).collect();
        let states: Vec<(SurfaceState, Vec<f64>)> = (0..=self.loads.len())
            .map(|load| {
                let tractions = vec![if load == self.loads.len() { 1.0 } else { 0.0 }; n];
                let amplitudes: Vec<f64> = unit(load);
                (solution.state(&amplitudes, &tractions), solution.balance(&amplitudes, &tractions))
            })
            .collect();
        let motions = self.motions();
        let places = self.elements.node_locations();
        let step = places.len().div_ceil(CHECKED);
        let checked: Vec<(usize, usize)> = places.iter().copied().step_by(step).collect();
        let of_row = |place: &(usize, usize)| -> Vec<(f64, f64)> {
            let (h, g) = self.elements.rows(*place, self.domain);
            let of_state = |(state, balance): &(SurfaceState, Vec<f64>)| {
                let (mut sum, mut size) = (Point::zeros(), 0.0);
                for (node, (h, g)) in h.iter().zip(&g).enumerate() {
                    let mut traction = Point::from(state.traction[node]);
                    for (j, balance) in balance.iter().enumerate() {
                        traction -= motions.fixed_view::<3, 1>(3 * node, j) * *balance;
                    }
                    let parts = [h * Point::from(state.displacement[node]), -g * traction];
                    sum += parts[0] + parts[1];
                    size += parts[0].norm() + parts[1].norm();
                }
                (sum.norm(), size)
            };
            states.iter().map(of_state).collect()
        };
        cancel::check()?;
        let found: Vec<Vec<(f64, f64)>> = checked.par_iter().map(of_row).collect();
        let relative = |i: usize| {
            let rows = found.iter().map(|row| row[i]);
            let most = rows.fold((0.0_f64, f64::MIN_POSITIVE), |(a, b), (x, y)| (a.max(x), b.max(y)));
            most.0 / most.1
        };
        // NaN counts as larger than any number.
        Ok((0..states.len()).map(relative).max_by(f64::total_cmp).unwrap_or(f64::NAN))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bem::finite::{BoundaryValues, Interpolation, Panel};
    use crate::bem::full_space::FullSpaceField;
    use crate::element::ElementKind::Quad9;
    use crate::material::Stiffness;

    fn cube() -> Vec<Panel> {
        let side = |(axis, sign): (usize, f64)| {
            let [u, v] = [(axis + 1) % 3, (axis + 2) % 3];
            let node = |[s, t]: &[f64; 2]| {
                let mut x = Point::zeros();
                (x[axis], x[u], x[v]) = (sign, *s, sign * t);
                x
            };
            Panel { kind: Quad9, nodes: Quad9.face_reference_nodes().iter().map(node).collect() }
        };
        (0..3).flat_map(|axis| [(axis, 1.0), (axis, -1.0)]).map(side).collect()
    }

    /// Truth: the residual of the solved equations is only rounding. If a unit response is 10 % too large, the residual
    /// must be large, even beside large prescribed displacements.
    #[test]
    fn wrong_responses_show_beside_prescribed_displacements() {
        let stiffness = Stiffness::isotropic(2e5, 0.3).unwrap();
        let field = FullSpaceField::new(&stiffness).unwrap();
        let elements = BoundaryElements::new(cube(), Interpolation::Constant, &stiffness, field, 1e-3);
        let positions = elements.positions();
        let base: Vec<bool> = positions.iter().flat_map(|x| [x.z < -0.99; 3]).collect();
        let moved = BoundaryValues::new(base.iter().map(|held| f64::from(u8::from(*held))).collect());
        let top = positions.iter().position(|x| x.z > 0.99).unwrap();
        let problem = BoundaryValueProblem {
            elements: &elements,
            domain: Domain::Interior,
            displacement_known: &base,
            loads: &[moved],
            loaded: &[top],
            free_motions: None,
        };
        let mut solution = problem.solve(Par::Seq).unwrap();
        assert!(solution.residual < 1e-12, "{}", solution.residual);
        solution.unknown.column_mut(1).iter_mut().for_each(|x| *x *= 1.1);
        let residual = problem.residual(&solution).unwrap();
        assert!(residual > 1e-3, "{residual}");
    }
}
