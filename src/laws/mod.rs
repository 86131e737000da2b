//! Constitutive laws of the contact surface: friction and wear, orthotropic and dependent on the fibre direction.
//!
//! A law passes through the code in this order:
//!
//! 1. `scene::resolve::laws` reads the law from the scene.
//! 2. `simulation::build::builder` stores the law in the `Model`.
//! 3. `PreparedModel` (`evolution::model`) evaluates the law, with one result for all cells.
//! 4. `increment_problem` (`evolution::increment_solve`) passes the result to the `Increment` (`contact::increment`).
//! 5. In the increment, `FrictionScaling` applies the friction ellipse, and `fill_wear` adds the wear depth to the gap.
//! 6. `run_increment` and `add_to_state` (`evolution`) store the new wear depth.
//!
//! The coefficients depend neither on temperature nor on position. The following code assumes one friction ellipse for
//! all cells:
//!
//! - all users of `Increment::friction_scaling` and `PreparedModel::ellipse`, and `ContactScales`,
//! - `SpecificWearRate::volume_per_energy`,
//! - the smallest μ in `contact::residual`,
//! - the windows of a frame (`contact::window`),
//! - the stored tractions of a cycle (`contact::Unknowns`), which are scaled by μ,
//! - the energy law, whose specific wear rate is k μ.
//!
//! `wear_path_factors` is an example of a field with one value per cell. A field that changes between increments must
//! be part of `RunState`, and `evolution::transfer` must transfer it to other frames.

pub mod friction;
pub mod wear;
