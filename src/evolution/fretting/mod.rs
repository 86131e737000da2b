//! Wear steps: fretting cycles or steady sliding, computed in jumps over many cycles. Jumps integrate dw/dN = F(w) with wear depth
//! w and number of cycles N. F = Σ_k p_k |s_k|_i sums pressure times slip over the increments k of a cycle. The norm |s|_i =
//! √((i1·s1)² + (i2·s2)²) contains the specific wear rates i1, i2 along the wear axes. [`wear_step_state::WearStepState`] is the
//! state of a step, [`cycle_state::CycleState`] of a cycle.
//!
//! * Steps and jumps: `wear_step` begins and ends a step, `next_jump` chooses, tries and accepts jumps, `jump_record` commits them.
//!   `wear_integrator` integrates a jump; its `solve_stage` solves the path points of a cycle.
//! * Stick zone: `solve_stage` solves the path points and tests the zone (`cycle_state`). If the zone is inconsistent, `strokes`
//!   recomputes it by solving stroke after stroke, and `solve_stage` solves the path points again.
//! * Path within a stroke: `path`, `loops`, `resolved_cycle`, `cycle_refinement`, `path_correction`.

mod critical_jump;
mod cycle_increment;
mod cycle_refinement;
mod cycle_slip;
pub(super) mod cycle_state;
mod cycle_wear;
mod jump_record;
mod loops;
mod next_jump;
mod path;
mod path_correction;
mod rates;
mod resolved_cycle;
mod resolved_cycle_warnings;
mod stick_zone;
pub(super) mod strokes;
mod wear_integrator;
mod wear_step;
pub(super) mod wear_step_state;
