//! What this module is.

pub(crate) mod critical_jump;
pub(crate) mod cycle_state;
pub(crate) mod jump_record;
pub(crate) mod jump_trial;
pub(crate) mod loops;
pub(crate) mod next_jump;
pub(crate) mod rates;
pub(crate) mod resolved_cycle;
pub(crate) mod wear_step;
