//! Blocks of half-width and depth `w` with the near field of a half-space. The base is clamped. Cells become smaller towards the
//! sides and the base.

use orthowear::body::HybridBody;
use orthowear::body::hybrid::HalfSpaceFit;
use orthowear::element::ElementKind;
use orthowear::fem::{CondensationResources, FeSpec, HexFormulation};
use orthowear::frame::{ContactFrame, Side};
use orthowear::material::Stiffness;
use orthowear::mesh::Mesh;

use crate::common::im7;
use crate::fem_bodies::{clamp, spec};
use crate::fem_meshes::block;

/// Half-width of the contact frame, mm.
pub const FRAME: f64 = 1.2;

/// Stiffness of CFRP with fibres tilted by 30 degrees out of the surface.
pub fn cfrp() -> Stiffness {
    im7(30.0)
}

/// Maps `t` in (0, 1) to a graded line of `n` cells. The first cell is `ratio` times as long as the last cell.
fn shrinking(t: f64, n: usize, ratio: f64) -> f64 {
    if n < 2 || ratio == 1.0 {
        return t;
    }
    // The map is linear in each cell, so that midpoints stay midpoints.
    let q = ratio.powf(-1.0 / (n as f64 - 1.0));
    let ends = |k: f64| (1.0 - q.powf(k)) / (1.0 - q.powf(n as f64));
    let first = (t * n as f64).floor().min(n as f64 - 1.0);
    let share = t * n as f64 - first;
    ends(first) + share * (ends(first + 1.0) - ends(first))
}

/// Mesh of a block below z = 0 with `n` cells along each edge. The cells in the middle of the top are `ratio` times as long as
/// the cells at the sides and at the base.
pub fn mesh(kind: ElementKind, w: f64, n: usize, ratio: f64) -> Mesh {
    let across = |x: f64| {
        let from_middle = 2.0 * x - 1.0;
        w * from_middle.signum() * shrinking(from_middle.abs(), n / 2, ratio)
    };
    block(kind, [n; 3], [1.0; 3], |[x, y, z]| [across(x), across(y), -w * shrinking(1.0 - z, n, ratio)])
}

pub fn body(kind: ElementKind, (w, n, ratio): (f64, usize, f64), stiffness: &Stiffness) -> FeSpec {
    spec(mesh(kind, w, n, ratio), stiffness.clone(), HexFormulation::Enhanced, vec![clamp("z0")])
}

pub fn hybrid(spec: FeSpec, contact: &str, side: Side, frame: &ContactFrame) -> HybridBody {
    let site = HalfSpaceFit::find(&spec, contact, side, frame).unwrap().expect("a place for a half-space");
    HybridBody::new(spec, &[], contact, side, frame, &site, &CondensationResources::default()).unwrap()
}

pub fn frame(cells: usize) -> ContactFrame {
    ContactFrame::grid([FRAME; 2], [cells; 2], [0.0; 2], 0.0).unwrap()
}
