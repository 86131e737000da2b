//! Panels loaded in their plane: Cook's membrane and the elliptic membrane LE1.

use orthowear::element::ElementKind::{self, Hex8, Hex20, Hex27, Tet10, Wedge15};
use orthowear::fem::{CondensedBody, FeModel, FeSpec, HexFormulation, StressRecovery, Support};
use orthowear::material::Stiffness;

use super::meshes::ellipses;
use crate::fem_bodies::{clamp, spec};
use crate::fem_meshes::block;

fn solve(spec: FeSpec) -> CondensedBody {
    FeModel::new(spec).unwrap().condense(&[]).unwrap()
}

fn held(group: &str, components: [bool; 3]) -> Support {
    Support { components, ..clamp(group) }
}

/// Vertical displacement at the middle of the right edge of Cook's panel of thickness 1. The mesh has `n` elements along an edge
/// and one through the thickness. Without `plane_strain` the front face is free.
fn cook(kind: ElementKind, n: usize, (modulus, nu, force): (f64, f64, f64), plane_strain: bool) -> f64 {
    let taper = |[s, t, z]: [f64; 3]| {
        let (bottom, top) = (44.0 * s, 44.0 + 16.0 * s);
        [48.0 * s, bottom + t * (top - bottom), z]
    };
    let mesh = block(kind, [n, n, 1], [1.0; 3], taper);
    let place = |x: &[f64; 3]| (x[0] - 48.0).abs() + (x[1] - 52.0).abs() + x[2].abs() < 1e-9;
    let tip = mesh.points.iter().position(place).expect("a node");
    let mut supports = vec![held("x0", [true, true, false]), held("z0", [false, false, true])];
    if plane_strain {
        supports.push(held("z1", [false, false, true]));
    }
    let material = Stiffness::isotropic(modulus, nu).unwrap();
    let mut spec = spec(mesh, material, HexFormulation::Enhanced, supports);
    spec.tractions = vec![("x1".into(), [0.0, force / 16.0, 0.0])];
    solve(spec).contact_free_displacement()[tip][1]
}

/// Truth: the tip of Cook's panel moves by 23.968 in plane stress (E = 1, nu = 1/3, F = 1). In plane strain it moves by 8.778
/// (E = 250, nu = 0.3, F = 100). Sources: Cook 1974, and a computation with graded elements of degree 4 and 5. Tolerance: 1 %
/// with 32 elements of second order along an edge. A solid of thickness 1 with a free front differs from plane stress only at the
/// clamped corners.
#[test]
fn cook_membrane() {
    let (stress, strain) = ((1.0, 1.0 / 3.0, 1.0), (250.0, 0.3, 100.0));
    for (kind, n) in [(Hex20, 32), (Hex20, 16), (Hex27, 16), (Wedge15, 16), (Tet10, 16), (Hex8, 64)] {
        let found = [cook(kind, n, stress, false) / 23.968 - 1.0, cook(kind, n, strain, true) / 8.778 - 1.0];
        println!("Cook {} {n}: plane stress {:+.2e}, plane strain {:+.2e}", kind.name(), found[0], found[1]);
        assert!(found.iter().all(|error| error.abs() < 0.01), "{}: {found:?}", kind.name());
    }
}

/// Truth: sigma_yy = 92.7 MPa at D = (2, 0) of the elliptic membrane (NAFEMS 1990). Tolerance: 2 % for the recovered nodal stress
/// on 16 x 24 elements.
#[test]
fn nafems_le1() {
    for kind in [Hex20, Hex27, Wedge15, Tet10] {
        let mesh = ellipses(kind, [16, 24, 1], 0.1);
        let place = |x: &[f64; 3]| (x[0] - 2.0).abs() + x[1].abs() + x[2].abs() < 1e-9;
        let at_d = mesh.points.iter().position(place).expect("a node");
        let supports = vec![
            held("y0", [false, true, false]),
            held("y1", [true, false, false]),
            held("z0", [false, false, true]),
        ];
        let material = Stiffness::isotropic(210e3, 0.3).unwrap();
        let mut spec = spec(mesh, material, HexFormulation::Enhanced, supports);
        spec.pressures = vec![("x1".into(), -10.0)];
        let body = solve(spec);
        let recovery = StressRecovery::new(body.model()).unwrap();
        let stress = recovery.stress(body.model(), body.contact_free_displacement()).unwrap();
        let sigma = stress[at_d][1];
        println!("LE1 {}: sigma_yy {sigma:.3}", kind.name());
        assert!((sigma / 92.7 - 1.0).abs() < 0.02, "{}: {sigma}", kind.name());
    }
}
