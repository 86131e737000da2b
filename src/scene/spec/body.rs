//! `[body1]` and `[body2]`.

use std::collections::BTreeMap;

use schemars::JsonSchema;
use serde::Deserialize;

use super::direction::{FibreDirection, Layup};
use super::frame::Positive;
use crate::bem::finite::Interpolation;
use crate::fem::Foundation;

/// A body; `kind` says how its elasticity is computed.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(tag = "kind", rename_all = "kebab-case", deny_unknown_fields)]
#[allow(missing_docs)]
pub enum Body {
    /// Finite elements on a gmsh mesh.
    Fe(Box<FeBody>),
    /// A finite body of boundary elements on a gmsh mesh: a closed surface mesh, or the boundary surface of a volume mesh.
    Be(Box<BeBody>),
    /// An elastic half-space whose surface is the plane of the contact frame.
    HalfSpace {
        /// Name of its material.
        material: String,
        /// Direction of material axis 1; default along x.
        fibre: Option<UniformFibre>,
        /// Half side length of the square around the frame that is meshed with boundary elements and solved with
        /// full-space kernels; the surface outside is fixed. For comparison with programs without half-space kernels;
        /// omit it for the exact half-space.
        truncated: Option<Positive>,
    },
    /// A body that does not deform.
    Rigid {},
}

/// A body of finite elements.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct FeBody {
    /// Name of its material.
    pub material: String,
    /// Direction of material axis 1; default along x.
    pub fibre: Option<FibreDirection>,
    /// Plies with a fibre each, instead of `fibre`.
    pub layup: Option<Layup>,
    /// Mesh file (.msh of gmsh, 2.2 or 4.1), relative to the scene file.
    pub mesh: String,
    /// Physical group of the contact surface.
    pub contact: String,
    /// Groups with zero displacement.
    #[serde(default)]
    pub fixed: Vec<Fixed>,
    /// Groups with prescribed displacements.
    #[serde(default)]
    pub displaced: Vec<Displaced>,
    /// Surface groups in symmetry planes (normal along x, y or z), where the normal displacement is zero. If the plane
    /// cuts the contact, both bodies need one, unless one body is rigid.
    #[serde(default)]
    pub symmetry: Vec<String>,
    /// Surface groups on elastic foundations.
    #[serde(default)]
    pub foundation: Vec<Foundation>,
    /// Surface groups under pressure.
    #[serde(default)]
    pub pressure: Vec<Pressure>,
    /// Surface groups under a traction.
    #[serde(default)]
    pub traction: Vec<Traction>,
    /// Force per volume.
    #[serde(default)]
    pub body_force: [f64; 3],
    /// Volume groups with a material or a fibre of their own.
    #[serde(default)]
    pub regions: BTreeMap<String, Region>,
    /// Formulation of 8-node hexahedra: "hex8-eas" (default), "hex8" or "hex8-bbar". Any other name only checks that the mesh contains elements of
    /// that type.
    pub element: Option<Element>,
    /// Model near the contact: "half-space" (half-space solution; the finite elements correct for the finite size of
    /// the body), "mesh" (finite elements only), or "auto" (half-space where it is valid).
    #[serde(default)]
    pub near_field: NearField,
}

/// A finite body of boundary elements: of one material, meshed on its surface.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct BeBody {
    /// Name of its material.
    pub material: String,
    /// Direction of material axis 1; default along x.
    pub fibre: Option<UniformFibre>,
    /// Mesh file (.msh of gmsh, 2.2 or 4.1), relative to the scene file: a closed surface mesh, or a volume mesh, whose boundary surface is used.
    pub mesh: String,
    /// Physical group of the contact surface.
    pub contact: String,
    /// Surface groups with zero displacement.
    #[serde(default)]
    pub fixed: Vec<Fixed>,
    /// Surface groups with prescribed displacements.
    #[serde(default)]
    pub displaced: Vec<Displaced>,
    /// Surface groups in symmetry planes (normal along x, y or z): zero normal displacement, zero shear traction.
    #[serde(default)]
    pub symmetry: Vec<String>,
    /// Surface groups under pressure.
    #[serde(default)]
    pub pressure: Vec<Pressure>,
    /// Surface groups under a traction.
    #[serde(default)]
    pub traction: Vec<Traction>,
    /// Force per volume.
    #[serde(default)]
    pub body_force: [f64; 3],
    /// Interpolation of displacement and traction on an element; default "linear".
    #[serde(default)]
    pub element: Interpolation,
}

/// Fibre direction (cos tilt cos azimuth, cos tilt sin azimuth, sin tilt).
#[derive(Debug, Clone, Copy, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct UniformFibre {
    /// Angle out of the surface, degrees.
    #[serde(default)]
    #[schemars(range(min = -90, max = 90))]
    pub tilt: f64,
    /// Angle in the surface from +x towards +y, degrees.
    #[serde(default)]
    pub azimuth: f64,
}

/// Components of a displacement.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
#[allow(missing_docs)]
pub enum Component {
    X,
    Y,
    Z,
}

/// A group whose displacement is zero in some components.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Fixed {
    /// Physical group.
    pub group: String,
    /// Fixed components; default all.
    #[serde(default = "all_components")]
    #[schemars(length(min = 1))]
    pub components: Vec<Component>,
}

/// A group with a prescribed displacement.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Displaced {
    /// Physical group.
    pub group: String,
    /// Components prescribed; default all.
    #[serde(default = "all_components")]
    #[schemars(length(min = 1))]
    pub components: Vec<Component>,
    /// Prescribed values, in the order of `components`; with `gradient` the values at the origin, default 0.
    pub value: Option<Vec<f64>>,
    /// Gradient of the prescribed displacement along x, y, z, one row for each of `components`; for a displacement that varies linearly in space.
    #[serde(default)]
    pub gradient: Vec<[f64; 3]>,
}

/// A surface group under pressure.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Pressure {
    /// Physical group.
    pub group: String,
    /// Pressure, positive towards the body.
    pub value: f64,
}

/// A surface group under a traction.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Traction {
    /// Physical group.
    pub group: String,
    /// Force per area along x, y, z.
    pub value: [f64; 3],
}

/// A volume group with properties of its own.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Region {
    /// Name of its material; default the body's.
    pub material: Option<String>,
    /// Direction of its material axis 1; default the body's.
    pub fibre: Option<FibreDirection>,
    /// Plies with a fibre each, instead of `fibre`; default the body's.
    pub layup: Option<Layup>,
}

/// Finite elements: a formulation of hexahedra, or a kind that the mesh must contain.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Element {
    /// Hexahedron with enhanced (incompatible) modes: good in bending.
    Hex8Eas,
    /// Hexahedron with 2 x 2 x 2 integration.
    Hex8,
    /// Hexahedron with the mean dilatation: good for nearly incompressible material.
    Hex8Bbar,
    /// Serendipity hexahedron.
    Hex20,
    /// Triquadratic hexahedron.
    Hex27,
    /// Tetrahedron of constant strain.
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
