//! Loads of a body that move its surface, with amplitudes that steps prescribe.

/// Load of a body. Loads of both bodies with the same name have one amplitude.
#[derive(Debug, Clone, PartialEq)]
pub struct BodyLoad {
    /// Name in steps; `None` if steps cannot prescribe the amplitude.
    pub name: Option<String>,
    /// Change of the gap at amplitude 1, `[3, N]` by components, mm.
    pub gap: Vec<f64>,
}
