//! The settings that runs get finer by.

use super::super::bodies::frame;
use super::super::failure::Failure;
use super::super::near_field::choose;
use crate::frame::GapShape;
use crate::friction::FrictionLaw;
use crate::history::step::{Closed, Correction, CycleMotion, Cycles, Jumps, Step};
use crate::scene::keys::accuracy::Knob;
use crate::scene::plan::{AccuracySpec, BodySpec, FrameSpec, Plan};
use crate::wear::WearLaw;

/// Cells along the shorter side of the frame: even numbers, so that cells lie alike in the middle, each about 1.5 times the one before.
const CELLS: [usize; 12] = [12, 18, 26, 40, 60, 90, 136, 200, 300, 450, 680, 1000];

/// Most cells of a frame.
const MOST: usize = 1_000_000;

/// Most doublings of the increments, and divisions of the tolerance of jumps by four or doublings of their number.
const DOUBLINGS: usize = 9;
const JUMP_LEVELS: usize = 7;

/// Doublings with which the cells are refined where more do not suffice either.
const ENOUGH: usize = 3;

/// Most increments per stroke of closed paths: all ends of a cycle are one problem.
const MOST_AROUND: usize = 128;

/// Cells in contact from which on values are believed to converge; of line contacts.
const IN_CONTACT: usize = 40;
const IN_LINE: usize = 6;

/// The natural residual over the accuracy, and its limits; the same of compressed operators.
const RESIDUAL: [f64; 3] = [1e-4, 1e-10, 1e-6];
const COMPRESSION: [f64; 3] = [1e-2, 1e-9, 1e-4];

/// How fine a run is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Levels {
    cells: usize,
    increments: usize,
    jumps: usize,
}

impl Levels {
    /// The next finer ones.
    pub(super) fn finer(self, knob: Knob) -> Self {
        match knob {
            Knob::Cells => Self { cells: self.cells + 1, ..self },
            Knob::Increments => Self { increments: self.increments + 1, ..self },
            Knob::Jumps => Self { jumps: self.jumps + 1, ..self },
        }
    }

    /// Those for what follows a knob that did not suffice.
    pub(super) fn coarser(self, knob: Knob) -> Self {
        match knob {
            Knob::Cells => self,
            Knob::Increments => Self { increments: self.increments.min(ENOUGH), ..self },
            Knob::Jumps => Self { jumps: self.jumps.min(ENOUGH), ..self },
        }
    }

    /// How many times the increments of the scene.
    pub(super) fn increments(self) -> usize {
        1 << self.increments
    }
}

/// What can be chosen of a plan, and how.
pub(super) struct Ladder {
    relative: f64,
    /// Whether cells, increments and jumps are chosen.
    chosen: [bool; 3],
    /// Cells along the frame's x and y over those along the shorter side; `None` for the one cell of a direction in which the frame repeats itself.
    aspect: [Option<f64>; 2],
    /// Increments per stroke of closed paths; 0 if there are none.
    around: usize,
    /// Least number of cycles of a step, which bounds the number of jumps.
    cycles: f64,
    /// Whether the scene says how exactly iterations and compressed operators are solved.
    given: [bool; 2],
}

impl Ladder {
    pub fn new(plan: &Plan, spec: &AccuracySpec) -> Result<Self, Failure> {
        let kept = |knob: Knob| spec.keep.contains(&knob);
        let cycles = plan
            .steps
            .iter()
            .filter_map(|step| step.cycles)
            .fold(f64::INFINITY, |least, cycles| least.min(cycles.count));
        let around = plan.steps.iter().filter_map(ring).map(|closed| closed.increments).max().unwrap_or(0);
        let given =
            ["solver.tolerance", "solver.compression_tolerance"].map(|key| plan.document.get(key).is_some());
        let mut ladder =
            Self { relative: spec.relative, chosen: [false; 3], aspect: [None; 2], around, cycles, given };
        if let FrameSpec::Grid { cells, half_width, periodic, .. } = &plan.frame {
            ladder.aspect = aspect(*cells, *half_width, *periodic);
            // Boundary elements have meshes of their own; heights of the cells are those of the scene's.
            let own = plan.bodies.iter().any(|body| matches!(body, BodySpec::Be(_)))
                || matches!(&plan.gap.shape, GapShape::Heights(heights) if heights.spacing.is_none())
                || matches!(plan.gap.shape, GapShape::Cells(_));
            if ladder.aspect != [None; 2] && !own && !kept(Knob::Cells) {
                ladder.chosen[0] = true;
                let coarse = ladder.plan(plan, &ladder.first());
                // Cells finer than the faces of a mesh that is condensed show nothing new.
                ladder.chosen[0] = !choose(&coarse, &frame(&coarse)?)?.iter().any(|near| near.is_condensed());
            }
        }
        let monotone = |step: &&Step| step.cycles.is_none() && step.rolling.is_none();
        let slips = |step: &Step| step.friction && plan.friction != FrictionLaw::None;
        let wears = |step: &Step| step.wear && plan.wear != WearLaw::None;
        let by_path = plan.steps.iter().filter(monotone).any(|step| slips(step) || wears(step));
        ladder.chosen[1] = (by_path || around > 0) && !kept(Knob::Increments);
        ladder.chosen[2] =
            plan.steps.iter().any(|step| step.cycles.is_some() && wears(step)) && !kept(Knob::Jumps);
        Ok(ladder)
    }

    /// What is turned: the cells last.
    pub fn knobs(&self) -> Vec<Knob> {
        let [cells, increments, jumps] = self.chosen;
        let all = [(increments, Knob::Increments), (jumps, Knob::Jumps), (cells, Knob::Cells)];
        all.into_iter().filter(|(chosen, _)| *chosen).map(|(_, knob)| knob).collect()
    }

    pub fn first(&self) -> Levels {
        Levels { cells: 0, increments: 0, jumps: 0 }
    }

    pub fn is_last(&self, knob: Knob, levels: &Levels) -> bool {
        match knob {
            Knob::Cells => {
                let [x, y] = self.cells(levels.cells + 1);
                levels.cells + 1 >= CELLS.len() || x * y > MOST
            }
            Knob::Increments => {
                levels.increments >= DOUBLINGS || self.around << levels.increments >= MOST_AROUND
            }
            Knob::Jumps => levels.jumps >= JUMP_LEVELS || f64::from(1u32 << levels.jumps) >= self.cycles,
        }
    }

    /// Cells along x and y.
    fn cells(&self, level: usize) -> [usize; 2] {
        let shorter = CELLS[level.min(CELLS.len() - 1)] as f64;
        self.aspect.map(|aspect| aspect.map_or(1, |aspect| even(aspect * shorter)))
    }

    /// Whether so many cells in contact resolve it.
    pub fn resolves(&self, cells: usize) -> bool {
        cells >= if self.aspect.contains(&None) { IN_LINE } else { IN_CONTACT }
    }

    /// What the error of a knob falls with.
    pub fn size(&self, knob: Knob, levels: &Levels) -> f64 {
        match knob {
            Knob::Cells => 1.0 / CELLS[levels.cells.min(CELLS.len() - 1)] as f64,
            Knob::Increments => 0.5f64.powi(levels.increments as i32),
            // The error of jumps follows their tolerance, which falls by four.
            Knob::Jumps => 0.5f64.powi(levels.jumps as i32),
        }
    }

    /// What the cells within an outline lack of its area, or have too much, over it; `None` without an outline, or of one that the frame cuts.
    pub fn cut(&self, plan: &Plan, levels: &Levels) -> Option<f64> {
        let FrameSpec::Grid { half_width, outline: Some(outline), .. } = &plan.frame else { return None };
        let reaches =
            outline.extent().iter().zip(half_width).any(|([low, high], half)| -low > *half || high > half);
        if reaches || !self.chosen[0] {
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

    /// Area of the cells within an outline of which they have `cut` too much.
    pub fn punch(&self, plan: &Plan, cut: Option<f64>) -> Option<f64> {
        let FrameSpec::Grid { outline: Some(outline), .. } = &plan.frame else { return None };
        cut.map(|cut| (1.0 + cut) * outline.area())
    }

    /// The plan with these levels.
    pub fn plan(&self, plan: &Plan, levels: &Levels) -> Plan {
        let [cells, increments, jumps] = self.chosen;
        let mut plan = Plan { accuracy: None, ..plan.clone() };
        let of = |[factor, least, most]: [f64; 3]| (factor * self.relative).clamp(least, most);
        if !self.given[0] {
            plan.solver.tolerance = of(RESIDUAL);
        }
        if !self.given[1] {
            plan.solver.compression_tolerance = of(COMPRESSION);
        }
        if let (FrameSpec::Grid { cells: n, .. }, true) = (&mut plan.frame, cells) {
            *n = self.cells(levels.cells);
        }
        if increments {
            plan.fields_every = levels.increments();
        }
        for step in &mut plan.steps {
            if let (Some(closed), true) = (ring(step), increments) {
                let finer = Closed { increments: closed.increments * levels.increments(), ..closed };
                step.cycles =
                    step.cycles.map(|cycles| Cycles { motion: CycleMotion::Closed(finer), ..cycles });
            }
            match &mut step.cycles {
                Some(cycles) if jumps && step.wear => {
                    let share = self.relative * 0.25f64.powi(levels.jumps as i32);
                    cycles.jumps = match cycles.jumps {
                        Jumps::Number(number) => {
                            Jumps::Number((number << levels.jumps).min(cycles.count as usize).max(number))
                        }
                        Jumps::Tolerance(_) => Jumps::Tolerance(share),
                    };
                    if let CycleMotion::Closed(Closed { resolve: Some(used), .. }) = &mut cycles.motion {
                        used.tolerance = share;
                    }
                }
                None if increments && step.rolling.is_none() => step.increments *= levels.increments(),
                _ => {}
            }
        }
        plan
    }

    /// Levels in words.
    pub fn words(&self, levels: &Levels) -> String {
        let [cells, increments, jumps] = self.chosen;
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
            words.push(format!("jumps of level {}", levels.jumps + 1));
        }
        words.join(", ")
    }
}

/// The closed path of a step whose increments may be refined: not "auto", where resolved cycles do it.
fn ring(step: &Step) -> Option<Closed> {
    match step.cycles?.motion {
        CycleMotion::Closed(closed)
            if closed.resolve.is_none_or(|used| used.correction != Correction::Always) =>
        {
            Some(closed)
        }
        _ => None,
    }
}

/// Cells along the sides of a frame over those along the shorter one, as the scene has them; one cell across where the frame does not repeat itself
/// is as long as its side, beside square ones.
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

/// The nearest even number, at least 2.
fn even(n: f64) -> usize {
    2 * ((0.5 * n).round() as usize).max(1)
}

/// Cells of a grid frame.
pub(super) fn cells(plan: &Plan) -> Option<[usize; 2]> {
    match plan.frame {
        FrameSpec::Grid { cells, .. } => Some(cells),
        FrameSpec::Mesh { .. } => None,
    }
}

/// Tolerance or number of jumps of the first step that has them.
pub(super) fn jumps(plan: &Plan) -> Option<f64> {
    plan.steps.iter().find_map(|step| step.cycles).map(|cycles| match cycles.jumps {
        Jumps::Number(number) => number as f64,
        Jumps::Tolerance(tolerance) => tolerance,
    })
}
