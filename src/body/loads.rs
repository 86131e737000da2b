//! Loads of a body that move its surface. Each load is multiplied by an amplitude that the steps prescribe.

use crate::error::{Error, Result};
use crate::fem::{AppliedLoads, FeModel, FeSpec};
use crate::geometry::Side;

/// Name of the load that removes the overlap of the two meshes.
pub const INTERFERENCE: &str = "interference";

/// Tolerance for the balance of a load: its largest work on a rigid-body mode, divided by the sum of the magnitudes of
/// its forces. The mode has the amplitude 1, and the load has the amplitude 1.
const BALANCE_TOLERANCE: f64 = 1e-6;

/// Loads and prescribed displacements of a body that share an amplitude.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct LoadCase {
    /// Name by which steps prescribe the amplitude; `None` if steps cannot prescribe it.
    pub name: Option<String>,
    /// Whether the amplitude is 1 before the first step.
    pub preload: bool,
}

impl LoadCase {
    /// Load case that removes the overlap of the two meshes.
    pub fn interference() -> Self {
        Self { name: Some(INTERFERENCE.to_owned()), preload: false }
    }

    /// Refuses a preload that is not in equilibrium. `works` contains the work of the load on each of the rigid-body
    /// modes `names`. `size` is the sum of the magnitudes of the forces.
    ///
    /// # Errors
    /// If this is a preload and its work on a mode is not zero.
    pub(super) fn ensure_balanced(&self, works: &[f64], names: &[String], size: f64) -> Result<()> {
        let moves = |(work, _): &(&f64, &String)| work.abs() > BALANCE_TOLERANCE * size;
        match works.iter().zip(names).find(moves).filter(|_| self.preload) {
            None => Ok(()),
            Some((_, mode)) => Err(Error::input(format!(
                "the preload{} moves the body freely ({mode}), because before contact nothing balances this load: remove `preload`, so that the load grows in the first step, or support the body",
                self.name.as_ref().map_or_else(String::new, |name| format!(" \"{name}\""))
            ))),
        }
    }
}

/// Load of a body. Loads with the same name share one amplitude, also if they act on different bodies.
#[derive(Debug, Clone, PartialEq)]
pub struct BodyLoad {
    /// Side of the body; `None` for the interference of two bodies.
    pub side: Option<Side>,
    /// Name of the load, and whether it acts before the first step.
    pub case: LoadCase,
    /// Change of the gap at amplitude 1, `[3, N]`, component by component, mm.
    pub gap: Vec<f64>,
}

impl BodyLoad {
    /// Whether the load changes the normal gap.
    pub fn changes_normal_gap(&self) -> bool {
        self.gap[2 * self.gap.len() / 3..].iter().any(|gap| *gap != 0.0)
    }
}

/// Contact tractions, and the amplitudes of the loads of a body.
#[derive(Debug, Clone, Copy)]
pub struct Loading<'a> {
    /// Tractions on body 2, `[3, N]`, component by component, MPa.
    pub tractions: &'a [f64],
    /// Amplitude of each load of the body; missing amplitudes are zero.
    pub amplitudes: &'a [f64],
}

impl<'a> Loading<'a> {
    /// Loading by contact tractions alone.
    pub fn of_contact(tractions: &'a [f64]) -> Self {
        Self { tractions, amplitudes: &[] }
    }

    /// Amplitude of load `k`.
    pub fn amplitude(&self, k: usize) -> f64 {
        self.amplitudes.get(k).copied().unwrap_or(0.0)
    }
}

/// Load cases of a body, and the loads of each case at amplitude 1. Without `cases`, all loads of `model` form one
/// case.
///
/// # Errors
/// As [`FeModel::loads_of`].
pub(super) fn applied_loads(
    model: &FeModel,
    cases: &[(LoadCase, FeSpec)],
) -> Result<(Vec<LoadCase>, Vec<AppliedLoads>)> {
    if cases.len() > 1 {
        let loads_of = |(case, spec): &(LoadCase, FeSpec)| {
            let on_mesh = FeSpec { mesh: model.mesh().clone(), ..spec.clone() };
            Ok((case.clone(), model.loads_of(&on_mesh)?))
        };
        return cases.iter().map(loads_of).collect();
    }
    if cases.is_empty() && !model.has_own_loads() {
        return Ok((Vec::new(), Vec::new()));
    }
    let case = cases.first().map_or_else(LoadCase::default, |(case, _)| case.clone());
    Ok((vec![case], vec![model.loads().clone()]))
}
