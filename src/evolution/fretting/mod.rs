//! Wear steps: fretting cycles or steady sliding, computed in jumps over many cycles (equations in `wear_integrator`).
//! A coupled cycle is a cycle whose path points are solved together.
//!
//! * Step: `wear_step` finds the periodic cycle (`strokes`), evaluates its wear rates (`rates`) and takes jumps.
//! * Jump: `next_jump` tries jumps until the step controller accepts one, and `jump_record` commits it.
//!   `wear_integrator` integrates a trial, and each of its stages solves one coupled cycle. `jump_correction` corrects
//!   a jump by the resolved cycle at the end of the jump.
//! * Stick zone: `stick_zone` solves coupled cycles and decides which cells stick. `cycle_state` contains the stick
//!   zone.
//! * Path between the path points: `resolved_cycle` corrects the wear of a coupled cycle by a cycle with more
//!   increments (`cycle_refinement`). `repeated_cycle` repeats this cycle until it is steady (`settling`). `loops`
//!   records cycles with many increments.

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
mod repeated_cycle;
mod settling;
mod stick_zone;
pub(super) mod strokes;
mod wear_integrator;
mod wear_step;
pub(super) mod wear_step_state;
