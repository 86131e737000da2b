//! Matrix and preconditioner of the conjugate gradient iteration.

use super::coarse::CoarseSpace;
use super::node_matrix::NodeMatrix;
use super::smoother::GaussSeidel;

/// Estimated relative error in the energy norm at which the iteration stops.
pub(super) const MAX_ENERGY_ERROR: f64 = 1e-11;

pub(super) const SLOW_OR_SINGULAR: &str = "a part of the body may move without any force. Look for parts joined only by a single node or edge. Otherwise raise --max-memory or solver.memory_limit, so that a factorisation is possible; its error message names the node that can move";

/// Iterative solver for systems with a symmetric positive definite matrix A. It does not factorise A.
pub struct TwoLevelSolver {
    pub(super) matrix: NodeMatrix,
    pub(super) smoother: GaussSeidel,
    pub(super) coarse: CoarseSpace,
}
