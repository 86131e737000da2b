//! Solution on the surface of a body: displacement and traction.

use super::compressed::CompressionReport;
use super::problem::BoundaryValues;
use crate::linalg::dense_matrix::DenseMatrix;

/// Displacement and traction of all nodes of a surface, in global axes.
#[derive(Debug, Clone, PartialEq)]
pub struct SurfaceState {
    /// Displacement, mm.
    pub displacement: Vec<[f64; 3]>,
    /// Traction on the body, MPa.
    pub traction: Vec<[f64; 3]>,
}

/// Unknown displacements and tractions: one column per load and one per unit traction component of the loaded nodes.
pub struct BoundarySolution {
    pub(super) displacement_known: Vec<bool>,
    pub(super) loads: Vec<BoundaryValues>,
    pub(super) loaded: Vec<usize>,
    /// `[3 n + free motions, loads + 3 loaded nodes]`.
    pub(super) unknown: DenseMatrix,
    /// Divisor of the unknown tractions, MPa/mm.
    pub(super) traction_scale: f64,
    pub(super) residual: f64,
    pub(super) compression: Option<CompressionReport>,
}

impl BoundarySolution {
    /// Largest residual of some equations that are computed again after the solution. The residual is relative to the
    /// largest sum of the magnitudes of the terms of an equation.
    pub fn residual(&self) -> f64 {
        self.residual
    }

    /// Report on the compression; `None` for dense equations.
    pub fn compression(&self) -> Option<&CompressionReport> {
        self.compression.as_ref()
    }

    /// Nodes for which responses to unit tractions were computed.
    pub fn loaded(&self) -> &[usize] {
        &self.loaded
    }

    /// Displacement of `dof` due to a unit traction component c at loaded node j, mm/MPa, with `loaded = 3 j + c`. The displacement
    /// of `dof` must not be prescribed.
    pub fn response(&self, dof: usize, loaded: usize) -> f64 {
        self.unknown.at(dof, self.loads.len() + loaded)
    }

    /// Memory of the solution, bytes.
    pub fn bytes(&self) -> usize {
        8 * self.unknown.values().len()
    }

    fn superpose(&self, amplitudes: &[f64], tractions: &[f64]) -> Vec<f64> {
        let mut sum = vec![0.0; self.unknown.n_rows()];
        let of_loads = amplitudes.iter().take(self.loads.len()).enumerate();
        let of_nodes = tractions.iter().enumerate().map(|(j, traction)| (self.loads.len() + j, traction));
        for (j, factor) in of_loads.chain(of_nodes) {
            if *factor != 0.0 {
                sum.iter_mut().zip(self.unknown.column(j)).for_each(|(sum, x)| *sum += factor * x);
            }
        }
        sum
    }

    /// State due to the loads with their `amplitudes` and the `tractions` on the loaded nodes, `[3 n_loaded]`, MPa.
    pub fn state(&self, amplitudes: &[f64], tractions: &[f64]) -> SurfaceState {
        let n = self.displacement_known.len() / 3;
        let found = self.superpose(amplitudes, tractions);
        let mut state = SurfaceState { displacement: vec![[0.0; 3]; n], traction: vec![[0.0; 3]; n] };
        for (dof, held) in self.displacement_known.iter().enumerate() {
            let known = self.loads.iter().zip(amplitudes).map(|(load, a)| a * load.at_dofs[dof]).sum();
            let (u, t) = if *held { (known, found[dof] * self.traction_scale) } else { (found[dof], known) };
            state.displacement[dof / 3][dof % 3] = u;
            state.traction[dof / 3][dof % 3] = t;
        }
        for (j, &node) in self.loaded.iter().enumerate() {
            (0..3).for_each(|c| state.traction[node][c] += tractions[3 * j + c]);
        }
        state
    }

    /// Amplitudes of the tractions that balance the loads of [`Self::state`] with the same arguments, MPa. Each free
    /// rigid motion has one amplitude. Its tractions have the shape of the motion.
    pub fn balance(&self, amplitudes: &[f64], tractions: &[f64]) -> Vec<f64> {
        let found = self.superpose(amplitudes, tractions);
        found[self.displacement_known.len()..].iter().map(|x| x * self.traction_scale).collect()
    }
}
