//! What a step prescribes, and what is recorded of it.

use serde::{Deserialize, Serialize};

use super::Snapshot;

/// Normal control: totals at the end of the step.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub enum Normal {
    /// Motion of body 2 towards body 1, mm, 0 = first touch of the undeformed surfaces.
    Approach(f64),
    /// Normal force on body 1, compression positive.
    Force(f64),
}

/// Tangential control: totals at the end of the step.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub enum Tangential {
    /// Displacement of body 2 along the frame's x, y, mm.
    Shift([f64; 2]),
    /// Tangential force on body 1 along the frame's x, y.
    Force([f64; 2]),
}

/// Control of the rotation of body 2 about the frame's x and y through its centre: totals at the end of the step.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub enum Tilt {
    /// Small rotation about x, y, radians.
    Rotation([f64; 2]),
    /// Moment on body 1 about x, y; the rotation is found.
    Moment([f64; 2]),
}

/// Control of the rotation of body 2 about n through the frame's centre: totals at the end of the step.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub enum Spin {
    /// Small rotation, radians.
    Twist(f64),
    /// Moment on body 1; the twist is found.
    Moment(f64),
}

/// Wear by many passes of one motion, taken in jumps.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Cycles {
    /// Number of cycles; the distance of steady sliding, mm.
    pub count: f64,
    /// What happens in each.
    pub motion: CycleMotion,
    /// How many are taken at once.
    pub jumps: Jumps,
    /// How a jump is integrated.
    pub integrator: Integrator,
    /// Whether explicit jumps may be longer than is stable.
    pub beyond_critical: bool,
}

/// Motion of body 2 in a cycle.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum CycleMotion {
    /// To and fro, or round an ellipse, about where it is at the start of the step.
    Closed(Closed),
    /// Steady sliding along a direction from the frame's x, radians.
    Sliding {
        /// The direction.
        angle: f64,
    },
}

/// A closed path of displacements or tangential forces about those at the start of the step, begun at its + end.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Closed {
    /// What follows the path.
    pub drive: Drive,
    /// Half-axes: along `angle`, and a quarter turn to the left of it (0 for a line), mm or N.
    pub amplitude: [f64; 2],
    /// Direction from the frame's x, radians.
    pub angle: f64,
    /// Increments per stroke, half a cycle, between the ends that are solved together.
    pub increments: usize,
    /// Relative tolerance to which cycles in more increments say, now and then, what wears between the ends; `None` if none do.
    pub resolve: Option<f64>,
}

/// What is prescribed of a closed path.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum Drive {
    /// The displacement of body 2.
    Shift,
    /// The tangential force on body 1.
    Force,
}

impl Cycles {
    /// Farthest that body 2 is moved from where it is at the start of the step, mm; `None` where forces move it.
    pub fn reach(&self) -> Option<f64> {
        match &self.motion {
            CycleMotion::Closed(closed) if closed.drive == Drive::Force => None,
            CycleMotion::Closed(closed) => Some(closed.amplitude[0].max(closed.amplitude[1])),
            CycleMotion::Sliding { .. } => Some(0.0),
        }
    }

    /// Contact problems that are solved together in a stage: the ends of a cycle.
    pub fn ends(&self) -> usize {
        match &self.motion {
            CycleMotion::Closed(closed) => 2 * closed.increments,
            CycleMotion::Sliding { .. } => 1,
        }
    }
}

impl Closed {
    /// Offsets along x, y from the centre at the ends of the increments of a cycle, the + end first; equal increments.
    pub fn offsets(&self) -> Vec<[f64; 2]> {
        self.offsets_at(|part| part)
    }

    /// The same with increments of a line that begin short and grow in proportion to their number where the displacement is
    /// prescribed: just after the reversal slip spreads over the contact.
    pub fn graded_offsets(&self) -> Vec<[f64; 2]> {
        let graded = self.drive == Drive::Shift && self.amplitude[1] == 0.0;
        self.offsets_at(|part| if graded { part * part } else { part })
    }

    /// Offsets at the parts `of` 1/K, 2/K, .. 1 of both strokes.
    fn offsets_at(&self, of: impl Fn(f64) -> f64) -> Vec<[f64; 2]> {
        let k = self.increments as f64;
        let (s, c) = self.angle.sin_cos();
        let offset = |end: usize| {
            let at = end as f64;
            let [along, left] = if self.amplitude[1] == 0.0 {
                let back = end > self.increments;
                let along = self.amplitude[0] * (1.0 - 2.0 * of(if back { at - k } else { at } / k));
                [if back { -along } else { along }, 0.0]
            } else {
                let (sin, cos) = (std::f64::consts::PI * at / k).sin_cos();
                [self.amplitude[0] * cos, self.amplitude[1] * sin]
            };
            [along * c - left * s, along * s + left * c]
        };
        (0..2 * self.increments).map(offset).collect()
    }
}

/// How many cycles are taken at once.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Jumps {
    /// So many jumps of equal length.
    Number(usize),
    /// As many as keep the estimated error of the worn depth below a share of the largest.
    Tolerance(f64),
}

/// Steady rolling of the contact over both bodies.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Rolling {
    /// Direction in which the contact moves over the bodies, in quarter turns from the frame's x towards its y.
    pub quarter_turns: u8,
    /// Rigid slip of body 2 over body 1 per rolled distance, along the direction of rolling and to its left.
    pub creepage: [f64; 2],
    /// Rotation of body 2 relative to body 1 about the normal per rolled distance, 1/mm.
    pub spin: f64,
    /// Rolled distance, for wear and dissipation, mm.
    pub distance: f64,
}

/// What the steady state of an entry belongs to.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, Default)]
pub struct RollingRecord {
    /// Slip of body 2 over body 1 per rolled distance, along the direction of rolling and to its left.
    pub creepage: [f64; 2],
    /// Rotation of body 2 relative to body 1 per rolled distance, 1/mm.
    pub spin: f64,
    /// Distance rolled in this step, mm.
    pub distance: f64,
}

/// Time integration of wear over a cycle jump.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Integrator {
    /// L-stable, second order, slip path taken at every stage.
    Sdirk2,
    /// Implicit, first order.
    BackwardEuler,
    /// Explicit Euler, first order, stable only below a critical jump.
    Explicit,
}

/// Place of a step among the load points of a history.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Row {
    /// Its number, from 0.
    pub index: usize,
    /// Number of load points.
    pub count: usize,
}

/// One load step.
#[derive(Debug, Clone, PartialEq)]
pub struct Step {
    /// Name, for results.
    pub name: String,
    /// Normal control; `None` keeps what held before.
    pub normal: Option<Normal>,
    /// Tangential control; `None` keeps what held before.
    pub tangential: Option<Tangential>,
    /// Rotation about x, y or its moment; `None` keeps what held before.
    pub tilt: Option<Tilt>,
    /// Rotation about n or its moment; `None` keeps what held before.
    pub spin: Option<Spin>,
    /// Number of load increments.
    pub increments: usize,
    /// Whether friction acts in this step.
    pub friction: bool,
    /// Whether wear acts in this step.
    pub wear: bool,
    /// Fretting cycles or steady sliding instead of a monotone step.
    pub cycles: Option<Cycles>,
    /// Which load point of a history it is; its increments are numbered on from those before.
    pub row: Option<Row>,
    /// Steady rolling instead of a monotone step.
    pub rolling: Option<Rolling>,
}

/// Independent checks of a converged increment (docs/theory-contact.md), recomputed afresh from the tractions.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, Default)]
pub struct Certificate {
    /// Natural residual (7.1), relative to the largest pressure.
    pub natural_residual: f64,
    /// Smallest normal gap over the approach.
    pub min_gap: f64,
    /// Largest violation of the friction cone over the largest pressure.
    pub max_cone_violation: f64,
    /// Energy of the normal complementarity gap over the elastic energy.
    pub normal_gap_energy: f64,
    /// Energy of the tangential (Fenchel) gap over the elastic energy.
    pub tangential_gap_energy: f64,
    /// Imbalance of work and elastic energy over the increment, relative.
    pub energy_balance: f64,
    /// Largest difference of S P from its direct summation in some of the loaded cells, relative; `None` without any, and for
    /// operators that are no sum of half-spaces on a grid.
    #[serde(skip_serializing_if = "Option::is_none", default)]
    pub operator_defect: Option<f64>,
}

/// Resultants at one end of a stroke; forces and moments act on body 1, components along the frame's axes.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, Default)]
pub struct StrokeEnd {
    /// Displacement of body 2 along x, y, mm.
    pub shift: [f64; 2],
    /// Rotation of body 2 about x, y, degrees.
    pub rotation: [f64; 2],
    /// Rotation of body 2 about n, degrees.
    pub twist: f64,
    /// Compression positive, N.
    pub normal_force: f64,
    /// Along x, y, N.
    pub tangential_force: [f64; 2],
    /// About the frame's centre, N mm.
    pub moment: [f64; 3],
    /// Area of the cells with p > 0, mm2.
    pub contact_area: f64,
    /// Area of those with |q|_μ < p (1 - 1e-6), mm2; 0 without friction.
    pub stick_area: f64,
    /// Largest cell pressure, MPa.
    pub peak_pressure: f64,
}

/// One entry of `summary.steps`: an increment, or a cycle jump (then areas, peak and normal force are means of the two
/// stroke ends, tangential force and moment those of the + end). Forces and moments act on body 1, components along
/// the frame's axes.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, Default)]
pub struct IncrementRecord {
    /// Name of the step.
    pub name: String,
    /// Number of the increment or jump in its step, from 1.
    pub increment: usize,
    /// Motion of body 2 towards body 1 from first touch, mm.
    pub approach: f64,
    /// Displacement of body 2 along x, y, mm.
    pub shift: [f64; 2],
    /// Rotation of body 2 about x, y through the frame's centre, degrees.
    pub rotation: [f64; 2],
    /// Rotation of body 2 about n, degrees.
    pub twist: f64,
    /// Compression positive, N.
    pub normal_force: f64,
    /// Along x, y, N.
    pub tangential_force: [f64; 2],
    /// About the frame's centre, N mm.
    pub moment: [f64; 3],
    /// Area of the cells with p > 0, mm2.
    pub contact_area: f64,
    /// Area of those with |q|_μ < p (1 - 1e-6), mm2; 0 without friction.
    pub stick_area: f64,
    /// Largest cell pressure, MPa.
    pub peak_pressure: f64,
    /// Whether a cell on the rim of the frame carries pressure.
    pub contact_touches_edge: bool,
    /// Worn volume of both bodies since the start, mm3.
    pub worn_volume: f64,
    /// Its parts of body 1 and body 2, mm3.
    pub worn_volume_by_body: [f64; 2],
    /// Estimated error of the worn volume by the integration over jumps, mm3.
    pub worn_volume_error: f64,
    /// Worn volume as it follows from the friction energy, mm3; `None` where wear does not follow friction.
    #[serde(skip_serializing_if = "Option::is_none", default)]
    pub worn_volume_by_energy: Option<f64>,
    /// Largest worn depth of the gap, mm.
    pub max_wear_depth: f64,
    /// Estimated error of the worn depth by the integration over jumps, root mean square over the contact, mm.
    pub wear_depth_error: f64,
    /// Fretting cycles since the start.
    pub cycles_done: u64,
    /// Distance of steady sliding since the start, mm.
    pub distance_slid: f64,
    /// Friction dissipation since the start, summed from tractions and slips, N mm.
    pub dissipation: f64,
    /// Independent checks; of a jump the worst of its stages.
    pub certificate: Certificate,
    /// Method of the contact solver, after those that stopped gaining; of a jump that of its last stage.
    pub method: String,
    /// Iterations of the contact solver.
    pub iterations: usize,
    /// Applications of the flexibility operator.
    pub operator_applications: usize,
    /// Wall-clock time, s.
    pub seconds: f64,
    /// Whether the solver and the certificate's natural residual met the tolerance.
    pub converged: bool,
    /// The two ends of the stroke (+, -) of a cycle jump.
    #[serde(skip_serializing_if = "Option::is_none", default)]
    pub stroke_ends: Option<[StrokeEnd; 2]>,
    /// The jump of an entry of cycles or sliding.
    #[serde(skip_serializing_if = "Option::is_none", default)]
    pub jump: Option<JumpRecord>,
    /// Creepages of a step of rolling.
    #[serde(skip_serializing_if = "Option::is_none", default)]
    pub rolling: Option<RollingRecord>,
}

/// A fretting cycle resolved into many increments, without wear.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct FrettingLoop {
    /// Name of its step.
    pub name: String,
    /// Fretting cycles since the start of the run.
    pub cycles_done: u64,
    /// What friction dissipates in it, N mm.
    pub dissipation: f64,
    /// After each increment from the - end: displacement of body 2 along x, y from the centre of the cycle, tangential force on
    /// body 1 along x, y, normal force; mm and N.
    pub points: Vec<[f64; 5]>,
}

/// How a jump went.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, Default)]
pub struct JumpRecord {
    /// Cycles (mm of sliding) that it spans.
    pub length: f64,
    /// Contact problems solved for it, those of rejected tries included.
    pub solves: usize,
    /// Tries that were too long.
    pub rejected: usize,
    /// Estimated error of the worn depth, root mean square over the contact, mm.
    pub depth_error: f64,
    /// Estimated error of the worn volume, mm3.
    pub volume_error: f64,
    /// Longest explicit jump that is stable.
    #[serde(skip_serializing_if = "Option::is_none", default)]
    pub critical_length: Option<f64>,
    /// Increments per stroke of the cycle that was resolved before it, if one was.
    #[serde(skip_serializing_if = "Option::is_none", default)]
    pub resolved: Option<usize>,
}

/// How a run ended.
#[derive(Debug, Clone, PartialEq)]
pub enum Outcome {
    /// All steps converged.
    Converged,
    /// A step did not; the reason is one of "iterations", "gross-sliding", "contact-lost", "frame-edge" (the jump in which contact
    /// reaches the edge of the frame is not taken), "stick-zone".
    NotConverged(&'static str),
    /// A signal stopped the run.
    Interrupted,
}

/// The fields on the frame after an increment, for output. All lengths N by cell, components (x, y, n) of the
/// frame's cells; tractions act on body 2.
#[derive(Debug, Clone, Default)]
pub struct FrameState {
    /// Tractions on body 2, `[3, N]` by planes, MPa.
    pub tractions: Vec<f64>,
    /// Gap, `[3, N]` by planes, mm.
    pub gap: Vec<f64>,
    /// Slip of the increment, `[2, N]` by planes, mm; of rolling per rolled distance.
    pub slip: Vec<f64>,
    /// 0 open, 1 stick, 2 slip.
    pub status: Vec<u8>,
    /// Worn depth (both bodies), mm.
    pub wear_depth: Vec<f64>,
}

/// Where a run can be taken up again.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Moment {
    /// After an entry.
    Entry,
    /// At the end of a step.
    StepEnd,
    /// The run ends here, before its time.
    Broken,
    /// The run ends here, to go on with other operators: contact reaches the edge of the frame in the jump that would follow, or
    /// the observer wants it.
    HandedOn,
}

/// Watches a run: progress, output of fields, checkpoints hang on it.
pub trait Observer {
    /// Called while a stage works: its name, the fraction done in 0..=1, and the current natural residual.
    fn progress(&mut self, stage: &str, fraction: f64, residual: Option<f64>);

    /// Called after every increment or cycle jump.
    ///
    /// # Errors
    /// If results cannot be written; the run stops.
    fn increment_done(&mut self, record: &IncrementRecord, state: &FrameState) -> crate::error::Result<()>;

    /// Called where the run can be taken up again: after every entry, and where it ends before its time. `snapshot` makes what it
    /// goes on from.
    ///
    /// # Errors
    /// If it cannot be written; the run stops.
    fn keep(&mut self, _moment: Moment, _snapshot: &dyn Fn() -> Snapshot) -> crate::error::Result<()> {
        Ok(())
    }

    /// Asked before jumps of a step in progress and before steps: whether the run is to end here, for the bodies have lost `worn`
    /// (`[N]`, mm, both of them) and it goes on with operators that know it.
    fn is_outdated(&self, _worn: &[f64]) -> bool {
        false
    }

    /// Asked between iterations: whether to stop (a signal was caught).
    fn interrupted(&self) -> bool {
        false
    }

    /// Whether fretting cycles are resolved into loops of force over shift.
    fn wants_loops(&self) -> bool {
        false
    }

    /// Whether it looks at the tangential gap of increments that have no friction.
    fn wants_tangential_gap(&self) -> bool {
        true
    }
}

/// Work that a scene did not need and that was therefore not done.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Skipped {
    /// What was skipped.
    pub what: String,
    /// Why it could be.
    pub why: String,
}
