//! Load paths with friction and wear, solved with the assembled block system and with the Schur complement.

use super::block::{Pair, pairs, tied};
use super::half_spaces::difference;
use crate::common::{Silent, fretting, frp_friction, frp_wear, indent, shift};
use orthowear::contact::SolverOptions;
use orthowear::coupling::{Coupling, surface_distance};
use orthowear::evolution::step::Integrator;
use orthowear::evolution::{Model, RunResult, run};
use orthowear::frame::{ContactFrame, GapShape, InitialGap};

/// Runs indentation, tangential displacement and fretting with wear under a sphere of radius 50 mm, to residuals of 1e-12.
pub fn history(pair: &mut Pair, frame: &ContactFrame, coupling: Coupling) -> RunResult {
    let gap = InitialGap::from(GapShape::Sphere { radius: 50.0 });
    let distance = surface_distance(&gap, frame, pair[0].as_ref(), pair[1].as_ref()).expect("a gap");
    let coupled = tied(pair, frame, coupling);
    let initial_gap = coupled.initial_gap(&distance);
    let model = Model {
        frame: frame.clone(),
        flexibility: coupled.flexibility,
        initial_gap,
        loads: Vec::new(),
        floating: Vec::new(),
        friction: frp_friction(30.0),
        wear: frp_wear(30.0),
        wear_share: 1.0,
    };
    let steps = [indent(0.012), shift(0.004, 25.0), fretting(5000, 0.02, 2, Integrator::Sdirk2)];
    let options = SolverOptions { tolerance: 1e-12, ..SolverOptions::default() };
    run(&model, &steps, &options, None, &mut Silent).expect("a run")
}

/// Truth: the block system and the Schur complement are the same equations, so their results must agree to 1e-8. This tolerance
/// exceeds the residual of 1e-12, because the condition number of the flexibility multiplies the residual.
#[test]
fn histories_agree_on_both_paths() {
    let frame = ContactFrame::grid([1.1, 0.9], [8, 7], [0.1, -0.2], 0.3).unwrap();
    for (name, mut pair) in pairs(&frame) {
        let block = history(&mut pair, &frame, Coupling::Block);
        let schur = history(&mut pair, &frame, Coupling::Schur);
        assert_eq!(block.records.len(), schur.records.len());
        for (a, b) in block.records.iter().zip(&schur.records) {
            assert!(a.converged && b.converged, "{name} {}: {:?} {:?}", a.name, a.certificate, b.certificate);
            let values = |r: &orthowear::evolution::records::IncrementRecord| {
                [r.normal_force, r.tangential_force[0], r.tangential_force[1], r.peak_pressure]
            };
            assert!(
                difference(&values(a), &values(b)) < 1e-8,
                "{name} {}: {:?} {:?}",
                a.name,
                values(a),
                values(b)
            );
        }
        let last = (block.records.last().unwrap(), schur.records.last().unwrap());
        assert!(last.0.worn_volume > 0.0);
        assert!(difference(&[last.0.worn_volume], &[last.1.worn_volume]) < 1e-8, "{name}");
        assert!(difference(&block.state.tractions, &schur.state.tractions) < 1e-8, "{name}");
    }
}
