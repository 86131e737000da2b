//! Directions of the material axes of meshed bodies, and laminates.

use schemars::JsonSchema;
use serde::Deserialize;

use super::frame::{Positive, PositiveCount};

/// Direction of material axis 1 (fibre) in a meshed body.
///
/// The direction is uniform (`tilt`, `azimuth`), given for each element (`field`, `file`), or wound around an axis
/// (`cylindrical`).
#[derive(Debug, Clone, Default, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct FibreDirection {
    /// Angle of the fibre out of the surface, degrees: 0 in the surface, 90 along the normal.
    #[schemars(range(min = -90, max = 90))]
    pub tilt: Option<f64>,
    /// Angle of the fibre's projection on the surface from +x towards +y, degrees.
    pub azimuth: Option<f64>,
    /// Name of an element field (`$ElementData`) of the mesh file, or of `file`, that contains the directions.
    ///
    /// 3 components are the direction of axis 1 in x, y, z; 9 components are the directions of axes 1, 2 and 3.
    pub field: Option<String>,
    /// File with the direction of each element, relative to the scene file: CSV or .msh.
    ///
    /// Each line of a CSV file contains: element number, fx, fy, fz (direction of axis 1) and optionally gx, gy, gz (direction of
    /// axis 2). A .msh file contains the element field `field`.
    pub file: Option<String>,
    /// Fibres wound around an axis.
    pub cylindrical: Option<CylindricalWinding>,
}

/// Fibres wound around an axis. Material axis 3 points radially outward.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct CylindricalWinding {
    /// Direction of the winding axis: "x", "y", "z", or a vector; default z.
    #[serde(default)]
    pub axis: WindingAxis,
    /// Point on the winding axis.
    #[serde(default)]
    pub origin: [f64; 3],
    /// Winding angle from the axis, degrees: 0 axial, 90 circumferential, positive for a right-handed helix.
    pub angle: Option<f64>,
    /// Layers with their own winding angles, from the inside to the outside, instead of one `angle`.
    #[serde(default)]
    pub layers: Vec<WindingLayer>,
}

/// Axis by name or as a vector.
#[derive(Debug, Clone, Copy, Deserialize, JsonSchema)]
#[serde(untagged)]
#[schemars(inline)]
pub enum WindingAxis {
    /// Global axis.
    Name(AxisName),
    /// Vector of any length.
    Vector([f64; 3]),
}

/// Global axis.
#[derive(Debug, Clone, Copy, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
#[schemars(inline)]
#[allow(missing_docs)]
pub enum AxisName {
    X,
    Y,
    Z,
}

impl WindingAxis {
    /// Direction vector of any length.
    pub fn vector(self) -> [f64; 3] {
        match self {
            Self::Name(AxisName::X) => [1.0, 0.0, 0.0],
            Self::Name(AxisName::Y) => [0.0, 1.0, 0.0],
            Self::Name(AxisName::Z) => [0.0, 0.0, 1.0],
            Self::Vector(vector) => vector,
        }
    }
}

impl Default for WindingAxis {
    fn default() -> Self {
        Self::Name(AxisName::Z)
    }
}

/// Layer of a winding.
#[derive(Debug, Clone, Copy, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct WindingLayer {
    /// Inner and outer radius of the layer.
    pub r: [f64; 2],
    /// Winding angle from the axis, degrees: 0 axial, 90 circumferential, positive for a right-handed helix.
    pub angle: f64,
}

/// Plies stacked along z; an element belongs to the ply that contains its centroid.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Layup {
    /// Plies from the lowest to the highest; `repeat` and `symmetric` repeat this sequence.
    #[schemars(length(min = 1))]
    pub plies: Vec<LayupPly>,
    /// Height z of the lower face of the lowest ply; default: the lowest node of the elements.
    pub bottom: Option<f64>,
    /// Number of times that `plies` is stacked; default 1. At most 100000 plies are allowed before mirroring
    /// (`symmetric`).
    #[serde(default = "super::frame::one")]
    #[schemars(range(min = 1, max = 100_000))]
    pub repeat: PositiveCount,
    /// Whether the stack is followed by its mirror image (symmetric laminate).
    #[serde(default)]
    pub symmetric: bool,
}

/// Ply with its fibre in the plane x, y.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct LayupPly {
    /// Thickness of the ply.
    pub thickness: Positive,
    /// Angle of the fibre from +x towards +y, degrees.
    #[serde(default)]
    pub angle: f64,
    /// Name of the material in `materials`; default: the material of the region or the body.
    pub material: Option<String>,
}
