//! Fretting loops: a cycle resolved into many increments, without wear.

use crate::contact::certificate::StateChecks;
use crate::contact::solver::{SolveReport, Stop};
use crate::contact::{Iterate, SlipReference, SolverOptions};
use crate::error::Result;

use super::Run;
use super::control::Loads;
use super::cycling::{Cycling, Way};
use super::increments::{Laws, Stage, problem, solve_and_check};
use super::record::Outcome;
use super::record::{FrettingLoop, Observer};
use super::ring::Course;
use super::step::{Closed, CycleMotion, Cycles, Step};

/// Increments per stroke, at least.
const RESOLVED: usize = 16;

/// Cycles that it takes until one follows from the one before alone; the last is what is reported.
const CYCLES: usize = 2;

/// What slip of the next increment is measured from, and what its solution begins with.
#[derive(Clone)]
pub(super) struct Place {
    /// Tangential gap, `[2, N]`, mm.
    pub reference: Vec<f64>,
    /// Tractions and motions.
    pub it: Iterate,
}

impl Place {
    /// An end of a cycle that was solved and evaluated.
    pub fn of(ring: &Iterate, end: usize) -> Self {
        let n = ring.wear_rate.len();
        let mut it = Iterate::new(n, vec![ring.rigid[end]]);
        it.floating = vec![ring.floating[end]];
        it.hatted.copy_from_slice(&ring.hatted[end * 3 * n..(end + 1) * 3 * n]);
        Self { reference: ring.gap[end * 3 * n..end * 3 * n + 2 * n].to_vec(), it }
    }
}

impl Run<'_> {
    /// One increment of a cycle at a worn depth (`[N]`, mm), from a place to an end of its course.
    ///
    /// # Errors
    /// If a body cannot be solved.
    pub(super) fn stroke_at(
        &mut self,
        step: &Step,
        (course, end, loads): (&Course, usize, Loads),
        (worn, options): (&[f64], &SolverOptions),
        place: Place,
        (observer, stage): (&mut dyn Observer, &Stage),
    ) -> Result<(Place, SolveReport, StateChecks)> {
        let laws = Laws { friction: step.friction, wear: step.wear, repeats: 0.0, factors: None };
        let n = self.prepared.n();
        let spec = self.end(step, &course.loads(end, loads), SlipReference::Previous(place.reference))?;
        let mut problem = problem(&self.prepared, options, worn, laws, vec![spec]);
        let mut it = place.it;
        course.place(end, &mut it.rigid[0]);
        let (report, checks) =
            solve_and_check((&self.prepared, &mut problem), &mut it, options, observer, stage)?;
        let reference = it.gap[..2 * n].to_vec();
        Ok((Place { reference, it }, report, checks))
    }

    /// Resolves the cycle at the worn depth of the state; nothing but the loop is left of it.
    ///
    /// # Errors
    /// If a body cannot be solved.
    pub(super) fn resolve_loop(
        &mut self,
        step: &Step,
        cycles: &Cycles,
        cycling: &Cycling,
        observer: &mut dyn Observer,
    ) -> Result<()> {
        let (Way::Round(coarse), CycleMotion::Closed(closed)) = (&cycling.way, &cycles.motion) else {
            return Ok(());
        };
        let increments = RESOLVED.div_ceil(closed.increments) * closed.increments;
        let course = coarse.resolved(&Closed { increments, ..*closed }, 1.0);
        let half = coarse.half();
        let (loads, _) = self.loads_in_cycles(step, cycling, cycling.done / cycles.count);
        // That of the - end, where the state is.
        let mut place =
            Place { reference: self.state.reference.clone(), ..Place::of(&cycling.ring.it, half) };
        let (worn, options) = (self.state.worn.clone(), self.stroke_options());
        let stage = Stage { name: "fretting loop", from: 0.0, to: 0.0 };
        let mut found = FrettingLoop {
            name: step.name.clone(),
            cycles_done: self.state.cycles_done,
            dissipation: 0.0,
            points: Vec::new(),
        };
        for _ in 0..CYCLES {
            (found.dissipation, found.points) = (0.0, Vec::new());
            for end in
                (increments + 1..=2 * increments).map(|end| end % (2 * increments)).chain(1..=increments)
            {
                let way = (&course, end, loads);
                let (next, report, checks) =
                    self.stroke_at(step, way, (&worn, &options), place, (&mut *observer, &stage))?;
                if report.stop != Stop::Converged {
                    if report.stop == Stop::Interrupted {
                        self.result.outcome = Outcome::Interrupted;
                    } else {
                        self.result.warnings.push(format!(
                            "step \"{}\": the fretting loop after {} cycles was not found: an increment of it did not converge",
                            step.name, self.state.cycles_done
                        ));
                    }
                    return Ok(());
                }
                place = next;
                found.dissipation += checks.dissipation;
                let (force, _) = self.prepared.resultants(&place.it.tractions);
                let motion = self.prepared.motion(&place.it.rigid[0], &place.it.floating[0]);
                let [x, y] = [0, 1].map(|k| motion[k] - course.center[k]);
                found.points.push([x, y, force[0], force[1], -force[2]]);
            }
        }
        self.result.loops.push(found);
        Ok(())
    }
}
