//! The ends of the increments of a cycle, which close on themselves, and strokes through them one after the other: where cells
//! come to stick is a matter of their history.

use std::time::Instant;

use serde::{Deserialize, Serialize};

use crate::contact::solver::{SolveReport, Stop};
use crate::contact::{End, Increment, Iterate, SlipReference, SolverOptions, TangentialControl, Unknowns};
use crate::error::Result;
use crate::skip::Skip;

use super::control::Loads;
use super::increments::{Laws, Stage, entry, problem, solve_and_check};
use super::loops::Place;
use super::record::{Observer, Outcome};
use super::step::{Closed, Drive, Step, Tangential};
use super::{Run, state};

/// Slip below this share of the amplitude counts as none.
const CREEP: f64 = 1e-3;

/// Cycles without wear, at most, and the change of their ends from cycle to cycle, by their range, at which they have settled.
const MOST_CYCLES: usize = 10;
const SETTLED: f64 = 1e-3;

/// Natural residual of strokes that only say where cells stick.
const TOLERANCE: f64 = 1e-6;

/// The ends of a cycle, solved together, and the set of cells that stick.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub(super) struct Ring {
    pub it: Iterate,
    /// Cells that stick through the cycle, `[N]`.
    pub stuck: Vec<bool>,
    /// Tangential gap that they stick at, `[2, N]`, mm.
    pub at: Vec<f64>,
    /// Solves, iterations and operator applications not yet in any entry.
    pub spent: [usize; 3],
}

/// Where the ends of a cycle are.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub(super) struct Course {
    /// What follows it.
    drive: Drive,
    /// Shift of body 2 or force on body 1 along x, y at each end, the + end first.
    ends: Vec<[f64; 2]>,
    /// Shift at the start of the step.
    pub center: [f64; 2],
    /// Force on body 1 there.
    force: [f64; 2],
}

impl Course {
    /// The ends of a closed path about a shift and a force.
    pub fn new(closed: &Closed, center: [f64; 2], force: [f64; 2]) -> Self {
        Self::through(&closed.offsets(), closed.drive, (center, force))
    }

    fn through(offsets: &[[f64; 2]], drive: Drive, (center, force): ([f64; 2], [f64; 2])) -> Self {
        let about = if drive == Drive::Shift { center } else { force };
        let ends = offsets.iter().map(|offset| [0, 1].map(|k| about[k] + offset[k])).collect();
        Self { drive, ends, center, force }
    }

    /// The same path through the ends of another number of increments, shorter ones in the share `transition` of each stroke.
    pub fn resolved(&self, closed: &Closed, transition: f64) -> Self {
        Self::through(&closed.graded_offsets(transition), closed.drive, (self.center, self.force))
    }

    /// Number of ends.
    pub fn len(&self) -> usize {
        self.ends.len()
    }

    /// The - end.
    pub fn half(&self) -> usize {
        self.len() / 2
    }

    /// Puts body 2 to an end where that is prescribed.
    pub fn place(&self, end: usize, rigid: &mut [f64; 3]) {
        if self.drive == Drive::Shift {
            rigid[..2].copy_from_slice(&self.ends[end]);
        }
    }

    /// What brings body 2 back to the centre, and is prescribed then.
    pub fn back(&self, loads: Loads) -> (Loads, Tangential) {
        match self.drive {
            Drive::Shift => {
                (Loads { tangential: TangentialControl::Shift, ..loads }, Tangential::Shift(self.center))
            }
            Drive::Force => {
                let on_body2 = self.force.map(|force| -force);
                let tangential = TangentialControl::Force(on_body2);
                (Loads { tangential, ..loads }, Tangential::Force(self.force))
            }
        }
    }

    /// What is prescribed at an end.
    pub fn loads(&self, end: usize, loads: Loads) -> Loads {
        let tangential = match self.drive {
            Drive::Shift => TangentialControl::Shift,
            // That on body 2.
            Drive::Force => TangentialControl::Force(self.ends[end].map(|force| -force)),
        };
        Loads { tangential, ..loads }
    }
}

impl Ring {
    /// Ends at which nothing is known but the motions.
    pub fn new(n: usize, course: &Course, rigid: [f64; 3]) -> Self {
        let motions = (0..course.len()).map(|end| {
            let mut rigid = rigid;
            course.place(end, &mut rigid);
            rigid
        });
        let it = Iterate::new(n, motions.collect());
        Self { it, stuck: vec![true; n], at: vec![0.0; 2 * n], spent: [0; 3] }
    }

    /// A single state, of steady sliding.
    pub fn still(n: usize, rigid: [f64; 3]) -> Self {
        Self { it: Iterate::new(n, vec![rigid]), stuck: vec![false; n], at: vec![0.0; 2 * n], spent: [0; 3] }
    }

    /// What slip is measured from at all ends.
    pub fn reference(&self) -> SlipReference {
        SlipReference::EndBefore { stuck: self.stuck.clone(), at: self.at.clone() }
    }

    /// Adds what a solve took.
    pub fn spend(&mut self, report: &SolveReport) {
        let spent = [1, report.iterations, report.applications];
        self.spent.iter_mut().zip(spent).for_each(|(sum, spent)| *sum += spent);
    }

    /// Takes over the state at an end; of the cells that stuck until there, those that did not slip on the way stick.
    fn take(&mut self, it: &Iterate, end: usize, creep: f64) {
        let n = self.stuck.len();
        let planes = end * 3 * n..(end + 1) * 3 * n;
        self.it.hatted[planes.clone()].copy_from_slice(&it.hatted);
        self.it.tractions[planes].copy_from_slice(&it.tractions);
        self.it.rigid[end] = it.rigid[0];
        self.it.floating[end] = it.floating[0];
        for (i, stuck) in self.stuck.iter_mut().enumerate() {
            *stuck &= it.hatted[2 * n + i] > 0.0 && it.slip[i].hypot(it.slip[n + i]) <= creep;
        }
        self.at.copy_from_slice(&it.gap[..2 * n]);
    }

    /// Half of the largest distance of two ends.
    fn amplitude(&self) -> f64 {
        let rigid = &self.it.rigid;
        let apart = |a: &[f64; 3], b: &[f64; 3]| (a[0] - b[0]).hypot(a[1] - b[1]);
        let farthest = |a: &[f64; 3]| rigid.iter().map(|b| apart(a, b)).fold(0.0, f64::max);
        0.5 * rigid.iter().map(farthest).fold(0.0, f64::max)
    }

    /// Lets go the cells that are said to stick, but slip at an end of a state that does not converge; whether there are any.
    pub fn release(&mut self, problem: &Increment) -> bool {
        let (n, ends, creep) = (problem.n(), problem.ends.len(), CREEP * self.amplitude());
        let mut any = false;
        for i in 0..n {
            let slips = |end: usize| {
                let slip = self.it.slip[end * 2 * n + i].hypot(self.it.slip[end * 2 * n + n + i]);
                slip > creep && !problem.sticks(&self.it, end, i)
            };
            if self.stuck[i] && (0..ends).any(slips) {
                self.stuck[i] = false;
                any = true;
            }
        }
        any
    }

    /// Whether the cells that stick do so at all ends, and no others: at which level those would stick, the ends do not tell.
    pub fn consistent(&self, problem: &Increment) -> bool {
        let (n, ends, creep) = (problem.n(), problem.ends.len(), CREEP * self.amplitude());
        (0..n).all(|i| {
            let mut sticks = (0..ends).map(|end| problem.sticks(&self.it, end, i));
            let creeps =
                |end: usize| self.it.slip[end * 2 * n + i].hypot(self.it.slip[end * 2 * n + n + i]) <= creep;
            if self.stuck[i] {
                sticks.enumerate().all(|(end, sticks)| sticks || creeps(end))
            } else {
                !sticks.all(|sticks| sticks)
            }
        })
    }
}

/// Whether what was found at the ends is what the cycle `before` found.
pub(super) fn settled(found: &[[f64; 2]], before: &[[f64; 2]]) -> bool {
    let apart = |a: &[f64; 2], b: &[f64; 2]| (a[0] - b[0]).hypot(a[1] - b[1]);
    let change = found.iter().zip(before).map(|(a, b)| apart(a, b)).fold(0.0, f64::max);
    let range = found.iter().map(|a| apart(a, &found[0])).fold(0.0, f64::max);
    found.len() == before.len() && change <= SETTLED * range
}

impl Run<'_> {
    /// The first cycles, resolved stroke by stroke without wear, until one is like the one before: where cells come to stick is
    /// a matter of their history.
    pub(super) fn first_strokes(
        &mut self,
        step: &Step,
        (course, loads): (&Course, Loads),
        ring: &mut Ring,
        observer: &mut dyn Observer,
    ) -> Result<()> {
        ring.it.floating.fill(self.state.floating);
        let half = course.half();
        let mut before: Vec<[f64; 2]> = Vec::new();
        for cycle in 0..MOST_CYCLES {
            let up = if cycle == 0 { course.len()..course.len() + 1 } else { half + 1..course.len() + 1 };
            for end in up.map(|end| end % course.len()).chain(1..half + 1) {
                let mut rigid = [ring.it.rigid[end][0], ring.it.rigid[end][1], self.state.rigid[2]];
                course.place(end, &mut rigid);
                let (it, report) = self.stroke_to(step, (course.loads(end, loads), rigid), observer)?;
                ring.spend(&report);
                if end == 1 {
                    ring.stuck.fill(true);
                }
                ring.take(&it, end, CREEP * ring.amplitude());
                if self.result.outcome != Outcome::Converged {
                    return Ok(());
                }
            }
            let found = self.found(ring, course);
            if settled(&found, &before) {
                return Ok(());
            }
            before = found;
        }
        self.result.warnings.push(format!(
            "step \"{}\": after {MOST_CYCLES} cycles without wear the tractions still change from cycle to cycle; the stroke ends are \
             those of the last one",
            step.name
        ));
        Ok(())
    }

    /// What a cycle finds at its ends: forces where the shift is prescribed, shifts where forces are.
    pub(super) fn found(&self, ring: &Ring, course: &Course) -> Vec<[f64; 2]> {
        let n = self.prepared.n();
        let at = |end: usize| match course.drive {
            Drive::Force => [ring.it.rigid[end][0], ring.it.rigid[end][1]],
            Drive::Shift => {
                let tractions = &ring.it.tractions[end * 3 * n..(end + 1) * 3 * n];
                let ([x, y, _], _) = self.prepared.resultants(tractions);
                [x, y]
            }
        };
        (0..course.len()).map(at).collect()
    }

    /// One increment without wear to a given rigid motion or under given loads; the state follows.
    pub(super) fn stroke_to(
        &mut self,
        step: &Step,
        (loads, rigid): (Loads, [f64; 3]),
        observer: &mut dyn Observer,
    ) -> Result<(Iterate, SolveReport)> {
        let clock = Instant::now();
        let reference = SlipReference::Previous(self.state.reference.clone());
        let end = self.end(step, &loads, reference)?;
        let worn = self.state.worn.clone();
        let laws = Laws { friction: step.friction, wear: false, repeats: 0.0, factors: None };
        let options = self.stroke_options();
        let mut problem = problem(&self.prepared, &options, &worn, laws, vec![end]);
        let mut it = Iterate::new(self.prepared.n(), vec![rigid]);
        it.floating = vec![self.state.floating];
        if options.skip.has(Skip::ColdStarts) {
            problem.hat_tractions(&self.state.tractions, &mut it.hatted);
        }
        let stage = Stage { name: &step.name, from: 0.0, to: 0.0 };
        let (report, checks) =
            solve_and_check((&self.prepared, &mut problem), &mut it, &options, observer, &stage)?;
        let balance = state::energy_balance(&self.prepared, &self.state, &it, 0);
        let values = state::resultants(&self.prepared, &problem, &it, 0);
        let fields = state::frame_state(&problem, &it, 0, &worn);
        self.state.take(&it, 0);
        let approach = self.prepared.approach(&it, 0);
        let mut record = entry(&step.name, 1, approach, &values);
        record.contact_touches_edge = state::touches_edge(&self.prepared, &it);
        record.certificate = state::certificate(&checks, approach, balance);
        record.seconds = clock.elapsed().as_secs_f64();
        self.finish(&mut record, &report, (&checks, options.tolerance));
        self.hint_at_spin(step);
        if self.result.outcome != Outcome::Converged {
            self.deliver(record, fields, observer)?;
        }
        Ok((it, report))
    }

    /// How strokes are solved that only say where cells stick.
    pub(super) fn stroke_options(&self) -> SolverOptions {
        SolverOptions { tolerance: self.options.tolerance.max(TOLERANCE), ..self.options }
    }

    /// Strokes through the cycle at the depth `worn` (`[N]`, mm) until they settle; the cells that stick, and where, follow.
    /// Where a stroke does not converge the ends stay as they were solved together, and the report says why.
    ///
    /// # Errors
    /// If a body cannot be solved.
    pub(super) fn resettle(
        &mut self,
        step: &Step,
        (course, loads): (&Course, Loads),
        worn: &[f64],
        ring: &mut Ring,
        (observer, stage): (&mut dyn Observer, &Stage),
    ) -> Result<SolveReport> {
        let (n, half) = (self.prepared.n(), course.half());
        let options = self.stroke_options();
        // Looked at here, the operator would be looked at again and again.
        let stage = &Stage { name: stage.name, from: stage.from, to: stage.from };
        let solved = Unknowns::of(&ring.it);
        let mut reference = ring.it.gap[half * 3 * n..half * 3 * n + 2 * n].to_vec();
        let mut sum = SolveReport { stop: Stop::Converged, ..SolveReport::default() };
        let mut before: Vec<[f64; 2]> = Vec::new();
        for _ in 0..MOST_CYCLES {
            for end in (half + 1..course.len() + 1).map(|end| end % course.len()).chain(1..half + 1) {
                let mut it = Iterate::new(n, vec![ring.it.rigid[end]]);
                it.floating = vec![ring.it.floating[end]];
                it.hatted.copy_from_slice(&ring.it.hatted[end * 3 * n..(end + 1) * 3 * n]);
                let place = Place { reference, it };
                let way = (course, end, loads);
                let (place, report, _) =
                    self.stroke_at(step, way, (worn, &options), place, (&mut *observer, stage))?;
                ring.spend(&SolveReport { iterations: 0, applications: 0, ..report.clone() });
                let (iterations, applications) =
                    (sum.iterations + report.iterations, sum.applications + report.applications);
                sum = SolveReport { iterations, applications, ..report };
                if sum.stop != Stop::Converged {
                    // What is reported are the last ends that were solved together.
                    solved.put(&mut ring.it);
                    return Ok(sum);
                }
                if end == 1 {
                    ring.stuck.fill(true);
                }
                ring.take(&place.it, end, CREEP * ring.amplitude());
                reference = place.reference;
            }
            let found = self.found(ring, course);
            if settled(&found, &before) {
                break;
            }
            before = found;
        }
        Ok(sum)
    }

    /// The ends of a cycle with the slip of each measured from the one before.
    ///
    /// # Errors
    /// If a load acts along a motion that nothing resists.
    pub(super) fn ends(
        &mut self,
        step: &Step,
        course: &Course,
        loads: Loads,
        ring: &Ring,
    ) -> Result<Vec<End>> {
        (0..course.len()).map(|end| self.end(step, &course.loads(end, loads), ring.reference())).collect()
    }
}
