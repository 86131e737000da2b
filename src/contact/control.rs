//! Prescribed quantities at the path points of an increment.

use super::balance::Balance;

/// Normal control of a path point.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum NormalControl {
    /// The normal rigid motion is given.
    Approach,
    /// The normal force is given (N, compression positive).
    Force(f64),
}

/// Tangential control of a path point.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum TangentialControl {
    /// The tangential rigid motion is given.
    Shift,
    /// The tangential force on body 2 along the frame's (x, y) is given (N).
    Force([f64; 2]),
}

/// Whether the pressures of an increment are unknown.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Pressures {
    /// Pressures are unknown.
    Unknown,
    /// Pressures are fixed at their values in the state, and only tangential tractions are unknown. The operator must
    /// have a separate tangential part.
    Given,
}

/// Reference configuration from which the slip of a path point is measured.
#[derive(Debug, Clone)]
pub enum SlipReference {
    /// End of the previous increment.
    Previous {
        /// Tangential gaps, `[2, N]`, mm.
        gap: Vec<f64>,
        /// Pressures, `[N]`, MPa. Wear and dissipation take the mean of the pressures at both ends of the increment.
        pressures: Vec<f64>,
    },
    /// Previous path point of a closed cycle, in which the last point precedes the first. In cells of `stick_mask`,
    /// slip is measured from `stick_gap`.
    PreviousPoint {
        /// Cells that stick through the cycle.
        stick_mask: Vec<bool>,
        /// Tangential gaps of the cells in `stick_mask`, `[2, N]`, mm.
        stick_gap: Vec<f64>,
        /// Displacement of body 2 along x, y at the first path point of the previous cycle, mm. The change since then
        /// is the drift per cycle. `None` without drift.
        origin: Option<[f64; 2]>,
    },
    /// Steady sliding: prescribed slip, `[2, N]`, mm per mm of sliding, independent of the tractions.
    Prescribed(Vec<f64>),
    /// Steady rolling: slip relative to the upstream cell.
    Upstream(Upstream),
}

/// Data of steady rolling, in which tractions are stationary while material passes from cell to cell.
#[derive(Debug, Clone)]
pub struct Upstream {
    /// Upstream cell of each cell, `[N]`, from which material enters the cell. A cell where material enters the frame
    /// is its own upstream cell.
    pub source_cell: Vec<usize>,
    /// Slip that the bodies would have without elastic deformation while material passes through one cell, `[2, N]`,
    /// mm.
    pub rigid_slip: Vec<f64>,
}

impl SlipReference {
    /// Reference of the linearised equations: the same variant for `n` cells, with gaps, pressures and rigid slip set
    /// to zero.
    pub(super) fn linearised(&self, n: usize) -> Self {
        match self {
            Self::Previous { .. } => Self::Previous { gap: vec![0.0; 2 * n], pressures: vec![0.0; n] },
            Self::PreviousPoint { stick_mask, origin, .. } => Self::PreviousPoint {
                stick_mask: stick_mask.clone(),
                stick_gap: vec![0.0; 2 * n],
                origin: origin.map(|_| [0.0; 2]),
            },
            Self::Prescribed(_) => Self::Prescribed(vec![0.0; 2 * n]),
            Self::Upstream(upstream) => Self::Upstream(Upstream {
                source_cell: upstream.source_cell.clone(),
                rigid_slip: vec![0.0; 2 * n],
            }),
        }
    }
}

/// One path point of an increment.
#[derive(Debug, Clone)]
pub struct PathPoint {
    /// Normal control.
    pub normal: NormalControl,
    /// Tangential control.
    pub tangential: TangentialControl,
    /// Balance that determines the unknown rigid motions. It replaces the forces in `normal` and `tangential`. `None`
    /// if these two controls alone determine the motions.
    pub balance: Option<Balance>,
    /// Reference from which slip is measured.
    pub reference: SlipReference,
    /// Factor on [`super::Increment::cyclic_gap`], -1 to 1.
    pub load_phase: f64,
}
