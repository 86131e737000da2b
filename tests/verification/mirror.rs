//! Halves of increments that are their own mirror images: the same answers as of all cells.

use orthowear::contact::SolverOptions;
use orthowear::evolution::records::Outcome;
use orthowear::evolution::step::{Integrator, Rolling, Step};
use orthowear::evolution::{Model, RunResult};
use orthowear::laws::friction::FrictionLaw;
use orthowear::laws::wear::WearLaw;
use orthowear::omitted::{AllowedOmissions, OmittableWork};

use crate::common::{
    fretting, frp_friction, frp_wear, half_spaces, indent, path_of, press, shift, solve_with, sphere,
    sphere_on_frp, steel, step,
};
use crate::observed::pull;

fn solve(model: &Model, steps: &[Step], skip: AllowedOmissions) -> RunResult {
    let options = SolverOptions { tolerance: 1e-11, skip, ..SolverOptions::default() };
    let result = solve_with(model, steps, &options);
    assert_eq!(result.outcome, Outcome::Converged);
    result
}

/// Whether the pressures at the end are their own image along `across`, bit by bit: solved on all cells they differ by rounding.
fn is_image(model: &Model, run: &RunResult, across: usize) -> bool {
    let ([nx, ny], n) = (model.frame.grid.expect("a grid").cells, model.frame.n_cells());
    let pressures = &run.state.tractions[2 * n..];
    let image = |cell: usize| {
        let (x, y) = (cell / ny, cell % ny);
        if across == 0 { (nx - 1 - x) * ny + y } else { x * ny + ny - 1 - y }
    };
    (0..n).all(|cell| pressures[cell] == pressures[image(cell)])
}

/// The steps that the ledger says halves are solved in.
fn told(run: &RunResult) -> Vec<&str> {
    run.skipped.iter().map(|entry| entry.what.as_str()).filter(|what| what.starts_with("half of")).collect()
}

/// Residuals of 1e-11, and what they leave open of the largest force.
const SOLVED: f64 = 1e-9;

/// As [`compare`] to what the residuals leave open.
fn same(model: &Model, steps: &[Step], across: usize) {
    compare(model, steps, across, SOLVED);
}

/// Compares a run on halves with one on all cells, to a share of the largest.
fn compare(model: &Model, steps: &[Step], across: usize, share: f64) {
    let [half, whole] = [AllowedOmissions::ALL, AllowedOmissions::ALL.without(OmittableWork::MirrorHalf)]
        .map(|skip| solve(model, steps, skip));
    assert_eq!([told(&half).len(), told(&whole).len()], [1, 0]);
    assert!(is_image(model, &half, across));
    let last = whole.records.last().expect("steps");
    let (force, depth) =
        (last.normal_force.abs(), whole.state.wear_depth.iter().fold(0.0f64, |most, w| most.max(*w)));
    for (a, b) in half.records.iter().zip(&whole.records) {
        assert!(a.certificate.natural_residual <= 1e-11, "{}", a.certificate.natural_residual);
        assert!((a.normal_force - b.normal_force).abs() < share * force, "{}", a.name);
        for axis in 0..2 {
            assert!(
                (a.tangential_force[axis] - b.tangential_force[axis]).abs() < share * force,
                "{}",
                a.name
            );
        }
        assert_eq!((a.contact_area, a.stick_area), (b.contact_area, b.stick_area), "{}", a.name);
    }
    for (a, b) in half.state.tractions.iter().zip(&whole.state.tractions) {
        assert!((a - b).abs() < share * last.peak_pressure, "{a} {b}");
    }
    for (a, b) in half.state.wear_depth.iter().zip(&whole.state.wear_depth) {
        assert!((a - b).abs() <= share * depth, "{a} {b}");
    }
}

/// Truth: the mirror image of a solution solves the mirrored problem, and there is one solution. Pressures alone, by approach and by
/// force, on all of a small frame and on windows of a large one.
#[test]
fn hertz() {
    for cells in [20, 72] {
        let model = half_spaces(&steel(), None, (0.5, cells), sphere(10.0));
        let steps = [indent(0.004), press(600.0)].map(|step| Step { friction: false, ..step });
        same(&model, &steps, 1);
    }
}

/// Truth: as above. Equal bodies pulled along x or y, in partial slip, by force and by shift; also with a law that is the same in all
/// directions, given by turned axes.
#[test]
fn partial_slip() {
    for (cells, across) in [(24, 1), (64, 1), (24, 0)] {
        let mut model = half_spaces(&steel(), Some(&steel()), (0.6, cells), sphere(10.0));
        model.friction = FrictionLaw::Elliptic { mu: [0.3; 2], angle: 0.4 };
        let (force, angle) = if across == 1 { ([200.0, 0.0], 0.0) } else { ([0.0, 200.0], 90.0) };
        same(&model, &[press(1000.0), pull(force), shift(-0.001, angle)], across);
    }
}

/// Truth: as above, where pressure and shear are coupled: fibres tilted in the plane of the mirror, by approach, shift and forces.
#[test]
fn tilted_fibres() {
    for cells in [24, 64] {
        let model = sphere_on_frp(30.0, 1.4, cells);
        same(&model, &[indent(0.02), shift(0.008, 0.0), press(200.0), pull([30.0, 0.0])], 1);
    }
}

/// Truth: as above, for worn depths of cycles in gross and in partial slip. Where cells stick through partial slip is found by strokes
/// of residuals of 1e-6 only (src/evolution/fretting/cycle_state.rs).
#[test]
fn wear() {
    let mut model = sphere_on_frp(30.0, 1.4, 24);
    model.wear = frp_wear(30.0);
    for (amplitude, share) in [(0.05, SOLVED), (0.004, 1e-6)] {
        compare(&model, &[indent(0.02), fretting(1000, amplitude, 3, Integrator::Sdirk2)], 1, share);
    }
}

/// Truth: as above, for steady rolling along x.
#[test]
fn rolling() {
    let mut model = half_spaces(&steel(), Some(&steel()), (0.6, 32), sphere(10.0));
    model.friction = FrictionLaw::Coulomb { mu: 0.3 };
    let rolling = Rolling { quarter_turns: 0, creepage: [2e-3, 0.0], spin: 0.0, distance: 1.0 };
    same(&model, &[press(800.0), Step { rolling: Some(rolling), ..step("roll") }], 1);
}

/// Truth: docs/skips.md: what is not quite its own image is solved on all cells: a gap that differs by 1e-9 of it, laws along other
/// axes, loads across, an odd number of cells. Of steps of which some are, those before the first that is not are named.
#[test]
fn what_is_not_symmetric_is_whole() {
    let steps = [indent(0.02), shift(0.008, 0.0)];
    let whole = |model: &Model, steps: &[Step]| {
        let run = solve(model, steps, AllowedOmissions::ALL);
        assert!(told(&run).is_empty() && !is_image(model, &run, 1), "{:?}", told(&run));
    };
    let mut model = sphere_on_frp(30.0, 1.4, 20);
    let n = model.frame.n_cells();
    model.initial_gap[2 * n + 7] += 1e-9 * model.initial_gap[2 * n + 7];
    whole(&model, &steps);
    let mut model = sphere_on_frp(30.0, 1.4, 20);
    model.friction = FrictionLaw::Elliptic { mu: [0.3, 0.4], angle: 0.1 };
    whole(&model, &steps);
    whole(&sphere_on_frp(30.0, 1.4, 21), &steps);
    let mut model = sphere_on_frp(30.0, 1.4, 20);
    model.wear = WearLaw::Orthotropic { i: [1e-9, 2e-9], angle: 0.1 };
    let mut cycles = fretting(1000, 0.05, 2, Integrator::Sdirk2);
    whole(&model, &[indent(0.02), cycles.clone()]);
    model.wear = frp_wear(30.0);
    path_of(&mut cycles).angle = 0.1;
    let run = solve(&model, &[indent(0.02), cycles], AllowedOmissions::ALL);
    assert_eq!(told(&run), ["half of the cells in the iterations of step indent"]);
    assert!(!is_image(&model, &run, 1));
    let mut equal = half_spaces(&steel(), Some(&steel()), (0.6, 20), sphere(10.0));
    equal.friction = frp_friction(30.0);
    let run = solve(&equal, &[press(1000.0), pull([100.0, 1.0])], AllowedOmissions::ALL);
    assert_eq!(told(&run), ["half of the cells in the iterations of step press"]);
}
