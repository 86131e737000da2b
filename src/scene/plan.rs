//! Plan: the validated inputs of a run. Angles are in radians.

mod bodies;

use std::collections::{BTreeMap, BTreeSet};
use std::path::PathBuf;

use super::document::Document;
use super::spec::accuracy::{AccuracyQuantity, RefinementParameter};
use super::spec::body::BulkStress;
use super::spec::frame::FramePoints;
use super::spec::solver::{Output, Solver};
use super::variant::ComparePlan;
use crate::body::LoadCase;
use crate::error::Warning;
use crate::evolution::step::{Integrator, Normal, Step};
use crate::fem;
use crate::frame::{InitialGap, Outline};
use crate::laws::friction::FrictionLaw;
use crate::laws::wear::WearLaw;
use crate::linalg::memory::MemoryLimit;
use crate::material::strength::MaterialStrength;
use crate::output::interior_points::InteriorPointRequest;
use crate::output::summary::Units;

pub use bodies::{
    BeBodyPlan, BodyMaterial, BodyPlan, FibreAngles, GroupLoad, MeshedBodyPlan, PrescribedDisplacement,
    TemperaturePlan, TruncatedHalfSpacePlan,
};

/// Inputs of a run from a scene. They are validated as far as possible without a solution.
#[derive(Debug, Clone)]
pub struct Plan {
    /// Title; the name of the file if the scene has no title.
    pub title: String,
    /// Names of the units.
    pub units: Units,
    /// Body 1 (below) and body 2 (above).
    pub bodies: [BodyPlan; 2],
    /// Loads of body 1 and body 2 if they are half-spaces.
    pub half_space_loads: [HalfSpaceLoads; 2],
    /// Strengths of the materials, by name of the material. Materials without strengths are absent.
    pub strength_limits: BTreeMap<String, MaterialStrength>,
    /// The contact frame.
    pub frame: FramePlan,
    /// The initial gap.
    pub gap: InitialGap,
    /// The friction law.
    pub friction: FrictionLaw,
    /// The wear law.
    pub wear: WearLaw,
    /// Index (0 or 1) of the body whose fibre a law uses: first for the friction law, then for the wear law. `None` if
    /// the law uses no fibre or has its own fibre angles.
    pub fibre_bodies: [Option<usize>; 2],
    /// Fraction of the wear depth that is taken from body 1.
    pub wear_share: f64,
    /// Meshes move when the wear depth since the last move reaches this fraction of the element height. `None` if
    /// meshes do not move.
    pub mesh_motion_threshold: Option<f64>,
    /// Time integrator of wear over wear jumps.
    pub integrator: Integrator,
    /// The load steps.
    pub steps: Vec<Step>,
    /// Solver settings.
    pub solver: Solver,
    /// Memory limit of the run.
    pub memory_limit: MemoryLimit,
    /// Output settings.
    pub output: Output,
    /// Variants to compare.
    pub compare: ComparePlan,
    /// Points inside bodies at which displacement and stress are written.
    pub interior_requests: Vec<InteriorPointRequest>,
    /// Required accuracy; `None` if the scene fixes cells, increments and jumps.
    pub accuracy: Option<AccuracyPlan>,
    /// Fields are written every `fields_every` increments, in steps without cycles, sliding and rolling.
    pub fields_every: usize,
    /// Cache of the flexibilities of finite-element bodies; `None` without a cache.
    pub flexibility_cache: Option<fem::FlexibilityCache>,
    /// Notes for the user before the run.
    pub notes: Vec<Warning>,
    /// Keys and paths of the files that the scene names.
    pub files: Vec<(String, PathBuf)>,
    /// The scene file, for messages that refer to it.
    pub document: Document,
}

impl Plan {
    /// Largest positive approach that the steps prescribe, in the length unit of the scene.
    pub fn max_prescribed_approach(&self) -> Option<f64> {
        let approach = |step: &Step| match step.normal {
            Some(Normal::Approach(approach)) => Some(approach),
            _ => None,
        };
        self.steps.iter().filter_map(approach).reduce(f64::max).filter(|&most| most > 0.0)
    }

    /// Whether friction acts in `step`.
    pub fn has_friction(&self, step: &Step) -> bool {
        step.friction && self.friction.ellipse().is_some()
    }

    /// Whether bodies wear in `step`.
    pub fn has_wear(&self, step: &Step) -> bool {
        step.wear && self.wear.specific_rate(self.friction.ellipse().filter(|_| step.friction)).is_some()
    }

    /// Replaces the memory limit if `limit` is given. Adds a note if the memory limit exceeds the available memory.
    pub fn override_memory_limit(&mut self, limit: Option<MemoryLimit>) {
        self.memory_limit = limit.unwrap_or(self.memory_limit);
        if self.memory_limit.exceeds_available() {
            let note = "the memory limit exceeds the memory that is available now. A run that needs more than the available memory starts anyway, and the operating system may stop it";
            self.notes.push(Warning::note(note));
        }
    }
}

/// Required accuracy of the results.
#[derive(Debug, Clone, PartialEq)]
pub struct AccuracyPlan {
    /// Largest allowed relative error.
    pub relative: f64,
    /// Quantities whose estimated errors must not exceed `relative`.
    pub quantities: Vec<AccuracyQuantity>,
    /// Parameters that are not refined.
    pub fixed_parameters: Vec<RefinementParameter>,
}

/// Loads of a half-space; empty for other bodies.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct HalfSpaceLoads {
    /// Uniform stress parallel to the surface.
    pub bulk_stress: Option<BulkStress>,
    /// Uniform change of temperature.
    pub temperature: Option<TemperaturePlan>,
}

impl HalfSpaceLoads {
    /// Load cases of the bulk stress and of the temperature.
    pub fn cases(&self) -> Vec<LoadCase> {
        let stress = self.bulk_stress.iter();
        let stress =
            stress.map(|BulkStress { name, preload, .. }| LoadCase { name: name.clone(), preload: *preload });
        stress.chain(self.temperature.iter().map(|temperature| temperature.case.clone())).collect()
    }
}

/// The contact frame.
#[derive(Debug, Clone, PartialEq)]
pub enum FramePlan {
    /// Grid of uniform rectangular cells.
    Grid {
        /// Half side lengths along the frame's x and y.
        half_width: [f64; 2],
        /// Numbers of cells along the frame's x and y.
        cells: [usize; 2],
        /// Centre in global x, y.
        center: [f64; 2],
        /// Angle of the frame's x from global x.
        azimuth: f64,
        /// Whether the frame is periodic along its x and y.
        periodic: [bool; 2],
        /// Outline of the region in which contact is possible.
        outline: Option<Outline>,
        /// Whether the frame is enlarged when wear moves the contact to its edge.
        grow: bool,
    },
    /// Contact group of a meshed body.
    Mesh {
        /// Index of the body, 0 or 1.
        body: usize,
        /// Whether each face or each node has a cell.
        points: FramePoints,
        /// Origin of gap shapes, rotations and moments in global x, y.
        center: [f64; 2],
        /// Angle of the cells' x from global x.
        azimuth: f64,
        /// Direction from body 1 to body 2, of any length above 0.
        normal: [f64; 3],
    },
}

impl FramePlan {
    /// Angle of the frame's x from global x, radians.
    pub fn azimuth(&self) -> f64 {
        match self {
            Self::Grid { azimuth, .. } | Self::Mesh { azimuth, .. } => *azimuth,
        }
    }
}

impl Plan {
    /// Names of all loads of the bodies. If the overlap of the meshes is a load, its name is included.
    pub fn load_names(&self) -> BTreeSet<String> {
        let of_bodies = [0, 1].into_iter().flat_map(|index| self.load_cases(index));
        let all = of_bodies.chain(self.gap.as_meshed.then(LoadCase::interference));
        all.filter_map(|case| case.name).collect()
    }

    /// Load cases of body `index`.
    pub fn load_cases(&self, index: usize) -> Vec<LoadCase> {
        match self.bodies[index].as_meshed() {
            Some(meshed) => meshed.load_cases().into_iter().cloned().collect(),
            None => self.half_space_loads[index].cases(),
        }
    }
}
