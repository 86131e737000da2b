//! The validated inputs of a run; angles in radians.

use std::collections::BTreeMap;
use std::path::PathBuf;
use std::sync::Arc;

use nalgebra::Matrix3;

use super::document::Document;
use super::spec::accuracy::{AccuracyQuantity, RefinementParameter};
use super::spec::body::{Element, NearField, UniformFibre};
use super::spec::frame::FramePoints;
use super::spec::solver::{Output, Solver};
use super::variant::{ComparePlan, Discretisation};
use crate::bem::finite::Interpolation;
use crate::body;
use crate::element::ElementKind;
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

/// What a scene asks for, checked as far as it can be without solving anything.
#[derive(Debug, Clone)]
pub struct Plan {
    /// Title; the file's name if the scene has none.
    pub title: String,
    /// Names of the units.
    pub units: Units,
    /// Body 1 (below) and body 2 (above).
    pub bodies: [BodyPlan; 2],
    /// What the materials bear, by name, where the scene says it.
    pub strength_limits: BTreeMap<String, MaterialStrength>,
    /// The contact frame.
    pub frame: FramePlan,
    /// The initial gap.
    pub gap: InitialGap,
    /// The friction law.
    pub friction: FrictionLaw,
    /// The wear law.
    pub wear: WearLaw,
    /// Of friction and wear, the body whose fibre the law takes, 0 or 1; `None` where it takes none, or one of its own.
    pub fibre_bodies: [Option<usize>; 2],
    /// Fraction of the worn depth taken from body 1.
    pub wear_share: f64,
    /// Share of the elements that a meshed body wears by until its mesh moves; `None` where it does not.
    pub mesh_motion_threshold: Option<f64>,
    /// Integration of wear over cycle jumps.
    pub integrator: Integrator,
    /// The load steps.
    pub steps: Vec<Step>,
    /// Solver settings.
    pub solver: Solver,
    /// Memory that the run may take.
    pub memory_limit: MemoryLimit,
    /// What is written.
    pub output: Output,
    /// What is compared.
    pub compare: ComparePlan,
    /// Points inside bodies whose displacement and stress is written.
    pub interior_requests: Vec<InteriorPointRequest>,
    /// How accurate results shall be; `None` where cells, increments and jumps are the scene's.
    pub accuracy: Option<AccuracyPlan>,
    /// Of the increments of a monotone step each so-manieth is written to files.
    pub fields_every: usize,
    /// Where flexibilities of finite-element bodies are kept between runs; `None` where they are not.
    pub flexibility_cache: Option<fem::FlexibilityCache>,
    /// What the user should know before running.
    pub notes: Vec<String>,
    /// Files that the scene names, by key.
    pub files: Vec<(String, PathBuf)>,
    /// The scene file, for messages that point into it.
    pub document: Document,
}

impl Plan {
    /// The largest approach that the steps prescribe, mm; `None` if they prescribe none.
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
        step.wear && self.wear.specific_rate(self.friction.ellipse()).is_some()
    }

    /// Lets a run take memory up to `limit`, where one is given in place of the scene's own.
    pub fn override_memory_limit(&mut self, limit: Option<MemoryLimit>) {
        self.memory_limit = limit.unwrap_or(self.memory_limit);
        if self.memory_limit.exceeds_available() {
            let note = "the memory limit exceeds the memory that is available now: a run that needs more starts anyway \
                        and may be ended by the system";
            self.notes.push(note.to_owned());
        }
    }
}

/// How accurate results shall be.
#[derive(Debug, Clone, PartialEq)]
pub struct AccuracyPlan {
    /// Relative error.
    pub relative: f64,
    /// Of what.
    pub quantities: Vec<AccuracyQuantity>,
    /// What stays as the scene has it.
    pub fixed_parameters: Vec<RefinementParameter>,
}

/// A body.
#[derive(Debug, Clone)]
pub enum BodyPlan {
    /// Finite elements.
    Fe(Box<MeshedBodyPlan>),
    /// Boundary elements.
    Be(Box<BeBodyPlan>),
    /// Boundary-element half-space.
    HalfSpace(Box<BodyMaterial>),
    /// Half-space whose surface is meshed as far as it goes.
    TruncatedHalfSpace(Box<TruncatedHalfSpacePlan>),
    /// Does not deform.
    Rigid,
}

/// A material in place.
#[derive(Debug, Clone)]
pub struct BodyMaterial {
    /// Name of the material.
    pub name: String,
    /// Stiffness in material axes.
    pub stiffness: Stiffness,
    /// Whether the stiffness is the same in all directions.
    pub isotropic: bool,
    /// Direction of material axis 1; along x if absent.
    pub fibre: Option<FibreAngles>,
}

/// A half-space whose surface is meshed.
#[derive(Debug, Clone)]
pub struct TruncatedHalfSpacePlan {
    /// Its material.
    pub material: BodyMaterial,
    /// Half of the sides of the square of its elements around the frame.
    pub half_size: f64,
}

/// Direction of a fibre, radians.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FibreAngles {
    /// Angle out of the surface.
    pub tilt: f64,
    /// Angle in the surface from +x towards +y.
    pub azimuth: f64,
}

/// A finite body of boundary elements.
#[derive(Debug, Clone)]
pub struct BeBodyPlan {
    /// Its closed surface as a mesh without solids, normals outward, of one material; no foundations.
    pub meshed: MeshedBodyPlan,
    /// The solids whose skin the surface is, if there are any.
    pub solids: Option<Arc<Mesh>>,
    /// How displacement and traction vary over an element.
    pub interpolation: Interpolation,
}

/// A meshed body.
#[derive(Debug, Clone)]
pub struct MeshedBodyPlan {
    /// Its material, with its fibre where that is one direction.
    pub material: BodyMaterial,
    /// Whether fibres are given, in whichever way.
    pub has_fibre: bool,
    /// Its mesh.
    pub mesh: Arc<Mesh>,
    /// The mesh's file as the scene names it.
    pub mesh_name: String,
    /// Physical group of the contact surface.
    pub contact: String,
    /// Prescribed displacements.
    pub supports: Vec<PrescribedDisplacement>,
    /// Elastic foundations.
    pub foundations: Vec<fem::Foundation>,
    /// Pressures on surface groups, positive towards the body.
    pub pressures: Vec<(String, f64)>,
    /// Tractions on surface groups along x, y, z.
    pub tractions: Vec<(String, [f64; 3])>,
    /// Force per volume.
    pub body_force: [f64; 3],
    /// What fills each volume group; `None` stands for the elements in no named region.
    pub regions: Vec<(Option<String>, RegionMaterial)>,
    /// Element formulation; the mesh's own default if absent.
    pub element: Option<Element>,
    /// Where the near field of the contact is computed.
    pub near_field: NearField,
}

/// Displacement components prescribed on a group; `None` leaves one free.
#[derive(Debug, Clone, PartialEq)]
pub struct PrescribedDisplacement {
    /// Its key in the scene, dotted: "body1.fixed.0".
    pub key: String,
    /// Physical group.
    pub group: String,
    /// Prescribed values along x, y, z.
    pub values: [Option<f64>; 3],
    /// Their change per length along x, y, z, a row for each.
    pub gradient: [[f64; 3]; 3],
}

/// The contact frame.
#[derive(Debug, Clone, PartialEq)]
pub enum FramePlan {
    /// Uniform rectangular cells.
    Grid {
        /// Half of the sides.
        half_width: [f64; 2],
        /// Number of cells.
        cells: [usize; 2],
        /// Centre in global x, y.
        center: [f64; 2],
        /// Angle of the frame's x from global x.
        azimuth: f64,
        /// Whether it repeats itself along its x, y.
        periodic: [bool; 2],
        /// Outline of what may touch.
        outline: Option<Outline>,
        /// Whether it is enlarged when wear brings the contact to its edge.
        grow: bool,
    },
    /// The contact group of a meshed body.
    Mesh {
        /// Index of the body, 0 or 1.
        body: usize,
        /// Whether faces or nodes have a cell each.
        points: FramePoints,
        /// Origin in global x, y.
        center: [f64; 2],
        /// Angle of the cells' x from global x.
        azimuth: f64,
        /// Direction from body 1 to body 2, not of unit length.
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

impl BodyMaterial {
    /// Axes of the material as columns, in axes turned by `azimuth` (radians) from the global ones.
    pub fn material_axes(&self, azimuth: f64) -> Matrix3<f64> {
        let fibre = self.fibre.unwrap_or(FibreAngles { tilt: 0.0, azimuth: 0.0 });
        fibre_axes(fibre.tilt, fibre.azimuth - azimuth)
    }

    /// Stiffness in axes turned by `azimuth` (radians) from the global ones about the normal.
    pub fn stiffness_in_frame(&self, azimuth: f64) -> Stiffness {
        if self.isotropic {
            self.stiffness.clone()
        } else {
            self.stiffness.rotated(&self.material_axes(azimuth))
        }
    }
}

impl BeBodyPlan {
    /// What the body takes; `name` is what its messages call it.
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
        }
    }
}

impl PrescribedDisplacement {
    /// A support of `group` that leaves all components free.
    pub fn free(key: String, group: &str) -> Self {
        Self { key, group: group.to_owned(), values: [None; 3], gradient: [[0.0; 3]; 3] }
    }

    /// Whether it prescribes a displacement other than zero.
    pub fn is_moving(&self) -> bool {
        self.values.iter().flatten().chain(self.gradient.iter().flatten()).any(|&value| value != 0.0)
    }
}

impl MeshedBodyPlan {
    /// Whether its contact faces are of first order; false without them.
    pub fn has_linear_contact_faces(&self) -> bool {
        let linear = |kind: ElementKind| kind.n_nodes() == kind.n_corners();
        let group = self.mesh.group_of_dim(&self.contact, 2);
        group.is_ok_and(|group| group.cells.iter().all(|&cell| linear(self.mesh.kind(cell))))
    }

    /// Whether it has loads of its own.
    pub fn is_loaded(&self) -> bool {
        !self.pressures.is_empty() || !self.tractions.is_empty() || self.body_force != [0.0; 3]
    }

    /// Groups of surfaces of its contact, supports, foundations and loads, some of them more than once.
    pub fn groups(&self) -> impl Iterator<Item = &str> {
        let supports = self.supports.iter().map(|support| &support.group);
        let foundations = self.foundations.iter().map(|foundation| &foundation.group);
        let pressures = self.pressures.iter().map(|(group, _)| group);
        let tractions = self.tractions.iter().map(|(group, _)| group);
        let all = std::iter::once(&self.contact)
            .chain(supports)
            .chain(foundations)
            .chain(pressures)
            .chain(tractions);
        all.map(String::as_str)
    }

    /// What the finite-element module takes; `name` is what its messages call the body.
    pub fn fem_spec(&self, name: &str) -> fem::FeSpec {
        let supports = self.supports.iter().map(|support| fem::Support {
            group: support.group.clone(),
            components: support.values.map(|value| value.is_some()),
            value: support.values.map(|value| value.unwrap_or(0.0)),
            gradient: support.gradient,
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
            pressures: self.pressures.clone(),
            tractions: self.tractions.clone(),
            body_force: self.body_force,
        }
    }
}

impl BodyPlan {
    /// What it is.
    pub fn discretisation(&self) -> Discretisation {
        match self {
            Self::Fe(_) => Discretisation::FiniteElements,
            Self::Be(_) => Discretisation::BoundaryElements,
            Self::HalfSpace(_) => Discretisation::HalfSpace,
            Self::TruncatedHalfSpace(_) => Discretisation::TruncatedHalfSpace,
            Self::Rigid => Discretisation::Rigid,
        }
    }

    /// The material, unless rigid.
    pub fn material(&self) -> Option<&BodyMaterial> {
        match self {
            Self::Fe(fe) => Some(&fe.material),
            Self::Be(be) => Some(&be.meshed.material),
            Self::HalfSpace(elastic) => Some(elastic),
            Self::TruncatedHalfSpace(body) => Some(&body.material),
            Self::Rigid => None,
        }
    }

    /// Whether it says where its fibres run.
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
