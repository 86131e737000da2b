//! Wear steps: fretting cycles or steady sliding, computed in jumps over many cycles.

mod critical_jump;
pub(super) mod cycle_state;
mod jump_record;
mod jump_trial;
mod loops;
mod next_jump;
mod rates;
mod resolved_cycle;
pub(super) mod wear_step;
