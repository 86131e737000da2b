//! Anisotropic half-spaces: tabulated admittances and Green's functions, an independent formalism, Hertz ellipses.

mod green;
mod hertz;
mod incompressible;
mod punches;
mod roots;
mod stroh;
