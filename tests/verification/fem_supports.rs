//! Elastic foundations, planes of symmetry, and displacements prescribed as a linear field.

use orthowear::element::ElementKind::Hex8;
use orthowear::fem::{CondensedBody, FeModel, FeSpec, Foundation, FoundationStiffness, Support};
use orthowear::fem::{HexFormulation::Enhanced, find_rigid_body_modes, symmetry_component};
use orthowear::material::Stiffness;

use super::fem_bodies::{ALL, ELEMENTS, clamp, isotropic, largest_difference, rotated_orthotropic, spec};
use super::fem_meshes::{block, rough, wavy};

fn bedded(group: &str, stiffness: FoundationStiffness) -> Vec<Foundation> {
    vec![Foundation { group: group.into(), stiffness }]
}

fn solved(spec: FeSpec) -> (CondensedBody, Vec<[f64; 3]>) {
    let body = FeModel::new(spec).expect("a body").condense(&[]).expect("a factor");
    let u = body.contact_free_displacement().to_vec();
    (body, u)
}

/// Truth: a block of height h and modulus E stands on springs of stiffness k per area. Under a pressure p its base sinks by p /
/// k, and its top by p / k + p h / E. Every element represents uniform stress. Springs along the normal leave the translations
/// along x and y and the rotation about z unconstrained. The tolerance 1e-10 covers rounding of the solve.
#[test]
fn a_block_on_a_foundation_sinks_by_the_pressure_over_its_stiffness() {
    let (p, k, h, e) = (3.0, 250.0, 2.0, 210e3);
    for (kind, formulation) in ELEMENTS {
        for bedding in [FoundationStiffness::Normal(k), FoundationStiffness::Components([0.0, 0.0, k])] {
            // The distortion would fold coarse elements of order 2.
            let map = if kind.n_nodes() > 8 { |x: [f64; 3]| x } else { wavy };
            let mesh = block(kind, [3, 2, 3], [1.0, 1.5, h], map);
            let mut body = spec(mesh, isotropic(), formulation, vec![]);
            body.pressures = vec![("z1".into(), p)];
            body.foundations = bedded("z0", bedding);
            let names =
                find_rigid_body_modes(&body).expect("sound supports").expect("free along its base").names;
            assert_eq!(names.join(", "), "translation x, translation y, rotation about z");
            let (solved, u) = solved(body);
            for (x, u) in solved.model().mesh().points.iter().zip(&u) {
                let wanted = -p / k - p * x[2] / e;
                assert!((u[2] / wanted - 1.0).abs() < 1e-10, "{x:?} {u:?} {wanted}");
            }
        }
    }
    let mut held = spec(block(Hex8, [2; 3], [1.0; 3], |x| x), isotropic(), Enhanced, vec![]);
    held.foundations = bedded("z0", FoundationStiffness::Components([1.0, 2.0, 3.0]));
    assert!(find_rigid_body_modes(&held).expect("sound supports").is_none());
}

/// Truth: a semi-infinite beam on a foundation under an end load P deflects at its end by 2 P lambda / (k b) (Hetenyi 1946). Here
/// lambda^4 = k b / (4 E I), with the height h, the width b, the bending stiffness E I and the foundation stiffness k per area.
/// The deflection first vanishes at lambda x = pi / 2. Shear deformation and the division into 60 elements each change the
/// deflection by a fraction of about (lambda h)^2 = 0.0025. The tolerance is therefore 1 %.
#[test]
fn a_beam_on_a_foundation() {
    let (h, b, e) = (1.0, 1.0, 1000.0_f64);
    let lambda = 0.05 / h;
    let k = 4.0 * e * (b * h * h * h / 12.0) * f64::powi(lambda, 4) / b;
    let mesh = block(Hex8, [60, 1, 1], [6.0 / lambda, b, h], |x| x);
    let material = Stiffness::isotropic(e, 0.0).expect("admissible");
    let guide = Support {
        group: "y0".into(),
        components: [false, true, false],
        value: [0.0; 3],
        gradient: [[0.0; 3]; 3],
    };
    let mut beam = spec(mesh, material, Enhanced, vec![guide]);
    beam.foundations = bedded("z0", FoundationStiffness::Normal(k));
    let force = 1e-3;
    beam.tractions = vec![("x0".into(), [0.0, 0.0, -force / (b * h)])];
    let (body, u) = solved(beam);
    let deflection = |x: f64| {
        let at = |(point, u): (&[f64; 3], &[f64; 3])| (point[0] == x && point[2] == 0.0).then_some(u[2]);
        body.model().mesh().points.iter().zip(&u).find_map(at).expect("a node")
    };
    let wanted = -2.0 * force * lambda / (k * b);
    assert!((deflection(0.0) / wanted - 1.0).abs() < 1e-2, "{} {wanted}", deflection(0.0));
    assert!(deflection(30.0) * wanted > 0.0 && deflection(32.0) * wanted < 0.0);
}

/// Truth: a displacement that is linear on the boundary is linear inside (patch test). Row i of the gradient belongs to
/// displacement component i. The tolerance is 1e-12 of the largest displacement.
#[test]
fn a_far_strain_field() {
    let gradient = [[1e-3, 2e-4, -3e-4], [5e-4, -7e-4, 1e-4], [2e-4, 4e-4, 6e-4]];
    let value = [0.01, -0.02, 0.03];
    let supports = ["x0", "x1", "y0", "y1", "z0", "z1"].map(|group| Support {
        group: group.into(),
        components: ALL,
        value,
        gradient,
    });
    for (kind, formulation) in ELEMENTS {
        let mesh = block(kind, [3, 4, 3], [1.0; 3], rough);
        let (body, u) = solved(spec(mesh, rotated_orthotropic(), formulation, supports.to_vec()));
        let points = &body.model().mesh().points;
        let wanted: Vec<[f64; 3]> = points
            .iter()
            .map(|x| std::array::from_fn(|i| value[i] + (0..3).map(|j| gradient[i][j] * x[j]).sum::<f64>()))
            .collect();
        assert!(largest_difference(&u, &wanted) < 1e-12 * 0.03);
    }
}

/// Truth: half of a symmetric body has the same displacement as the whole body, to 1e-11 of the largest displacement. Curved and
/// oblique surfaces are refused as planes of symmetry.
#[test]
fn a_plane_of_symmetry() {
    let load = |mesh, supports| {
        let mut body = spec(mesh, isotropic(), Enhanced, supports);
        body.body_force = [0.0, 0.0, -2.0];
        body.pressures = vec![("y1".into(), 5.0)];
        solved(body)
    };
    let (whole, u) =
        load(block(Hex8, [6, 3, 3], [2.0, 1.0, 1.0], |[x, y, z]| [x - 1.0, y, z]), vec![clamp("z0")]);
    let half = block(Hex8, [3, 3, 3], [1.0; 3], |x| x);
    let component = symmetry_component(&half, "x0").expect("a plane");
    assert_eq!(component, 0);
    let mut components = [false; 3];
    components[component] = true;
    let mirror = Support { group: "x0".into(), components, value: [0.0; 3], gradient: [[0.0; 3]; 3] };
    let (half, v) = load(half, vec![clamp("z0"), mirror]);
    let largest = u.iter().flatten().fold(0.0f64, |m, c| m.max(c.abs()));
    for (x, v) in half.model().mesh().points.iter().zip(&v) {
        let near = |p: &[f64; 3]| (0..3).all(|c| (p[c] - x[c]).abs() < 1e-9);
        let node = whole.model().mesh().points.iter().position(near).expect("the same point");
        (0..3).for_each(|c| assert!((u[node][c] - v[c]).abs() < 1e-11 * largest));
    }
    let turned = block(Hex8, [2; 3], [1.0; 3], |[x, y, z]| [0.8 * x - 0.6 * y, 0.6 * x + 0.8 * y, z]);
    let message = symmetry_component(&turned, "x1").expect_err("an oblique plane").to_string();
    assert!(message.contains("(0.8000, 0.6000, 0.0000)") && message.contains("rotate the mesh"), "{message}");
    let bent = symmetry_component(&block(Hex8, [2; 3], [1.0; 3], rough), "z1").expect_err("bent").to_string();
    assert!(bent.contains("not plane"), "{bent}");
}

/// Truth: springs must have a positive stiffness, and the group of a foundation must exist.
#[test]
fn refuses_wrong_foundations() {
    for (group, bedding, words) in [
        ("z0", FoundationStiffness::Normal(-1.0), ["z0", "positive"]),
        ("z0", FoundationStiffness::Components([0.0; 3]), ["z0", "positive"]),
        ("ground", FoundationStiffness::Normal(1.0), ["ground", "z0"]),
    ] {
        let mut body = spec(block(Hex8, [2; 3], [1.0; 3], |x| x), isotropic(), Enhanced, vec![]);
        body.foundations = bedded(group, bedding);
        let message = FeModel::new(body).err().expect("a refusal").to_string();
        assert!(words.iter().all(|word| message.contains(word)), "{message}");
    }
}
