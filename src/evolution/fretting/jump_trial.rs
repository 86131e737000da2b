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
    pub fn of(cycling: &WearStepState) -> Self {
        Self {
            unknowns: Unknowns::from_state(&cycling.cycle.contact),
            stuck: cycling.cycle.stick_mask.clone(),
            at: cycling.cycle.stick_gap.clone(),
            rate: cycling.wear_rate.clone(),
            power: cycling.dissipation_rate,
        }
    }

    /// Restores the values.
    pub fn put(self, cycling: &mut WearStepState) {
        self.unknowns.restore_into(&mut cycling.cycle.contact);
        (cycling.cycle.stick_mask, cycling.cycle.stick_gap) = (self.stuck, self.at);
        (cycling.wear_rate, cycling.dissipation_rate) = (self.rate, self.power);
    }
}
