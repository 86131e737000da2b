//! Case `str-penalty-choice` of docs/verification.md: step sizes of the solvers. The solvers use no penalty parameters r_n and
//! r_t. Instead, the operator gives the compliances of single cells. These compliances scale the natural residual, local steps,
//! and the criteria for contact, stick and slip.

use std::sync::Arc;

use nalgebra::Matrix3;
use orthowear::contact::{Method, SolverOptions};
use orthowear::evolution::records::{Divergence, Outcome};
use orthowear::flexibility::Flexibility;
use orthowear::flexibility::per_cell::PerCell;

use crate::common::{indent, shift, solve_with, sphere_on_frp};

/// An operator whose diagonal blocks, the compliances of cells, are wrong by the factors `normal` and `tangential`.
struct Misjudged {
    operator: Arc<dyn Flexibility>,
    normal: f64,
    tangential: f64,
}

impl Flexibility for Misjudged {
    fn n_cells(&self) -> usize {
        self.operator.n_cells()
    }

    fn apply(&self, tractions: &[f64], gap: &mut [f64]) {
        self.operator.apply(tractions, gap);
    }

    fn apply_normal(&self, pressure: &[f64], normal_gap: &mut [f64]) {
        self.operator.apply_normal(pressure, normal_gap);
    }

    fn diagonal_blocks(&self) -> PerCell<Matrix3<f64>> {
        let scales = [self.tangential.sqrt(), self.tangential.sqrt(), self.normal.sqrt()];
        let scaled = |block: &Matrix3<f64>| Matrix3::from_fn(|i, j| block[(i, j)] * scales[i] * scales[j]);
        self.operator.diagonal_blocks().map(scaled)
    }
}

/// Truth: case `str-penalty-choice`. Compliances of cells up to a thousand times too large or too small give the same solution,
/// or the run reports no convergence. Tractions agree to 1e-6 of the largest pressure. The correct compliances take at most three
/// times the operator applications of the best choice. Compliances that are too large reduce the residual by their factor, so the
/// tolerance is reduced by this factor, too.
#[test]
fn step_sizes_a_thousand_times_off() {
    for method in [Method::Newton, Method::BarzilaiBorwein] {
        let steps = [indent(0.02), shift(0.008, 30.0)];
        let run = |normal: f64, tangential: f64| {
            let mut model = sphere_on_frp(30.0, 1.2, 20);
            let operator = model.flexibility;
            model.flexibility = Arc::new(Misjudged { operator, normal, tangential });
            let tolerance = 1e-8 / normal.max(tangential).max(1.0);
            let options =
                SolverOptions { tolerance, method, max_iterations: 5000, ..SolverOptions::default() };
            solve_with(&model, &steps, &options)
        };
        let own = run(1.0, 1.0);
        assert_eq!(own.outcome, Outcome::Converged, "{method:?}");
        let count = |records: &[orthowear::evolution::records::IncrementRecord]| {
            records.iter().map(|record| record.operator_applications).sum::<usize>()
        };
        let mut least = count(&own.records);
        let peak = own.records[1].peak_pressure;
        for (normal, tangential) in [
            (1e-3, 1e-3),
            (1e-1, 1e-1),
            (10.0, 10.0),
            (1e3, 1e3),
            (1.0, 1e-3),
            (1.0, 1e3),
            (1e-3, 1.0),
            (1e3, 1.0),
        ] {
            let result = run(normal, tangential);
            let name = format!("{method:?} {normal} {tangential}");
            match result.outcome {
                Outcome::Converged => {
                    let pairs = result.state.tractions.iter().zip(&own.state.tractions);
                    let apart = pairs.map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
                    assert!(apart < 1e-6 * peak, "{name}: {apart:e} of {peak}");
                    least = least.min(count(&result.records));
                }
                Outcome::NotConverged(reason) => assert_eq!(reason, Divergence::Iterations, "{name}"),
                Outcome::Interrupted => panic!("nobody interrupts"),
            }
            println!("{name}: {:?}, {} products", result.outcome, count(&result.records));
        }
        assert!(count(&own.records) <= 3 * least, "{method:?}: {} {least}", count(&own.records));
    }
}
