//! Truncated half-spaces (full-space kernels on a meshed, finite surface) against exact half-spaces.

use orthowear::body::{TruncatedHalfSpace, TruncatedSpec};
use orthowear::frame::{ContactFrame, Side};
use orthowear::linalg::memory::MemoryLimit;
use orthowear::material::Stiffness;

use crate::common::{im7, steel, usual_or_finest};

/// Relative difference between the work of uniform tractions on a truncated half-space and on the exact half-space. Elements
/// extend out to `half_size`. The frame has half-width 1 and `n` cells along each side.
fn difference(stiffness: &Stiffness, side: Side, (half_size, n): (f64, usize)) -> f64 {
    let frame = ContactFrame::grid([1.0; 2], [n; 2], [0.3, -0.2], 0.4).unwrap();
    let spec = TruncatedSpec { stiffness, half_size };
    let memory = MemoryLimit::of_machine();
    let body = TruncatedHalfSpace::new(&spec, side, &frame, None, &memory).unwrap();
    assert!(body.truncation().residual < 1e-12, "{:?}", body.truncation());
    body.truncation().difference
}

/// Truth: tractions of a point force in an incompressible full space vanish on planes through the force (Kelvin). The truncated
/// surface therefore causes no error.
#[test]
fn incompressible_half_spaces_lose_nothing() {
    let rubber = Stiffness::isotropic(10.0, 0.4999).unwrap();
    for side in [Side::Lower, Side::Upper] {
        let found = difference(&rubber, side, (2.0, 6));
        assert!(found < 1e-5, "{found:e}");
    }
}

/// Truth: beyond the elements, tractions of order 1/r² work on displacements of order 1/r. The truncation error is therefore
/// inversely proportional to `half_size`. The remaining error is the error of constant elements. Finer elements reduce it.
#[test]
fn larger_surfaces_lose_less() {
    for stiffness in usual_or_finest(vec![im7(30.0)], vec![steel(), im7(30.0)]) {
        let found = [3.0, 6.0, 12.0].map(|half_size| difference(&stiffness, Side::Lower, (half_size, 6)));
        let [first, second] = [found[0] - found[1], found[1] - found[2]];
        assert!(second > 0.0 && first > 1.8 * second, "{found:?}");
        let finer = difference(&stiffness, Side::Lower, (12.0, 12));
        assert!(finer < 0.7 * found[2], "{finer} {found:?}");
    }
}
