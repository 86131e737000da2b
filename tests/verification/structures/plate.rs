//! A thick plate under pressure: LE10.

use orthowear::element::ElementKind::{Hex20, Hex27};
use orthowear::fem::{FeModel, HexFormulation, StressRecovery, Support};
use orthowear::material::Stiffness;

use super::meshes::ellipses;
use crate::fem_bodies::{clamp, spec};
use crate::fem_meshes::prescribe;

/// Truth: sigma_yy = -5.38 MPa at D = (2, 0, 0.6) of the thick elliptic plate (NAFEMS 1990). The outer face is fixed along x and
/// y. On the middle line of this face, z is fixed, too. Tolerance: 2 % for the recovered stress at D, on 8 x 12 x 4 elements.
#[test]
fn nafems_le10() {
    for kind in [Hex20, Hex27] {
        let mut mesh = ellipses(kind, [8, 12, 4], 0.6);
        let place = |x: &[f64; 3]| (x[0] - 2.0).abs() + x[1].abs() + (x[2] - 0.6).abs() < 1e-9;
        let at_d = mesh.points.iter().position(place).expect("a node");
        let on_line = |x: &[f64; 3]| {
            let ellipse = (x[0] / 3.25).powi(2) + (x[1] / 2.75).powi(2);
            (ellipse - 1.0).abs() < 1e-9 && (x[2] - 0.3).abs() < 1e-9
        };
        let line: Vec<usize> = (0..mesh.n_points()).filter(|&node| on_line(&mesh.points[node])).collect();
        let mut supports = prescribe(&mut mesh, &line, [false, false, true], |_| [0.0; 3]);
        for (group, components) in
            [("y0", [false, true, false]), ("y1", [true, false, false]), ("x1", [true, true, false])]
        {
            supports.push(Support { components, ..clamp(group) });
        }
        let material = Stiffness::isotropic(210e3, 0.3).unwrap();
        let mut spec = spec(mesh, material, HexFormulation::Enhanced, supports);
        spec.pressures = vec![("z1".into(), 1.0)];
        let body = FeModel::new(spec).unwrap().condense(&[]).unwrap();
        let recovery = StressRecovery::new(body.model()).unwrap();
        let stress = recovery.stress(body.model(), body.contact_free_displacement()).unwrap();
        let sigma = stress[at_d][1];
        println!("LE10 {}: sigma_yy {sigma:.4}", kind.name());
        assert!((sigma / -5.38 - 1.0).abs() < 0.02, "{}: {sigma}", kind.name());
    }
}
