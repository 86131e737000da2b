//! Anisotropic half-spaces: tabulated admittances and Green's functions, an independent formalism, Hertz ellipses.

mod green;
mod hertz;
mod roots;
mod stroh;
