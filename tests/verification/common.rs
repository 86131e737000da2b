//! Materials, models and steps for several tests: two half-spaces, or a half-space and a rigid body, on a grid frame.

use std::sync::Arc;

use orthowear::bem::half_space::{CrossBlocks, FftFlexibility, Side, SurfaceGreen};
use orthowear::contact::SolverOptions;
use orthowear::error::Result;
use orthowear::evolution::observer::Observer;
use orthowear::evolution::records::{FrameState, IncrementRecord};
use orthowear::evolution::step::{
    ClosedPath, Cycles, Drive, Integrator, JumpPolicy, Normal, Step, StepKind, Tangential,
};
use orthowear::evolution::{Model, RunResult, run};
use orthowear::frame::ContactFrame;
use orthowear::geometry::fibre_axes;
use orthowear::laws::friction::FrictionLaw;
use orthowear::laws::wear::WearLaw;
use orthowear::material::{Orthotropic, Stiffness};

/// Returns `finest` in runs of `scripts/test --thorough`, and `usual` otherwise.
pub fn usual_or_finest<T>(usual: T, finest: T) -> T {
    if std::env::var_os("ORTHOWEAR_THOROUGH").is_some() { finest } else { usual }
}

/// Asserts orders of convergence for meshes with `cells` along a side. The last order must exceed `order`, earlier orders must
/// exceed `order` - 0.3.
pub fn assert_order<const N: usize>(errors: &[f64; N], cells: &[usize; N], order: f64, case: &str) {
    let found = |k: usize| (errors[k] / errors[k + 1]).ln() / (cells[k + 1] as f64 / cells[k] as f64).ln();
    let orders: Vec<f64> = (0..N - 1).map(found).collect();
    println!("{case}: orders {orders:.3?}");
    let (last, before) = orders.split_last().expect("two meshes at least");
    assert!(
        *last > order && before.iter().all(|found| *found > order - 0.3),
        "{case}: {orders:?}, {errors:?}"
    );
}

/// Stiffness of IM7/8551-7 with the fibre tilted out of the surface by `tilt` degrees; nu23 = 0.369.
pub fn im7(tilt: f64) -> Stiffness {
    let constants = Orthotropic {
        e1: 167_230.0,
        e2: 9544.0,
        e3: 9544.0,
        g12: 5292.0,
        g13: 5292.0,
        g23: 3483.0,
        nu12: 0.272,
        nu13: 0.272,
        nu23: 0.369,
    };
    let material = Stiffness::orthotropic(&constants).expect("IM7 is admissible");
    material.rotated(&fibre_axes(tilt.to_radians(), 0.0))
}

/// Stiffness, in material axes, of the CFRP in the tables of independent programs.
pub fn tabulated_cfrp() -> Stiffness {
    let constants = Orthotropic {
        e1: 140e3,
        e2: 10e3,
        e3: 9e3,
        g12: 5.2e3,
        g13: 4.8e3,
        g23: 3.3e3,
        nu12: 0.30,
        nu13: 0.28,
        nu23: 0.45,
    };
    Stiffness::orthotropic(&constants).expect("the tabulated CFRP is admissible")
}

/// Steel, E = 210 GPa, nu = 0.3.
pub fn steel() -> Stiffness {
    Stiffness::isotropic(210e3, 0.3).expect("steel is admissible")
}

/// Friction of fibre-reinforced plastic in the model [`sphere_on_frp`].
pub fn frp_friction(tilt: f64) -> FrictionLaw {
    FrictionLaw::Frp { mu_l: 0.4, mu_t: 0.5, mu_n: 0.55, tilt: tilt.to_radians(), azimuth: 0.0 }
}

/// Wear of fibre-reinforced plastic in the model [`sphere_on_frp`].
pub fn frp_wear(tilt: f64) -> WearLaw {
    WearLaw::Frp { i_l: 5.0e-10, i_t: 6.25e-10, i_n: 6.875e-10, tilt: tilt.to_radians(), azimuth: 0.0 }
}

/// Two half-spaces (`upper` rigid if `None`) on a square grid of `cells` x `cells` cells.
pub fn half_spaces(
    lower: &Stiffness,
    upper: Option<&Stiffness>,
    (half_width, cells): (f64, usize),
    gap: impl Fn(f64, f64) -> f64,
) -> Model {
    rectangle(lower, upper, ([half_width; 2], [cells; 2]), gap)
}

/// Like [`half_spaces`], but on a rectangular frame.
pub fn rectangle(
    lower: &Stiffness,
    upper: Option<&Stiffness>,
    (half_width, cells): ([f64; 2], [usize; 2]),
    gap: impl Fn(f64, f64) -> f64,
) -> Model {
    let frame = ContactFrame::grid(half_width, cells, [0.0; 2], 0.0).expect("an admissible grid");
    let grid = frame.grid.expect("a grid frame");
    let below = SurfaceGreen::new(lower, Side::Lower).expect("a surface Green's function");
    let green = match upper {
        None => below,
        Some(material) => {
            let above = SurfaceGreen::new(material, Side::Upper).expect("a surface Green's function");
            SurfaceGreen::sum(&[&below, &above])
        }
    };
    let flexibility = FftFlexibility::new(grid.cells, grid.spacing, &green, CrossBlocks::SkipVanishing)
        .expect("an operator");
    let n = frame.n_cells();
    let mut initial_gap = vec![0.0; 3 * n];
    for (cell, center) in frame.centers.iter().enumerate() {
        initial_gap[2 * n + cell] = gap(center.x, center.y);
    }
    Model {
        frame,
        flexibility: Arc::new(flexibility),
        initial_gap,
        loads: Vec::new(),
        floating: Vec::new(),
        friction: FrictionLaw::None,
        wear: WearLaw::None,
        wear_share: 1.0,
    }
}

/// The reference scene: a steel sphere of R = 50 mm on IM7 with fibres tilted by `tilt` degrees.
pub fn sphere_on_frp(tilt: f64, half_width: f64, cells: usize) -> Model {
    let mut model = half_spaces(&im7(tilt), Some(&steel()), (half_width, cells), sphere(50.0));
    model.friction = frp_friction(tilt);
    model
}

pub fn sphere(radius: f64) -> impl Fn(f64, f64) -> f64 {
    move |x, y| (x * x + y * y) / (2.0 * radius)
}

pub fn step(name: &str) -> Step {
    Step {
        name: name.to_owned(),
        normal: None,
        tangential: None,
        tilt: None,
        spin: None,
        loads: Vec::new(),
        cyclic_loads: Vec::new(),
        increments: 1,
        friction: true,
        wear: true,
        kind: StepKind::Monotone,
        history_row: None,
    }
}

pub fn indent(approach: f64) -> Step {
    Step { normal: Some(Normal::Approach(approach)), ..step("indent") }
}

pub fn press(force: f64) -> Step {
    Step { normal: Some(Normal::Force(force)), ..step("press") }
}

/// Tangential displacement by `distance` (mm) at the `angle` (degrees) from x.
pub fn shift(distance: f64, angle: f64) -> Step {
    let (s, c) = angle.to_radians().sin_cos();
    Step { tangential: Some(Tangential::Shift([distance * c, distance * s])), ..step("shift") }
}

pub fn fretting(count: u64, amplitude: f64, jumps: usize, integrator: Integrator) -> Step {
    let path = ClosedPath {
        drive: Drive::Shift,
        amplitude: [amplitude, 0.0],
        angle: 0.0,
        increments: 1,
        resolved_cycles: None,
    };
    let cycles = Cycles { count: count as f64, jumps: JumpPolicy::Number(jumps), integrator };
    Step { kind: StepKind::Fretting { path, cycles }, ..step("fretting") }
}

pub fn path_of(step: &mut Step) -> &mut ClosedPath {
    match &mut step.kind {
        StepKind::Fretting { path, .. } => path,
        _ => panic!("no closed path"),
    }
}

pub struct Silent;

impl Observer for Silent {
    fn progress(&mut self, _: &str, _: f64, _: Option<f64>) {}

    fn increment_done(&mut self, _: &IncrementRecord, _: &FrameState) -> Result<()> {
        Ok(())
    }
}

pub fn solve(model: &Model, steps: &[Step]) -> RunResult {
    solve_with(model, steps, &SolverOptions::default())
}

pub fn solve_with(model: &Model, steps: &[Step], options: &SolverOptions) -> RunResult {
    run(model, steps, options, None, &mut Silent).expect("a run without errors")
}

pub fn relative(found: f64, wanted: f64) -> f64 {
    (found - wanted).abs() / wanted.abs()
}

/// Values of an independent program for the model [`sphere_on_frp`].
pub fn reference() -> serde_json::Value {
    serde_json::from_str(include_str!("../data/sphere-on-frp.json")).expect("a valid data file")
}
