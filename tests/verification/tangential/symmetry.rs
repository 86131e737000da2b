//! Symmetries of frictional contact: signs, axes, position, order of the bodies (case `shear-reversal-symmetry` of
//! docs/verification.md).

use std::sync::Arc;

use orthowear::bem::half_space::{CrossBlocks, FftFlexibility, Side, SurfaceGreen};
use orthowear::contact::SolverOptions;
use orthowear::evolution::records::{IncrementRecord, Outcome};
use orthowear::evolution::{Model, RunResult};
use orthowear::frame::ContactFrame;
use orthowear::laws::friction::FrictionLaw;
use orthowear::laws::wear::WearLaw;
use orthowear::material::Stiffness;

use crate::common::{half_spaces, press, solve_with, sphere, steel};
use crate::observed::pull;

const CELLS: usize = 24;

fn run(model: &Model, force: [f64; 2]) -> RunResult {
    let options = SolverOptions { tolerance: 1e-10, ..SolverOptions::default() };
    let result = solve_with(model, &[press(1000.0), pull(force)], &options);
    assert_eq!(result.outcome, Outcome::Converged);
    result
}

/// Two bodies of different materials, in which normal and tangential displacements are coupled.
fn pair(lower: &Stiffness, upper: &Stiffness) -> Model {
    let mut model = half_spaces(lower, Some(upper), (0.6, CELLS), sphere(10.0));
    model.friction = FrictionLaw::Coulomb { mu: 0.3 };
    model
}

fn aluminium() -> Stiffness {
    Stiffness::isotropic(70e3, 0.33).expect("aluminium")
}

fn last(result: &RunResult) -> &IncrementRecord {
    result.records.last().expect("records")
}

/// Largest difference of two states, relative to the largest pressure. `image` maps cells of state `a` to cells of state `b`, and
/// `q` maps tangential tractions.
fn apart(
    a: &RunResult,
    b: &RunResult,
    image: impl Fn(usize) -> usize,
    q: impl Fn([f64; 2]) -> [f64; 2],
) -> f64 {
    let n = CELLS * CELLS;
    let p_max = last(a).peak_pressure;
    (0..n)
        .map(|i| {
            let (here, there) = (&a.state.tractions, &b.state.tractions);
            let j = image(i);
            let turned = q([here[i], here[n + i]]);
            let pressure = (here[2 * n + i] - there[2 * n + j]).abs();
            pressure.max((turned[0] - there[j]).abs()).max((turned[1] - there[n + j]).abs()) / p_max
        })
        .fold(0.0, f64::max)
}

/// Truth: a force reversed or rotated by 90 degrees gives the reversed or rotated state. The bodies have different materials, Q =
/// 0.6 mu P. Tolerance: 1e-6 of the peak pressure.
#[test]
fn forces_turned_and_reversed() {
    let model = pair(&steel(), &aluminium());
    let along = run(&model, [180.0, 0.0]);
    let back = run(&model, [-180.0, 0.0]);
    let across = run(&model, [0.0, 180.0]);
    let (row, column) = (|i: usize| i / CELLS, |i: usize| i % CELLS);
    let mirrored = |i: usize| (CELLS - 1 - row(i)) * CELLS + column(i);
    assert!(apart(&along, &back, mirrored, |[x, y]| [-x, y]) < 1e-6);
    // The rotation maps (x, y) to (-y, x).
    let turned = |i: usize| (CELLS - 1 - column(i)) * CELLS + row(i);
    assert!(apart(&along, &across, turned, |[x, y]| [-y, x]) < 1e-6);
    assert!((last(&along).shift[0] + last(&back).shift[0]).abs() < 1e-6 * last(&along).shift[0]);
    assert!((last(&along).shift[0] - last(&across).shift[1]).abs() < 1e-6 * last(&along).shift[0]);
}

/// Truth: the same contact upside down. A rotation by 180 degrees about y changes the signs of x and of the normal. Afterwards,
/// forces on body 1 are forces on body 2. Tractions (qx, qy) at (x, y) therefore become (qx, -qy) at (-x, y).
#[test]
fn bodies_exchanged() {
    let upright = run(&pair(&steel(), &aluminium()), [180.0, 0.0]);
    let exchanged = run(&pair(&aluminium(), &steel()), [180.0, 0.0]);
    let mirrored = |i: usize| (CELLS - 1 - i / CELLS) * CELLS + i % CELLS;
    assert!(apart(&upright, &exchanged, mirrored, |q| [q[0], -q[1]]) < 1e-6);
    assert!((last(&upright).shift[0] - last(&exchanged).shift[0]).abs() < 1e-6 * last(&upright).shift[0]);
    // The test proves nothing if the state is its own mirror image.
    assert!(apart(&upright, &upright, mirrored, |q| [q[0], -q[1]]) > 1e-4);
}

/// Truth: a common translation of frame and gap does not change the state. The tolerance 1e-9 covers the rounding of the gap.
#[test]
fn another_place() {
    let here = pair(&steel(), &aluminium());
    let frame = ContactFrame::grid([0.6; 2], [CELLS; 2], [37.25, -12.5], 0.0).expect("a frame");
    let grid = frame.grid.expect("a grid frame");
    let greens = [(steel(), Side::Lower), (aluminium(), Side::Upper)]
        .map(|(material, side)| SurfaceGreen::new(&material, side).expect("a Green's function"));
    let green = SurfaceGreen::sum(&[&greens[0], &greens[1]]);
    let flexibility =
        FftFlexibility::new(grid.cells, grid.spacing, &green, CrossBlocks::SkipVanishing).expect("made");
    let n = frame.n_cells();
    let mut initial_gap = vec![0.0; 3 * n];
    for (i, center) in frame.centers.iter().enumerate() {
        initial_gap[2 * n + i] = sphere(10.0)(center.x - 37.25, center.y + 12.5);
    }
    let moved = Model {
        frame,
        flexibility: Arc::new(flexibility),
        initial_gap,
        loads: Vec::new(),
        floating: Vec::new(),
        friction: FrictionLaw::Coulomb { mu: 0.3 },
        wear: WearLaw::None,
        wear_share: 1.0,
    };
    assert!(apart(&run(&here, [108.0, 144.0]), &run(&moved, [108.0, 144.0]), |i| i, |q| q) < 1e-9);
}
