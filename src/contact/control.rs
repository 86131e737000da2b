//! What is prescribed at the ends of an increment.

use super::balance::Balance;

/// Normal control of an end.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum NormalControl {
    /// The normal rigid motion is given.
    Approach,
    /// The normal force is given (N, compression positive); the approach is found.
    Force(f64),
}

/// Tangential control of an end.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum TangentialControl {
    /// The tangential rigid motion is given.
    Shift,
    /// The tangential force on body 2 along local (x, y) is given; the shift is found.
    Force([f64; 2]),
}

/// Whether pressures are to be found.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Pressures {
    /// With everything else.
    Unknown,
    /// They are those of the state, and only what happens in the surface is asked for: of operators with a tangential part.
    Given,
}

/// Where the slip of an end is measured from.
#[derive(Debug, Clone)]
pub enum SlipReference {
    /// Tangential gaps `[2, N]` at the end of the previous increment.
    Previous(Vec<f64>),
    /// The end before it in the closed cycle that the ends of the increment make up, the last being the one before the first;
    /// except in cells that stick through the whole cycle, which keep the tangential gap they stuck at.
    PreviousPoint {
        /// Cells that stick through the cycle.
        stick_mask: Vec<bool>,
        /// Their tangential gaps, `[2, N]`.
        stick_gap: Vec<f64>,
    },
    /// Steady sliding: the slip itself, `[2, N]`, whatever the tractions.
    Prescribed(Vec<f64>),
    /// The cell that the material comes from, in steady rolling.
    Upstream(Upstream),
}

/// Steady rolling: tractions stand still while the material passes from cell to cell.
#[derive(Debug, Clone)]
pub struct Upstream {
    /// The cell that the material of each cell comes from, `[N]`; itself where it enters the frame.
    pub source_cell: Vec<usize>,
    /// Slip of rigid bodies over the passage of a cell, `[2, N]`, mm.
    pub rigid_slip: Vec<f64>,
}

impl SlipReference {
    /// The same for changes of a state on `n` cells: what is constant in it is zero.
    pub(super) fn linearised(&self, n: usize) -> Self {
        match self {
            Self::Previous(_) => Self::Previous(vec![0.0; 2 * n]),
            Self::PreviousPoint { stick_mask, .. } => {
                Self::PreviousPoint { stick_mask: stick_mask.clone(), stick_gap: vec![0.0; 2 * n] }
            }
            Self::Prescribed(_) => Self::Prescribed(vec![0.0; 2 * n]),
            Self::Upstream(upstream) => Self::Upstream(Upstream {
                source_cell: upstream.source_cell.clone(),
                rigid_slip: vec![0.0; 2 * n],
            }),
        }
    }
}

/// One end of an increment: what is prescribed there.
#[derive(Debug, Clone)]
pub struct PathPoint {
    /// Normal control.
    pub normal: NormalControl,
    /// Tangential control.
    pub tangential: TangentialControl,
    /// The rigid motions that a balance finds, in place of the forces of both controls; `None` where the controls say
    /// all, forces along the common axes of a level frame included.
    pub balance: Option<Balance>,
    /// Where its slip is measured from.
    pub reference: SlipReference,
}
