//! Steady sliding: closed forms for worn contacts. docs/verification.md lists the named cases.

use std::sync::Arc;

use orthowear::contact::SolverOptions;
use orthowear::error::Result;
use orthowear::evolution::records::Outcome;
use orthowear::evolution::step::{Cycles, Integrator, JumpPolicy, Normal, Step, StepKind};
use orthowear::evolution::{Model, RunResult};
use orthowear::flexibility::Flexibility;
use orthowear::flexibility::per_cell::PerCell;
use orthowear::frame::ContactFrame;
use orthowear::laws::friction::FrictionLaw;
use orthowear::laws::wear::WearLaw;
use orthowear::material::Stiffness;

use crate::common::{half_spaces, relative, solve, sphere, step};

/// A step of steady sliding in the direction `angle`, degrees.
fn slide(distance: f64, angle: f64, jumps: JumpPolicy, integrator: Integrator) -> Step {
    let cycles = Cycles { count: distance, jumps, integrator };
    Step { kind: StepKind::Sliding { angle: angle.to_radians(), cycles }, ..step("slide") }
}

pub(super) fn slide_to(distance: f64, tolerance: f64) -> Step {
    slide(distance, 0.0, JumpPolicy::Tolerance(tolerance), Integrator::Sdirk2)
}

pub(super) fn half_space(e_star: f64, frame: (f64, usize), gap: impl Fn(f64, f64) -> f64) -> Model {
    let material = Stiffness::isotropic(0.91 * e_star, 0.3).expect("an admissible material");
    half_spaces(&material, None, frame, gap)
}

/// A step that presses the bodies without wear, because pressures alone can cause tangential slip.
pub(super) fn press(force: f64) -> Step {
    Step { wear: false, ..crate::common::press(force) }
}

pub(super) fn last(run: &RunResult) -> &orthowear::evolution::records::IncrementRecord {
    assert_eq!(run.outcome, Outcome::Converged, "{:?}", run.warnings);
    run.records.last().expect("records")
}

/// Truth: case `archard-global-volume`. The wear volume is V = k P s for any profile. k is the specific wear rate, P the load, s
/// the sliding distance.
#[test]
fn volume_is_that_of_archard() {
    let rough = |x: f64, y: f64| x * x / 40.0 + y * y / 30.0 + 1e-3 * ((17.0 * x).sin() + (23.0 * y).cos());
    let cone = |x: f64, y: f64| 0.01 * x.hypot(y);
    let flat = |x: f64, y: f64| if x.hypot(y) < 0.8 { 0.0 } else { 10.0 };
    let profiles = [
        ("sphere", half_space(1e5, (2.5, 32), sphere(20.0))),
        ("flat", half_space(1e5, (2.5, 32), flat)),
        ("cone", half_space(1e5, (2.5, 32), cone)),
        ("rough", half_space(1e5, (2.5, 32), rough)),
    ];
    for (name, mut model) in profiles {
        model.wear = WearLaw::Archard { i: 1e-8 };
        model.friction = FrictionLaw::Coulomb { mu: 0.3 };
        let run = solve(&model, &[press(1000.0), slide_to(10_000.0, 1e-2)]);
        let record = last(&run);
        assert!(relative(record.worn_volume, 0.1) < 1e-10, "{name}: {}", record.worn_volume);
        assert_eq!(record.distance_slid, 10_000.0);
        assert!(
            relative(record.dissipation - run.records[0].dissipation, 3e6) < 1e-8,
            "{name}: {}",
            record.dissipation
        );
    }
}

/// Truth: a force that grows linearly from P0 to P1 wears V = k s (P0 + P1) / 2. k is the specific wear rate, s the sliding
/// distance. SDIRK2 integrates this growth exactly.
#[test]
fn forces_change_along_the_way() {
    let mut model = half_space(1e5, (1.5, 20), sphere(20.0));
    model.wear = WearLaw::Archard { i: 1e-8 };
    let ramp = Step {
        normal: Some(Normal::Force(1000.0)),
        ..slide(500.0, 30.0, JumpPolicy::Number(3), Integrator::Sdirk2)
    };
    let run = solve(&model, &[press(200.0), ramp, slide_to(100.0, 1e-3)]);
    assert_eq!(run.outcome, Outcome::Converged);
    let wanted = 1e-8 * 500.0 * 600.0;
    assert!(relative(run.records[3].worn_volume, wanted) < 1e-9, "{}", run.records[3].worn_volume);
    assert!(relative(run.records[3].normal_force, 1000.0) < 1e-9);
    assert!(relative(last(&run).worn_volume, wanted + 1e-8 * 100.0 * 1000.0) < 1e-9);
}

/// Truth: case `wear-orthotropic-direction`. Sliding over a distance s at the angle θ under the load P wears V = k(θ) P s. The
/// specific wear rate is k(θ) = √((k1 cos θ)² + (k2 sin θ)²).
#[test]
fn direction_of_sliding() {
    for (angle, k) in [(0.0, 1.0), (30.0, 0.875_f64), (90.0, 0.25)] {
        let mut model = half_space(1e5, (1.0, 8), sphere(20.0));
        model.wear = WearLaw::Orthotropic { i: [1e-8, 0.25e-8], angle: 0.0 };
        let run =
            solve(&model, &[press(100.0), slide(1000.0, angle, JumpPolicy::Number(2), Integrator::Sdirk2)]);
        let wanted = 1e-8 * k * 100.0 * 1000.0;
        assert!(relative(last(&run).worn_volume, wanted) < 1e-9, "{angle}: {}", last(&run).worn_volume);
    }
}

/// Truth: case `wear-sphere-rigid-limit`. A sphere of radius R wears to a flat of radius a = (4 R k P s / π)^¼ and depth a² /
/// (2R). k is the specific wear rate, P the load, s the sliding distance.
#[test]
fn flat_of_a_sphere() {
    let mut model = half_spaces(&crate::common::steel(), None, (2.2, 64), sphere(10.0));
    model.wear = WearLaw::Archard { i: 1e-7 };
    let run = solve(
        &model,
        &[press(10.0), slide_to(1e4, 1e-2), Step { name: "on".into(), ..slide_to(0.99e6, 1e-2) }],
    );
    let record = last(&run);
    let first = run.records.iter().rfind(|record| record.name == "slide").expect("an entry");
    let radius = |area: f64| (area / std::f64::consts::PI).sqrt();
    let exponent = (radius(record.contact_area) / radius(first.contact_area)).ln() / 100_f64.ln();
    assert!((exponent - 0.25).abs() < 0.005, "{exponent}");
    assert!(relative(radius(record.contact_area), 1.888_980_739) < 1e-2, "{}", radius(record.contact_area));
    assert!(relative(record.max_wear_depth, 0.178_412_411_6) < 1e-2, "{}", record.max_wear_depth);
    assert!(relative(record.worn_volume, 1.0) < 1e-9);
}

/// Truth: case `wear-sphere-elastic` at the dimensionless sliding distances τ = k p0 s / δ0 = 1 and 10. p0 and δ0 are the peak
/// pressure and the approach before wear, k is the specific wear rate, s the distance.
#[test]
fn elastic_sphere() {
    let (radius, a0, e_star) = (100.0, 1.0, 1e5);
    let force = 4.0 * e_star / (3.0 * radius);
    let (p0, delta0) = (1.5 * force / std::f64::consts::PI, a0 * a0 / radius);
    let cells = 96;
    for (tau, [a, p, h, delta]) in
        [(1.0, [1.408, 0.4656, 0.6786, 1.3561]), (10.0, [2.31, 0.1308, 2.5229, 2.8966])]
    {
        let mut model = half_space(e_star, (2.7, cells), sphere(radius));
        model.wear = WearLaw::Archard { i: 1e-8 };
        let run = solve(&model, &[press(force), slide_to(tau * delta0 / (1e-8 * p0), 1e-3)]);
        let record = last(&run);
        let middle = cells / 2 * cells + cells / 2;
        let pressure = run.state.tractions[2 * cells * cells + middle];
        let found = (record.contact_area / std::f64::consts::PI).sqrt();
        assert!((found - a).abs() < 5.4 / cells as f64, "{found} {a}");
        assert!(relative(pressure / p0, p) < 1e-2, "{} {p}", pressure / p0);
        assert!(relative(run.state.wear_depth[middle] / delta0, h) < 1e-2);
        assert!(relative(record.approach / delta0, delta) < 1e-2, "{} {delta}", record.approach / delta0);
    }
}

/// Truth: case `wear-flat-punch-steady`. Deviations from the mean pressure decay as exp(-2.06065 k s E* / a), after faster modes
/// have decayed. k is the specific wear rate, s the distance, a the radius.
#[test]
fn flat_punch_runs_in() {
    let cells = 42;
    let punch = |x: f64, y: f64| if x.hypot(y) < 1.0 { 0.0 } else { 1e3 };
    let pressures = |distance: f64| {
        let mut model = half_space(1.0, (1.05, cells), punch);
        model.wear = WearLaw::Archard { i: 1.0 };
        let slide = slide(distance, 0.0, JumpPolicy::Number(80), Integrator::Sdirk2);
        let run = solve(&model, &[press(1.0), slide]);
        let mean = 1.0 / last(&run).contact_area;
        run.state.tractions[2 * cells * cells..].iter().map(|p| p / mean).collect::<Vec<f64>>()
    };
    let [early, late] = [2.4, 3.4].map(|t| pressures(t)[cells / 2 * cells + cells / 2] - 1.0);
    let rate = (early / late).ln();
    assert!(relative(rate, 2.060_65) < 2e-2, "{rate}");
    for (cell, p) in pressures(7.0).iter().enumerate() {
        let at = |k: usize| (k as f64 + 0.5) * 2.1 / cells as f64 - 1.05;
        let inside = at(cell / cells).hypot(at(cell % cells)) < 0.93;
        assert!(!inside || (p - 1.0).abs() < 1e-3, "cell {cell}: {p}");
    }
}

/// Flexibility of independent elastic columns: their number and stiffness.
struct Columns(usize, f64);

impl Flexibility for Columns {
    fn n_cells(&self) -> usize {
        self.0
    }

    fn apply(&self, tractions: &[f64], gap: &mut [f64]) {
        gap.iter_mut().zip(tractions).for_each(|(gap, traction)| *gap = traction / self.1);
    }

    fn apply_normal(&self, pressure: &[f64], gap: &mut [f64]) {
        self.apply(pressure, gap);
    }

    fn couples_normal_tangential(&self) -> bool {
        false
    }

    fn diagonal_blocks(&self) -> PerCell<nalgebra::Matrix3<f64>> {
        PerCell::Same(nalgebra::Matrix3::identity() / self.1, self.0)
    }
}

/// Model and steps of two columns of stiffness 0.8 with initial forces 2 and 0.5.
fn columns(distance: f64, jumps: usize, integrator: Integrator) -> (Model, [Step; 2]) {
    let frame = ContactFrame::grid([1.0, 0.5], [2, 1], [0.0; 2], 0.0).expect("a grid");
    let model = Model {
        frame,
        flexibility: Arc::new(Columns(2, 0.8)),
        initial_gap: vec![0.0, 0.0, 0.0, 0.0, 0.0, 1.875],
        loads: Vec::new(),
        floating: Vec::new(),
        friction: FrictionLaw::None,
        wear: WearLaw::Archard { i: 1.0 },
        wear_share: 1.0,
    };
    (model, [press(2.5), slide(distance, 0.0, JumpPolicy::Number(jumps), integrator)])
}

/// Truth: case `wear-winkler-exponential`. The pressures of the columns tend to their mean p̄: p(t) = p̄ + (p(0) - p̄) exp(-λt) at
/// the sliding distance t, with λ = 0.8. Explicit jumps beyond 2 / λ are refused.
#[test]
fn columns_run_in() {
    for (integrator, order) in
        [(Integrator::Explicit, 1.0), (Integrator::BackwardEuler, 1.0), (Integrator::Sdirk2, 2.0)]
    {
        let error = |jumps: usize| {
            let (model, steps) = columns(1.0, jumps, integrator);
            let run = solve(&model, &steps);
            assert!(relative(last(&run).normal_force, 2.5) < 1e-10);
            (run.state.tractions[4] - 1.586_996_723).abs()
        };
        let errors = [8, 16, 32].map(error);
        let observed = (errors[0] / errors[2]).log2() / 2.0;
        assert!((observed - order).abs() < 0.15, "{integrator:?}: {errors:?}, order {observed}");
        assert!(errors[2] < 1e-2, "{integrator:?}: {errors:?}");
    }
    let (model, steps) = columns(10.0, 3, Integrator::Explicit);
    let error = orthowear::evolution::run(
        &model,
        &steps,
        &SolverOptions::default(),
        None,
        &mut crate::common::Silent,
    );
    let error: Result<()> = error.map(|_| ());
    assert!(error.expect_err("10 / 3 > 2 / 0.8").to_string().contains("Take 4 jumps"));
}
