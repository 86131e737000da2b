//! What a try at a jump changes, to be put back where it is not taken.

use crate::contact::Unknowns;

use super::cycling::Cycling;

/// What a try at a jump changes.
pub(super) struct Tried {
    unknowns: Unknowns,
    stuck: Vec<bool>,
    at: Vec<f64>,
    rate: Vec<f64>,
    power: f64,
}

impl Tried {
    pub fn of(cycling: &Cycling) -> Self {
        Self {
            unknowns: Unknowns::of(&cycling.ring.it),
            stuck: cycling.ring.stuck.clone(),
            at: cycling.ring.at.clone(),
            rate: cycling.rate.clone(),
            power: cycling.power,
        }
    }

    /// Puts it back.
    pub fn put(self, cycling: &mut Cycling) {
        self.unknowns.put(&mut cycling.ring.it);
        (cycling.ring.stuck, cycling.ring.at) = (self.stuck, self.at);
        (cycling.rate, cycling.power) = (self.rate, self.power);
    }
}
