//! Changes of an operator after its construction, recorded so that a new operator can repeat them.

use serde::{Deserialize, Serialize};

/// Changes that earlier calls made to an operator after its construction.
///
/// A new operator of the same bodies that repeats this history gives the same products, bit by bit.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct OperatorHistory {
    /// Cells whose rows were formed, one list per call.
    pub formed: Vec<Vec<usize>>,
    /// Whether the formed rows have been compared with another solution of the equations of the body.
    pub formed_rows_checked: bool,
    /// Histories of the parts of a sum of operators.
    pub parts: Vec<OperatorHistory>,
}
