//! Loads of a rigid sphere on finite blocks against an independent program.

use orthowear::bem::half_space::CrossBlocks::SkipVanishing;
use orthowear::body::{ElasticBody, RigidBody};
use orthowear::contact::SolverOptions;
use orthowear::coupling::{Coupling, couple};
use orthowear::element::ElementKind::{self, Hex8, Hex27};
use orthowear::evolution::{Model, run};
use orthowear::frame::{ContactFrame, GapShape, InitialGap, Side};
use orthowear::laws::friction::FrictionLaw;
use orthowear::laws::wear::WearLaw;
use orthowear::material::Stiffness;

use super::blocks::{body, cfrp, frame, hybrid};
use crate::common::{Silent, indent, steel, usual_or_finest};

pub fn sphere_on(body: &mut dyn ElasticBody, side: Side, frame: &ContactFrame) -> Model {
    let mut rigid = RigidBody;
    let distance = InitialGap::from(GapShape::Sphere { radius: 50.0 }).evaluate(frame).unwrap();
    let coupled = match side {
        Side::Lower => couple(body, &mut rigid, frame, Coupling::Schur, SkipVanishing),
        Side::Upper => couple(&mut rigid, body, frame, Coupling::Schur, SkipVanishing),
    };
    let coupled = coupled.unwrap();
    let initial_gap = coupled.initial_gap(&distance);
    Model {
        frame: frame.clone(),
        flexibility: coupled.flexibility,
        initial_gap,
        loads: Vec::new(),
        floating: Vec::new(),
        friction: FrictionLaw::None,
        wear: WearLaw::None,
        wear_share: 1.0,
    }
}

/// Load, N, at an approach of 0.02 mm without friction, and number of unknowns of the finite elements.
fn load(kind: ElementKind, (w, n, ratio): (f64, usize, f64), stiffness: &Stiffness) -> (f64, usize) {
    let frame = frame(64);
    let mut body = hybrid(body(kind, (w, n, ratio), stiffness), "z1", Side::Lower, &frame);
    assert_eq!(body.indicators().rejection_reason(), None, "{:?}", body.indicators());
    let model = sphere_on(&mut body, Side::Lower, &frame);
    let result = run(&model, &[indent(0.02)], &SolverOptions::default(), None, &mut Silent).unwrap();
    assert!(result.records[0].converged);
    (result.records[0].normal_force, body.n_free())
}

/// Truth: loads from an independent program, which combines a half-space with a far field of 14³ hex27 elements. The error of
/// these loads is 1e-4 for steel and 1e-3 for CFRP. The frame of 64 x 64 cells adds an error of 1e-4.
#[test]
fn loads_of_blocks() {
    let (steel, cfrp) = (steel(), cfrp());
    let few = [(&steel, 3.0, 8414.4), (&steel, 6.0, 7138.7), (&steel, 12.0, 6609.7)];
    for (stiffness, w, wanted) in few.into_iter().step_by(usual_or_finest(2, 1)) {
        let (coarse, n) = load(Hex8, (w, 4, 1.0), stiffness);
        assert!(n <= 300 && (coarse / wanted - 1.0).abs() < 1e-2, "{w}: {coarse} with {n}");
        let (fine, n) = load(Hex27, (w, 6, 4.0), stiffness);
        assert!(n <= 6084 && (fine / wanted - 1.0).abs() < 1e-3, "{w}: {fine} with {n}");
    }
    for (w, wanted) in [(3.0, 462.29), (6.0, 411.69)].into_iter().take(usual_or_finest(1, 2)) {
        let (coarse, n) = load(Hex27, (w, 4, 4.0), &cfrp);
        assert!(n <= 1944 && (coarse / wanted - 1.0).abs() < 1e-2, "{w}: {coarse} with {n}");
        let (fine, n) = load(Hex27, (w, 8, 3.0), &cfrp);
        assert!(n <= 13_872 && (fine / wanted - 1.0).abs() < 1e-3, "{w}: {fine} with {n}");
    }
}
