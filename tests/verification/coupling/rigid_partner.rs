//! A rigid sphere on a meshed block. The peak pressure converges on cells around nodes.

use std::f64::consts::PI;

use super::bricks::{spec, support};
use super::nodes::nodal_frame;
use crate::common::{press, relative, solve, sphere, steel};
use crate::structured::GradedBlock;
use nalgebra::DMatrix;
use orthowear::bem::half_space::CrossBlocks::SkipVanishing;
use orthowear::body::{FeBody, RigidBody};
use orthowear::coupling::{Coupling, couple};
use orthowear::evolution::Model;
use orthowear::frame::{ContactFrame, Side};
use orthowear::laws::friction::FrictionLaw;
use orthowear::laws::wear::WearLaw;
use orthowear::mesh::Mesh;

/// Mesh of a block. Its patch of 3 mm x 3 mm under the contact has `n` x `n` equal faces.
fn block(n: usize) -> Mesh {
    let block = GradedBlock {
        patch_half_width: [1.5; 2],
        outer_cells: 5,
        first_depth: Some(3.0 / n as f64),
        ..GradedBlock::uniform([12.0; 2], 12.0, [n, n, 9])
    };
    block.mesh().expect("a block")
}

/// Rigid sphere of R = 50 mm on the block. The frame has one cell per node if `nodes`, otherwise one cell per face.
fn model(n: usize, nodes: bool) -> Model {
    let mesh = block(n);
    let frame = if nodes {
        nodal_frame(&mesh, "contact")
    } else {
        ContactFrame::from_faces(&mesh, "contact", Side::Lower, [0.0; 2], 0.0).expect("a frame")
    };
    let mut spec = spec(mesh, &steel());
    spec.supports = vec![support("base", [true; 3], [0.0; 3])];
    let mut body = FeBody::new(spec, "contact", Side::Lower, &frame).expect("a body");
    let coupled =
        couple(&mut body, &mut RigidBody, &frame, Coupling::Schur, SkipVanishing).expect("coupled bodies");
    let gap = sphere(50.0);
    let distance: Vec<f64> = frame.centers.iter().map(|x| gap(x.x, x.y)).collect();
    Model {
        initial_gap: coupled.initial_gap(&distance),
        frame,
        flexibility: coupled.flexibility,
        loads: coupled.loads,
        floating: coupled.floating,
        friction: FrictionLaw::None,
        wear: WearLaw::None,
        wear_share: 1.0,
    }
}

/// Smallest eigenvalue of the symmetric part of A S_nn, scaled to a unit diagonal. A is the diagonal matrix of the cell areas and
/// S_nn the normal flexibility.
fn smallest_eigenvalue(model: &Model) -> f64 {
    let n = model.frame.n_cells();
    let (mut unit, mut column) = (vec![0.0; n], vec![0.0; n]);
    let mut s = DMatrix::zeros(n, n);
    for j in 0..n {
        unit[j] = 1.0;
        model.flexibility.apply_normal(&unit, &mut column);
        unit[j] = 0.0;
        (0..n).for_each(|i| s[(i, j)] = column[i] * model.frame.areas[i]);
    }
    let scale: Vec<f64> = (0..n).map(|i| s[(i, i)].sqrt()).collect();
    let scaled = DMatrix::from_fn(n, n, |i, j| 0.5 * (s[(i, j)] + s[(j, i)]) / (scale[i] * scale[j]));
    scaled.symmetric_eigenvalues().min()
}

/// Truth: Hertz's peak pressure p0 = (6 F E*² / (pi³ R²))^(1/3). F is the load on a half-space at an approach of 0.02 mm, where
/// the contact radius is a = 1 mm. The finite size of the block causes an error of the order (a / 12 mm)³. The mean over a cell
/// of size h differs from the peak by about (h / a)² / 8, which is 1.8, 0.4 and 0.2 % for the three meshes. The elements cause
/// errors of the same size, so the tolerances are about twice these values.
#[test]
fn peak_pressure_converges_on_cells_around_nodes() {
    let modulus: f64 = 210e3 / (1.0 - 0.09);
    let load = 4.0 / 3.0 * modulus * 50f64.sqrt() * 0.02f64.powf(1.5);
    let peak = (6.0 * load * modulus.powi(2) / (PI.powi(3) * 2500.0)).cbrt();
    let mut before = f64::INFINITY;
    for (n, tolerance) in [(8, 0.036), (16, 0.011), (24, 0.007)] {
        let result = solve(&model(n, true), &[press(load)]);
        assert!(result.records[0].converged);
        let error = relative(result.records[0].peak_pressure, peak);
        println!("{n}: {error:.4} in {} iterations", result.records[0].iterations);
        assert!(error < tolerance && error < before, "{n}: {error}");
        before = error;
    }
}

/// Truth: tractions that alternate from quadrangle to quadrangle cause no force on inner nodes. On a frame of faces, only the
/// edge of the frame makes the smallest eigenvalue positive. This eigenvalue therefore decreases with every refinement. With
/// cells around nodes, alternating tractions cause a quarter of the force (nodes.rs). The smallest eigenvalue of these cells
/// stays above 0.1.
#[test]
fn alternating_tractions_are_felt_by_cells_around_nodes_only() {
    let mut before = 0.01;
    for n in [6, 10, 14] {
        let [faces, nodes] = [false, true].map(|nodes| smallest_eigenvalue(&model(n, nodes)));
        println!("{n}: faces {faces:.2e}, nodes {nodes:.2e}");
        assert!(faces < before && nodes > 0.1, "{n}: {faces:e} {nodes:e}");
        before = faces;
    }
}
