//! `[body1]` and `[body2]`.

use std::collections::BTreeMap;

use schemars::JsonSchema;
use serde::Deserialize;

use super::direction::{FibreDirection, Layup};
use super::frame::Positive;
use crate::bem::finite::Interpolation;
use crate::fem::Foundation;

/// A body; `kind` selects its elastic model.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(tag = "kind", rename_all = "kebab-case", deny_unknown_fields)]
#[allow(missing_docs)]
pub enum Body {
    /// Finite elements on a gmsh mesh.
    Fe(Box<FeBody>),
    /// Finite body of boundary elements on a gmsh mesh: a closed surface mesh, or the boundary surface of a volume mesh.
    Be(Box<BeBody>),
    /// Elastic half-space whose surface is the plane of the contact frame.
    HalfSpace {
        /// Name of the material in `materials`.
        material: String,
        /// Direction of material axis 1 (fibre); default along x.
        fibre: Option<UniformFibre>,
        /// Half side length of the square around the frame to which the surface of the half-space is truncated.
        ///
        /// Boundary elements with full-space kernels compute the surface in the square. The displacement of the surface
        /// outside is zero. The value must be 1.1 to 1000 times the larger `half_width` of a grid frame. The truncation
        /// allows comparisons with programs without half-space kernels. Omit it for the exact half-space.
        truncated: Option<Positive>,
        /// Uniform stress parallel to the surface, which steps may vary.
        bulk_stress: Option<BulkStress>,
        /// Uniform change of temperature since assembly, K, which steps may vary. The material needs `alpha`.
        temperature_change: Option<TemperatureChange>,
    },
    /// Body that does not deform.
    Rigid {},
}

/// Uniform stress of a half-space parallel to its surface. The stress strains the surface; with friction, this strain
/// causes slip.
#[derive(Debug, Clone, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct BulkStress {
    /// Name by which steps prescribe the amplitude (`steps.loads`). Loads of both bodies with the same name have one amplitude.
    #[schemars(length(min = 1))]
    pub name: Option<String>,
    /// Stresses xx, yy and xy at amplitude 1, along the frame's axes.
    ///
    /// On a periodic frame, the strain of the surface along the period must be zero. For an isotropic body and a period
    /// along y, this requires yy = nu xx.
    pub value: [f64; 3],
    /// Whether the load acts in full before the first step; by default it grows in the first step.
    #[serde(default)]
    pub preload: bool,
}

/// Body of finite elements.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct FeBody {
    /// Name of the material in `materials`.
    pub material: String,
    /// Direction of material axis 1 (fibre); default along x.
    pub fibre: Option<FibreDirection>,
    /// Laminate of plies stacked along z, each with its own fibre direction; instead of `fibre`.
    pub layup: Option<Layup>,
    /// Mesh file (.msh of gmsh, 2.2 or 4.1), relative to the scene file.
    pub mesh: String,
    /// Physical group of surfaces that form the contact surface.
    pub contact: String,
    /// Groups with zero displacement.
    #[serde(default)]
    pub fixed: Vec<Fixed>,
    /// Groups with prescribed displacements.
    #[serde(default)]
    pub displaced: Vec<Displaced>,
    /// Surface groups in symmetry planes (normal along x, y or z): zero normal displacement, zero shear traction.
    ///
    /// If a symmetry plane cuts the contact, both bodies need a group in this plane, unless one body is rigid.
    #[serde(default)]
    pub symmetry: Vec<String>,
    /// Surface groups on elastic foundations.
    #[serde(default)]
    pub foundation: Vec<Foundation>,
    /// Surface groups under pressure.
    #[serde(default)]
    pub pressure: Vec<Pressure>,
    /// Surface groups under traction.
    #[serde(default)]
    pub traction: Vec<Traction>,
    /// Body force per volume along x, y, z.
    #[serde(default)]
    pub body_force: BodyForce,
    /// Uniform change of temperature since assembly, K, which steps may vary. The materials need `alpha`.
    pub temperature_change: Option<TemperatureChange>,
    /// Volume groups with their own material, fibre or layup, by name of the group.
    #[serde(default)]
    pub regions: BTreeMap<String, Region>,
    /// Formulation of 8-node hexahedra: "hex8-eas" (default), "hex8" or "hex8-bbar".
    ///
    /// Other names do not select a formulation. They only check that the mesh contains elements of the named type.
    pub element: Option<Element>,
    /// Model near the contact: "auto" (default), "half-space" or "mesh".
    ///
    /// "half-space" is the half-space solution, which the finite elements correct for the finite size of the body.
    /// "mesh" uses finite elements only. "auto" uses "half-space" if body, mesh and frame allow it, else "mesh".
    #[serde(default)]
    pub near_field: NearField,
}

/// Finite body of boundary elements: one material, meshed on its surface.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct BeBody {
    /// Name of the material in `materials`.
    pub material: String,
    /// Direction of material axis 1 (fibre); default along x.
    pub fibre: Option<UniformFibre>,
    /// Mesh file (.msh of gmsh, 2.2 or 4.1), relative to the scene file: a closed surface, or a volume whose surface is used.
    pub mesh: String,
    /// Physical group of surfaces that form the contact surface.
    pub contact: String,
    /// Surface groups with zero displacement.
    #[serde(default)]
    pub fixed: Vec<Fixed>,
    /// Surface groups with prescribed displacements.
    #[serde(default)]
    pub displaced: Vec<Displaced>,
    /// Surface groups in symmetry planes (normal along x, y or z): zero normal displacement, zero shear traction.
    ///
    /// If a symmetry plane cuts the contact, both bodies need a group in this plane, unless one body is rigid.
    #[serde(default)]
    pub symmetry: Vec<String>,
    /// Surface groups under pressure.
    #[serde(default)]
    pub pressure: Vec<Pressure>,
    /// Surface groups under traction.
    #[serde(default)]
    pub traction: Vec<Traction>,
    /// Body force per volume along x, y, z.
    #[serde(default)]
    pub body_force: BodyForce,
    /// Uniform change of temperature since assembly, K, which steps may vary. The material needs `alpha`.
    pub temperature_change: Option<TemperatureChange>,
    /// Interpolation of displacement and traction on an element; default "linear".
    #[serde(default)]
    pub element: Interpolation,
}

/// Fibre direction, the unit vector (cos tilt cos azimuth, cos tilt sin azimuth, sin tilt).
#[derive(Debug, Clone, Copy, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct UniformFibre {
    /// Angle of the fibre out of the surface, degrees: 0 in the surface, 90 along the normal.
    #[serde(default)]
    #[schemars(range(min = -90, max = 90))]
    pub tilt: f64,
    /// Angle of the fibre's projection on the surface from +x towards +y, degrees.
    #[serde(default)]
    pub azimuth: f64,
}

/// Component of a displacement.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
#[allow(missing_docs)]
pub enum Component {
    X,
    Y,
    Z,
}

/// Support: a group with zero displacement in some components.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Fixed {
    /// Physical group of points, lines, surfaces or volumes. A body of kind "be" needs a group of surfaces.
    pub group: String,
    /// Components with zero displacement; default all.
    #[serde(default = "all_components")]
    #[schemars(length(min = 1))]
    pub components: Vec<Component>,
}

/// Group with a prescribed displacement.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Displaced {
    /// Physical group of points, lines, surfaces or volumes. A body of kind "be" needs a group of surfaces.
    pub group: String,
    /// Components with a prescribed displacement; default all.
    #[serde(default = "all_components")]
    #[schemars(length(min = 1))]
    pub components: Vec<Component>,
    /// Prescribed displacements, in the order of `components`; required without `gradient`.
    ///
    /// With `gradient`, the values are the displacements at the origin; default 0.
    pub value: Option<Vec<f64>>,
    /// Gradient of a displacement that varies linearly: one row of derivatives along x, y, z for each of `components`.
    #[serde(default)]
    pub gradient: Vec<[f64; 3]>,
    /// Name by which steps prescribe the amplitude (`steps.loads`). Loads with the same name have one amplitude.
    #[schemars(length(min = 1))]
    pub name: Option<String>,
    /// Whether the group is fully displaced before the first step; by default it moves in the first step.
    #[serde(default)]
    pub preload: bool,
}

/// Body force per volume: three components, or a table.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(untagged)]
pub enum BodyForce {
    /// Force per volume along x, y, z.
    Value([f64; 3]),
    /// Force per volume with a name.
    Load(NamedBodyForce),
}

impl BodyForce {
    /// Force per volume along x, y, z.
    pub fn value(&self) -> [f64; 3] {
        match self {
            Self::Value(value) | Self::Load(NamedBodyForce { value, .. }) => *value,
        }
    }
}

impl Default for BodyForce {
    fn default() -> Self {
        Self::Value([0.0; 3])
    }
}

/// Body force per volume with a name.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct NamedBodyForce {
    /// Force per volume along x, y, z.
    pub value: [f64; 3],
    /// Name by which steps prescribe the amplitude (`steps.loads`). Loads with the same name have one amplitude.
    #[schemars(length(min = 1))]
    pub name: Option<String>,
    /// Whether the load acts in full before the first step; by default it grows in the first step.
    #[serde(default)]
    pub preload: bool,
}

/// Uniform change of temperature: a number, or a table.
#[derive(Debug, Clone, PartialEq, Deserialize, JsonSchema)]
#[serde(untagged)]
pub enum TemperatureChange {
    /// Change of temperature, K.
    Value(f64),
    /// Change of temperature with a name.
    Load(NamedTemperatureChange),
}

/// Uniform change of temperature with a name.
#[derive(Debug, Clone, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct NamedTemperatureChange {
    /// Change of temperature, K.
    pub value: f64,
    /// Name by which steps prescribe the amplitude (`steps.loads`). Loads with the same name have one amplitude.
    #[schemars(length(min = 1))]
    pub name: Option<String>,
    /// Whether the temperature has changed before the first step; by default it changes in the first step.
    #[serde(default)]
    pub preload: bool,
}

/// Surface group under pressure.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Pressure {
    /// Physical group of surfaces.
    pub group: String,
    /// Pressure, positive towards the body.
    pub value: f64,
    /// Name by which steps prescribe the amplitude (`steps.loads`). Loads with the same name have one amplitude.
    #[schemars(length(min = 1))]
    pub name: Option<String>,
    /// Whether the load acts in full before the first step; by default it grows in the first step.
    #[serde(default)]
    pub preload: bool,
}

/// Surface group under traction.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Traction {
    /// Physical group of surfaces.
    pub group: String,
    /// Traction (force per area) along x, y, z.
    pub value: [f64; 3],
    /// Name by which steps prescribe the amplitude (`steps.loads`). Loads with the same name have one amplitude.
    #[schemars(length(min = 1))]
    pub name: Option<String>,
    /// Whether the load acts in full before the first step; by default it grows in the first step.
    #[serde(default)]
    pub preload: bool,
}

/// Volume group with properties of its own.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Region {
    /// Name of the material in `materials`; default: the material of the body.
    pub material: Option<String>,
    /// Direction of material axis 1 (fibre); default: the fibre direction of the body.
    pub fibre: Option<FibreDirection>,
    /// Laminate of plies stacked along z, each with its own fibre direction; instead of `fibre`.
    ///
    /// Default: the layup of the body, unless the region has its own material or fibre.
    pub layup: Option<Layup>,
}

/// Formulation of 8-node hexahedra, or an element type that the mesh must contain.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Element {
    /// Hexahedron with enhanced (incompatible) modes, accurate in bending.
    Hex8Eas,
    /// Hexahedron with 2 x 2 x 2 integration; too stiff in bending.
    Hex8,
    /// Hexahedron with mean dilatation (B-bar), for nearly incompressible materials.
    Hex8Bbar,
    /// Serendipity hexahedron.
    Hex20,
    /// Triquadratic hexahedron.
    Hex27,
    /// Linear tetrahedron (constant strain).
    Tet4,
    /// Quadratic tetrahedron.
    Tet10,
    /// Linear wedge.
    Wedge6,
    /// Serendipity wedge.
    Wedge15,
    /// Quadratic wedge.
    Wedge18,
    /// Linear pyramid.
    Pyramid5,
    /// Serendipity pyramid.
    Pyramid13,
    /// Quadratic pyramid.
    Pyramid14,
}

/// Model near the contact.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
#[allow(missing_docs)]
pub enum NearField {
    #[default]
    Auto,
    HalfSpace,
    Mesh,
}

fn all_components() -> Vec<Component> {
    vec![Component::X, Component::Y, Component::Z]
}
