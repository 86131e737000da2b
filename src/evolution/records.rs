//! What is recorded of a run, and who hears of it.

use serde::{Deserialize, Serialize};

use crate::evolution::RunCheckpoint;
use crate::frame::ContactFrame;

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

/// Independent checks of a converged increment (docs/theory-contact.md), recomputed afresh from the tractions.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, Default)]
pub struct Certificate {
    /// Natural residual, relative to the largest pressure.
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
pub struct Resultants {
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
    /// Whether a cell on an edge of the frame beyond which the bodies continue carries pressure.
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
    pub stroke_ends: Option<[Resultants; 2]>,
    /// The jump of an entry of cycles or sliding.
    #[serde(skip_serializing_if = "Option::is_none", default)]
    pub jump: Option<JumpRecord>,
    /// Creepages of a step of rolling.
    #[serde(skip_serializing_if = "Option::is_none", default)]
    pub rolling: Option<RollingRecord>,
}

impl IncrementRecord {
    /// The entry with the resultants of a path point in place of its own.
    pub fn with_resultants(self, values: &Resultants) -> Self {
        Self {
            shift: values.shift,
            rotation: values.rotation,
            twist: values.twist,
            normal_force: values.normal_force,
            tangential_force: values.tangential_force,
            moment: values.moment,
            contact_area: values.contact_area,
            stick_area: values.stick_area,
            peak_pressure: values.peak_pressure,
            ..self
        }
    }

    /// The entry with the shift, rotation, forces, areas and peak of a cycle at its + reversal point, in place of means; the approach stays the mean.
    pub fn at_plus_reversal(&self) -> Self {
        let entry = self.clone();
        if let Some([plus, _]) = self.stroke_ends { entry.with_resultants(&plus) } else { entry }
    }
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
pub enum CheckpointEvent {
    /// After an entry.
    Entry,
    /// At the end of a step.
    StepEnd,
    /// The run ends here, before its time.
    Aborted,
    /// The run ends here, to go on with other operators: contact reaches the edge of the frame in the jump that would follow, or
    /// the observer wants it.
    Suspended,
}

/// Watches a run: progress, output of fields, checkpoints hang on it.
pub trait Observer: Send {
    /// Called while a stage works: its name, the fraction done in 0..=1, and the current natural residual.
    fn progress(&mut self, _stage: &str, _fraction: f64, _residual: Option<f64>) {}

    /// Called before increments, with the frame that they are on: at the start, and where it changes.
    fn on_frame(&mut self, _frame: &ContactFrame) {}

    /// Called after every increment or cycle jump.
    ///
    /// # Errors
    /// If results cannot be written; the run stops.
    fn increment_done(&mut self, record: &IncrementRecord, state: &FrameState) -> crate::error::Result<()>;

    /// Called where the run can be taken up again: after every entry, and where it ends before its time. `checkpoint` makes what it
    /// goes on from.
    ///
    /// # Errors
    /// If it cannot be written; the run stops.
    fn on_checkpoint(
        &mut self,
        _moment: CheckpointEvent,
        _checkpoint: &dyn Fn() -> RunCheckpoint,
    ) -> crate::error::Result<()> {
        Ok(())
    }

    /// Asked before jumps of a step in progress and before steps: whether the run is to end here, for the bodies have lost `wear_depth`
    /// (`[N]`, mm, both of them) and it goes on with operators that know it.
    fn wants_rebuild(&self, _wear_depth: &[f64]) -> bool {
        false
    }

    /// Asked between iterations: whether to stop (a signal was caught).
    fn cancelled(&self) -> bool {
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
