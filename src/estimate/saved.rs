//! Time that was not spent, estimated from the time of what was done.

use crate::estimate::{FLOPS_PER_SECOND, dense_matrix_seconds};
use crate::evolution::records::IncrementRecord;
use crate::evolution::step::{CycleMotion, Step};
use crate::frame::ContactFrame;
use crate::omitted::{Basis, OmissionKind, OmittableWork, OmittedWork, Saved};
use crate::scene::plan::{BodyPlan, Plan};

/// Time of contact problems without the skip over that with it: medians over the scenes of docs/skips.md.
const TANGENTIAL_UNKNOWNS: f64 = 1.9;
const SLIDING_FRICTION: f64 = 1.1;
const NORMAL_COMPONENTS: f64 = 1.4;
const TANGENTIAL_GAP: f64 = 1.4;
const SECOND_HALF_SPACE: f64 = 2.3;
const SECOND_NEAR_FIELD: f64 = 1.3;
const VANISHING_BLOCKS: f64 = 1.4;
const COLD_STARTS: f64 = 1.1;

/// Of cells away from the contact: power of the share of the frame in contact, which fits those scenes to a factor of 1.5.
const DISTANT_CELLS: f64 = -0.5;

/// Share of the frame that is usually in contact.
const USUAL_SHARE: f64 = 0.3;

/// What a run spends its time on, as it was measured or is expected.
#[derive(Debug, Clone, Default)]
pub struct Spent {
    /// What each step of the plan took; those of one name have it in the first.
    pub steps: Vec<StepTime>,
    /// Seconds to make the bodies ready.
    pub bodies: f64,
    /// Seconds to make the operators ready.
    pub operators: f64,
    /// Largest share of the frame's area that was in contact, where that is known.
    pub share: Option<f64>,
}

/// What a step takes.
#[derive(Debug, Clone, Copy, Default)]
pub struct StepTime {
    /// Seconds of its contact problems.
    pub seconds: f64,
    /// Entries of its history.
    pub entries: f64,
    /// Cycles that were solved.
    pub cycles: f64,
}

impl Spent {
    /// As the history of `plan` on `frame` was recorded, with the seconds to make bodies and operators ready.
    pub fn of(
        plan: &Plan,
        frame: &ContactFrame,
        records: &[IncrementRecord],
        [bodies, operators]: [f64; 2],
    ) -> Self {
        let mut steps = vec![StepTime::default(); plan.steps.len()];
        for record in records {
            let Some(place) = plan.steps.iter().position(|step| step.name == record.name) else { continue };
            let step = &mut steps[place];
            step.seconds += record.seconds;
            step.entries += 1.0;
            step.cycles += record.jump.map_or(0.0, |jump| jump.solves as f64);
        }
        let touched = records.iter().map(|record| record.contact_area).fold(0.0, f64::max);
        Self { steps, bodies, operators, share: Some(touched / frame.areas.iter().sum::<f64>()) }
    }
}

/// Says of the entries of `ledger` what they save, where that is not known yet.
pub fn estimate(plan: &Plan, frame: &ContactFrame, spent: &Spent, ledger: &mut [OmittedWork]) {
    // Meshes that move are factorised anew, whatever the cache had.
    let making = ledger.iter().filter(|entry| entry.kind != OmissionKind::CommonSteps);
    let measured: f64 = making.filter_map(|entry| entry.saved).map(|saved| saved.seconds).sum();
    for entry in ledger.iter_mut().filter(|entry| entry.saved.is_none()) {
        let seconds = match entry.kind {
            OmissionKind::Named(skip) => Some(of_skip(plan, frame, spent, skip)),
            OmissionKind::Cycles => Some(of_cycles(plan, spent)),
            OmissionKind::MovingMeshes => Some((spent.bodies + measured) * entries(&plan.steps, spent)),
            OmissionKind::CommonSteps | OmissionKind::Other => None,
        };
        let known = seconds.filter(|seconds| seconds.is_finite());
        entry.saved = known.map(|seconds| Saved { seconds: seconds.max(0.0), basis: Basis::Estimated });
    }
}

fn of_skip(plan: &Plan, frame: &ContactFrame, spent: &Spent, skip: OmittableWork) -> f64 {
    let friction = plan.friction.ellipse();
    let rubs = |step: &Step| step.friction && friction.is_some();
    let wears = |step: &Step| step.wear && plan.wear.specific_rate(friction).is_some();
    // Seconds of the steps that `counts`, times what the work would add to them.
    let more = |factor: f64, counts: &dyn Fn(&Step) -> bool| {
        let steps = plan.steps.iter().zip(&spent.steps);
        let seconds: f64 = steps.filter(|(step, _)| counts(step)).map(|(_, step)| step.seconds).sum();
        (factor - 1.0) * seconds
    };
    match skip {
        OmittableWork::TangentialUnknowns => more(TANGENTIAL_UNKNOWNS, &|step| !rubs(step) && !wears(step)),
        OmittableWork::SlidingFriction => more(SLIDING_FRICTION, &|step| rubs(step) && step.cycles.is_some()),
        OmittableWork::NormalComponents => {
            more(NORMAL_COMPONENTS, &|step| rubs(step) && !wears(step) && step.cycles.is_none())
        }
        OmittableWork::TangentialGap => more(TANGENTIAL_GAP, &|_| true),
        OmittableWork::SecondHalfSpace => {
            let half_spaces = plan.bodies.iter().all(|body| matches!(body, BodyPlan::HalfSpace(_)));
            more(if half_spaces { SECOND_HALF_SPACE } else { SECOND_NEAR_FIELD }, &|_| true)
        }
        OmittableWork::VanishingBlocks => more(VANISHING_BLOCKS, &|_| true),
        OmittableWork::DistantEntries => dense_matrix_seconds(frame.n_cells()) - spent.operators,
        OmittableWork::DistantCells => {
            more(spent.share.unwrap_or(USUAL_SHARE).powf(DISTANT_CELLS).clamp(1.0, 10.0), &|_| true)
        }
        OmittableWork::OpenCells => of_open_cells(frame),
        OmittableWork::ColdStarts => more(COLD_STARTS, &|_| true),
    }
}

/// Seconds to eliminate the contact nodes that are left out: as many as cells, in the dense block at the end of the factor.
fn of_open_cells(frame: &ContactFrame) -> f64 {
    let candidates =
        frame.candidates.as_ref().map_or(frame.n_cells(), |cells| cells.iter().filter(|&&is| is).count());
    let cubes = [frame.n_cells(), candidates].map(|n| (3.0 * n as f64).powi(3));
    (cubes[0] - cubes[1]) / FLOPS_PER_SECOND
}

/// Entries of steps with wear.
fn entries(steps: &[Step], spent: &Spent) -> f64 {
    steps.iter().zip(&spent.steps).filter(|(step, _)| step.wear).map(|(_, spent)| spent.entries).sum()
}

/// Seconds of the cycles between those that are solved.
fn of_cycles(plan: &Plan, spent: &Spent) -> f64 {
    let of = |(step, spent): (&Step, &StepTime)| match &step.cycles {
        Some(cycles) if matches!(cycles.motion, CycleMotion::ClosedPath(_)) && spent.cycles > 0.0 => {
            spent.seconds * (cycles.count / spent.cycles - 1.0).max(0.0)
        }
        _ => 0.0,
    };
    plan.steps.iter().zip(&spent.steps).map(of).sum()
}
