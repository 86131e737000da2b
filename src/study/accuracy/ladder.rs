//! The settings that runs get finer by.

use super::super::bodies::frame;
use super::super::failure::Failure;
use super::super::near_field::choose;
use crate::friction::FrictionLaw;
use crate::history::step::{Jumps, Step};
use crate::scene::keys::accuracy::Knob;
use crate::scene::plan::{AccuracySpec, BodySpec, FrameSpec, Plan};

/// Cells along the longer side of the frame: even numbers, so that cells lie alike in the middle, each about 1.5 times the one before.
const CELLS: [usize; 12] = [12, 18, 26, 40, 60, 90, 136, 200, 300, 450, 680, 1000];

/// Most doublings of the increments, and divisions of the tolerance of jumps by four or doublings of their number.
const DOUBLINGS: usize = 9;
const JUMP_LEVELS: usize = 7;

/// Cells in contact from which on values are believed to converge; of line contacts.
const IN_CONTACT: usize = 20;
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
    /// Cells along the frame's x and y over those along the longer side; `None` for one cell.
    aspect: [Option<f64>; 2],
}

impl Ladder {
    pub fn new(plan: &Plan, spec: &AccuracySpec) -> Result<Self, Failure> {
        let mut aspect = [None; 2];
        let mut of_grid = false;
        if let FrameSpec::Grid { cells, .. } = &plan.frame {
            let longer = cells[0].max(cells[1]) as f64;
            aspect = cells.map(|n| (n > 1).then_some(n as f64 / longer));
            let near = choose(plan, &frame(plan)?)?;
            // Cells finer than the faces of a mesh that is condensed show nothing new.
            let meshed = plan.bodies.iter().any(|body| matches!(body, BodySpec::Be(_)));
            of_grid = longer > 1.0 && !meshed && !near.iter().any(|near| near.is_condensed());
        }
        let frictional = |step: &Step| step.friction && step.cycles.is_none() && step.rolling.is_none();
        let slips = plan.friction != FrictionLaw::None && plan.steps.iter().any(frictional);
        let wears = plan.steps.iter().any(|step| step.cycles.is_some() && step.wear);
        let kept = |knob: Knob| spec.keep.contains(&knob);
        let chosen =
            [of_grid && !kept(Knob::Cells), slips && !kept(Knob::Increments), wears && !kept(Knob::Jumps)];
        Ok(Self { relative: spec.relative, chosen, aspect })
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
            Knob::Cells => levels.cells + 1 >= CELLS.len(),
            Knob::Increments => levels.increments >= DOUBLINGS,
            Knob::Jumps => levels.jumps >= JUMP_LEVELS,
        }
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

    /// The plan with these levels.
    pub fn plan(&self, plan: &Plan, levels: &Levels) -> Plan {
        let [cells, increments, jumps] = self.chosen;
        let mut plan = Plan { accuracy: None, ..plan.clone() };
        let of = |[factor, least, most]: [f64; 3]| (factor * self.relative).clamp(least, most);
        plan.solver.tolerance = of(RESIDUAL);
        plan.solver.compression_tolerance = of(COMPRESSION);
        if let (FrameSpec::Grid { cells: n, .. }, true) = (&mut plan.frame, cells) {
            let longer = CELLS[levels.cells.min(CELLS.len() - 1)];
            *n = self.aspect.map(|aspect| aspect.map_or(1, |aspect| even(aspect * longer as f64)));
        }
        for step in &mut plan.steps {
            match &mut step.cycles {
                Some(cycles) if jumps && step.wear => {
                    cycles.jumps = match cycles.jumps {
                        Jumps::Number(number) => Jumps::Number(number << levels.jumps),
                        Jumps::Tolerance(_) => {
                            Jumps::Tolerance(self.relative * 0.25f64.powi(levels.jumps as i32))
                        }
                    };
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
            let n = CELLS[levels.cells.min(CELLS.len() - 1)] as f64;
            let [x, y] = self.aspect.map(|aspect| aspect.map_or(1, |aspect| even(aspect * n)));
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
