//! Stress on the contact surface under known tractions: Hertz and full sliding.

use std::f64::consts::PI;

use orthowear::body::{ElasticBody, ErrorEstimation, FeBody, Loading};
use orthowear::element::ElementKind::{Hex8, Hex20};
use orthowear::fem::{FeSpec, Foundation, FoundationStiffness, HexFormulation, Support};
use orthowear::frame::ContactFrame;
use orthowear::geometry::Side;
use orthowear::material::Stiffness;
use orthowear::output::body_fields::{BodyOutput, RecoveryLocation, surface_grid};
use orthowear::output::frame_fields::FrameMesh;
use orthowear::output::vtu::{ArrayValues, DataArray, UnstructuredGrid};

use crate::fem_bodies::{clamp, spec};
use crate::fem_meshes::block;

/// Elements along the contact radius, which is 1.
const FINE: usize = 8;
/// Number of elements of uniform size from the centre to 1.5 radii.
const UNIFORM: usize = 3 * FINE / 2;
/// Number of elements of growing size from 1.5 to ten radii.
const GROWING: usize = 7;

/// Coordinate of mesh line `i`, counted from the centre.
fn line(i: f64) -> f64 {
    let h = 1.0 / FINE as f64;
    let beyond = i - UNIFORM as f64;
    if beyond <= 0.0 {
        return h * i;
    }
    // Bisection for the growth ratio that puts the last line at 10.
    let length = |q: f64, n: f64| h * q * (q.powf(n) - 1.0) / (q - 1.0);
    let (mut low, mut high) = (1.001, 5.0);
    for _ in 0..80 {
        let middle = 0.5 * (low + high);
        if length(middle, GROWING as f64) < 8.5 { low = middle } else { high = middle }
    }
    1.5 + length(low, beyond)
}

/// Contact surface with recovered stress of a quarter (x, y >= 0) of a block, ν = 0.3. The block measures ten contact radii from
/// the centre. `traction(r)` is the traction on body 2 (x, y, n) at the radius r in the unit circle. `planes` are the components
/// fixed on the planes x = 0 and y = 0.
fn quarter(planes: [[bool; 3]; 2], traction: impl Fn(f64) -> [f64; 3]) -> UnstructuredGrid {
    let n = UNIFORM + GROWING;
    let size = [n as f64; 3];
    let mesh = block(Hex8, [n; 3], size, |[i, j, k]| [line(i), line(j), -line(n as f64 - k)]);
    let plane = |group: &str, components| Support {
        group: group.into(),
        components,
        value: [0.0; 3],
        gradient: [[0.0; 3]; 3],
    };
    let supports = vec![plane("x0", planes[0]), plane("y0", planes[1]), clamp("z0")];
    let steel = Stiffness::isotropic(210e3, 0.3).unwrap();
    let frame = ContactFrame::grid([0.75; 2], [2 * UNIFORM; 2], [0.75; 2], 0.0).unwrap();
    let spec = spec(mesh, steel, HexFormulation::Enhanced, supports);
    let mesh = spec.mesh.clone();
    let body = FeBody::new(spec, "z1", Side::Lower, &frame).unwrap();
    let cells: Vec<[f64; 3]> = frame.centers.iter().map(|c| cell_mean([c.x, c.y], &traction)).collect();
    let planes: Vec<f64> = (0..3).flat_map(|k| cells.iter().map(move |t| t[k])).collect();
    let mut field = body.recover(Loading::of_contact(&planes)).unwrap();
    field.stress = body
        .recover_stress(Loading::of_contact(&planes), &field.displacement, ErrorEstimation::Skip)
        .unwrap();
    let contact_nodes = mesh.group_nodes("z1").unwrap();
    let location = RecoveryLocation::MeshNodes { mesh: &mesh, contact_nodes: &contact_nodes };
    let output = BodyOutput { side: Side::Lower, body: &body, location, first_load: 0 };
    surface_grid(&output, &frame, &FrameMesh::new(&frame), &field, &cells).unwrap()
}

/// Mean traction of a cell from 8 x 8 sampling points. The traction is zero outside the unit circle.
fn cell_mean(center: [f64; 2], traction: &impl Fn(f64) -> [f64; 3]) -> [f64; 3] {
    let h = 1.5 / (2 * UNIFORM) as f64;
    let mut mean = [0.0; 3];
    for (i, j) in (0..64).map(|k| (k / 8, k % 8)) {
        let at = |c: f64, i: usize| c + h * ((i as f64 + 0.5) / 8.0 - 0.5);
        let r = at(center[0], i).hypot(at(center[1], j));
        if r < 1.0 {
            traction(r).iter().zip(&mut mean).for_each(|(t, sum)| *sum += t / 64.0);
        }
    }
    mean
}

/// Stress components xx, yy, zz and the array "sigma_tangential" at the node nearest to (x, 0, 0).
fn at(grid: &UnstructuredGrid, x: f64) -> [f64; 4] {
    let distance = |p: &[f64; 3]| (p[0] - x).hypot(p[1]).hypot(p[2]);
    let order = |a: &usize, b: &usize| distance(&grid.points[*a]).total_cmp(&distance(&grid.points[*b]));
    let node = (0..grid.points.len()).min_by(order).unwrap();
    let reals = |name: &str| {
        let array: &DataArray = grid.point_data.iter().find(|array| array.name == name).unwrap();
        let ArrayValues::Float64(values) = &array.values else { panic!("{name} is not real") };
        values.clone()
    };
    let stress = reals("stress");
    [stress[6 * node], stress[6 * node + 1], stress[6 * node + 2], reals("sigma_tangential")[node]]
}

/// Stresses at the nodes of the surface "z1" of a slab of 3 x 2 x 1. The slab can expand freely in its plane. `change` adds loads
/// to the slab.
fn slab(change: impl FnOnce(&mut FeSpec)) -> Vec<[f64; 6]> {
    let lengths = [3.0, 2.0, 1.0];
    let mesh = block(Hex20, [3, 2, 2], lengths, |x| x);
    let rolling = |group: &str, component: usize| Support {
        group: group.into(),
        components: [0, 1, 2].map(|c| c == component),
        value: [0.0; 3],
        gradient: [[0.0; 3]; 3],
    };
    let supports = vec![rolling("x0", 0), rolling("y0", 1), rolling("z0", 2)];
    let material = Stiffness::isotropic(1000.0, 0.3).unwrap();
    let mut spec = spec(mesh, material, HexFormulation::Enhanced, supports);
    change(&mut spec);
    let frame = ContactFrame::grid([1.5, 1.0], [3, 2], [1.5, 1.0], 0.0).unwrap();
    let body = FeBody::new(spec, "z1", Side::Lower, &frame).unwrap();
    let loading = Loading { tractions: &[0.0; 18], amplitudes: &[1.0] };
    let displacement = body.recover(loading).unwrap().displacement;
    let field = body.recover_stress(loading, &displacement, ErrorEstimation::Skip).unwrap().unwrap();
    let on_top = body.condensed().model().mesh().group_nodes("z1").unwrap();
    assert_eq!(field.contact.len(), on_top.len());
    field.contact.iter().map(|point| point.stress(&[0.0; 3])).collect()
}

/// Truth: equilibrium without contact. On the face, a pressure p gives σ_zz = -p, and a traction (0, 0, t) gives σ_zz = t. In the
/// last two cases the face rests on a foundation of stiffness k, and the opposite face moves by w towards the foundation. A slab
/// of height L and modulus E then carries σ_zz = -w / (1/k + L/E). The stresses are exact to rounding, because the elements
/// represent linear displacements. The factorisation loses at most six digits.
#[test]
fn loads_on_contact_faces_are_in_their_stress() {
    let pressed = |spec: &mut FeSpec| spec.pressures.push(("z1".into(), 2.5));
    let pulled = |spec: &mut FeSpec| spec.tractions.push(("z1".into(), [0.0, 0.0, 0.7]));
    let bedded = |stiffness: FoundationStiffness| {
        move |spec: &mut FeSpec| {
            spec.foundations.push(Foundation { group: "z1".into(), stiffness });
            spec.supports[2].value = [0.0, 0.0, 0.01];
        }
    };
    let bed = -0.01 / (1.0 / 400.0 + 1.0 / 1000.0);
    let cases = [
        (slab(pressed), -2.5),
        (slab(pulled), 0.7),
        (slab(|spec| (pressed(spec), pulled(spec)).0), -1.8),
        (slab(bedded(FoundationStiffness::Normal(400.0))), bed),
        (slab(bedded(FoundationStiffness::Components([0.0, 0.0, 400.0]))), bed),
    ];
    for (points, wanted) in cases {
        assert!(!points.is_empty());
        for stress in points {
            let exact = [0.0, 0.0, wanted, 0.0, 0.0, 0.0];
            let error = stress.iter().zip(exact).map(|(s, e)| (s - e).abs()).fold(0.0, f64::max);
            assert!(error < 1e-9, "{stress:?} {wanted}");
        }
    }
}

/// Truth: Hertz' pressure with p0 = 1 on the unit circle (Johnson 1985, eqs. 3.42-3.45). At the centre σ_xx = -(1 + 2ν)/2.
/// Outside the circle there is the radial tension (1 - 2ν)/(3 r²), which is largest at the edge.
///
/// Tolerances: a block of ten radii deforms differently from a half-space, which changes the stress by some 1e-2. The strain at a
/// node is the mean of the adjacent elements, which smooths the kink of the stress at the edge. The recovered stress therefore
/// has its peak one element, h = 1/8, outside the edge. There the tension is smaller by the fraction 1 - 1/(1 + h)², a fifth.
#[test]
fn hertz_radial_tension_beside_the_edge() {
    let grid = quarter([[true, false, false], [false, true, false]], |r| [0.0, 0.0, (1.0 - r * r).sqrt()]);
    let (centre, edge) = (at(&grid, 0.0), [1.0, 1.125, 1.25, 1.5].map(|x| at(&grid, x)));
    println!("centre {centre:.4?}, edge and beyond {edge:.4?}");
    assert!((centre[0] + 0.8).abs() < 0.02 && (centre[1] - centre[0]).abs() < 0.01);
    // The pressure near the centre is 1 - r²/2, and the cells at the centre extend to x = y = 1/16.
    assert!((centre[2] + 1.0).abs() < 0.005);
    for (found, r) in edge[1..].iter().zip([1.125f64, 1.25]) {
        let exact = 0.4 / (3.0 * r * r);
        assert!((found[3] - exact).abs() < 0.15 * 0.4 / 3.0, "{found:?}, exact {exact}");
        assert!(found[2].abs() < 1e-14, "free surface");
    }
}

/// Truth: full sliding with the traction q = p, which is a friction coefficient of 1. (The stress is proportional to the
/// coefficient.) Inside the contact, the stress along the sliding direction is ∓π (4 + ν) x / 8 (Hamilton and Goodman 1966;
/// Johnson 1985, eq. 7.31). This stress is antisymmetric in x, so a quarter of the block suffices.
///
/// Tolerances: 1 % up to two elements inside the edge. Recovery smooths the stress at the edge. The recovered peak lies within
/// one element, h = 1/8, of the edge. Relative to the exact peak, the exact stress one element inside the edge is 1 - h. The
/// recovered peak is at least 0.95 (1 - h), because the element at the edge cannot represent the kink of the strain.
#[test]
fn sliding_stress_at_the_trailing_edge() {
    // The tractions act on body 2 and oppose its motion along +x.
    let grid = quarter([[false, true, true], [false, true, false]], |r| [-(1.0 - r * r).sqrt(), 0.0, 0.0]);
    let exact = -PI * 4.3 / 8.0;
    let found: Vec<f64> = (0..=12).map(|i| at(&grid, i as f64 / 8.0)[0]).collect();
    println!("along x {found:.4?}, at the edge {exact:.4}");
    for i in [2, 4, 6] {
        assert!((found[i] - exact * i as f64 / 8.0).abs() < 0.01 * exact.abs(), "{i}: {}", found[i]);
    }
    let peak = (0..found.len()).min_by(|&a, &b| found[a].total_cmp(&found[b])).unwrap();
    let share = found[peak] / exact;
    assert!((7..=9).contains(&peak) && share > 0.95 * 0.875 && share < 1.0, "{peak}: {share}");
}
