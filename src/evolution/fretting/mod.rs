//! Wear steps: fretting cycles or steady sliding, computed in jumps over many cycles (equations in `wear_integrator`).
//!
//! * Step: `wear_step` finds the periodic cycle (`strokes`), evaluates its rates (`rates`) and takes jumps.
//! * Jump: `next_jump` tries jumps until the step controller accepts one, and `jump_record` commits it. `wear_integrator`
//!   integrates a trial; each of its stages solves one cycle at a wear depth. `jump_correction` corrects it by the resolved cycle
//!   at its end.
//! * Stick zone: `stick_zone` solves the path points of a cycle together and decides which cells stick. `cycle_state` contains the
//!   zone.
//! * Path between the path points: `resolved_cycle` corrects the wear by a cycle of more increments (`cycle_refinement`). `loops`
//!   records cycles of many increments.

mod critical_jump;
mod cycle_increment;
mod cycle_refinement;
mod cycle_slip;
pub(super) mod cycle_state;
mod cycle_wear;
mod jump_correction;
mod jump_record;
mod loops;
mod next_jump;
mod path;
mod path_correction;
mod rate_correction;
mod rates;
mod resolved_cycle;
mod resolved_cycle_warnings;
mod settings;
mod stick_zone;
pub(super) mod strokes;
mod wear_integrator;
mod wear_step;
pub(super) mod wear_step_state;
