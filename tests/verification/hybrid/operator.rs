//! Operator of bodies with the near field of a half-space: invariants, windows, both sides of the frame, layers.

use std::sync::Arc;

use orthowear::bem::half_space::CrossBlocks::{Keep, SkipVanishing};
use orthowear::body::{ElasticBody, FeBody, HalfSpaceBody};
use orthowear::coupling::{Coupling, couple};
use orthowear::element::ElementKind::{Hex8, Hex27};
use orthowear::fem::{FeSpec, HexFormulation};
use orthowear::flexibility::Flexibility;
use orthowear::frame::{ContactFrame, Side};
use orthowear::material::{PlacedMaterial, Ply, RegionMaterial, Stiffness};

use super::blocks::{FRAME, body, cfrp, frame, hybrid, mesh};
use crate::common::steel;
use crate::fem_bodies::{clamp, spec};

fn random(n: usize) -> Vec<f64> {
    let mut state = 12_345_u64;
    (0..n)
        .map(|_| {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (state >> 11) as f64 / (1u64 << 52) as f64 - 1.0
        })
        .collect()
}

fn flexibility(spec: FeSpec, side: Side, frame: &ContactFrame) -> Arc<dyn Flexibility> {
    let contact = if side == Side::Lower { "z1" } else { "z0" };
    hybrid(spec, contact, side, frame).take_flexibility(SkipVanishing).unwrap().unwrap()
}

fn product(operator: &dyn Flexibility, tractions: &[f64]) -> Vec<f64> {
    let mut gap = vec![f64::NAN; tractions.len()];
    operator.apply(tractions, &mut gap);
    gap
}

fn apart(a: &[f64], b: &[f64]) -> f64 {
    let largest = |values: &mut dyn Iterator<Item = f64>| values.fold(0.0, f64::max);
    let difference = largest(&mut a.iter().zip(b).map(|(a, b)| (a - b).abs()));
    difference / largest(&mut b.iter().map(|b| b.abs()))
}

/// Truths: A S is symmetric, with the operator S and the diagonal matrix A of the cell areas. Direct sums and diagonal blocks
/// agree with products S p. The operator of a window has the rows and columns of the cells in the window.
#[test]
fn products_windows_and_entries() {
    let frame = frame(24);
    let operator = flexibility(body(Hex8, (3.0, 6, 2.0), &cfrp()), Side::Lower, &frame);
    let n = frame.n_cells();
    let (p, q) = (random(3 * n), random(6 * n)[3 * n..].to_vec());
    let (by_p, by_q) = (product(&*operator, &p), product(&*operator, &q));
    let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
    let (one, other) = (dot(&q, &by_p), dot(&p, &by_q));
    assert!((one - other).abs() < 1e-12 * dot(&p, &by_p), "{one} {other}");
    let mut normal = vec![0.0; n];
    operator.apply_normal(&p[2 * n..], &mut normal);
    let pressed: Vec<f64> = (0..3 * n).map(|k| if k < 2 * n { 0.0 } else { p[k] }).collect();
    assert!(apart(&normal, &product(&*operator, &pressed)[2 * n..]) < 1e-12);
    for cell in [0, 77, n - 1] {
        let direct = operator.direct_sum(cell, &p).unwrap();
        let found = [0, 1, 2].map(|c| by_p[c * n + cell]);
        assert!(apart(&direct, &found) < 1e-9, "{direct:?} {found:?}");
        let block = operator.diagonal_blocks()[cell];
        for c in 0..3 {
            let unit: Vec<f64> = (0..3 * n).map(|k| f64::from(u8::from(k == c * n + cell))).collect();
            let column = product(&*operator, &unit);
            let own = [0, 1, 2].map(|a| column[a * n + cell]);
            assert!(apart(block.column(c).as_slice(), &own) < 1e-11, "{cell}");
        }
    }
    let origin = [5, 3];
    let window = operator.restriction_at(operator.restrict([11, 9], 1).unwrap(), origin, 1);
    let cells = window.grid().unwrap();
    let m = cells[0] * cells[1];
    let place = |k: usize| k / m * n + (origin[0] + k % m / cells[1]) * 24 + origin[1] + k % m % cells[1];
    let inside = random(3 * m);
    let mut all = vec![0.0; 3 * n];
    inside.iter().enumerate().for_each(|(k, value)| all[place(k)] = *value);
    let whole = product(&*operator, &all);
    let wanted: Vec<f64> = (0..3 * m).map(|k| whole[place(k)]).collect();
    assert!(apart(&product(&*window, &inside), &wanted) < 1e-12);
}

/// Truth: if body, material and tractions rotate by 180 degrees about x, the solution rotates, too. The rotation also turns body
/// 1 into body 2, whose tractions have the opposite sign. Tractions and gaps along y and z therefore keep their sign, but
/// tractions and gaps along x change sign.
#[test]
fn either_side_of_the_frame() {
    let frame = frame(16);
    let n = frame.n_cells();
    let turn = |x: [f64; 3]| [x[0], -x[1], -x[2]];
    let lower = body(Hex8, (3.0, 6, 2.0), &cfrp());
    let mut turned = mesh(Hex8, 3.0, 6, 2.0);
    turned.points.iter_mut().for_each(|x| *x = turn(*x));
    let over = nalgebra::Matrix3::from_diagonal(&nalgebra::Vector3::new(1.0, -1.0, -1.0));
    let upper = spec(turned, cfrp().rotated(&over), HexFormulation::Enhanced, vec![clamp("z0")]);
    let below = flexibility(lower, Side::Lower, &frame);
    let above = hybrid(upper, "z1", Side::Upper, &frame).take_flexibility(SkipVanishing).unwrap().unwrap();
    let tractions = random(3 * n);
    // By the rotation, cell (ix, iy) becomes (ix, 15 - iy), and components along y and z change sign. The change from body 1 to
    // body 2 reverses both tractions and gaps. These two signs cancel, because the operator is linear.
    let mirrored = |values: &[f64]| -> Vec<f64> {
        let at = |k: usize| {
            let (c, ix, iy) = (k / n, k % n / 16, k % 16);
            let sign = if c == 0 { 1.0 } else { -1.0 };
            sign * values[c * n + ix * 16 + 15 - iy]
        };
        (0..3 * n).map(at).collect()
    };
    let found = product(&*above, &tractions);
    let wanted = mirrored(&product(&*below, &mirrored(&tractions)));
    assert!(apart(&found, &wanted) < 1e-9, "{}", apart(&found, &wanted));
}

/// Truth: the operator of the summed Green's function (`SkipVanishing`) and the sum of the operators of the two bodies (`Keep`)
/// give the same product.
#[test]
fn two_bodies() {
    let frame = frame(16);
    let bodies = || {
        let lower = hybrid(body(Hex8, (3.0, 4, 1.0), &cfrp()), "z1", Side::Lower, &frame);
        let mut over = mesh(Hex8, 4.0, 4, 1.0);
        over.points.iter_mut().for_each(|x| x[2] = -x[2]);
        over.blocks[0].nodes.chunks_exact_mut(8).for_each(|cell| cell.rotate_left(4));
        let upper = spec(over, steel(), HexFormulation::Enhanced, vec![clamp("z0")]);
        (lower, hybrid(upper, "z1", Side::Upper, &frame))
    };
    let operator = |cross| {
        let (mut lower, mut upper) = bodies();
        couple(&mut lower, &mut upper, &frame, Coupling::Schur, cross).unwrap().flexibility
    };
    let tractions = random(3 * frame.n_cells());
    let [summed, both] = [SkipVanishing, Keep].map(|cross| product(&*operator(cross), &tractions));
    assert!(apart(&summed, &both) < 1e-10, "{}", apart(&summed, &both));
    let (mut lower, _) = bodies();
    let mut steel = HalfSpaceBody::new(&steel(), Side::Upper, &frame).unwrap();
    let coupled = couple(&mut lower, &mut steel, &frame, Coupling::Schur, SkipVanishing).unwrap();
    assert!(coupled.flexibility.grid().is_some() && coupled.skipped.len() == 1);
}

/// Layup of plies, listed from the top down. A ply has the depth of its lower face and a stiffness.
fn plies(plies: &[(f64, &Stiffness)]) -> RegionMaterial {
    let mut upper = 1.0;
    let placed = |(depth, stiffness): &(f64, &Stiffness)| {
        let z_range = [-depth, upper];
        upper = -depth;
        let axes = nalgebra::Matrix3::identity();
        let orientation = orthowear::material::Orientation::Uniform(axes);
        Ply {
            z_range,
            material: PlacedMaterial {
                name: "ply".into(),
                stiffness: (*stiffness).clone(),
                expansion: None,
                orientation,
            },
        }
    };
    let mut all: Vec<Ply> = plies.iter().map(placed).collect();
    all.reverse();
    RegionMaterial::Layup(all)
}

/// Truths: layers of one material act like a homogeneous body. Under uniform pressure, a layer of 1.2 mm on a base ten times
/// softer moves as on the condensed mesh, to 2 %. Finer meshes agree better.
#[test]
fn layers() {
    let (hard, soft) = (steel(), Stiffness::isotropic(21e3, 0.3).unwrap());
    let frame = frame(16);
    let n = frame.n_cells();
    let layered = |base: &Stiffness, cells: usize| {
        let mut body = body(Hex27, (6.0, cells, 1.0), &hard);
        body.regions = vec![(None, plies(&[(1.2, &hard), (7.0, base)]))];
        body
    };
    let pressed: Vec<f64> = (0..3 * n).map(|k| if k < 2 * n { 0.0 } else { 1.0 }).collect();
    let mean = |gap: &[f64]| gap[2 * n..].iter().sum::<f64>() / n as f64;
    let same = product(&*flexibility(layered(&hard, 5), Side::Lower, &frame), &pressed);
    let whole = product(&*flexibility(body(Hex27, (6.0, 5, 1.0), &hard), Side::Lower, &frame), &pressed);
    assert!(apart(&same, &whole) < 1e-12);
    let soft_base =
        |cells| mean(&product(&*flexibility(layered(&soft, cells), Side::Lower, &frame), &pressed));
    let condensed = |cells| {
        let coarse = ContactFrame::grid([FRAME; 2], [4; 2], [0.0; 2], 0.0).unwrap();
        let mut body = FeBody::new(layered(&soft, cells), "z1", Side::Lower, &coarse).unwrap();
        let operator = body.take_flexibility(SkipVanishing).unwrap().unwrap();
        let gap = product(&*operator, &[vec![0.0; 32], vec![1.0; 16]].concat());
        gap[32..].iter().sum::<f64>() / 16.0
    };
    let on_soft = soft_base(10);
    let (coarse, fine) = (soft_base(5) / condensed(5), on_soft / condensed(10));
    println!("{coarse} {fine} {on_soft} {}", mean(&whole));
    assert!((fine - 1.0).abs() < 0.02 && (fine - 1.0).abs() < (coarse - 1.0).abs(), "{coarse} {fine}");
    assert!(on_soft > 2.0 * mean(&whole));
}
