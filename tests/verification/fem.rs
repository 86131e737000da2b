//! Finite elements against exact fields: patch tests, bars, rigid-body motions, loads. Cases are those of the catalogue
//! (docs/verification.md). Units are N, mm and MPa.

use nalgebra::{Matrix3, Vector3, Vector6};
use orthowear::element::ElementKind::{self, Hex8, Tet4};
use orthowear::element::{Hex20, ShapeFunctions, Tet10};
use orthowear::fem::{FeModel, HexFormulation, StressRecovery};
use orthowear::material::Stiffness;
use orthowear::mesh::Mesh;

use super::fem_bodies::{ALL, ELEMENTS, clamp, isotropic, largest_difference, rotated_orthotropic, spec};
use super::fem_meshes::{add_cells, block, boundary_nodes, bulging, macneal_harder, prescribe, rough, wavy};

/// Displacement field of the constant strain `strain` (Voigt order, engineering shears) with an added rotation.
fn linear_field(strain: [f64; 6]) -> impl Fn([f64; 3]) -> [f64; 3] {
    let [xx, yy, zz, yz, xz, xy] = strain;
    let spin = 2e-4;
    let h =
        Matrix3::new(xx, xy / 2.0 + spin, xz / 2.0, xy / 2.0 - spin, yy, yz / 2.0, xz / 2.0, yz / 2.0, zz);
    move |x| (h * Vector3::from(x)).into()
}

/// Patch test: prescribes the field of [`linear_field`] on the whole boundary of `mesh`, and checks displacement, stress, energy
/// and reactions. `volume` is the volume of the mesh. `tolerance` is the relative tolerance of stress and energy.
pub fn patch_test(
    mut mesh: Mesh,
    stiffness: Stiffness,
    formulation: HexFormulation,
    strain: [f64; 6],
    volume: f64,
    tolerance: f64,
) {
    let field = linear_field(strain);
    let boundary = boundary_nodes(&mesh);
    let supports = prescribe(&mut mesh, &boundary, ALL, &field);
    let exact: Vec<[f64; 3]> = mesh.points.iter().map(|&x| field(x)).collect();
    let sigma = stiffness.voigt() * Vector6::from(strain);
    let energy = 0.5 * volume * sigma.dot(&Vector6::from(strain));
    let body = FeModel::new(spec(mesh, stiffness, formulation, supports)).unwrap().condense(&[]).unwrap();
    let model = body.model();
    let u = body.contact_free_displacement();
    let scale = exact.iter().flatten().fold(0.0f64, |m, v| m.max(v.abs()));
    assert!(
        largest_difference(u, &exact) < 1e-12 * scale,
        "displacement {}",
        largest_difference(u, &exact) / scale
    );
    let stress = StressRecovery::new(model).unwrap().stress(model, u).unwrap();
    let error = largest_difference(&stress, &vec![sigma.into(); stress.len()]) / sigma.amax();
    assert!(error < tolerance, "stress {error:e}");
    assert!((model.strain_energy(u).unwrap() / energy - 1.0).abs() < tolerance);
    let reactions = model.reactions(u).unwrap();
    let largest = reactions.iter().flatten().fold(0.0f64, |m, v| m.max(v.abs()));
    for c in 0..3 {
        let sum: f64 = reactions.iter().map(|r| r[c]).sum();
        assert!(sum.abs() < 1e-12 * largest * reactions.len() as f64, "reaction sum {sum:e}");
    }
}

/// Truth: case `patch-macneal-harder` (MacNeal and Harder 1985). A strain of 1e-3 in all six components gives normal stresses of
/// 2000 and shear stresses of 400. Every consistent element represents this strain. The tolerance covers rounding.
#[test]
fn patch_macneal_harder() {
    let strain = [1e-3, 1e-3, 1e-3, 1e-3, 1e-3, 1e-3];
    let stiffness = Stiffness::isotropic(1e6, 0.25).unwrap();
    let sigma = stiffness.voigt() * Vector6::from(strain);
    let published = Vector6::new(2000.0, 2000.0, 2000.0, 400.0, 400.0, 400.0);
    assert!((sigma - published).amax() < 1e-9);
    // One of the seven elements is folded at a corner, but at no integration point.
    let quality = orthowear::mesh::quality::check(&macneal_harder()).expect("a mesh that can be computed");
    assert!(
        quality.folded_at_nodes == 1
            && quality.warnings()[0].text.contains("1 of 7 solid elements are folded")
    );
    for formulation in HexFormulation::ALL {
        patch_test(macneal_harder(), stiffness.clone(), formulation, strain, 1.0, 1e-12);
    }
}

/// Truth: case `patch-orthotropic-rotated`. For a constant strain in a rotated orthotropic material, an independent computation
/// gives the stresses and the energy density 0.03919764, to 7 digits. The tolerance of the elements covers rounding.
#[test]
fn patch_orthotropic_rotated() {
    let strain = [0.001, 0.0005, -0.0003, 0.0004, -0.0002, 0.0005];
    let stiffness = rotated_orthotropic();
    let sigma = stiffness.voigt() * Vector6::from(strain);
    let published = Vector6::new(66.07146, 16.66125, 30.78964, -12.26186, -38.75725, 20.76674);
    assert!((sigma - published).amax() < 1e-5);
    assert!((0.5 * sigma.dot(&Vector6::from(strain)) - 0.03919764).abs() < 1e-8);
    for (kind, formulation) in ELEMENTS {
        let mesh = block(kind, [3, 3, 3], [1.0, 1.0, 1.0], wavy);
        patch_test(mesh, stiffness.clone(), formulation, strain, 1.0, 1e-12);
        // In this mesh, inner nodes are moved in all three directions.
        let mesh = block(kind, [2, 2, 2], [1.0, 1.0, 1.0], bulging);
        patch_test(mesh, stiffness.clone(), formulation, strain, 1.0, 1e-12);
    }
    for formulation in HexFormulation::ALL {
        patch_test(macneal_harder(), stiffness.clone(), formulation, strain, 1.0, 1e-12);
    }
}

/// Truth: case `str-aspect-ratio`. Elements pass the patch test at an aspect ratio of 1000. The case allows errors of 1e-8. This
/// test allows 1e-11 for hex8 and tet4 and 3e-11 for other elements. These tolerances exceed rounding errors of 1e-16, because
/// strains are differences of displacements a thousand times larger.
#[test]
fn patch_slender() {
    let strain = [0.001, 0.0005, -0.0003, 0.0, 0.0, 0.0];
    for (kind, formulation) in ELEMENTS {
        let mesh = block(kind, [3, 3, 3], [1000.0, 1000.0, 1.0], |x| x);
        let tolerance = if matches!(kind, Hex8 | Tet4) { 1e-11 } else { 3e-11 };
        patch_test(mesh, rotated_orthotropic(), formulation, strain, 1e6, tolerance);
    }
}

/// Truth: case `uniaxial-rotated-orthotropic`, from an independent computation with 7 digits. If sigma_xx = 100 MPa is the only
/// stress, the strain is 100 MPa times the first column of the compliance in mesh axes. The apparent modulus is 14390.32 MPa. The
/// tolerance of the elements covers rounding of a solve with condition number 1e6.
#[test]
fn uniaxial_rotated_orthotropic() {
    let published = [0.006949115, -0.001998917, -0.002226602, 0.0001867743, 0.005359313, -0.002276476];
    let stiffness = rotated_orthotropic();
    let strain = stiffness.voigt().try_inverse().unwrap().column(0) * 100.0;
    assert!((Vector6::from(published) - strain).amax() < 1e-9);
    for (kind, formulation) in ELEMENTS {
        let mut mesh = block(kind, [4, 2, 2], [3.0, 1.0, 1.0], |x| x);
        let corner = |x: [f64; 3]| mesh.points.iter().position(|p| *p == x).unwrap();
        let (origin, along_x, along_y) = (corner([0.0; 3]), corner([3.0, 0.0, 0.0]), corner([0.0, 1.0, 0.0]));
        let zero = |_| [0.0; 3];
        let mut supports = prescribe(&mut mesh, &[origin], ALL, zero);
        supports.extend(prescribe(&mut mesh, &[along_x], [false, true, true], zero));
        supports.extend(prescribe(&mut mesh, &[along_y], [false, false, true], zero));
        let mut spec = spec(mesh, stiffness.clone(), formulation, supports);
        spec.tractions = vec![("x1".into(), [100.0, 0.0, 0.0]), ("x0".into(), [-100.0, 0.0, 0.0])];
        let body = FeModel::new(spec).unwrap().condense(&[]).unwrap();
        let u = body.contact_free_displacement();
        assert!((u[along_x][0] / 3.0 / strain[0] - 1.0).abs() < 1e-9);
        assert!((u[along_y][1] / strain[1] - 1.0).abs() < 1e-9);
        let stress = StressRecovery::new(body.model()).unwrap().stress(body.model(), u).unwrap();
        let wanted = vec![[100.0, 0.0, 0.0, 0.0, 0.0, 0.0]; stress.len()];
        assert!(largest_difference(&stress, &wanted) < 1e-7);
        assert!(largest_difference(&body.model().reactions(u).unwrap(), &vec![[0.0; 3]; u.len()]) < 1e-9);
    }
}

/// Truth: rigid-body motions R cause no internal forces: K R = 0 with the stiffness matrix K. The tolerance covers rounding,
/// relative to the largest diagonal entry of K.
#[test]
fn rigid_motions_cause_no_forces() {
    let graded = |x: [f64; 3]| x.map(|c| (1000f64.powf(c) - 1.0) / 999.0);
    for (kind, formulation) in ELEMENTS {
        for mesh in [block(kind, [4, 4, 4], [1.0; 3], rough), block(kind, [4, 4, 4], [1.0; 3], graded)] {
            let points = mesh.points.clone();
            let model =
                FeModel::new(spec(mesh, rotated_orthotropic(), formulation, vec![clamp("x0")])).unwrap();
            let stiffest = model.stiffness().diagonal().into_iter().fold(0.0, f64::max);
            for mode in 0..6 {
                let motion = |x: &[f64; 3]| -> [f64; 3] {
                    let mut t = Vector3::zeros();
                    t[mode % 3] = 1.0;
                    if mode < 3 { t.into() } else { t.cross(&Vector3::from(*x)).into() }
                };
                let u: Vec<[f64; 3]> = points.iter().map(motion).collect();
                let forces = model.internal_forces(&u).unwrap();
                assert!(largest_difference(&forces, &vec![[0.0; 3]; u.len()]) < 1e-12 * stiffest);
            }
        }
    }
}

/// Truth: for nu = 0 the top of a column of height L under the weight rho g per volume moves by -rho g L^2 / (2 E) = -0.0005.
/// Linear elements are exact at the nodes of a column. The tolerance covers rounding.
#[test]
fn self_weight_column() {
    for formulation in HexFormulation::ALL {
        let mesh = block(Hex8, [2, 2, 10], [1.0, 1.0, 10.0], |x| x);
        let top = mesh.points.iter().position(|x| *x == [1.0, 1.0, 10.0]).unwrap();
        let mut spec = spec(mesh, Stiffness::isotropic(1000.0, 0.0).unwrap(), formulation, vec![clamp("z0")]);
        spec.body_force = [0.0, 0.0, -0.01];
        let body = FeModel::new(spec).unwrap().condense(&[]).unwrap();
        let u = body.contact_free_displacement();
        assert!((u[top][2] + 0.0005).abs() < 1e-12 * 0.0005 * 1e2);
        let reactions = body.model().reactions(u).unwrap();
        let sum: f64 = reactions.iter().map(|r| r[2]).sum();
        assert!((sum - 0.1).abs() < 1e-12);
    }
}

/// Truth: a uniform pressure p loads each node of a rectangular face with a quarter of the force on the face. Each node of a
/// triangular face carries a third (docs/theory-finite-elements.md). On a curved distorted closed surface the nodal forces
/// balance. If every node moves by its position vector x, these forces do the work -3 p V, with the volume V (Gauss's theorem).
/// The tolerance covers rounding.
#[test]
fn pressurised_faces() {
    for (kind, weight) in [(Hex8, 0.25), (Tet4, 1.0 / 3.0)] {
        let mesh = block(kind, [1, 1, 1], [2.0, 3.0, 1.0], |x| x);
        let mut spec = spec(mesh, isotropic(), HexFormulation::Enhanced, vec![clamp("z0")]);
        spec.pressures = vec![("z1".into(), 5.0)];
        let model = FeModel::new(spec).unwrap();
        let forces = model.loads().forces();
        let face_force = if kind == Hex8 { 30.0 } else { 15.0 };
        let sum: f64 = forces.iter().map(|f| f[2]).sum();
        assert!((sum + 30.0).abs() < 1e-13);
        for force in forces {
            let share = force[2] / (-face_force * weight);
            assert!([0.0, 1.0, 2.0].iter().any(|&n| (share - n).abs() < 1e-14), "{share}");
            assert!(force[0] == 0.0 && force[1] == 0.0);
        }
    }
    for kind in [Hex8, Tet4] {
        let mesh = block(kind, [3, 3, 3], [1.0; 3], rough);
        let points = mesh.points.clone();
        let mut pressed = spec(mesh, isotropic(), HexFormulation::Enhanced, vec![clamp("z0")]);
        let mut pulled = pressed.clone();
        pressed.pressures = ["x0", "x1", "y0", "y1", "z0", "z1"].map(|g| (g.into(), 2.0)).to_vec();
        pulled.body_force = [1.0, 0.0, 0.0];
        let (pressed, pulled) = (FeModel::new(pressed).unwrap(), FeModel::new(pulled).unwrap());
        let volume: f64 = pulled.loads().forces().iter().map(|f| f[0]).sum();
        let (mut balance, mut work) = (Vector3::zeros(), 0.0);
        for (force, x) in pressed.loads().forces().iter().zip(&points) {
            balance += Vector3::from(*force);
            work += Vector3::from(*force).dot(&Vector3::from(*x));
        }
        assert!(balance.norm() < 1e-13);
        assert!((work / (-2.0 * 3.0 * volume) - 1.0).abs() < 1e-13, "{work} {volume}");
    }
}

/// Truth: a bar of two layers with thicknesses L1, L2 and moduli E1, E2 shortens by p (L1/E1 + L2/E2) under the pressure p, for
/// nu = 0. The tolerance covers rounding.
#[test]
fn regions_have_their_own_stiffness() {
    let mut mesh = block(Hex8, [1, 1, 4], [1.0, 1.0, 4.0], |x| x);
    let cells: Vec<_> = mesh.volume_cells().collect();
    let upper = cells.into_iter().filter(|&c| mesh.points[mesh.cell_nodes(c)[0]][2] >= 3.0).collect();
    let tag = 99;
    mesh.groups.push(orthowear::mesh::PhysicalGroup { name: "upper".into(), dim: 3, tag, cells: upper });
    let top = mesh.group_nodes("z1").unwrap()[0];
    let soft = Stiffness::isotropic(500.0, 0.0).unwrap();
    let mut spec =
        spec(mesh, Stiffness::isotropic(1000.0, 0.0).unwrap(), HexFormulation::Enhanced, vec![clamp("z0")]);
    spec.regions.push((Some("upper".into()), soft.into()));
    spec.pressures = vec![("z1".into(), 10.0)];
    let body = FeModel::new(spec).unwrap().condense(&[]).unwrap();
    let shortening = -body.contact_free_displacement()[top][2];
    assert!((shortening / (10.0 * (3.0 / 1000.0 + 1.0 / 500.0)) - 1.0).abs() < 1e-12);
}

/// Truth: moving a mid-edge node along its straight edge does not change the shape of an element. Under a body force b per
/// volume, the cube of side 2 therefore carries 8 b, and the tetrahedron b / 6.
#[test]
fn elements_that_fold_at_a_node_keep_their_weight() {
    let cases = [
        (ElementKind::Hex20, Hex20::NODES.to_vec(), [8, 7], 0.75, 8.0),
        (ElementKind::Tet10, Tet10::NODES.to_vec(), [4, 3], 0.9, 1.0 / 6.0),
    ];
    for (kind, points, [node, last_corner], x, volume) in cases {
        let mut mesh = Mesh { source: "one".into(), points, ..Mesh::default() };
        mesh.points[node][0] = x;
        add_cells(&mut mesh, kind, "body", (0..kind.n_nodes()).collect());
        let corners: Vec<usize> = (0..=last_corner).collect();
        let supports = prescribe(&mut mesh, &corners, ALL, |_| [0.0; 3]);
        let mut spec = spec(mesh, isotropic(), HexFormulation::Standard, supports);
        spec.body_force = [0.3, -0.5, 2.0];
        let model = FeModel::new(spec).unwrap();
        for (c, force) in [0.3, -0.5, 2.0].into_iter().enumerate() {
            let sum: f64 = model.loads().forces().iter().map(|nodal| nodal[c]).sum();
            assert!(
                (sum / (force * volume) - 1.0).abs() < 1e-12,
                "{}: {sum} {}",
                kind.name(),
                force * volume
            );
        }
    }
}
