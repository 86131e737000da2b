//! Constitutive laws of the contact surface: friction and wear, orthotropic and dependent on the fibre direction.
//!
//! From a scene to the contact problem: `scene::resolve::laws` reads a law, `simulation::build::builder` puts it into the `Model`,
//! `PreparedModel` (`evolution::model`) evaluates it once, and `increment_problem` (`evolution::increment_solve`) gives it to the
//! `Increment` (`contact::increment`). There `FrictionScaling` applies the ellipse, and `fill_wear` adds the wear depth to the gap.
//! `run_increment` and `add_to_state` store the new depth.
//!
//! The coefficients depend neither on temperature nor on place. What assumes one ellipse: every user of
//! `Increment::friction_scaling` and `PreparedModel::ellipse`, `ContactScales`, `SpecificWearRate::volume_per_energy`, the smallest
//! μ in `contact::residual`, and the windows of a frame (`contact::window`). The stored tractions of a cycle
//! (`contact::Unknowns`) are scaled by μ; with the energy law the specific wear rate is k μ. A template of a field per cell is
//! `wear_path_factors`. A field that changes between increments belongs to `RunState` and its transfer to other frames
//! (`evolution::transfer`).

pub mod friction;
pub mod wear;
