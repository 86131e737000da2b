//! Bodies of a plan: materials, supports and loads. Angles are in radians.

use std::collections::BTreeMap;
use std::sync::Arc;

use nalgebra::Matrix3;

use crate::bem::finite::Interpolation;
use crate::body::{self, LoadCase};
use crate::element::ElementKind;
use crate::fem::{self, ElementMaterials, HexFormulation};
use crate::geometry::fibre_axes;
use crate::material::{RegionMaterial, Stiffness};
use crate::mesh::Mesh;
use crate::scene::spec::body::{Element, NamedTemperatureChange, NearField, TemperatureChange, UniformFibre};
use crate::scene::variant::Discretisation;

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
    /// Coefficients of thermal expansion along the material axes, 1/K; `None` if they are not given.
    pub expansion: Option<[f64; 3]>,
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
    /// Body with a closed surface mesh and one material. The normals point outward; there are no volume elements and no
    /// foundations.
    pub meshed: MeshedBodyPlan,
    /// Volume mesh from which the surface mesh was extracted, if any.
    pub solids: Option<Arc<Mesh>>,
    /// Interpolation of displacement and traction over an element.
    pub interpolation: Interpolation,
}

/// Body with a mesh.
#[derive(Debug, Clone)]
pub struct MeshedBodyPlan {
    /// Material of the body, with its fibre direction if that is uniform.
    pub material: BodyMaterial,
    /// Whether the scene gives fibre directions in any form.
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
    /// Load case of the body force: name and preload of its amplitude.
    pub body_force_case: LoadCase,
    /// Uniform change of temperature.
    pub temperature: Option<TemperaturePlan>,
    /// Volume groups with their materials. The name `None` stands for the elements outside all volume groups in this
    /// list.
    pub regions: Vec<(Option<String>, RegionMaterial)>,
    /// Formulation of 8-node hexahedra, or an element type that the mesh must contain; `None` for the default formulation.
    pub element: Option<Element>,
    /// Model of the near field of the contact.
    pub near_field: NearField,
}

/// Uniform change of temperature of a body.
#[derive(Debug, Clone, PartialEq)]
pub struct TemperaturePlan {
    /// Change at amplitude 1, K.
    pub change: f64,
    /// Load case of the change of temperature.
    pub case: LoadCase,
}

/// Load on a group.
#[derive(Debug, Clone, PartialEq)]
pub struct GroupLoad<T> {
    /// Physical group of surfaces.
    pub group: String,
    /// Value at amplitude 1.
    pub value: T,
    /// Load case of the load.
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
    /// Gradients of the prescribed values. Each row contains the derivatives of one component along x, y, z.
    pub gradient: [[f64; 3]; 3],
    /// Load case of the displacement.
    pub case: LoadCase,
}

impl From<UniformFibre> for FibreAngles {
    fn from(fibre: UniformFibre) -> Self {
        Self { tilt: fibre.tilt.to_radians(), azimuth: fibre.azimuth.to_radians() }
    }
}

impl From<TemperatureChange> for TemperaturePlan {
    fn from(change: TemperatureChange) -> Self {
        match change {
            TemperatureChange::Value(change) => Self { change, case: LoadCase::default() },
            TemperatureChange::Load(NamedTemperatureChange { value, name, preload }) => {
                Self { change: value, case: LoadCase { name, preload } }
            }
        }
    }
}

impl BodyMaterial {
    /// Thermal strain tensor, global axes, due to a temperature change `change` in K. Zero if the coefficients of
    /// expansion are not given.
    pub fn thermal_strain(&self, change: f64) -> Matrix3<f64> {
        let Some(expansion) = self.expansion else { return Matrix3::zeros() };
        let axes = self.material_axes(0.0);
        axes * Matrix3::from_diagonal(&expansion.into()) * axes.transpose() * change
    }

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
        self.spec_with_loads(self.meshed.fem_spec(name))
    }

    /// Input of the boundary-element module for each load case. Each input contains the loads of its case only.
    pub fn load_specs(&self, name: &str) -> Vec<(LoadCase, body::BeSpec)> {
        let specs = self.meshed.load_specs(name).into_iter();
        specs.map(|(case, spec)| (case, self.spec_with_loads(spec))).collect()
    }

    /// Converts the input of the finite-element module to the input of the boundary-element module.
    fn spec_with_loads(&self, spec: fem::FeSpec) -> body::BeSpec {
        let fem::FeSpec {
            name, supports, pressures, tractions, body_force, temperature_change, mesh, ..
        } = spec;
        body::BeSpec {
            name,
            mesh,
            stiffness: self.meshed.material.stiffness_in_frame(0.0),
            interpolation: self.interpolation,
            supports,
            pressures,
            tractions,
            body_force,
            thermal_strain: self.meshed.material.thermal_strain(temperature_change),
        }
    }
}

impl PrescribedDisplacement {
    /// Prescribed displacement of `group` with all components free.
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

    /// Whether the body has pressures, tractions, a nonzero body force or a change of temperature.
    pub fn is_loaded(&self) -> bool {
        !self.pressures.is_empty()
            || !self.tractions.is_empty()
            || self.body_force != [0.0; 3]
            || self.temperature.is_some()
    }

    /// Names of the groups of contact, supports, foundations and loads. A group may occur several times.
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

    /// Load cases of the body, without duplicates. The order is pressures, tractions, body force, temperature,
    /// prescribed displacements.
    pub fn load_cases(&self) -> Vec<&LoadCase> {
        let forced = self.body_force != [0.0; 3] || self.body_force_case.name.is_some();
        let forced = forced.then_some(&self.body_force_case);
        let moving =
            self.supports.iter().filter(|support| support.is_moving() || support.case.name.is_some());
        let pressures = self.pressures.iter().map(|load| &load.case);
        let tractions = self.tractions.iter().map(|load| &load.case);
        let heated = self.temperature.as_ref().map(|temperature| &temperature.case);
        let moving = moving.map(|support| &support.case);
        let all = pressures.chain(tractions).chain(forced).chain(heated).chain(moving);
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

    /// Input of the finite-element module for each load case. Each input contains the loads of its case only.
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
            temperature_change: (self.temperature.as_ref())
                .filter(|temperature| acts(&temperature.case))
                .map_or(0.0, |temperature| temperature.change),
        }
    }
}

/// Groups and values of the loads whose load case satisfies `acts`.
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

    /// Names of the materials in use, with their coefficients of thermal expansion. Empty for a rigid body. Also empty
    /// if an element has no valid material, which is reported elsewhere.
    pub fn expansions(&self) -> BTreeMap<String, Option<[f64; 3]>> {
        match self.as_fe() {
            Some(fe) => match ElementMaterials::new(&fe.fem_spec("body")) {
                Ok(elements) => elements
                    .materials_in_use()
                    .map(|material| (material.name.clone(), material.expansion))
                    .collect(),
                Err(_) => BTreeMap::new(),
            },
            None => self.material().iter().map(|own| (own.name.clone(), own.expansion)).collect(),
        }
    }

    /// Whether the scene gives fibre directions for the body.
    pub fn has_fibre(&self) -> bool {
        match self.as_meshed() {
            Some(meshed) => meshed.has_fibre,
            None => self.material().is_some_and(|elastic| elastic.fibre.is_some()),
        }
    }

    /// Plan of a finite-element body; `None` for other bodies.
    pub fn as_fe(&self) -> Option<&MeshedBodyPlan> {
        match self {
            Self::Fe(fe) => Some(fe),
            _ => None,
        }
    }

    /// Plan of a boundary-element body; `None` for other bodies.
    pub fn as_be(&self) -> Option<&BeBodyPlan> {
        match self {
            Self::Be(be) => Some(be),
            _ => None,
        }
    }

    /// Plan of a body with a mesh (finite or boundary elements); `None` for other bodies.
    pub fn as_meshed(&self) -> Option<&MeshedBodyPlan> {
        match self {
            Self::Fe(fe) => Some(fe),
            Self::Be(be) => Some(&be.meshed),
            Self::HalfSpace(_) | Self::TruncatedHalfSpace(_) | Self::Rigid => None,
        }
    }
}
