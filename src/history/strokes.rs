//! Strokes of fretting cycles one after the other, without wear: where cells come to stick is a matter of their history.

use std::time::Instant;

use crate::contact::solver::{SolveReport, Stop};
use crate::contact::{Increment, Iterate, SlipReference, SolverOptions, Unknowns};
use crate::error::Result;

use super::increments::{Laws, Stage, entry, problem, solve_and_check};
use super::step::{Cycles, Observer, Outcome, Step};
use super::{Run, state};

/// Slip below this share of the amplitude counts as none.
const CREEP: f64 = 1e-3;

/// Cycles without wear, at most, and the change of the forces at their ends from cycle to cycle, by their range, at which they have
/// settled.
const MOST_CYCLES: usize = 10;
const SETTLED: f64 = 1e-3;

/// Natural residual of strokes that only say where cells stick.
const TOLERANCE: f64 = 1e-6;

/// The two stroke ends, solved, and the set of cells that stick.
#[derive(Clone)]
pub(super) struct Stroke {
    pub it: Iterate,
    /// Cells that stick through the cycle, `[N]`.
    pub stuck: Vec<bool>,
    /// Tangential gap that they stick at, `[2, N]`, mm.
    pub at: Vec<f64>,
    /// Iterations and operator applications not yet in any entry.
    pub spent: [usize; 2],
}

impl Stroke {
    /// Takes over the state at an end; what did not slip on the way there sticks.
    pub fn take(&mut self, it: &Iterate, end: usize, creep: f64) {
        let n = self.stuck.len();
        self.it.hatted[end * 3 * n..(end + 1) * 3 * n].copy_from_slice(&it.hatted);
        self.it.rigid[end] = it.rigid[0];
        self.it.floating[end] = it.floating[0];
        for (i, stuck) in self.stuck.iter_mut().enumerate() {
            *stuck = it.hatted[2 * n + i] > 0.0 && it.slip[i].hypot(it.slip[n + i]) <= creep;
        }
        self.at.copy_from_slice(&it.gap[..2 * n]);
    }

    /// Whether the cells that stick do so at both ends, and no others: at which level those would stick, the ends do not tell.
    pub fn consistent(&self, problem: &Increment, amplitude: f64) -> bool {
        let n = problem.n();
        (0..n).all(|i| {
            let sticks = [0, 1].map(|end| problem.sticks(&self.it, end, i));
            let creeps = |end: usize| {
                let slip = self.it.slip[end * 2 * n + i].hypot(self.it.slip[end * 2 * n + n + i]);
                slip <= CREEP * amplitude
            };
            if self.stuck[i] { (0..2).all(|end| sticks[end] || creeps(end)) } else { sticks != [true; 2] }
        })
    }
}

/// Whether the forces at the ends are those of the cycle `before`.
pub(super) fn settled(forces: [[f64; 2]; 2], before: [[f64; 2]; 2]) -> bool {
    let between = |a: [f64; 2], b: [f64; 2]| (a[0] - b[0]).hypot(a[1] - b[1]);
    let change = between(forces[0], before[0]).max(between(forces[1], before[1]));
    change <= SETTLED * between(forces[0], forces[1])
}

impl Run<'_> {
    /// The first cycles, resolved stroke by stroke without wear, until one is like the one before: where cells come to stick is
    /// a matter of their history.
    pub(super) fn first_strokes(
        &mut self,
        step: &Step,
        cycles: &Cycles,
        center: [f64; 3],
        observer: &mut dyn Observer,
    ) -> Result<Stroke> {
        let n = self.prepared.n();
        let along = [cycles.angle.cos() * cycles.amplitude, cycles.angle.sin() * cycles.amplitude];
        let mut pair = Iterate::new(n, vec![center; 2]);
        pair.floating = vec![self.state.floating; 2];
        let mut stroke = Stroke { it: pair, stuck: vec![true; n], at: vec![0.0; 2 * n], spent: [0; 2] };
        let mut before = [[f64::INFINITY; 2]; 2];
        for _ in 0..MOST_CYCLES {
            let mut forces = before;
            for (end, sign) in [1.0, -1.0].into_iter().enumerate() {
                let rigid = [center[0] + sign * along[0], center[1] + sign * along[1], self.state.rigid[2]];
                let (it, report) = self.stroke_to(step, rigid, observer)?;
                stroke.spent = [stroke.spent[0] + report.iterations, stroke.spent[1] + report.applications];
                stroke.take(&it, end, CREEP * cycles.amplitude);
                if self.result.outcome != Outcome::Converged {
                    return Ok(stroke);
                }
                forces[end] = self.tangential_force(&it, 0);
            }
            if settled(forces, before) {
                return Ok(stroke);
            }
            before = forces;
        }
        self.result.warnings.push(format!(
            "step \"{}\": after {MOST_CYCLES} cycles without wear the tractions still change from cycle to cycle; the stroke ends are \
             those of the last one",
            step.name
        ));
        Ok(stroke)
    }

    /// One increment without wear to a given rigid motion; the state follows.
    pub(super) fn stroke_to(
        &mut self,
        step: &Step,
        rigid: [f64; 3],
        observer: &mut dyn Observer,
    ) -> Result<(Iterate, SolveReport)> {
        let clock = Instant::now();
        let loads = self.carried(step, self.held.loads_at_shift());
        let reference = SlipReference::Previous(self.state.reference.clone());
        let end = self.end(step, &loads, reference)?;
        let worn = self.state.worn.clone();
        let laws = Laws { friction: step.friction, wear: false, repeats: 0.0 };
        let mut problem = problem(&self.prepared, &self.options, &worn, laws, vec![end]);
        let mut it = Iterate::new(self.prepared.n(), vec![rigid]);
        it.floating = vec![self.state.floating];
        if self.options.skip {
            problem.hat_tractions(&self.state.tractions, &mut it.hatted);
        }
        let stage = Stage { name: &step.name, from: 0.0, to: 0.0 };
        let (report, checks) =
            solve_and_check((&self.prepared, &mut problem), &mut it, &self.options, observer, &stage)?;
        let balance = state::energy_balance(&self.prepared, &self.state, &it, 0);
        let values = state::resultants(&self.prepared, &problem, &it, 0);
        let fields = state::frame_state(&problem, &it, 0, &worn);
        self.state.take(&it, 0);
        let approach = self.prepared.approach(&it, 0);
        let mut record = entry(&step.name, 1, approach, &values);
        record.contact_touches_edge = state::touches_edge(&self.prepared, &it);
        record.certificate = state::certificate(&checks, approach, balance);
        record.seconds = clock.elapsed().as_secs_f64();
        self.finish(&mut record, &report, &checks);
        self.hint_at_spin(step);
        if self.result.outcome != Outcome::Converged {
            self.deliver(record, fields, observer)?;
        }
        Ok((it, report))
    }

    /// Strokes from end to end at the depth `worn` (`[N]`, mm) until they settle; the cells that stick, and where, follow. Where a
    /// stroke does not converge the ends stay as they were solved together, and the report says why.
    ///
    /// # Errors
    /// If a body cannot be solved.
    pub(super) fn resettle(
        &mut self,
        step: &Step,
        cycles: &Cycles,
        worn: &[f64],
        stroke: &mut Stroke,
        (observer, stage): (&mut dyn Observer, &Stage),
    ) -> Result<SolveReport> {
        let n = self.prepared.n();
        let loads = self.carried(step, self.held.loads_at_shift());
        let laws = Laws { friction: step.friction, wear: false, repeats: 0.0 };
        let tolerance = self.options.tolerance.max(TOLERANCE);
        let options = SolverOptions { tolerance, ..self.options };
        // Looked at here, the operator would be looked at again and again.
        let stage = &Stage { name: stage.name, from: stage.from, to: stage.from };
        let solved = Unknowns::of(&stroke.it);
        let mut reference = stroke.it.gap[3 * n..5 * n].to_vec();
        let mut sum = SolveReport { stop: Stop::Converged, ..SolveReport::default() };
        let mut before = [[f64::INFINITY; 2]; 2];
        for _ in 0..MOST_CYCLES {
            let mut forces = before;
            for (end, force) in forces.iter_mut().enumerate() {
                let spec = self.end(step, &loads, SlipReference::Previous(reference))?;
                let mut problem = problem(&self.prepared, &self.options, worn, laws, vec![spec]);
                let mut it = Iterate::new(n, vec![stroke.it.rigid[end]]);
                it.floating = vec![stroke.it.floating[end]];
                it.hatted.copy_from_slice(&stroke.it.hatted[end * 3 * n..(end + 1) * 3 * n]);
                let (report, _) =
                    solve_and_check((&self.prepared, &mut problem), &mut it, &options, observer, stage)?;
                let (iterations, applications) =
                    (sum.iterations + report.iterations, sum.applications + report.applications);
                sum = SolveReport { iterations, applications, ..report };
                if sum.stop != Stop::Converged {
                    // What is reported is the last pair of ends.
                    solved.put(&mut stroke.it);
                    return Ok(sum);
                }
                stroke.take(&it, end, CREEP * cycles.amplitude);
                *force = self.tangential_force(&it, 0);
                reference = it.gap[..2 * n].to_vec();
            }
            if settled(forces, before) {
                break;
            }
            before = forces;
        }
        Ok(sum)
    }

    /// Resultant of the tractions of an end in the surface, N.
    pub(super) fn tangential_force(&self, it: &Iterate, end: usize) -> [f64; 2] {
        let planes = 3 * self.prepared.n();
        let ([x, y, _], _) = self.prepared.resultants(&it.tractions[end * planes..(end + 1) * planes]);
        [x, y]
    }
}
