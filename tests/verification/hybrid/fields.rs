//! Fields of bodies with the near field of a half-space.

use orthowear::body::{ElasticBody, ErrorEstimation, FeBody, Loading};
use orthowear::element::ElementKind::{Hex8, Hex27};
use orthowear::frame::{ContactFrame, Side};

use super::blocks::{FRAME, body, cfrp, frame, hybrid};

/// Tractions on body 2, `[3, N]`: a paraboloid of pressure, and a tangential traction along x where x > 0.
fn bump(frame: &ContactFrame) -> Vec<f64> {
    let n = frame.n_cells();
    let mut tractions = vec![0.0; 3 * n];
    for (cell, x) in frame.centers.iter().enumerate() {
        let r = (x.x * x.x + x.y * x.y) / (FRAME * FRAME);
        let pressure = 100.0 * (1.0 - r).max(0.0);
        tractions[2 * n + cell] = pressure;
        tractions[cell] = if x.x > 0.0 { 0.3 * pressure } else { 0.0 };
    }
    tractions
}

/// Truths: the base does not move. Stresses on planes across the block carry the resultant of the tractions. The displacement of
/// the surface is the negative gap that the operator gives.
#[test]
fn supports_and_balance() {
    let (w, n) = (3.0, 8);
    let frame = frame(32);
    let tractions = bump(&frame);
    let mut body = hybrid(body(Hex27, (w, n, 1.0), &cfrp()), "z1", Side::Lower, &frame);
    let operator = body.take_flexibility(orthowear::bem::half_space::CrossBlocks::Keep).unwrap().unwrap();
    let field = body.recover(Loading::of_contact(&tractions)).unwrap();
    let stress = body
        .recover_stress(Loading::of_contact(&tractions), &field.displacement, ErrorEstimation::Estimate)
        .unwrap()
        .unwrap();
    let surface = body.surface().unwrap();
    let points = &surface.mesh.points;
    let largest = field.displacement.iter().flatten().fold(0.0, |m: f64, u| m.max(u.abs()));
    let mut gap = vec![0.0; tractions.len()];
    operator.apply(&tractions, &mut gap);
    let m = frame.n_cells();
    for (x, u) in points.iter().zip(&field.displacement) {
        if (x[2] + w).abs() < 1e-9 {
            assert!(u.iter().all(|u| u.abs() < 1e-3 * largest), "{x:?} {u:?}");
        }
        let near = |cell: &usize| (0..2).map(|k| (frame.centers[*cell][k] - x[k]).powi(2)).sum::<f64>();
        if x[2] == 0.0 && x[0].abs() < 1.0 && x[1].abs() < 1.0 {
            let cells: Vec<usize> = (0..m).filter(|cell| near(cell) < 0.004).collect();
            for c in 0..3 {
                // Only body 1 is elastic, so its displacement is minus the gap.
                let mean = -cells.iter().map(|cell| gap[c * m + cell]).sum::<f64>() / cells.len() as f64;
                assert!((mean - u[c]).abs() < 1e-2 * largest, "{x:?} {c}: {mean} {u:?}");
            }
        }
    }
    let area: f64 = frame.areas[0];
    let force = |plane: usize| -area * tractions[plane * m..(plane + 1) * m].iter().sum::<f64>();
    let h = w / n as f64;
    let weight = |x: f64| match ((x + w) / h).round() as usize {
        0 => h / 3.0,
        k if k == 2 * n => h / 3.0,
        k if k % 2 == 1 => 4.0 * h / 3.0,
        _ => 2.0 * h / 3.0,
    };
    for level in [-0.75, -1.5] {
        let mut carried = [0.0; 3];
        for (point, &node) in stress.points.mesh_nodes.iter().enumerate() {
            let x = points[node];
            if (x[2] - level).abs() < 1e-9 {
                let [.., zz, yz, xz, _] = stress.stress[point];
                for (sum, s) in carried.iter_mut().zip([xz, yz, zz]) {
                    *sum += weight(x[0]) * weight(x[1]) * s;
                }
            }
        }
        for c in 0..3 {
            let off = (carried[c] - force(c)).abs() / force(2).abs();
            assert!(off < 0.02, "at {level}: {carried:?} for {:?}", [0, 1, 2].map(force));
        }
    }
    let error = stress.error.unwrap().relative_error();
    assert!(error < 0.2, "{error}");
}

/// Truth: the displacement of the condensed mesh away from the contact. The error of this mesh is 1 % of the largest displacement.
#[test]
fn displacement_of_a_condensed_mesh() {
    let frame = frame(8);
    let tractions = bump(&frame);
    let spec = || body(Hex8, (3.0, 20, 1.0), &cfrp());
    let near = hybrid(spec(), "z1", Side::Lower, &frame)
        .recover(Loading::of_contact(&tractions))
        .unwrap()
        .displacement;
    let condensed = FeBody::new(spec(), "z1", Side::Lower, &frame).unwrap();
    let meshed = condensed.recover(Loading::of_contact(&tractions)).unwrap().displacement;
    let largest = near.iter().flatten().fold(0.0, |m: f64, u| m.max(u.abs()));
    let points = &condensed.surface().unwrap().mesh.points;
    let mut compared = 0;
    for (x, (a, b)) in points.iter().zip(near.iter().zip(&meshed)) {
        if x[2] < -1.0 || x[0].abs() > 2.0 {
            compared += 1;
            assert!((0..3).all(|c| (a[c] - b[c]).abs() < 0.01 * largest), "{x:?}: {a:?} {b:?}");
        }
    }
    assert!(compared > 1000);
}
