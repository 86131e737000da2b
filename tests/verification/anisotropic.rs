//! Anisotropic half-spaces: admittances, Green's functions, Hertz ellipses and flat punches.

mod green;
mod hertz;
mod incompressible;
mod punches;
mod roots;
mod stroh;
