//! Normal force on a block fixed at its base, relative to the force on a half-space: the table of docs/theory-coupling.md.
//!
//!     cargo run --release --example blocks

#[path = "../im7.rs"]
mod im7;
#[path = "../../tests/fixtures/structured.rs"]
mod structured;

use std::sync::Arc;

use orthowear::bem::half_space::CrossBlocks::SkipVanishing;
use orthowear::body::{ElasticBody, FeBody, HalfSpaceBody};
use orthowear::contact::SolverOptions;
use orthowear::coupling::{Coupling, couple, surface_distance};
use orthowear::error::{Error, Result};
use orthowear::evolution::observer::Observer;
use orthowear::evolution::records::{FrameState, IncrementRecord};
use orthowear::evolution::step::{Normal, Step, StepKind};
use orthowear::evolution::{Model, run};
use orthowear::fem::{FeSpec, HexFormulation, Support};
use orthowear::frame::{ContactFrame, GapShape, InitialGap, Side};
use orthowear::laws::friction::FrictionLaw;
use orthowear::laws::wear::WearLaw;
use orthowear::material::Stiffness;

use structured::{BlockElements, GradedBlock};

/// Half side length of the frame (mm), and number of cells along a side.
const FRAME: (f64, usize) = (1.2, 24);

/// Blocks: half-width, which equals the depth (mm); number of elements from the contact to the side; number of elements
/// from the contact to the base.
const SIZES: [(f64, usize, usize); 4] = [(6.0, 6, 10), (12.0, 8, 12), (24.0, 10, 14), (48.0, 12, 17)];

fn main() -> Result<()> {
    let frame = ContactFrame::grid([FRAME.0; 2], [FRAME.1; 2], [0.0; 2], 0.0)?;
    let mut materials = vec![("isotropic".to_owned(), Stiffness::isotropic(70e3, 0.33)?)];
    for tilt in [0.0, 30.0, 90.0] {
        materials.push((format!("fibre at {tilt} degrees"), im7::im7(tilt)?));
    }
    let sizes: Vec<String> = SIZES.iter().map(|(size, ..)| format!("{size} mm")).collect();
    println!("| lower body | half-space, N | {} |", sizes.join(" | "));
    println!("|{}", "---|".repeat(2 + SIZES.len()));
    for (name, material) in materials {
        let reference = force(&mut HalfSpaceBody::new(&material, Side::Lower, &frame)?, &frame)?;
        print!("| {name} | {reference:.2} |");
        for size in SIZES {
            let apart = force(&mut block(&material, size, &frame)?, &frame)? / reference - 1.0;
            print!(" {:+.2} % |", 100.0 * apart);
        }
        println!();
    }
    Ok(())
}

/// Block fixed at its base. Its element faces at the contact coincide with the cells of the frame.
fn block(
    material: &Stiffness,
    (size, outer, deep): (f64, usize, usize),
    frame: &ContactFrame,
) -> Result<FeBody> {
    let graded = GradedBlock {
        half_width: [size; 2],
        depth: size,
        patch_half_width: [FRAME.0; 2],
        patch_cells: [FRAME.1; 2],
        outer_cells: outer,
        depth_cells: deep,
        first_depth: Some(2.0 * FRAME.0 / FRAME.1 as f64),
        solids: BlockElements::Hex8,
        side: Side::Lower,
        distortion: 0.0,
    };
    let base =
        Support { group: "base".into(), components: [true; 3], value: [0.0; 3], gradient: [[0.0; 3]; 3] };
    let spec = FeSpec {
        name: "block".into(),
        mesh: Arc::new(graded.mesh()?),
        regions: vec![(None, material.clone().into())],
        formulation: HexFormulation::Enhanced,
        supports: vec![base],
        foundations: Vec::new(),
        pressures: Vec::new(),
        tractions: Vec::new(),
        body_force: [0.0; 3],
        temperature_change: 0.0,
    };
    FeBody::new(spec, "contact", Side::Lower, frame)
}

/// Normal force (N) between `lower` and a steel half-space at an approach of 0.02 mm. The gap is the gap of a sphere of
/// radius 50 mm.
fn force(lower: &mut dyn ElasticBody, frame: &ContactFrame) -> Result<f64> {
    let steel = Stiffness::isotropic(210e3, 0.3)?;
    let mut upper = HalfSpaceBody::new(&steel, Side::Upper, frame)?;
    let gap = InitialGap::from(GapShape::Sphere { radius: 50.0 });
    let distance = surface_distance(&gap, frame, lower, &upper)?;
    let coupled = couple(lower, &mut upper, frame, Coupling::Schur, SkipVanishing)?;
    let model = Model {
        frame: frame.clone(),
        initial_gap: coupled.initial_gap(&distance),
        flexibility: coupled.flexibility,
        loads: Vec::new(),
        floating: Vec::new(),
        friction: FrictionLaw::None,
        wear: WearLaw::None,
        wear_share: 1.0,
    };
    let press = Step {
        name: "press".into(),
        normal: Some(Normal::Approach(0.02)),
        tangential: None,
        tilt: None,
        spin: None,
        loads: Vec::new(),
        cyclic_loads: Vec::new(),
        increments: 1,
        friction: false,
        wear: false,
        kind: StepKind::Monotone,
        history_row: None,
    };
    let result = run(&model, &[press], &SolverOptions::default(), None, &mut Silent)?;
    match result.records.first() {
        Some(record) if record.converged => Ok(record.normal_force),
        _ => Err(Error::numerical("the contact did not converge")),
    }
}

struct Silent;

impl Observer for Silent {
    fn progress(&mut self, _: &str, _: f64, _: Option<f64>) {}

    fn increment_done(&mut self, _: &IncrementRecord, _: &FrameState) -> Result<()> {
        Ok(())
    }
}
