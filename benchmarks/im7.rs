//! CFRP of the benchmarks.

use orthowear::error::Result;
use orthowear::geometry::fibre_axes;
use orthowear::material::{Orthotropic, Stiffness};

/// Stiffness of the CFRP IM7/8551-7, MPa. `tilt` is the fibre angle out of the surface, degrees.
pub fn im7(tilt: f64) -> Result<Stiffness> {
    let constants = Orthotropic {
        e1: 167_230.0,
        e2: 9544.0,
        e3: 9544.0,
        g12: 5292.0,
        g13: 5292.0,
        g23: 3483.0,
        nu12: 0.272,
        nu13: 0.272,
        nu23: 0.369,
    };
    Ok(Stiffness::orthotropic(&constants)?.rotated(&fibre_axes(tilt.to_radians(), 0.0)))
}
