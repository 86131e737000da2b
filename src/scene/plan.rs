//! The validated inputs of a run. Angles are in radians.

use std::collections::BTreeMap;
use std::path::PathBuf;
use std::sync::Arc;

use nalgebra::Matrix3;

use super::document::Document;
use super::spec::accuracy::{AccuracyQuantity, RefinementParameter};
use super::spec::body::{BulkStress, Element, NearField, UniformFibre};
use super::spec::frame::FramePoints;
use super::spec::solver::{Output, Solver};
use super::variant::{ComparePlan, Discretisation};
use crate::bem::finite::Interpolation;
use crate::body::{self, LoadCase};
use crate::element::ElementKind;
use crate::error::Warning;
use crate::evolution::step::{Integrator, Normal, Step};
use crate::fem::{self, HexFormulation};
use crate::frame::{InitialGap, Outline};
use crate::geometry::fibre_axes;
use crate::laws::friction::FrictionLaw;
use crate::laws::wear::WearLaw;
use crate::linalg::memory::MemoryLimit;
use crate::material::strength::MaterialStrength;
use crate::material::{RegionMaterial, Stiffness};
use crate::mesh::Mesh;
use crate::output::interior_points::InteriorPointRequest;
use crate::output::summary::Units;

/// A scene, validated as far as possible without solving anything.
#[derive(Debug, Clone)]
pub struct Plan {
    /// Title; the name of the file if the scene has no title.
    pub title: String,
    /// Names of the units.
    pub units: Units,
    /// Body 1 (below) and body 2 (above).
    pub bodies: [BodyPlan; 2],
    /// Bulk stresses of body 1 and body 2.
    pub bulk_stresses: [Option<BulkStress>; 2],
    /// Strengths of the materials by name, where the scene gives them.
    pub strength_limits: BTreeMap<String, MaterialStrength>,
    /// The contact frame.
    pub frame: FramePlan,
    /// The initial gap.
    pub gap: InitialGap,
    /// The friction law.
    pub friction: FrictionLaw,
    /// The wear law.
    pub wear: WearLaw,
    /// For the friction law and the wear law: index (0 or 1) of the body whose fibre the law uses. `None` if the law uses no fibre,
    /// or has fibre angles of its own.
    pub fibre_bodies: [Option<usize>; 2],
    /// Fraction of the wear depth that is taken from body 1.
    pub wear_share: f64,
    /// Wear depth since the last move, as a fraction of the element height, at which meshes move; `None` if meshes do not move.
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
    /// Interval, in increments, between the written fields of a step without cycles, sliding and rolling.
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

    /// Replaces the memory limit if `limit` is given, with a note if it exceeds the available memory.
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

/// A body.
#[derive(Debug, Clone)]
pub enum BodyPlan {
    /// Finite elements.
    Fe(Box<MeshedBodyPlan>),
    /// Boundary elements.
    Be(Box<BeBodyPlan>),
    /// Half-space whose surface is the plane of the contact frame.
    HalfSpace(Box<BodyMaterial>),
    /// Half-space whose surface is meshed only around the frame.
    TruncatedHalfSpace(Box<TruncatedHalfSpacePlan>),
    /// Rigid body.
    Rigid,
}

/// Elastic material with its orientation.
#[derive(Debug, Clone)]
pub struct BodyMaterial {
    /// Name of the material.
    pub name: String,
    /// Stiffness in material axes.
    pub stiffness: Stiffness,
    /// Whether the stiffness is isotropic.
    pub isotropic: bool,
    /// Direction of material axis 1; along x if `None`.
    pub fibre: Option<FibreAngles>,
}

/// Half-space whose surface is meshed only around the frame.
#[derive(Debug, Clone)]
pub struct TruncatedHalfSpacePlan {
    /// Material of the half-space.
    pub material: BodyMaterial,
    /// Half side length of the meshed square around the frame.
    pub half_size: f64,
}

/// Direction of a fibre, in radians.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FibreAngles {
    /// Angle out of the surface.
    pub tilt: f64,
    /// Angle in the surface from +x towards +y.
    pub azimuth: f64,
}

/// Finite body of boundary elements.
#[derive(Debug, Clone)]
pub struct BeBodyPlan {
    /// Closed surface mesh with outward normals and one material, without volume elements and foundations.
    pub meshed: MeshedBodyPlan,
    /// Volume mesh from which the surface was extracted, if there is one.
    pub solids: Option<Arc<Mesh>>,
    /// Interpolation of displacement and traction over an element.
    pub interpolation: Interpolation,
}

/// Body with a mesh.
#[derive(Debug, Clone)]
pub struct MeshedBodyPlan {
    /// Material of the body, with its fibre direction if that is uniform.
    pub material: BodyMaterial,
    /// Whether fibre directions are given in any form.
    pub has_fibre: bool,
    /// Mesh of the body.
    pub mesh: Arc<Mesh>,
    /// Name of the mesh file as given in the scene.
    pub mesh_name: String,
    /// Physical group of the contact surface.
    pub contact: String,
    /// Prescribed displacements.
    pub supports: Vec<PrescribedDisplacement>,
    /// Elastic foundations.
    pub foundations: Vec<fem::Foundation>,
    /// Pressures on surface groups, positive in compression.
    pub pressures: Vec<GroupLoad<f64>>,
    /// Tractions on surface groups along x, y, z.
    pub tractions: Vec<GroupLoad<[f64; 3]>>,
    /// Body force per volume along x, y, z.
    pub body_force: [f64; 3],
    /// Amplitude of the body force.
    pub body_force_case: LoadCase,
    /// Material of each volume group; `None` for the elements outside all named regions.
    pub regions: Vec<(Option<String>, RegionMaterial)>,
    /// Formulation of 8-node hexahedra, or an element type that the mesh must contain; `None` for the default formulation.
    pub element: Option<Element>,
    /// Model of the near field of the contact.
    pub near_field: NearField,
}

/// Load on a group.
#[derive(Debug, Clone, PartialEq)]
pub struct GroupLoad<T> {
    /// Physical group of surfaces.
    pub group: String,
    /// Value at amplitude 1.
    pub value: T,
    /// Amplitude.
    pub case: LoadCase,
}

/// Displacement components prescribed on a group. A component with `None` is free.
#[derive(Debug, Clone, PartialEq)]
pub struct PrescribedDisplacement {
    /// Dotted key of the support in the scene, e.g. "body1.fixed.0".
    pub key: String,
    /// Physical group.
    pub group: String,
    /// Prescribed values along x, y, z.
    pub values: [Option<f64>; 3],
    /// Gradients of the prescribed values along x, y, z, one row per component.
    pub gradient: [[f64; 3]; 3],
    /// Amplitude of the displacement.
    pub case: LoadCase,
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

impl From<UniformFibre> for FibreAngles {
    fn from(fibre: UniformFibre) -> Self {
        Self { tilt: fibre.tilt.to_radians(), azimuth: fibre.azimuth.to_radians() }
    }
}

impl Plan {
    /// Load cases of body `index`.
    pub fn load_cases(&self, index: usize) -> Vec<LoadCase> {
        if let Some(BulkStress { name, preload, .. }) = &self.bulk_stresses[index] {
            return vec![LoadCase { name: name.clone(), preload: *preload }];
        }
        let meshed = self.bodies[index].as_meshed();
        meshed.map_or_else(Vec::new, |meshed| meshed.load_cases().into_iter().cloned().collect())
    }
}

impl BodyMaterial {
    /// Material axes as columns, in coordinate axes that are rotated by `azimuth` (radians) about z from the global axes.
    pub fn material_axes(&self, azimuth: f64) -> Matrix3<f64> {
        let fibre = self.fibre.unwrap_or(FibreAngles { tilt: 0.0, azimuth: 0.0 });
        fibre_axes(fibre.tilt, fibre.azimuth - azimuth)
    }

    /// Stiffness in coordinate axes that are rotated by `azimuth` (radians) about z from the global axes.
    pub fn stiffness_in_frame(&self, azimuth: f64) -> Stiffness {
        if self.isotropic {
            self.stiffness.clone()
        } else {
            self.stiffness.rotated(&self.material_axes(azimuth))
        }
    }
}

impl BeBodyPlan {
    /// Input of the boundary-element module; `name` names the body in messages.
    pub fn bem_spec(&self, name: &str) -> body::BeSpec {
        let fem::FeSpec { supports, pressures, tractions, body_force, mesh, .. } = self.meshed.fem_spec(name);
        body::BeSpec {
            name: name.to_owned(),
            mesh,
            stiffness: self.meshed.material.stiffness_in_frame(0.0),
            interpolation: self.interpolation,
            supports,
            pressures,
            tractions,
            body_force,
            load_case: self.meshed.load_cases().first().map_or_else(LoadCase::default, |&case| case.clone()),
        }
    }
}

impl PrescribedDisplacement {
    /// A support of `group` with all components free.
    pub fn free(key: String, group: &str) -> Self {
        let (values, gradient, case) = ([None; 3], [[0.0; 3]; 3], LoadCase::default());
        Self { key, group: group.to_owned(), values, gradient, case }
    }

    /// Whether a displacement other than zero is prescribed.
    pub fn is_moving(&self) -> bool {
        self.values.iter().flatten().chain(self.gradient.iter().flatten()).any(|&value| value != 0.0)
    }
}

impl MeshedBodyPlan {
    /// Whether all contact faces are of first order; false without a contact group.
    pub fn has_linear_contact_faces(&self) -> bool {
        let linear = |kind: ElementKind| kind.n_nodes() == kind.n_corners();
        let group = self.mesh.group_of_dim(&self.contact, 2);
        group.is_ok_and(|group| group.cells.iter().all(|&cell| linear(self.mesh.kind(cell))))
    }

    /// Whether the scene gives pressures, tractions or a nonzero body force for the body.
    pub fn is_loaded(&self) -> bool {
        !self.pressures.is_empty() || !self.tractions.is_empty() || self.body_force != [0.0; 3]
    }

    /// Groups of contact, supports, foundations and loads. A group may occur several times.
    pub fn groups(&self) -> impl Iterator<Item = &str> {
        let supports = self.supports.iter().map(|support| &support.group);
        let foundations = self.foundations.iter().map(|foundation| &foundation.group);
        let pressures = self.pressures.iter().map(|load| &load.group);
        let tractions = self.tractions.iter().map(|load| &load.group);
        let all = std::iter::once(&self.contact)
            .chain(supports)
            .chain(foundations)
            .chain(pressures)
            .chain(tractions);
        all.map(String::as_str)
    }

    /// Load cases of the body, in the order of their first loads: pressures, tractions, body force, prescribed displacements.
    pub fn load_cases(&self) -> Vec<&LoadCase> {
        let forced = self.body_force != [0.0; 3] || self.body_force_case.name.is_some();
        let forced = forced.then_some(&self.body_force_case);
        let moving =
            self.supports.iter().filter(|support| support.is_moving() || support.case.name.is_some());
        let pressures = self.pressures.iter().map(|load| &load.case);
        let tractions = self.tractions.iter().map(|load| &load.case);
        let all = pressures.chain(tractions).chain(forced).chain(moving.map(|support| &support.case));
        let mut cases: Vec<&LoadCase> = Vec::new();
        for case in all {
            if !cases.contains(&case) {
                cases.push(case);
            }
        }
        cases
    }

    /// Input of the finite-element module; `name` names the body in messages.
    pub fn fem_spec(&self, name: &str) -> fem::FeSpec {
        self.spec_with_loads(name, |_| true)
    }

    /// For each load case, the input of the finite-element module with the loads of this case alone.
    pub fn load_specs(&self, name: &str) -> Vec<(LoadCase, fem::FeSpec)> {
        let spec = |case: &LoadCase| (case.clone(), self.spec_with_loads(name, |other| other == case));
        self.load_cases().into_iter().map(spec).collect()
    }

    fn spec_with_loads(&self, name: &str, acts: impl Fn(&LoadCase) -> bool) -> fem::FeSpec {
        let supports = self.supports.iter().map(|support| {
            let moves = acts(&support.case);
            fem::Support {
                group: support.group.clone(),
                components: support.values.map(|value| value.is_some()),
                value: support.values.map(|value| value.filter(|_| moves).unwrap_or(0.0)),
                gradient: if moves { support.gradient } else { [[0.0; 3]; 3] },
            }
        });
        fem::FeSpec {
            name: name.to_owned(),
            mesh: self.mesh.clone(),
            regions: self.regions.clone(),
            formulation: match self.element {
                Some(Element::Hex8) => HexFormulation::Standard,
                Some(Element::Hex8Bbar) => HexFormulation::MeanDilatation,
                _ => HexFormulation::Enhanced,
            },
            supports: supports.collect(),
            foundations: self.foundations.clone(),
            pressures: loads_of(&self.pressures, &acts),
            tractions: loads_of(&self.tractions, &acts),
            body_force: if acts(&self.body_force_case) { self.body_force } else { [0.0; 3] },
        }
    }
}

/// Groups and values of the loads that act.
fn loads_of<T: Copy>(loads: &[GroupLoad<T>], acts: impl Fn(&LoadCase) -> bool) -> Vec<(String, T)> {
    loads.iter().filter(|load| acts(&load.case)).map(|load| (load.group.clone(), load.value)).collect()
}

impl BodyPlan {
    /// Kind of model of the body.
    pub fn discretisation(&self) -> Discretisation {
        match self {
            Self::Fe(_) => Discretisation::FiniteElements,
            Self::Be(_) => Discretisation::BoundaryElements,
            Self::HalfSpace(_) => Discretisation::HalfSpace,
            Self::TruncatedHalfSpace(_) => Discretisation::TruncatedHalfSpace,
            Self::Rigid => Discretisation::Rigid,
        }
    }

    /// The material; `None` for a rigid body.
    pub fn material(&self) -> Option<&BodyMaterial> {
        match self {
            Self::Fe(fe) => Some(&fe.material),
            Self::Be(be) => Some(&be.meshed.material),
            Self::HalfSpace(elastic) => Some(elastic),
            Self::TruncatedHalfSpace(body) => Some(&body.material),
            Self::Rigid => None,
        }
    }

    /// Whether fibre directions are given.
    pub fn has_fibre(&self) -> bool {
        match self.as_meshed() {
            Some(meshed) => meshed.has_fibre,
            None => self.material().is_some_and(|elastic| elastic.fibre.is_some()),
        }
    }

    /// The finite-element body, if it is one.
    pub fn as_fe(&self) -> Option<&MeshedBodyPlan> {
        match self {
            Self::Fe(fe) => Some(fe),
            _ => None,
        }
    }

    /// The boundary-element body, if it is one.
    pub fn as_be(&self) -> Option<&BeBodyPlan> {
        match self {
            Self::Be(be) => Some(be),
            _ => None,
        }
    }

    /// The meshed body, of finite or boundary elements, if it is one.
    pub fn as_meshed(&self) -> Option<&MeshedBodyPlan> {
        match self {
            Self::Fe(fe) => Some(fe),
            Self::Be(be) => Some(&be.meshed),
            Self::HalfSpace(_) | Self::TruncatedHalfSpace(_) | Self::Rigid => None,
        }
    }
}
