//! Wear steps: fretting cycles or steady sliding, computed in jumps over many cycles. Jumps integrate dw/dN = F(w), F = Σ p|s|_i
//! over the increments of a cycle. State of a step: [`wear_step::WearStepState`], of a cycle: [`cycle_state::CycleState`].

mod critical_jump;
pub(super) mod cycle_state;
mod jump_record;
mod jump_trial;
mod loops;
mod next_jump;
mod rates;
mod resolved_cycle;
pub(super) mod wear_step;
