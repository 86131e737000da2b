//! Records of a run: increments, jumps, fretting loops, and the fields for output.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

/// Creepages and rolled distance of a steady state of rolling.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, Default)]
pub struct RollingRecord {
    /// Slip of body 2 relative to body 1 per rolled distance, along the direction of rolling and to the left of this direction.
    pub creepage: [f64; 2],
    /// Rotation of body 2 relative to body 1 per rolled distance, 1/mm.
    pub spin: f64,
    /// Distance rolled in this step, mm.
    pub distance: f64,
}

/// Estimated errors of the wear volume by source, mm3.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, Default)]
pub struct WearErrors {
    /// Error of the jumps: error of the time integration, and error from corrections that change during a jump.
    pub jumps: f64,
    /// Error from the finite number of increments per stroke.
    pub increments: f64,
    /// Error from tractions that still change from cycle to cycle.
    pub settling: f64,
}

impl WearErrors {
    /// Sum of all sources.
    pub fn sum(&self) -> f64 {
        self.jumps + self.increments + self.settling
    }
}

/// Checks of a solved increment (docs/theory-contact.md).
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, Default)]
pub struct Certificate {
    /// Natural residual: largest change of a traction by one projection step, divided by the largest pressure.
    pub natural_residual: f64,
    /// Smallest normal gap, divided by the magnitude of the approach. At zero approach, the smallest normal gap in mm.
    pub min_gap: f64,
    /// Largest violation of the friction cone, divided by the largest pressure.
    pub max_cone_violation: f64,
    /// Complementarity error Σ A |p g_n| of pressures p and normal gaps g_n over cells of area A, divided by the
    /// elastic energy.
    pub normal_gap_energy: f64,
    /// Friction error Σ A (p |Δg|*_μ + q·Δg) (Fenchel gap), divided by the elastic energy. q is the tangential
    /// traction, Δg the slip, |Δg|*_μ the slip scaled by the friction coefficients.
    pub tangential_gap_energy: f64,
    /// Relative imbalance of work and elastic energy over the increment.
    pub energy_balance: f64,
    /// Largest difference between the elastic displacements and an independent evaluation in some loaded cells,
    /// relative to the largest value. `None` without loaded cells or without an independent evaluation.
    #[serde(skip_serializing_if = "Option::is_none", default)]
    pub operator_defect: Option<f64>,
}

/// Resultants at one path point. Forces and moments act on body 1. All components are along the frame's axes.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, Default)]
pub struct Resultants {
    /// Displacement of body 2 along x, y, mm.
    pub shift: [f64; 2],
    /// Rotation of body 2 about x, y, degrees.
    pub rotation: [f64; 2],
    /// Rotation of body 2 about n, degrees.
    pub twist: f64,
    /// Normal force, compression positive, N.
    pub normal_force: f64,
    /// Tangential force along x, y, N.
    pub tangential_force: [f64; 2],
    /// Moment about the frame's centre, N mm.
    pub moment: [f64; 3],
    /// Area of the cells with p > 0, mm2.
    pub contact_area: f64,
    /// Area of the cells that stick, mm2; 0 without friction. A cell with the pressure p sticks if |q|_μ < p (1 -
    /// 1e-6). |q|_μ is the tangential traction divided by the friction coefficients, as a norm.
    pub stick_area: f64,
    /// Largest cell pressure, MPa.
    pub peak_pressure: f64,
}

/// One entry of `summary.steps`: an increment or a jump. For a jump, approach, displacements, rotations, areas, peak pressure and
/// normal force are means of the two reversal points. Tangential force and moment belong to the + reversal point. Forces and
/// moments act on body 1. All components are along the frame's axes.
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
    /// Normal force, compression positive, N.
    pub normal_force: f64,
    /// Tangential force along x, y, N.
    pub tangential_force: [f64; 2],
    /// Moment about the frame's centre, N mm.
    pub moment: [f64; 3],
    /// Area of the cells with p > 0, mm2.
    pub contact_area: f64,
    /// Area of the cells that stick, mm2 (see [`Resultants`]).
    pub stick_area: f64,
    /// Largest cell pressure, MPa.
    pub peak_pressure: f64,
    /// Whether a cell carries pressure at an edge of the frame beyond which the bodies continue.
    pub contact_touches_edge: bool,
    /// Wear volume of both bodies since the start, mm3.
    pub worn_volume: f64,
    /// Wear volumes of body 1 and body 2 since the start, mm3.
    pub worn_volume_by_body: [f64; 2],
    /// Estimated error of the wear volume caused by jumps and by the path between reversal points, mm3.
    pub worn_volume_error: f64,
    /// Estimated errors of the wear volume by source.
    pub worn_volume_error_by_source: WearErrors,
    /// Wear volume computed from the friction energy, mm3; `None` if this energy does not determine the wear volume.
    #[serde(skip_serializing_if = "Option::is_none", default)]
    pub worn_volume_by_energy: Option<f64>,
    /// Largest wear depth of both bodies together, mm.
    pub max_wear_depth: f64,
    /// Estimated error of the wear depth in the cell with the largest depth, mm.
    pub max_wear_depth_error: f64,
    /// Estimated error of the wear depth caused by jumps and by the path between reversal points, rms over the worn cells, mm.
    pub wear_depth_error: f64,
    /// Fretting cycles since the start.
    pub cycles_done: u64,
    /// Distance of steady sliding since the start, mm.
    pub distance_slid: f64,
    /// Friction dissipation since the start, summed from tractions and slips, N mm.
    pub dissipation: f64,
    /// Checks of the solution. For a jump, `energy_balance` refers to the whole jump, and the other values are the
    /// worst values of all stages.
    pub certificate: Certificate,
    /// Method of the contact solver, preceded by the methods that failed before. For a jump, the entry belongs to the
    /// last stage.
    pub method: String,
    /// Iterations of the contact solver.
    pub iterations: usize,
    /// Applications of the flexibility operator.
    pub operator_applications: usize,
    /// Wall-clock time, s.
    pub seconds: f64,
    /// Whether the solver and the certificate's natural residual met the tolerance.
    pub converged: bool,
    /// Amplitudes of the named loads of the bodies.
    #[serde(skip_serializing_if = "BTreeMap::is_empty", default)]
    pub loads: BTreeMap<String, f64>,
    /// Resultants at the two reversal points (+, -) of a cycle jump.
    #[serde(skip_serializing_if = "Option::is_none", default)]
    pub stroke_ends: Option<[Resultants; 2]>,
    /// Length, work and errors of a jump over cycles or sliding; `None` for an increment.
    #[serde(skip_serializing_if = "Option::is_none", default)]
    pub jump: Option<JumpRecord>,
    /// Creepages and distance of a rolling step; `None` for other steps.
    #[serde(skip_serializing_if = "Option::is_none", default)]
    pub rolling: Option<RollingRecord>,
}

impl IncrementRecord {
    /// Returns the record with the resultants `values`.
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

    /// Returns the record with the resultants of the + reversal point, if the record has reversal points. The approach
    /// stays the mean.
    pub fn at_plus_reversal(&self) -> Self {
        let entry = self.clone();
        if let Some([plus, _]) = self.stroke_ends { entry.with_resultants(&plus) } else { entry }
    }
}

/// A fretting cycle resolved into many increments, at constant wear depth.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct FrettingLoop {
    /// Name of the step.
    pub name: String,
    /// Fretting cycles since the start of the run.
    pub cycles_done: u64,
    /// Friction dissipation of the cycle, N mm.
    pub dissipation: f64,
    /// Values after each increment of the cycle, which begins at the - reversal point. They are the displacement of
    /// body 2 along x, y from the centre of the cycle (mm), the tangential force on body 1 along x, y and the normal
    /// force (N).
    pub points: Vec<[f64; 5]>,
}

/// Length, work and errors of a jump.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, Default)]
pub struct JumpRecord {
    /// Cycles (or mm of sliding) of the jump.
    pub length: f64,
    /// Number of contact problems solved, rejected trials included.
    pub solves: usize,
    /// Number of rejected trials.
    pub rejected: usize,
    /// Estimated error of the wear depth, root mean square over the contact, mm.
    pub depth_error: f64,
    /// Estimated error of the wear volume, mm3.
    pub volume_error: f64,
    /// Longest stable explicit jump, cycles or mm of sliding.
    #[serde(skip_serializing_if = "Option::is_none", default)]
    pub critical_length: Option<f64>,
    /// Increments per stroke of the resolved cycle at the end of the jump; in the first record, also of a resolved
    /// cycle before the jump. `None` without a new resolved cycle.
    #[serde(skip_serializing_if = "Option::is_none", default)]
    pub resolved: Option<usize>,
}

/// Reason why a run did not converge.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Divergence {
    /// The contact solver reached its iteration limit or stopped making progress.
    Iterations,
    /// The tangential load exceeds the friction limit.
    GrossSliding,
    /// The bodies separated under prescribed forces.
    ContactLost,
    /// Loads rotate a body by more than linearised rotations allow.
    LargeRotation,
    /// The next jump would bring the contact to the edge of the frame. The run ended before this jump.
    FrameEdge,
    /// The stick zone of a cycle did not converge.
    StickZone,
    /// The solver of the linear equations of a body failed.
    LinearSolver,
    /// The requested accuracy was not reached.
    Accuracy,
}

impl Divergence {
    /// Name of the reason in results.
    pub fn name(self) -> &'static str {
        match self {
            Self::Iterations => "iterations",
            Self::GrossSliding => "gross-sliding",
            Self::ContactLost => "contact-lost",
            Self::LargeRotation => "large-rotation",
            Self::FrameEdge => "frame-edge",
            Self::StickZone => "stick-zone",
            Self::LinearSolver => "linear-solver",
            Self::Accuracy => "accuracy",
        }
    }
}

impl std::fmt::Display for Divergence {
    fn fmt(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
        f.write_str(self.name())
    }
}

/// Outcome of a run.
#[derive(Debug, Clone, PartialEq)]
pub enum Outcome {
    /// All steps converged.
    Converged,
    /// A step did not converge.
    NotConverged(Divergence),
    /// A signal stopped the run.
    Interrupted,
}

/// Fields on the frame after an increment, in the axes of the cells.
#[derive(Debug, Clone, Default)]
pub struct FrameState {
    /// Tractions on body 2, `[3, N]` by components, MPa.
    pub tractions: Vec<f64>,
    /// Gap, `[3, N]` by components, mm.
    pub gap: Vec<f64>,
    /// Slip of the increment, `[2, N]` by components, mm; for rolling, slip per rolled distance.
    pub slip: Vec<f64>,
    /// Contact status of each cell, `[N]`: 0 open, 1 stick, 2 slip.
    pub status: Vec<u8>,
    /// Wear depth of both bodies, mm.
    pub wear_depth: Vec<f64>,
    /// Estimated error of the wear depth, mm (see [`IncrementRecord::wear_depth_error`]).
    pub wear_depth_error: Vec<f64>,
    /// Amplitudes of the loads of body 1, then of body 2.
    pub load_amplitudes: Vec<f64>,
}
