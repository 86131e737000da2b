//! Rollback of rejected jumps.

use crate::contact::Unknowns;
use crate::evolution::fretting::wear_step_state::WearStepState;

/// Values that a trial jump changes.
pub(super) struct Tried {
    unknowns: Unknowns,
    stuck: Vec<bool>,
    at: Vec<f64>,
    rate: Vec<f64>,
    power: f64,
}

impl Tried {
    pub fn of(wear_step: &WearStepState) -> Self {
        Self {
            unknowns: Unknowns::from_state(&wear_step.cycle.contact),
            stuck: wear_step.cycle.stick_mask.clone(),
            at: wear_step.cycle.stick_gap.clone(),
            rate: wear_step.wear_rate.clone(),
            power: wear_step.dissipation_rate,
        }
    }

    /// Restores the values.
    pub fn put(self, wear_step: &mut WearStepState) {
        self.unknowns.restore_into(&mut wear_step.cycle.contact);
        (wear_step.cycle.stick_mask, wear_step.cycle.stick_gap) = (self.stuck, self.at);
        (wear_step.wear_rate, wear_step.dissipation_rate) = (self.rate, self.power);
    }
}
