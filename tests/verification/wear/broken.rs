//! Fretting steps that are interrupted after their last jump, and resumed.

use orthowear::contact::SolverOptions;
use orthowear::error::{ErrorKind, Result};
use orthowear::evolution::RunCheckpoint;
use orthowear::evolution::observer::{CheckpointEvent, Observer};
use orthowear::evolution::records::{FrameState, IncrementRecord, Outcome};
use orthowear::evolution::step::{Integrator, Step};

use crate::common::{Silent, fretting, frp_wear, indent, shift, sphere_on_frp};

/// Observer that interrupts the run at the first progress message after `after` entries.
struct Breaking {
    loops: bool,
    entries: usize,
    after: usize,
    broken: bool,
    kept: Option<RunCheckpoint>,
}

impl Observer for Breaking {
    fn progress(&mut self, _: &str, _: f64, _: Option<f64>) {
        self.broken |= self.entries == self.after;
    }

    fn increment_done(&mut self, _: &IncrementRecord, _: &FrameState) -> Result<()> {
        self.entries += 1;
        Ok(())
    }

    fn on_checkpoint(&mut self, moment: CheckpointEvent, snapshot: &dyn Fn() -> RunCheckpoint) -> Result<()> {
        if moment == CheckpointEvent::Aborted {
            self.kept = Some(snapshot());
        }
        Ok(())
    }

    fn cancelled(&self) -> bool {
        self.broken
    }

    fn wants_loops(&self) -> bool {
        self.loops
    }
}

/// Truth: the uninterrupted run. The resumed run equals the uninterrupted run, bit by bit. The interruption comes during the
/// computation of the loop of force over displacement, or on the way back to the centre of the stroke.
#[test]
fn runs_broken_off_after_the_last_jump() {
    let mut model = sphere_on_frp(30.0, 1.5, 16);
    model.wear = frp_wear(30.0);
    let cycles = || fretting(50_000, 0.04, 2, Integrator::Sdirk2);
    let options = SolverOptions::default();
    for (loops, steps) in [
        (true, vec![indent(0.02), cycles(), shift(0.01, 0.0)]),
        (true, vec![indent(0.02), cycles()]),
        (false, vec![indent(0.02), cycles(), shift(0.01, 0.0)]),
    ] {
        let observer = |after: usize| Breaking { loops, entries: 0, after, broken: false, kept: None };
        let whole = orthowear::evolution::run(&model, &steps, &options, None, &mut observer(usize::MAX))
            .expect("a run");
        assert_eq!(whole.outcome, Outcome::Converged);
        let mut breaking = observer(3);
        let part = orthowear::evolution::run(&model, &steps, &options, None, &mut breaking).expect("a run");
        assert_eq!(part.outcome, Outcome::Interrupted, "{loops} {}", steps.len());
        let from = breaking.kept.expect("where the run was broken off");
        let end = orthowear::evolution::run(&model, &steps, &options, Some(from), &mut observer(usize::MAX));
        let end = end.expect("a run");
        assert_eq!(end.outcome, Outcome::Converged);
        assert_eq!(end.records.len(), whole.records.len());
        assert_eq!(end.fretting_loops.len(), whole.fretting_loops.len());
        if steps.len() == 2 {
            // Without a further step, the resumed run adds no entry, and its fields are not compared.
            continue;
        }
        let bits = |field: &[f64]| field.iter().map(|value| value.to_bits()).collect::<Vec<_>>();
        assert_eq!(bits(&end.state.wear_depth), bits(&whole.state.wear_depth));
        assert_eq!(bits(&end.state.tractions), bits(&whole.state.tractions));
    }
}

struct First(Option<RunCheckpoint>);

impl Observer for First {
    fn increment_done(&mut self, _: &IncrementRecord, _: &FrameState) -> Result<()> {
        Ok(())
    }

    fn on_checkpoint(&mut self, moment: CheckpointEvent, snapshot: &dyn Fn() -> RunCheckpoint) -> Result<()> {
        if moment == CheckpointEvent::Entry && self.0.is_none() {
            self.0 = Some(snapshot());
        }
        Ok(())
    }
}

/// Truth: a checkpoint within a step is refused if this step has become another kind of step. A checkpoint with completed
/// increments is refused for a fretting step. A checkpoint with completed cycles is refused for a step of increments.
#[test]
fn checkpoints_within_a_step_of_another_kind_are_refused() {
    let mut model = sphere_on_frp(30.0, 1.5, 12);
    model.wear = frp_wear(30.0);
    let increments = || Step { increments: 3, ..indent(0.02) };
    let cycles = || fretting(1000, 0.04, 2, Integrator::Sdirk2);
    let options = SolverOptions::default();
    for (steps, others) in [
        (vec![increments(), cycles()], vec![cycles(), increments()]),
        (vec![cycles(), increments()], vec![increments(), cycles()]),
    ] {
        let mut first = First(None);
        orthowear::evolution::run(&model, &steps, &options, None, &mut first).expect("a run");
        let from = first.0.expect("an entry");
        let same = orthowear::evolution::run(&model, &steps, &options, Some(from.clone()), &mut Silent);
        assert_eq!(same.expect("a run").outcome, Outcome::Converged);
        let other = orthowear::evolution::run(&model, &others, &options, Some(from), &mut Silent);
        assert_eq!(other.expect_err("another kind of step").kind(), ErrorKind::Input);
    }
}
