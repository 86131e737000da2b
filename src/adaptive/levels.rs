//! Levels of refinement of cells, increments and jumps, and the settings at each level.

use crate::evolution::step::{ClosedPath, Correction, JumpPolicy, Step, StepKind};
use crate::frame::GapShape;
use crate::scene::plan::{AccuracyPlan, BodyPlan, FramePlan, Plan};
use crate::scene::spec::accuracy::RefinementParameter;
use crate::simulation::build::contact_frame::contact_frame;
use crate::simulation::build::near_field::choose_near_fields;
use crate::simulation::failure::SceneError;

/// Number of cells along the shorter side of the frame at each level. The numbers are even, so the middle of the frame
/// lies between cells.
const CELLS_BY_LEVEL: [usize; 12] = [12, 18, 26, 40, 60, 90, 136, 200, 300, 450, 680, 1000];

/// Largest number of cells of a frame.
const MOST: usize = 1_000_000;

/// Largest levels of the increments (`DOUBLINGS`) and of the jumps (`JUMP_LEVELS`). Each level doubles the increments.
/// For jumps, each level divides their tolerance by four or doubles their number.
const DOUBLINGS: usize = 9;
const JUMP_LEVELS: usize = 7;

/// Highest level to which increments or jumps are reset for later refinements, if they did not reach the accuracy at
/// their finest level.
const FALLBACK_LEVEL: usize = 3;

/// Number of increments per stroke at which the refinement of closed paths ends.
const MAX_INCREMENTS_PER_STROKE: usize = 128;

/// Smallest number of cells in contact with which values are expected to converge, for area contacts and line contacts.
const MIN_CONTACT_CELLS: usize = 40;
const MIN_LINE_CONTACT_CELLS: usize = 6;

/// Tolerances of the natural residual and of compressed operators: [multiple of the accuracy, lower limit, upper limit].
const RESIDUAL: [f64; 3] = [1e-4, 1e-10, 1e-6];
const COMPRESSION: [f64; 3] = [1e-2, 1e-9, 1e-4];

/// Level of each refinement parameter.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Levels {
    cells: usize,
    increments: usize,
    jumps: usize,
}

impl Levels {
    pub(super) fn finer(self, knob: RefinementParameter) -> Self {
        match knob {
            RefinementParameter::Cells => Self { cells: self.cells + 1, ..self },
            RefinementParameter::Increments => Self { increments: self.increments + 1, ..self },
            RefinementParameter::Jumps => Self { jumps: self.jumps + 1, ..self },
        }
    }

    /// Levels from which later parameters start if the finest level of `knob` did not reach the accuracy.
    pub(super) fn coarser(self, knob: RefinementParameter) -> Self {
        match knob {
            RefinementParameter::Cells => self,
            RefinementParameter::Increments => {
                Self { increments: self.increments.min(FALLBACK_LEVEL), ..self }
            }
            RefinementParameter::Jumps => Self { jumps: self.jumps.min(FALLBACK_LEVEL), ..self },
        }
    }

    pub(super) fn increments(self) -> usize {
        1 << self.increments
    }
}

pub(super) struct RefinementLadder {
    relative: f64,
    /// Whether cells, increments and jumps are refined.
    is_refined: [bool; 3],
    /// Number of cells along x and y, divided by the number along the shorter side (see the function `aspect`). Both
    /// are `None` without a grid.
    aspect: [Option<f64>; 2],
    /// Largest number of increments per stroke of closed paths that may be refined; 0 without these paths.
    increments_per_stroke: usize,
    /// Smallest number of cycles of all steps, which limits the number of jumps.
    cycles: f64,
    /// Whether the scene prescribes the tolerances of the solver and of compressed operators.
    has_own_tolerances: [bool; 2],
}

impl RefinementLadder {
    pub fn new(plan: &Plan, spec: &AccuracyPlan) -> Result<Self, SceneError> {
        let kept = |knob: RefinementParameter| spec.fixed_parameters.contains(&knob);
        let cycles = plan
            .steps
            .iter()
            .filter_map(|step| step.kind.cycles())
            .fold(f64::INFINITY, |least, cycles| least.min(cycles.count));
        let paths = plan.steps.iter().filter_map(|step| step.kind.closed_path());
        let increments_per_stroke =
            paths.filter(|path| is_refinable(path)).map(ClosedPath::given_increments).max().unwrap_or(0);
        let has_own_tolerances =
            ["solver.tolerance", "solver.compression_tolerance"].map(|key| plan.document.get(key).is_some());
        let mut ladder = Self {
            relative: spec.relative,
            is_refined: [false; 3],
            aspect: [None; 2],
            increments_per_stroke,
            cycles,
            has_own_tolerances,
        };
        if let FramePlan::Grid { cells, half_width, periodic, .. } = &plan.frame {
            ladder.aspect = aspect(*cells, *half_width, *periodic);
            // Cells are not refined if a body has its own boundary-element mesh, or if the gap is given at the cells
            // of the scene.
            let own = plan.bodies.iter().any(|body| matches!(body, BodyPlan::Be(_)))
                || matches!(&plan.gap.shape, GapShape::Heights(heights) if heights.spacing.is_none())
                || matches!(plan.gap.shape, GapShape::PerCell(_));
            if ladder.aspect != [None; 2] && !own && !kept(RefinementParameter::Cells) {
                ladder.is_refined[0] = true;
                let coarse = ladder.plan(plan, &ladder.first());
                // Cells are not refined on a condensed mesh, because cells finer than its faces do not improve the
                // result.
                ladder.is_refined[0] = !choose_near_fields(&coarse, &contact_frame(&coarse)?)?
                    .iter()
                    .any(|near| near.is_condensed());
            }
        }
        let monotone = |step: &&Step| matches!(step.kind, StepKind::Monotone);
        let by_path =
            plan.steps.iter().filter(monotone).any(|step| plan.has_friction(step) || plan.has_wear(step));
        ladder.is_refined[1] =
            (by_path || increments_per_stroke > 0) && !kept(RefinementParameter::Increments);
        ladder.is_refined[2] =
            plan.steps.iter().any(|step| step.kind.cycles().is_some() && plan.has_wear(step))
                && !kept(RefinementParameter::Jumps);
        Ok(ladder)
    }

    pub fn knobs(&self) -> Vec<RefinementParameter> {
        let [cells, increments, jumps] = self.is_refined;
        let all = [
            (increments, RefinementParameter::Increments),
            (jumps, RefinementParameter::Jumps),
            (cells, RefinementParameter::Cells),
        ];
        all.into_iter().filter(|(chosen, _)| *chosen).map(|(_, knob)| knob).collect()
    }

    pub fn first(&self) -> Levels {
        Levels { cells: 0, increments: 0, jumps: 0 }
    }

    pub fn is_last(&self, knob: RefinementParameter, levels: &Levels) -> bool {
        match knob {
            RefinementParameter::Cells => {
                let [x, y] = self.cells(levels.cells + 1);
                levels.cells + 1 >= CELLS_BY_LEVEL.len() || x * y > MOST
            }
            RefinementParameter::Increments => {
                levels.increments >= DOUBLINGS
                    || self.increments_per_stroke << levels.increments >= MAX_INCREMENTS_PER_STROKE
            }
            RefinementParameter::Jumps => {
                levels.jumps >= JUMP_LEVELS || f64::from(1u32 << levels.jumps) >= self.cycles
            }
        }
    }

    fn cells(&self, level: usize) -> [usize; 2] {
        let shorter = CELLS_BY_LEVEL[level.min(CELLS_BY_LEVEL.len() - 1)] as f64;
        self.aspect.map(|aspect| aspect.map_or(1, |aspect| even(aspect * shorter)))
    }

    pub fn resolves(&self, cells: usize) -> bool {
        cells >= if self.aspect.contains(&None) { MIN_LINE_CONTACT_CELLS } else { MIN_CONTACT_CELLS }
    }

    /// Size h of the parameter `knob` at its level, for the error estimate C h^p.
    pub fn size(&self, knob: RefinementParameter, levels: &Levels) -> f64 {
        match knob {
            RefinementParameter::Cells => {
                1.0 / CELLS_BY_LEVEL[levels.cells.min(CELLS_BY_LEVEL.len() - 1)] as f64
            }
            RefinementParameter::Increments => 0.5f64.powi(levels.increments as i32),
            // The tolerance of jumps decreases by four per level, so an error proportional to the tolerance has
            // order 2.
            RefinementParameter::Jumps => 0.5f64.powi(levels.jumps as i32),
        }
    }

    /// Relative error of the outline area: (area of the cells with centres in the outline) / (outline area) - 1. `None`
    /// without an outline, if the outline extends beyond the frame, or if cells are not refined.
    pub fn outline_area_error(&self, plan: &Plan, levels: &Levels) -> Option<f64> {
        let FramePlan::Grid { half_width, outline: Some(outline), .. } = &plan.frame else { return None };
        let reaches =
            outline.extent().iter().zip(half_width).any(|([low, high], half)| -low > *half || high > half);
        if reaches || !self.is_refined[0] {
            return None;
        }
        let [nx, ny] = self.cells(levels.cells);
        let center = |i: usize, n: usize, half: f64| half * ((2 * i + 1) as f64 / n as f64 - 1.0);
        let inside = (0..nx * ny)
            .filter(|i| {
                outline.contains([center(i / ny, nx, half_width[0]), center(i % ny, ny, half_width[1])])
            })
            .count();
        let cell = 4.0 * half_width[0] * half_width[1] / (nx * ny) as f64;
        Some(inside as f64 * cell / outline.area() - 1.0)
    }

    /// Area of the cells with centres in the outline. `cut` is the error from [`Self::outline_area_error`].
    pub fn outline_cell_area(&self, plan: &Plan, cut: Option<f64>) -> Option<f64> {
        let FramePlan::Grid { outline: Some(outline), .. } = &plan.frame else { return None };
        cut.map(|cut| (1.0 + cut) * outline.area())
    }

    pub fn plan(&self, plan: &Plan, levels: &Levels) -> Plan {
        let [cells, increments, jumps] = self.is_refined;
        let mut plan = Plan { accuracy: None, ..plan.clone() };
        let of = |[factor, least, most]: [f64; 3]| (factor * self.relative).clamp(least, most);
        if !self.has_own_tolerances[0] {
            plan.solver.tolerance = of(RESIDUAL);
        }
        if !self.has_own_tolerances[1] {
            plan.solver.compression_tolerance = of(COMPRESSION);
        }
        if let (FramePlan::Grid { cells: n, .. }, true) = (&mut plan.frame, cells) {
            *n = self.cells(levels.cells);
        }
        if increments {
            plan.fields_every = levels.increments();
        }
        for step in &mut plan.steps {
            match &mut step.kind {
                StepKind::Monotone if increments => step.increments *= levels.increments(),
                StepKind::Fretting { path, .. } if increments && is_refinable(path) => {
                    path.refine(levels.increments())
                }
                _ => {}
            }
            if let Some(cycles) = step.kind.cycles_mut().filter(|_| jumps && step.wear) {
                let share = self.relative * 0.25f64.powi(levels.jumps as i32);
                cycles.jumps = match cycles.jumps {
                    JumpPolicy::Number(number) => {
                        JumpPolicy::Number((number << levels.jumps).min(cycles.count as usize).max(number))
                    }
                    JumpPolicy::Tolerance(_) => JumpPolicy::Tolerance(share),
                };
                if let StepKind::Fretting { path: ClosedPath { resolved_cycles: Some(used), .. }, .. } =
                    &mut step.kind
                {
                    // The error warning of resolved cycles is off, because the accuracy search estimates these
                    // errors itself.
                    (used.tolerance, used.error_warning) = (share, f64::INFINITY);
                }
            }
        }
        plan
    }

    pub fn describe(&self, levels: &Levels) -> String {
        let [cells, increments, jumps] = self.is_refined;
        let mut words = Vec::new();
        if cells {
            let [x, y] = self.cells(levels.cells);
            words.push(format!("{x} x {y} cells"));
        }
        if increments {
            words.push(match levels.increments() {
                1 => "the increments of the scene".to_owned(),
                n => format!("{n} times the increments"),
            });
        }
        if jumps {
            words.push(match levels.jumps {
                0 => "the first wear jumps".to_owned(),
                1 => "wear jumps refined once".to_owned(),
                n => format!("wear jumps refined {n} times"),
            });
        }
        words.join(", ")
    }
}

/// Whether the increments of a path may be refined. With `increments = "auto"` they are not refined, because resolved
/// cycles correct the wear.
fn is_refinable(path: &ClosedPath) -> bool {
    path.resolved_cycles.is_none_or(|used| used.increments.is_some() || used.correction != Correction::Always)
}

/// Number of cells along x and y, divided by the smaller number.
///
/// If only one direction has a single cell and no direction is periodic, side lengths replace the numbers of cells. The
/// value is `None` for a periodic direction with a single cell, and for a frame of one cell.
fn aspect(cells: [usize; 2], half_width: [f64; 2], periodic: [bool; 2]) -> [Option<f64>; 2] {
    let several = |axis: usize| cells[axis] > 1;
    let numbers = [0, 1].map(|axis| match (several(axis), periodic[axis]) {
        (false, true) => None,
        _ if several(0) != several(1) && !periodic[0] && !periodic[1] => Some(half_width[axis]),
        _ => Some(cells[axis] as f64),
    });
    let shorter = numbers.iter().flatten().fold(f64::INFINITY, |least, n| least.min(*n));
    if cells == [1, 1] { [None; 2] } else { numbers.map(|n| n.map(|n| n / shorter)) }
}

/// Nearest even number, at least 2.
fn even(n: f64) -> usize {
    2 * ((0.5 * n).round() as usize).max(1)
}

pub(super) fn cells(plan: &Plan) -> Option<[usize; 2]> {
    match plan.frame {
        FramePlan::Grid { cells, .. } => Some(cells),
        FramePlan::Mesh { .. } => None,
    }
}

/// Tolerance or number of jumps of the first step with cycles.
pub(super) fn jumps(plan: &Plan) -> Option<f64> {
    plan.steps.iter().find_map(|step| step.kind.cycles()).map(|cycles| match cycles.jumps {
        JumpPolicy::Number(number) => number as f64,
        JumpPolicy::Tolerance(tolerance) => tolerance,
    })
}
