//! Directions of the material axes of meshed bodies, and laminates.

use schemars::JsonSchema;
use serde::Deserialize;

use super::frame::{Positive, PositiveCount};

/// Direction of material axis 1 in a meshed body: the same everywhere (`tilt`, `azimuth`), by element (`field`,
/// `file`), or around an axis (`cylindrical`).
#[derive(Debug, Clone, Default, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct FibreDirection {
    /// Angle out of the surface, degrees.
    #[schemars(range(min = -90, max = 90))]
    pub tilt: Option<f64>,
    /// Angle in the surface from +x towards +y, degrees.
    pub azimuth: Option<f64>,
    /// Element field (`$ElementData`) of the mesh file: 3 components (direction of axis 1 in x, y, z) or 9 (directions of axes 1, 2 and 3).
    pub field: Option<String>,
    /// CSV file, relative to the scene file, with lines of element number, fx, fy, fz (direction of axis 1) and
    /// optionally gx, gy, gz (direction of axis 2); or a .msh file that contains `field`.
    pub file: Option<String>,
    /// Fibres wound around an axis (cylindrical fibre directions).
    pub cylindrical: Option<CylindricalWinding>,
}

/// Fibres wound around an axis; material axis 3 points outward.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct CylindricalWinding {
    /// Direction of the axis: "x", "y", "z", or a vector; default z.
    #[serde(default)]
    pub axis: WindingAxis,
    /// A point on the axis.
    #[serde(default)]
    pub origin: [f64; 3],
    /// Winding angle from the axis, degrees: 0 axial, 90 circumferential, positive for a right-handed helix.
    pub angle: Option<f64>,
    /// Layers by radius, from the inside to the outside, instead of one `angle`.
    #[serde(default)]
    pub layers: Vec<WindingLayer>,
}

/// An axis by its name or as a vector.
#[derive(Debug, Clone, Copy, Deserialize, JsonSchema)]
#[serde(untagged)]
#[schemars(inline)]
pub enum WindingAxis {
    /// A global axis.
    Name(AxisName),
    /// A vector of any length.
    Vector([f64; 3]),
}

/// A global axis.
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

/// A layer of a winding.
#[derive(Debug, Clone, Copy, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct WindingLayer {
    /// Inner and outer radius.
    pub r: [f64; 2],
    /// Angle of the fibre from the axis, degrees.
    pub angle: f64,
}

/// Plies stacked along z; an element belongs to the ply that contains its centroid.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Layup {
    /// The plies from the lowest to the highest.
    #[schemars(length(min = 1))]
    pub plies: Vec<LayupPly>,
    /// z of the lower face of the lowest ply; default: lowest node of the elements.
    pub bottom: Option<f64>,
    /// Number of repetitions of the sequence `plies`, at most 100000.
    #[serde(default = "super::frame::one")]
    #[schemars(range(min = 1, max = 100_000))]
    pub repeat: PositiveCount,
    /// Whether the stack is followed by its mirror image (symmetric laminate).
    #[serde(default)]
    pub symmetric: bool,
}

/// A ply, its fibre in the plane x, y.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct LayupPly {
    /// Thickness.
    pub thickness: Positive,
    /// Angle of its fibre from +x towards +y, degrees.
    #[serde(default)]
    pub angle: f64,
    /// Name of its material; default the body's.
    pub material: Option<String>,
}
