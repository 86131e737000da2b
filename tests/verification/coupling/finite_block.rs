//! A finite-element block against the half-space it stands for, pressed by a steel half-space with a sphere's gap.

use super::bricks::{spec, support};
use crate::common::{Silent, im7, indent, steel};
use orthowear::bem::half_space::CrossBlocks::SkipVanishing;
use orthowear::body::{ElasticBody, FeBody, HalfSpaceBody};
use orthowear::contact::SolverOptions;
use orthowear::coupling::{Coupling, couple, surface_distance};
use orthowear::frame::{ContactFrame, GapShape, InitialGap, Side};
use orthowear::friction::FrictionLaw;
use orthowear::history::{Model, run};
use orthowear::material::Stiffness;
use orthowear::mesh::structured::{self, GradedBlock, Solids};
use orthowear::wear::WearLaw;

/// Normal force at an approach of 0.02 mm, where the contact radius is about 1 mm.
fn normal_force(lower: &mut dyn ElasticBody, frame: &ContactFrame) -> f64 {
    let mut upper = HalfSpaceBody::new(&steel(), Side::Upper, frame).expect("a half-space");
    let gap = InitialGap::from(GapShape::Sphere { radius: 50.0 });
    let distance = surface_distance(&gap, frame, lower, &upper).expect("an admissible gap");
    let coupled = couple(lower, &mut upper, frame, Coupling::Schur, SkipVanishing).expect("coupled bodies");
    let initial_gap = coupled.initial_gap(&distance);
    let model = Model {
        frame: frame.clone(),
        flexibility: coupled.flexibility,
        initial_gap,
        friction: FrictionLaw::None,
        wear: WearLaw::None,
        wear_share: 1.0,
    };
    let result = run(&model, &[indent(0.02)], &SolverOptions::default(), &mut Silent).expect("a run");
    assert!(result.records[0].converged);
    result.records[0].normal_force
}

/// A block of half-size and depth `size`, clamped at its base, with elements of 0.15 mm under the contact.
fn block(stiffness: &Stiffness, (size, outer, deep): (f64, usize, usize), frame: &ContactFrame) -> FeBody {
    let graded = GradedBlock {
        half_width: [size; 2],
        depth: size,
        patch_half_width: [1.2; 2],
        patch_cells: [16; 2],
        outer_cells: outer,
        depth_cells: deep,
        first_depth: Some(0.15),
        solids: Solids::Hex8,
        side: structured::Side::Lower,
        distortion: 0.0,
    };
    let mut spec = spec(graded.mesh().expect("a mesh"), stiffness);
    spec.supports = vec![support("base", [true; 3], [0.0; 3])];
    FeBody::new(spec, "contact", Side::Lower, frame).expect("a finite-element body")
}

/// Truth: the load of a clamped block differs from the half-space's by a term in contact radius / size
/// (formulation 15.11; Saint-Venant: the far field of a point force). So doubling the size halves the difference
/// (the quadratic term and the elements of 0.15 mm leave 0.44 to 0.56), and 2 d(12) - d(6), without the first-order
/// term, is below 1 %.
#[test]
fn blocks_tend_to_the_half_space() {
    let frame = ContactFrame::grid([1.2; 2], [16; 2], [0.0; 2], 0.0).unwrap();
    let aluminium = Stiffness::isotropic(70e3, 0.33).expect("an admissible material");
    for material in [aluminium, im7(30.0)] {
        let mut half_space = HalfSpaceBody::new(&material, Side::Lower, &frame).unwrap();
        let reference = normal_force(&mut half_space, &frame);
        let [six, twelve] = [(6.0, 6, 9), (12.0, 8, 11)]
            .map(|size| normal_force(&mut block(&material, size, &frame), &frame) / reference - 1.0);
        let ratio = twelve / six;
        assert!((0.44..0.56).contains(&ratio), "{six} {twelve}");
        assert!((2.0 * twelve - six).abs() < 0.01, "{six} {twelve}");
    }
}
