//! Runs a scene and classifies the outcome. The audit of a converged state uses only the fields of this state.

use std::fs;
use std::sync::atomic::AtomicBool;

use orthowear::error::Result;
use orthowear::evolution::Model;
use orthowear::evolution::observer::Observer;
use orthowear::evolution::records::{Divergence, FrameState, IncrementRecord, Outcome};
use orthowear::scene;
use orthowear::simulation::build;

use super::audit::audit;

pub enum Verdict {
    /// All steps converged and passed the audit.
    Certified(Run),
    /// The run did not converge and reports a reason. Its converged steps passed the audit.
    NotConverged(Divergence, Run),
    Refused(String),
}

pub struct Run {
    pub records: Vec<IncrementRecord>,
    pub warnings: Vec<String>,
    /// Tractions of the last state, `[3, N]`: the x components of all cells, then all y, then all normal components.
    pub tractions: Vec<f64>,
}

#[derive(Default)]
struct Kept(Vec<FrameState>);

impl Observer for Kept {
    fn progress(&mut self, _: &str, _: f64, _: Option<f64>) {}

    fn increment_done(&mut self, _: &IncrementRecord, state: &FrameState) -> Result<()> {
        self.0.push(state.clone());
        Ok(())
    }
}

pub fn run(name: &str, scene: &str, mesh: Option<&[u8]>) -> Verdict {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("scene.toml");
    fs::write(&path, scene).expect("a written scene");
    if let Some(mesh) = mesh {
        fs::write(folder.path().join("block.msh"), mesh).expect("a written mesh");
    }
    let place = format!("{}/", folder.path().display());
    let refused = |message: String| Verdict::Refused(message.replace(&place, ""));
    let plan = match scene::read(&path, &[]) {
        Ok(plan) => plan,
        Err(mistakes) => return refused(mistakes.to_string()),
    };
    let study = match build(&plan, &mut |_| {}, &AtomicBool::new(false)) {
        Ok(study) => study,
        Err(failure) => return refused(failure.error.to_string()),
    };
    let mut kept = Kept::default();
    let result = match study.run(&mut kept) {
        Ok(result) => result,
        Err(error) => return refused(error.to_string()),
    };
    for (record, state) in result.records.iter().zip(&kept.0) {
        finite(name, record, state);
        if record.converged {
            check(name, (study.model(), plan.solver.tolerance), record, state);
        }
    }
    let converged = result.records.iter().all(|record| record.converged);
    let before = plan.notes.iter().chain(&study.report.warnings).map(|warning| warning.text.clone());
    let warnings = before.chain(result.warnings).collect();
    let tractions = kept.0.pop().map(|state| state.tractions).unwrap_or_default();
    let run = Run { records: result.records, warnings, tractions };
    match result.outcome {
        Outcome::Converged => {
            assert!(converged, "{name}: a step that did not converge in a run that did");
            Verdict::Certified(run)
        }
        Outcome::NotConverged(reason) => {
            assert!(!converged, "{name}: {reason:?}");
            Verdict::NotConverged(reason, run)
        }
        Outcome::Interrupted => panic!("{name}: nobody interrupts"),
    }
}

/// Asserts that a record and its state have finite numbers, even in steps that did not converge.
fn finite(name: &str, record: &IncrementRecord, state: &FrameState) {
    // JSON writes non-finite numbers as null.
    let json = serde_json::to_string(record).expect("a record has a form");
    assert!(!json.contains("null"), "{name}: {json}");
    let fields = [&state.tractions, &state.gap, &state.slip, &state.wear_depth];
    assert!(fields.into_iter().flatten().all(|value| value.is_finite()), "{name}: {}", record.name);
}

fn check(name: &str, (model, tolerance): (&Model, f64), record: &IncrementRecord, state: &FrameState) {
    let n = model.frame.n_cells();
    let place = format!("{name}, {} {}", record.name, record.increment);
    assert!(record.certificate.natural_residual <= tolerance, "{place}: {:?}", record.certificate);
    let pressure = &state.tractions[2 * n..];
    let force: f64 = pressure.iter().zip(&model.frame.areas).map(|(p, area)| p * area).sum();
    assert!((force - record.normal_force).abs() <= 1e-10 * force, "{place}: {force} {}", record.normal_force);
    if force == 0.0 {
        assert!(state.tractions.iter().all(|t| *t == 0.0), "{place}: shear without pressure");
        return;
    }
    let blocks = model.flexibility.diagonal_blocks();
    let mut elastic = vec![0.0; 3 * n];
    model.flexibility.apply(&state.tractions, &mut elastic);
    let (p_max, mut size) = (pressure.iter().copied().fold(0.0, f64::max), record.approach.abs());
    let (mut defect, mut residual) = (0.0_f64, 0.0_f64);
    for i in 0..n {
        let terms = [model.initial_gap[2 * n + i], -record.approach, elastic[2 * n + i]];
        size = terms.iter().fold(size, |size, term| size.max(term.abs()));
        // The flexibility of meshed bodies may be unknown outside the contact.
        if pressure[i] > 0.0 {
            defect = defect.max((terms.iter().sum::<f64>() - state.gap[2 * n + i]).abs());
        }
        let star = (pressure[i] - state.gap[2 * n + i] / blocks[i][(2, 2)]).max(0.0);
        residual = residual.max((pressure[i] - star).abs() / p_max);
    }
    assert!(defect <= 1e-11 * size, "{place}: the gap is not that of the tractions: {defect:e} of {size:e}");
    // Rounding errors of gaps that are much larger than the elastic displacements.
    let unit = blocks[0][(2, 2)];
    let rounding = 1e-13 * size / (unit * p_max);
    assert!(residual <= 1.01 * tolerance + rounding, "{place}: residual {residual:e}");
    let found = audit(state, model.friction.ellipse(), unit);
    assert!(found.passes(1e-6 + rounding), "{place}: {found:?}");
}
