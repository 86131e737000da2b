//! Bodies with soft supports. Their rigid motions need much smaller forces than deformations of their surfaces.

use super::bricks::{Brick, spec, straight};
use crate::common::{Silent, indent, press, steel};
use nalgebra::{DMatrix, DVector};
use orthowear::bem::half_space::CrossBlocks::SkipVanishing;
use orthowear::body::{FeBody, RigidBody};
use orthowear::contact::SolverOptions;
use orthowear::coupling::{CoupledBodies, Coupling, couple};
use orthowear::evolution::records::Outcome;
use orthowear::evolution::{Model, run};
use orthowear::fem::{Foundation, FoundationStiffness};
use orthowear::frame::{ContactFrame, Side};
use orthowear::laws::friction::FrictionLaw;
use orthowear::laws::wear::WearLaw;

/// Flexibility of a plate on a foundation that is soft compared with the plate.
fn plate(frame: &ContactFrame) -> CoupledBodies {
    let brick = Brick {
        width: [10.0, 1.5],
        z: [-1.0, 0.0],
        cells: [40, 6, 1],
        contact_on_top: true,
        distortion: straight,
        tetrahedra: false,
    };
    let mut spec = spec(brick.mesh(), &steel());
    spec.foundations =
        vec![Foundation { group: "base".into(), stiffness: FoundationStiffness::Components([2000.0; 3]) }];
    let mut body = FeBody::new(spec, "contact", Side::Lower, frame).expect("a body");
    couple(&mut body, &mut RigidBody, frame, Coupling::Schur, SkipVanishing).expect("a coupled body")
}

/// Pressures p with p >= 0, g0 + S p >= 0 and p (g0 + S p) = 0, by an active-set method. S is `matrix` and g0 is `gap`.
fn active_set(matrix: &DMatrix<f64>, gap: &[f64]) -> Vec<f64> {
    let n = gap.len();
    let mut pressures = vec![0.0; n];
    let mut active: Vec<usize> = (0..n).filter(|&i| gap[i] < 0.0).collect();
    for _ in 0..200 {
        let block = DMatrix::from_fn(active.len(), active.len(), |i, j| matrix[(active[i], active[j])]);
        let rhs = DVector::from_fn(active.len(), |i, _| -gap[active[i]]);
        let solved = block.lu().solve(&rhs).expect("a regular block");
        pressures.fill(0.0);
        active.iter().zip(&solved).for_each(|(&i, p)| pressures[i] = *p);
        let all = matrix * DVector::from_column_slice(&pressures);
        let next: Vec<usize> =
            (0..n).filter(|&i| pressures[i] - (gap[i] + all[i]) / matrix[(i, i)] > 0.0).collect();
        if next == active {
            return pressures;
        }
        active = next;
    }
    panic!("the active set does not come to rest");
}

/// Truth: the complementarity problem, solved by an active-set method. The tolerance is 1e-6 of the largest pressure. It covers
/// the residual 1e-10 times the condition number of the normal flexibility.
#[test]
fn a_plate_on_a_soft_foundation() {
    let frame = ContactFrame::grid([9.8, 1.4], [26, 3], [0.0; 2], 0.0).unwrap();
    let n = frame.n_cells();
    let wavy = |x: f64, y: f64| 0.05 * (1.0 + (0.9 * x).cos()) + 2e-4 * x * x + 1e-3 * y;
    let coupled = plate(&frame);
    let mut matrix = DMatrix::zeros(n, n);
    let mut column = vec![0.0; n];
    for j in 0..n {
        let unit: Vec<f64> = (0..n).map(|i| f64::from(i == j)).collect();
        coupled.flexibility.apply_normal(&unit, &mut column);
        matrix.set_column(j, &DVector::from_column_slice(&column));
    }
    let mut initial_gap = vec![0.0; 3 * n];
    for (cell, center) in frame.centers.iter().enumerate() {
        initial_gap[2 * n + cell] = wavy(center.x, center.y);
    }
    let lowest = initial_gap[2 * n..].iter().copied().fold(f64::INFINITY, f64::min);
    let model = Model {
        frame,
        flexibility: coupled.flexibility,
        initial_gap: initial_gap.clone(),
        loads: Vec::new(),
        floating: Vec::new(),
        friction: FrictionLaw::None,
        wear: WearLaw::None,
        wear_share: 1.0,
    };
    let options = SolverOptions { tolerance: 1e-10, ..SolverOptions::default() };
    for approach in [0.07, 0.14, 0.3] {
        let result = run(&model, &[indent(lowest + approach)], &options, None, &mut Silent).unwrap();
        assert_eq!(result.outcome, Outcome::Converged, "{approach}");
        let gap: Vec<f64> = initial_gap[2 * n..].iter().map(|gap| gap - lowest - approach).collect();
        let exact = active_set(&matrix, &gap);
        let largest = exact.iter().copied().fold(0.0, f64::max);
        for (found, exact) in result.state.tractions[2 * n..].iter().zip(&exact) {
            assert!((found - exact).abs() < 1e-6 * largest, "{approach}: {found} {exact}");
        }
        let force = result.records[0].normal_force;
        let forced = run(&model, &[press(force)], &options, None, &mut Silent).unwrap();
        assert_eq!(forced.outcome, Outcome::Converged, "{approach}");
        assert!(
            (forced.records[0].approach - lowest - approach).abs() < 1e-6 * approach,
            "{:?}",
            forced.records
        );
    }
}
