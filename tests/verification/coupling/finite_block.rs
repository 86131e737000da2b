//! Finite-element blocks compared with the half-spaces that they approximate. A steel half-space with the gap of a sphere presses
//! on both.

use std::sync::Arc;

use super::bricks::{spec, support};
use crate::common::{Silent, im7, indent, steel};
use crate::structured::{BlockElements, GradedBlock};
use nalgebra::Matrix3;
use orthowear::bem::half_space::CrossBlocks::SkipVanishing;
use orthowear::body::{ElasticBody, FeBody, HalfSpaceBody};
use orthowear::contact::SolverOptions;
use orthowear::coupling::{Coupling, couple, surface_distance};
use orthowear::evolution::{Model, run};
use orthowear::flexibility::Flexibility;
use orthowear::frame::{ContactFrame, GapShape, InitialGap, Side};
use orthowear::laws::friction::FrictionLaw;
use orthowear::laws::wear::WearLaw;
use orthowear::material::Stiffness;

fn normal_force(lower: &mut dyn ElasticBody, frame: &ContactFrame) -> f64 {
    force_and_peak(lower, frame).0
}

/// Steel half-space with the gap of a sphere of R = 50 mm over the body `lower`, without friction.
pub fn under_a_sphere(lower: &mut dyn ElasticBody, frame: &ContactFrame) -> Model {
    let mut upper = HalfSpaceBody::new(&steel(), Side::Upper, frame).expect("a half-space");
    let gap = InitialGap::from(GapShape::Sphere { radius: 50.0 });
    let distance = surface_distance(&gap, frame, lower, &upper).expect("an admissible gap");
    let coupled = couple(lower, &mut upper, frame, Coupling::Schur, SkipVanishing).expect("coupled bodies");
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

/// Normal force and peak pressure at an approach of 0.02 mm, where the contact radius is about 1 mm.
fn force_and_peak(lower: &mut dyn ElasticBody, frame: &ContactFrame) -> (f64, f64) {
    let model = under_a_sphere(lower, frame);
    let result = run(&model, &[indent(0.02)], &SolverOptions::default(), None, &mut Silent).expect("a run");
    assert!(result.records[0].converged);
    (result.records[0].normal_force, result.records[0].peak_pressure)
}

/// A block of half-width and depth `size`, clamped at its base. Its element faces are the cells of the frame.
pub fn block(
    stiffness: &Stiffness,
    (size, outer, deep): (f64, usize, usize),
    frame: &ContactFrame,
) -> FeBody {
    let cells = frame.grid.expect("a grid frame").cells;
    let graded = GradedBlock {
        half_width: [size; 2],
        depth: size,
        patch_half_width: [1.2; 2],
        patch_cells: cells,
        outer_cells: outer,
        depth_cells: deep,
        first_depth: Some(2.4 / cells[0] as f64),
        solids: BlockElements::Hex8,
        side: Side::Lower,
        distortion: 0.0,
    };
    let mut spec = spec(graded.mesh().expect("a mesh"), stiffness);
    spec.supports = vec![support("base", [true; 3], [0.0; 3])];
    FeBody::new(spec, "contact", Side::Lower, frame).expect("a finite-element body")
}

/// Truth: the far field of a point force (Saint-Venant). The loads of a clamped block and of a half-space differ by a term of the
/// order contact radius / size. The relative difference d(size) is therefore halved from 6 to 12 mm. The quadratic term and the
/// elements of 0.15 mm leave ratios of 0.44 to 0.56. 2 d(12) - d(6) has no first-order term and is below 1 %.
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

/// Truth: case `fe-tends-to-half-space` of docs/verification.md. Local quantities converge faster than the load. On a block of 20
/// contact radii the peak pressure is Hertz's value (6 P E*² / (pi³ R²))^(1/3) for the computed load P, to 1 %.
#[test]
fn local_quantities_converge_faster() {
    let frame = ContactFrame::grid([1.2; 2], [16; 2], [0.0; 2], 0.0).unwrap();
    let aluminium = Stiffness::isotropic(70e3, 0.33).expect("an admissible material");
    let (force, peak) = force_and_peak(&mut block(&aluminium, (20.0, 9, 13), &frame), &frame);
    let modulus = 1.0 / ((1.0 - 0.33 * 0.33) / 70e3 + 0.91 / 210e3);
    let hertz = (6.0 * force * modulus * modulus / (std::f64::consts::PI.powi(3) * 2500.0)).cbrt();
    assert!((peak / hertz - 1.0).abs() < 0.01, "{peak} {hertz}");
}

/// Flexibility with a relative error, as if it came from a wrong cache entry.
struct Spoilt(Arc<dyn Flexibility>, f64);

impl Spoilt {
    fn scale(&self, gap: &mut [f64]) {
        gap.iter_mut().for_each(|g| *g *= 1.0 - self.1);
    }
}

impl Flexibility for Spoilt {
    fn n_cells(&self) -> usize {
        self.0.n_cells()
    }

    fn apply(&self, tractions: &[f64], gap: &mut [f64]) {
        self.0.apply(tractions, gap);
        self.scale(gap);
    }

    fn apply_normal(&self, pressure: &[f64], normal_gap: &mut [f64]) {
        self.0.apply_normal(pressure, normal_gap);
        self.scale(normal_gap);
    }

    fn diagonal_blocks(&self) -> orthowear::flexibility::per_cell::PerCell<Matrix3<f64>> {
        self.0.diagonal_blocks()
    }

    fn direct_sums(&self, cells: &[usize], tractions: &[f64]) -> Option<Vec<[f64; 3]>> {
        self.0.direct_sums(cells, tractions)
    }
}

/// Truth: the definition of the certificate's `operator_defect`. It is the relative difference between the gap by the flexibility
/// in use and the gap by a new solution of the body. For the correct flexibility it is rounding (1e-11).
#[test]
fn the_certificate_solves_the_body_afresh() {
    let frame = ContactFrame::grid([1.2; 2], [8; 2], [0.0; 2], 0.0).unwrap();
    for (friction, spoilt) in [
        (FrictionLaw::None, 0.0),
        (FrictionLaw::Coulomb { mu: 0.3 }, 0.0),
        (FrictionLaw::None, 1e-5),
        (FrictionLaw::Coulomb { mu: 0.3 }, 1e-5),
    ] {
        let mut model = under_a_sphere(&mut block(&im7(30.0), (6.0, 2, 4), &frame), &frame);
        model.friction = friction;
        model.flexibility = Arc::new(Spoilt(model.flexibility, spoilt));
        let result =
            run(&model, &[indent(0.02)], &SolverOptions::default(), None, &mut Silent).expect("a run");
        let found = result.records[0].certificate.operator_defect.expect("the factor is at hand");
        assert!((found - spoilt).abs() < 1e-11 + 1e-3 * spoilt, "{friction:?} {spoilt:e}: {found:e}");
    }
}
