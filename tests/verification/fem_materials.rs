//! Directions of the material axes in all input forms, and windings and laminates against closed forms.

use std::sync::Arc;

use nalgebra::{Matrix3, Vector3};
use orthowear::element::ElementKind::Hex8;
use orthowear::fem::{ElementMaterials, FeModel, FeSpec, HexFormulation, Support, check_materials};
use orthowear::geometry::fibre_axes;
use orthowear::material::{
    ElementAxes, Orientation, PlacedMaterial, Ply, RegionMaterial, Winding, WoundLayer,
};
use orthowear::mesh::Mesh;

use crate::common::assert_order;

use super::crystals::{CFRP, cfrp_of_tables};
use super::fem_bodies::{clamp, largest_difference, spec};
use super::fem_meshes::{block, rough};

fn placed(orientation: Orientation) -> PlacedMaterial {
    PlacedMaterial { name: "cfrp".into(), stiffness: cfrp_of_tables(), expansion: None, orientation }
}

fn single(orientation: Orientation) -> RegionMaterial {
    RegionMaterial::Single(Box::new(placed(orientation)))
}

fn body(mesh: Mesh, placement: RegionMaterial, supports: Vec<Support>) -> FeSpec {
    let mut body = spec(mesh, cfrp_of_tables(), HexFormulation::Enhanced, supports);
    body.regions = vec![(None, placement)];
    body
}

/// Orientation given by two directions for each solid element. `axes` returns the material axes, as columns, for the tag of an
/// element.
fn by_element(mesh: &Mesh, axes: impl Fn(u64) -> Matrix3<f64>) -> Orientation {
    let mut table = ElementAxes::new("the test");
    for cell in mesh.volume_cells() {
        let (tag, axes) = (mesh.tag(cell), axes(mesh.tag(cell)));
        // Directions need neither unit length nor orthogonality.
        let second = axes.column(1) * 0.5 + axes.column(0) * 0.2;
        table.add(tag, (axes.column(0) * 3.0).into(), Some(second.into())).unwrap();
    }
    Orientation::PerElement(Arc::new(table))
}

/// Truth: a fibre direction gives the same stiffness in all input forms. The tolerance of 1e-14 of the largest entry covers
/// rounding in the normalisation of the direction.
#[test]
fn one_direction_is_the_same_in_every_way() {
    let (tilt, azimuth) = (0.0f64, 0.35f64);
    let axes = fibre_axes(tilt, azimuth);
    let mesh = block(Hex8, [3, 2, 2], [1.0; 3], rough);
    let truth = cfrp_of_tables().rotated(&axes);
    let mut only_first = ElementAxes::new("the test");
    mesh.volume_cells()
        .for_each(|c| only_first.add(mesh.tag(c), axes.column(0).into_owned().into(), None).unwrap());
    let uniform = Orientation::Uniform(axes);
    let ways = [
        single(uniform.clone()),
        single(by_element(&mesh, |_| axes)),
        single(Orientation::PerElement(Arc::new(only_first))),
        RegionMaterial::Layup(vec![Ply { z_range: [-1.0, 3.0], material: placed(uniform) }]),
    ];
    for way in ways {
        let spec = body(mesh.clone(), way, vec![clamp("z0")]);
        assert!(check_materials(&spec).unwrap().iter().all(|f| f.errors.is_empty() && f.notes.is_empty()));
        let regions = ElementMaterials::new(&spec).unwrap();
        for i in 0..regions.n_elements() {
            let error = (regions.stiffness(i) - truth.voigt()).amax() / truth.voigt().amax();
            assert!(error < 1e-14, "{error:e}");
            assert_eq!(regions.material(i).name, "cfrp");
        }
    }
}

/// Truth: a body that is rotated with its loads and material directions has the rotated displacement. The tolerance covers rounding
/// in the factorisation.
#[test]
fn a_turned_body_with_turned_directions_gives_the_turned_answer() {
    let turn = fibre_axes(0.6, -1.2);
    let direction = |tag: u64| fibre_axes(0.3 * tag as f64, 0.7 * tag as f64);
    let mesh = block(Hex8, [3, 2, 3], [1.0; 3], rough);
    let mut turned = mesh.clone();
    turned.points.iter_mut().for_each(|x| *x = (turn * Vector3::from(*x)).into());
    let force = Vector3::new(3.0, -2.0, 5.0);
    let solve = |mesh: Mesh, orientation: Orientation, force: Vector3<f64>| {
        let mut spec = body(mesh, single(orientation), vec![clamp("z0")]);
        spec.body_force = force.into();
        FeModel::new(spec).unwrap().condense(&[]).unwrap().contact_free_displacement().to_vec()
    };
    let u = solve(mesh.clone(), by_element(&mesh, direction), force);
    let turned_directions = by_element(&turned, |tag| turn * direction(tag));
    let v = solve(turned, turned_directions, turn * force);
    let expected: Vec<[f64; 3]> = u.iter().map(|u| (turn * Vector3::from(*u)).into()).collect();
    let scale = expected.iter().flatten().fold(0.0f64, |m, x| m.max(x.abs()));
    assert!(
        largest_difference(&v, &expected) < 1e-10 * scale,
        "{:e}",
        largest_difference(&v, &expected) / scale
    );
}

/// Radial displacement of the inner wall of a cylindrically orthotropic tube with radii a < b under internal pressure in plane
/// strain.
///
/// # Source
/// Lekhnitskii, Theory of Elasticity of an Anisotropic Body (1963), section 25: the radial stress is sigma_r = A r^(k-1) + B
/// r^(-k-1), the hoop stress sigma_t = k (A r^(k-1) - B r^(-k-1)). Here k^2 = b_rr / b_tt. In plane strain, the compliances s_ij
/// become b_ij = s_ij - s_iz s_jz / s_zz. The pressures at a and b determine A and B.
fn lekhnitskii(pressure: f64, [a, b]: [f64; 2]) -> f64 {
    // Axes 1, 2, 3 = hoop, axial, radial.
    let [s_tt, s_zz, s_rr] = [1.0 / CFRP.e1, 1.0 / CFRP.e2, 1.0 / CFRP.e3];
    let [s_tz, s_tr, s_zr] = [-CFRP.nu12 / CFRP.e1, -CFRP.nu13 / CFRP.e1, -CFRP.nu23 / CFRP.e2];
    let (b_tt, b_rr) = (s_tt - s_tz * s_tz / s_zz, s_rr - s_zr * s_zr / s_zz);
    let b_tr = s_tr - s_tz * s_zr / s_zz;
    let k = (b_rr / b_tt).sqrt();
    // sigma_r(a) = -pressure and sigma_r(b) = 0. The second condition gives B = -A b^(2k).
    let power = |r: f64, sign: f64| r.powf(sign * k - 1.0);
    let amplitude = -pressure / (power(a, 1.0) - b.powf(2.0 * k) * power(a, -1.0));
    let hoop = k * amplitude * (power(a, 1.0) + b.powf(2.0 * k) * power(a, -1.0));
    a * (b_tt * hoop - b_tr * pressure)
}

/// Truth: [`lekhnitskii`] for a tube with hoop fibres and radii 1 and 2. The error is of second order in the element size between
/// n = 4, 8 and 16 cells, and below 0.5 % for n = 16. A table with the axes of every element gives the same displacement to
/// rounding.
#[test]
fn hoop_wound_tube_under_internal_pressure() {
    let (radii, pressure) = ([1.0, 2.0], 100.0);
    let exact = lekhnitskii(pressure, radii);
    let winding = |degrees: f64| {
        let layers = vec![WoundLayer { radii: [0.0, f64::INFINITY], angle: degrees.to_radians() }];
        Orientation::Winding(Winding::new([0.0, 0.0, 1.0], [0.0; 3], layers).unwrap())
    };
    let tube = |n: usize| {
        block(Hex8, [n, n, 1], [1.0, 1.0, 0.1], |[r, t, z]| {
            let (s, c) = (t * std::f64::consts::FRAC_PI_2).sin_cos();
            [(1.0 + r) * c, (1.0 + r) * s, z]
        })
    };
    let hold = |group: &str, axis: usize| {
        let components = std::array::from_fn(|c| c == axis);
        Support { group: group.into(), components, value: [0.0; 3], gradient: [[0.0; 3]; 3] }
    };
    let solve = |mesh: Mesh, orientation: Orientation| {
        let supports = vec![hold("y0", 1), hold("y1", 0), hold("z0", 2), hold("z1", 2)];
        let inner = mesh.group_nodes("x0").unwrap();
        let points: Vec<Vector3<f64>> = inner.iter().map(|&node| mesh.points[node].into()).collect();
        let mut spec = body(mesh, single(orientation), supports);
        spec.pressures = vec![("x0".into(), pressure)];
        let body = FeModel::new(spec).unwrap().condense(&[]).unwrap();
        let radial = |(node, x): (&usize, &Vector3<f64>)| {
            let u = Vector3::from(body.contact_free_displacement()[*node]);
            (u.x * x.x + u.y * x.y) / x.x.hypot(x.y)
        };
        inner.iter().zip(&points).map(radial).sum::<f64>() / inner.len() as f64
    };
    let error = |n: usize| (solve(tube(n), winding(90.0)) / exact - 1.0).abs();
    let cells = [4, 8, 16];
    let errors = cells.map(error);
    assert_order(&errors, &cells, 1.8, "a wound tube");
    assert!(errors[2] < 5e-3, "{errors:?}");
    let mesh = tube(8);
    let axes = ElementMaterials::new(&body(mesh.clone(), single(winding(90.0)), vec![])).unwrap();
    let listed = by_element(&mesh, |tag| *axes.axes(tag as usize - 1));
    let (wound, listed) = (solve(tube(8), winding(90.0)), solve(mesh, listed));
    assert!((listed / wound - 1.0).abs() < 1e-12, "{listed} {wound}");
    let straight = solve(tube(8), Orientation::Uniform(Matrix3::identity()));
    assert!((straight / exact - 1.0).abs() > 0.5, "{straight} {exact}");
}

/// In-plane stiffness of a ply with its fibre at `angle` from x, in plane stress. Rows and columns are xx, yy, xy.
///
/// # Source
/// Jones, Mechanics of Composite Materials (1999), equations 2.61 and 2.85.
fn reduced_stiffness(angle: f64) -> Matrix3<f64> {
    let nu21 = CFRP.nu12 * CFRP.e2 / CFRP.e1;
    let share = 1.0 - CFRP.nu12 * nu21;
    let [q11, q12] = [CFRP.e1 / share, CFRP.nu12 * CFRP.e2 / share];
    let [q22, q66] = [CFRP.e2 / share, CFRP.g12];
    let (s, c) = angle.sin_cos();
    let (s2, c2) = (s * s, c * c);
    let cross = (q11 + q22 - 4.0 * q66) * s2 * c2 + q12 * (s2 * s2 + c2 * c2);
    let b16 = (q11 - q12 - 2.0 * q66) * s * c * c2 + (q12 - q22 + 2.0 * q66) * s * s2 * c;
    let b26 = (q11 - q12 - 2.0 * q66) * s * s2 * c + (q12 - q22 + 2.0 * q66) * s * c * c2;
    let b66 = (q11 + q22 - 2.0 * q12 - 2.0 * q66) * s2 * c2 + q66 * (s2 * s2 + c2 * c2);
    let q11 = |a: f64, b: f64| q11 * a * a + 2.0 * (q12 + 2.0 * q66) * s2 * c2 + q22 * b * b;
    Matrix3::new(q11(c2, s2), cross, b16, cross, q11(s2, c2), b26, b16, b26, b66)
}

/// Truth: classical lamination theory. Under a uniform in-plane strain, the mean stress of a laminate is the strain times the
/// thickness-weighted mean of its plies' reduced stiffnesses. The exact displacement is linear in each ply, so that the elements
/// represent it exactly. The tolerance covers rounding.
#[test]
fn laminates_have_the_stiffness_of_classical_lamination_theory() {
    let cross_ply = vec![(0.2, 0.0), (0.3, 90.0), (0.3, 90.0), (0.2, 0.0)];
    let quasi = vec![(0.25, 0.0), (0.25, 45.0), (0.25, -45.0), (0.25, 90.0)];
    for plies in [cross_ply, quasi] {
        let borders: Vec<f64> =
            plies.iter().scan(0.0, |z, ply| Some(std::mem::replace(z, *z + ply.0))).chain([1.0]).collect();
        let stretch = |[x, y, t]: [f64; 3]| {
            let i = ((t * 4.0) as usize).min(3);
            [x, y, borders[i] + (t * 4.0 - i as f64) * (borders[i + 1] - borders[i])]
        };
        let mesh = block(Hex8, [2, 2, 8], [2.0, 1.0, 1.0], stretch);
        let layup = plies.iter().zip(&borders).map(|((thickness, angle), &bottom)| Ply {
            z_range: [bottom, bottom + thickness],
            material: placed(Orientation::Uniform(fibre_axes(0.0, f64::to_radians(*angle)))),
        });
        let layup = RegionMaterial::Layup(layup.collect());
        let mean: Matrix3<f64> = plies
            .iter()
            .map(|(thickness, angle)| reduced_stiffness(f64::to_radians(*angle)) * *thickness)
            .sum();
        for (strain, column) in [([1e-3, 0.0, 0.0], 0), ([0.0, 1e-3, 0.0], 1), ([0.0, 0.0, 1e-3], 2)] {
            let stress = mean_stress(&mesh, &layup, strain);
            let expected = mean.column(column) * 1e-3;
            assert!((stress - expected).amax() < 1e-10 * expected.amax(), "{stress} {expected}");
        }
    }
}

/// Mean in-plane stresses (xx, yy, xy) of a box 2 x 1 x 1 whose sides follow a uniform strain. Each stress is the work of the
/// reactions on the displacement field of the corresponding unit strain, divided by the volume.
fn mean_stress(mesh: &Mesh, layup: &RegionMaterial, strain: [f64; 3]) -> Vector3<f64> {
    let field = |strain: [f64; 3], x: [f64; 3]| {
        [strain[0] * x[0] + 0.5 * strain[2] * x[1], strain[1] * x[1] + 0.5 * strain[2] * x[0]]
    };
    let mut mesh = mesh.clone();
    let mut sides: Vec<usize> =
        ["x0", "x1", "y0", "y1"].iter().flat_map(|g| mesh.group_nodes(g).unwrap()).collect();
    sides.sort_unstable();
    sides.dedup();
    let move_sides = |x: [f64; 3]| {
        let [u, v] = field(strain, x);
        [u, v, 0.0]
    };
    let mut supports = super::fem_meshes::prescribe(&mut mesh, &sides, [true, true, false], move_sides);
    supports.push(Support {
        group: "z0".into(),
        components: [false, false, true],
        value: [0.0; 3],
        gradient: [[0.0; 3]; 3],
    });
    let points = mesh.points.clone();
    let body = FeModel::new(body(mesh, layup.clone(), supports)).unwrap().condense(&[]).unwrap();
    let reactions = body.model().reactions(body.contact_free_displacement()).unwrap();
    let virtual_work = |strain: [f64; 3]| {
        let work = |(force, x): (&[f64; 3], &[f64; 3])| {
            let [u, v] = field(strain, *x);
            force[0] * u + force[1] * v
        };
        reactions.iter().zip(&points).map(work).sum::<f64>() / 2.0
    };
    Vector3::new(virtual_work([1.0, 0.0, 0.0]), virtual_work([0.0, 1.0, 0.0]), virtual_work([0.0, 0.0, 1.0]))
}

/// Truth: the numbers of elements outside the plies, or cut by a border between plies, counted by hand.
#[test]
fn plies_that_do_not_fit_the_mesh_are_found() {
    let mesh = || block(Hex8, [2, 2, 4], [1.0; 3], |x| x);
    let ply = |low: f64, high: f64| Ply {
        z_range: [low, high],
        material: placed(Orientation::Uniform(Matrix3::identity())),
    };
    let findings = |plies: Vec<Ply>| {
        check_materials(&body(mesh(), RegionMaterial::Layup(plies), vec![])).unwrap().remove(0)
    };
    let short = findings(vec![ply(0.0, 0.5), ply(0.5, 0.75)]);
    assert!(short.errors[0].contains("outside all plies (4 elements in all)"), "{short:?}");
    let thin = findings(vec![ply(0.0, 0.1), ply(0.1, 1.0)]);
    assert!(thin.errors[0].starts_with("ply 1 of 2, from 0.000000 to 0.100000, contains no"), "{thin:?}");
    let across = findings(vec![ply(0.0, 0.55), ply(0.55, 1.0)]);
    assert!(across.errors.is_empty());
    assert!(
        across.notes[0].starts_with("4 of 16 elements") && across.notes[0].contains("20.0 %"),
        "{across:?}"
    );
    let mut table = ElementAxes::new("fibres.csv");
    (1..=15).for_each(|tag| table.add(tag, [1.0, 0.0, 0.0], None).unwrap());
    let missing = body(mesh(), single(Orientation::PerElement(Arc::new(table))), vec![clamp("z0")]);
    let message = FeModel::new(missing).err().expect("a refusal").to_string();
    assert!(message.contains("element 16 of box: it has no fibre in fibres.csv"), "{message}");
}
