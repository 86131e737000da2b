//! Contact models of two meshed bodies, with the gap between their meshes.

use super::bricks::{spec, support};
use crate::common::Silent;
use orthowear::bem::half_space::CrossBlocks::SkipVanishing;
use orthowear::body::{ElasticBody, FeBody};
use orthowear::contact::SolverOptions;
use orthowear::coupling::{Coupling, couple, surface_distance};
use orthowear::evolution::step::Step;
use orthowear::evolution::{Model, RunResult, run};
use orthowear::fem::Support;
use orthowear::frame::{ContactFrame, GapShape, InitialGap, Side};
use orthowear::laws::friction::FrictionLaw;
use orthowear::laws::wear::WearLaw;
use orthowear::material::Stiffness;
use orthowear::mesh::Mesh;

/// One body of a pair. `supports` lists groups and their fixed components.
pub struct Part<'a> {
    pub mesh: &'a Mesh,
    pub contact: &'a str,
    pub material: &'a Stiffness,
    pub supports: &'a [(&'a str, [bool; 3])],
}

impl Part<'_> {
    pub fn body(&self, side: Side, frame: &ContactFrame) -> FeBody {
        let held =
            |(group, components): &(&str, [bool; 3])| -> Support { support(group, *components, [0.0; 3]) };
        let mut spec = spec(self.mesh.clone(), self.material);
        spec.supports = self.supports.iter().map(held).collect();
        FeBody::new(spec, self.contact, side, frame).expect("a finite-element body")
    }
}

pub fn model(parts: [&Part; 2], frame: &ContactFrame, friction: FrictionLaw) -> Model {
    let (mut lower, mut upper) = (parts[0].body(Side::Lower, frame), parts[1].body(Side::Upper, frame));
    let gap = InitialGap::from(GapShape::Mesh);
    let bodies: [&dyn ElasticBody; 2] = [&lower, &upper];
    let distance = surface_distance(&gap, frame, bodies[0], bodies[1]).expect("surfaces that do not overlap");
    let coupled =
        couple(&mut lower, &mut upper, frame, Coupling::Schur, SkipVanishing).expect("coupled bodies");
    let initial_gap = coupled.initial_gap(&distance);
    Model {
        frame: frame.clone(),
        flexibility: coupled.flexibility,
        initial_gap,
        loads: coupled.loads,
        floating: coupled.floating,
        friction,
        wear: WearLaw::None,
        wear_share: 1.0,
    }
}

/// Runs the steps and asserts that every increment converges.
pub fn solved(model: &Model, steps: &[Step]) -> RunResult {
    let result = run(model, steps, &SolverOptions::default(), None, &mut Silent).expect("a run");
    assert!(result.records.iter().all(|record| record.converged), "{:?}", result.outcome);
    result
}
