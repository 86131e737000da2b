//! A block with so many cells in contact that the linear systems of Newton steps are too large to be factorised.

use std::collections::HashMap;

use super::bricks::{Brick, spec, straight, support};
use crate::common::{Silent, indent, shift};
use orthowear::bem::half_space::CrossBlocks::SkipVanishing;
use orthowear::body::{FeBody, RigidBody};
use orthowear::contact::SolverOptions;
use orthowear::coupling::{Coupling, couple, surface_distance};
use orthowear::evolution::records::Outcome;
use orthowear::evolution::step::Step;
use orthowear::evolution::{Model, run};
use orthowear::frame::{ContactFrame, GapShape, InitialGap, Side};
use orthowear::laws::friction::FrictionLaw;
use orthowear::laws::wear::WearLaw;
use orthowear::material::Stiffness;

/// Truth: if all cells stick, an increment is one linear system. With the local compliances as preconditioner, its solution takes
/// 390 operator products. Exact solutions on patches of neighbouring cells must take at most half of them, 195.
#[test]
fn large_systems_take_few_products() {
    let brick = Brick {
        width: [5.0, 5.0],
        z: [0.0, 10.0],
        cells: [37, 37, 4],
        contact_on_top: false,
        distortion: straight,
        tetrahedra: false,
    };
    let mut block = spec(brick.mesh(), &Stiffness::isotropic(70e3, 0.3).expect("an admissible material"));
    block.supports = vec![support("base", [true; 3], [0.0; 3])];
    let frame = ContactFrame::from_nodes(&block.mesh, "contact", Side::Upper, [0.0; 2], 0.0, &HashMap::new())
        .expect("a frame");
    let mut block = FeBody::new(block, "contact", Side::Upper, &frame).expect("a body");
    let distance =
        surface_distance(&InitialGap::from(GapShape::Flat), &frame, &RigidBody, &block).expect("a gap");
    let coupled =
        couple(&mut RigidBody, &mut block, &frame, Coupling::Schur, SkipVanishing).expect("coupled");
    let model = Model {
        initial_gap: coupled.initial_gap(&distance),
        frame,
        flexibility: coupled.flexibility,
        loads: coupled.loads,
        floating: coupled.floating,
        friction: FrictionLaw::Coulomb { mu: 1e3 },
        wear: WearLaw::None,
        wear_share: 1.0,
    };
    let press = Step { friction: false, ..indent(1e-3) };
    let result = run(&model, &[press, shift(1e-4, 30.0)], &SolverOptions::default(), None, &mut Silent)
        .expect("a run");
    assert_eq!(result.outcome, Outcome::Converged);
    let record = &result.records[1];
    assert!((record.stick_area - 100.0).abs() < 1e-9, "{}", record.stick_area);
    assert!(record.operator_applications <= 195, "{}", record.operator_applications);
}
