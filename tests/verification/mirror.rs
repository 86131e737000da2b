//! Solutions of mirror-symmetric increments are mirror-symmetric.

use orthowear::contact::SolverOptions;
use orthowear::evolution::Model;
use orthowear::evolution::records::Outcome;
use orthowear::evolution::step::{Integrator, Rolling, Step, StepKind};
use orthowear::laws::friction::FrictionLaw;

use crate::common::{
    fretting, frp_wear, half_spaces, indent, press, shift, solve_with, sphere, sphere_on_frp, steel, step,
};
use crate::observed::pull;

/// Tolerance relative to the largest value, for solver residuals of 1e-11.
const SOLVED: f64 = 2e-9;

/// Asserts that tractions and wear depths equal their mirror images along axis `across` (0 for x, 1 for y). The traction along
/// this axis is odd, all other fields are even. The tolerance is `share` times the largest value.
fn is_own_image(model: &Model, steps: &[Step], across: usize, share: f64) {
    let run = solve_with(model, steps, &SolverOptions { tolerance: 1e-11, ..SolverOptions::default() });
    assert_eq!(run.outcome, Outcome::Converged);
    let ([nx, ny], n) = (model.frame.grid.expect("a grid").cells, model.frame.n_cells());
    let image = |cell: usize| {
        let (x, y) = (cell / ny, cell % ny);
        if across == 0 { (nx - 1 - x) * ny + y } else { x * ny + ny - 1 - y }
    };
    let peak = run.records.last().expect("steps").peak_pressure;
    for (plane, tractions) in run.state.tractions.chunks_exact(n).enumerate() {
        let sign = if plane == across { -1.0 } else { 1.0 };
        for cell in 0..n {
            let (a, b) = (tractions[cell], sign * tractions[image(cell)]);
            assert!((a - b).abs() < share * peak, "{plane} {cell}: {a} {b}");
        }
    }
    let wear = &run.state.wear_depth;
    let deepest = wear.iter().fold(0.0f64, |most, depth| most.max(*depth));
    for cell in 0..n {
        let (a, b) = (wear[cell], wear[image(cell)]);
        assert!((a - b).abs() <= share * deepest, "{cell}: {a} {b}");
    }
}

/// Truth: the mirror image of a solution solves the mirrored problem, and the solution is unique.
#[test]
fn hertz() {
    for cells in [20, 72] {
        let model = half_spaces(&steel(), None, (0.5, cells), sphere(10.0));
        let steps = [indent(0.004), press(600.0)].map(|step| Step { friction: false, ..step });
        is_own_image(&model, &steps, 1, SOLVED);
    }
}

/// Truth: mirror symmetry, as in [`hertz`]. The isotropic friction law is given in rotated axes.
#[test]
fn partial_slip() {
    for (cells, across) in [(24, 1), (64, 1), (24, 0)] {
        let mut model = half_spaces(&steel(), Some(&steel()), (0.6, cells), sphere(10.0));
        model.friction = FrictionLaw::Elliptic { mu: [0.3; 2], angle: 0.4 };
        let (force, angle) = if across == 1 { ([200.0, 0.0], 0.0) } else { ([0.0, 200.0], 90.0) };
        is_own_image(&model, &[press(1000.0), pull(force), shift(-0.001, angle)], across, SOLVED);
    }
}

/// Truth: mirror symmetry, as in [`hertz`], with coupled pressures and tangential tractions.
#[test]
fn tilted_fibres() {
    for cells in [24, 64] {
        let model = sphere_on_frp(30.0, 1.4, cells);
        let steps = [indent(0.02), shift(0.008, 0.0), press(200.0), pull([30.0, 0.0])];
        is_own_image(&model, &steps, 1, SOLVED);
    }
}

/// Truth: mirror symmetry, as in [`hertz`]. In partial slip, the strokes that determine the stick zone have residuals of only
/// 1e-6 (src/evolution/fretting/settings.rs). The tolerance is therefore larger for the small amplitude.
#[test]
fn wear() {
    let mut model = sphere_on_frp(30.0, 1.4, 24);
    model.wear = frp_wear(30.0);
    for (amplitude, share) in [(0.05, SOLVED), (0.004, 2e-6)] {
        let steps = [indent(0.02), fretting(1000, amplitude, 3, Integrator::Sdirk2)];
        is_own_image(&model, &steps, 1, share);
    }
}

/// Truth: mirror symmetry, as in [`hertz`].
#[test]
fn rolling() {
    let mut model = half_spaces(&steel(), Some(&steel()), (0.6, 32), sphere(10.0));
    model.friction = FrictionLaw::Coulomb { mu: 0.3 };
    let rolling = Rolling { quarter_turns: 0, creepage: [2e-3, 0.0], spin: 0.0, distance: 1.0 };
    let steps = [press(800.0), Step { kind: StepKind::Rolling(rolling), ..step("roll") }];
    is_own_image(&model, &steps, 1, SOLVED);
}
