//! Isotropic normal contact and the displacements that known loads cause.

mod loads;
mod scaling;
