//! Constitutive laws of the contact surface: friction and wear, orthotropic and dependent on the fibre direction.
//!
//! [`friction::FrictionLaw`] gives one friction ellipse, and [`wear::WearLaw`] one specific wear rate (1/MPa), for the whole frame, both
//! in the local axes of each cell. From a scene to the contact problem: `scene::resolve::laws` reads a law, `simulation::build` puts it
//! into the `Model`, `PreparedModel` in `evolution` evaluates it once, and `increment_problem` gives it to the `Increment` in `contact`.
//! There `FrictionScaling` applies the ellipse, and `fill_wear` adds the wear depth to the gap.
//!
//! The coefficients depend neither on temperature nor on place. These assume one ellipse for the frame: `FrictionScaling` with the
//! stored scaled tractions (`contact::Unknowns`), the projection on prescribed forces (`contact::projection`), `BalanceCells`,
//! `ContactScales`, the windows of a frame (`contact::window`), and Newton's preconditioner.

pub mod friction;
pub mod wear;
