//! Isotropic normal contact and displacements under known loads.

mod loads;
mod scaling;
