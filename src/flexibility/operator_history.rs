//! What an operator has come to hold in the course of a run, so that a run that is taken up again has the same one.

use serde::{Deserialize, Serialize};

/// What the products of an operator owe to those before them, beyond what it is made of.
///
/// An operator made afresh that repeats the course of another gives the same products, bit by bit.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct OperatorHistory {
    /// Cells that rows were formed for, call by call.
    pub formed: Vec<Vec<usize>>,
    /// Whether the rows that are formed were compared with the body solved afresh.
    pub formed_rows_checked: bool,
    /// Of the operators that it is the sum of.
    pub parts: Vec<OperatorHistory>,
}
