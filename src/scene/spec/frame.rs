//! `[frame]` and `[gap]`.

use schemars::JsonSchema;
use serde::Deserialize;

/// The contact frame.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(tag = "kind", rename_all = "kebab-case", deny_unknown_fields)]
#[allow(missing_docs)]
pub enum Frame {
    /// Uniform rectangular cells in the plane z = 0.
    Grid {
        /// Half of the frame's sides along its x and y.
        half_width: [Positive; 2],
        /// Number of cells along its x and y.
        cells: [PositiveCount; 2],
        /// Centre in global x, y.
        #[serde(default)]
        center: [f64; 2],
        /// Angle of the frame's x from global x towards y, degrees.
        #[serde(default)]
        azimuth: f64,
        /// Outline of a flat punch: cells whose centres lie outside are never in contact.
        outline: Option<Outline>,
        /// Whether the problem is periodic along the frame's x and y; not available with meshed bodies.
        #[serde(default)]
        periodic: [bool; 2],
        /// Whether the frame is enlarged when the worn contact reaches its edge; if false, the run stops there (exit code 3).
        #[serde(default = "yes")]
        grow: bool,
    },
    /// The contact group of a meshed body, divided into cells by its mesh.
    Mesh {
        /// Body whose faces are taken, 1 or 2; default the one with more faces.
        #[schemars(range(min = 1, max = 2))]
        body: Option<u8>,
        /// One cell per face or per node. Default: "nodes" for first-order faces of a finite-element body if neither body is a
        /// half-space, else "faces".
        points: Option<FramePoints>,
        /// Origin of the gap's shape and of moments in global x, y.
        #[serde(default)]
        center: [f64; 2],
        /// Angle of the cells' x from global x towards y, degrees.
        #[serde(default)]
        azimuth: f64,
        /// Direction from body 1 to body 2; `approach` moves body 2 in the opposite direction.
        #[serde(default = "upward")]
        normal: [f64; 3],
    },
}

/// Default of switches that are on.
pub(super) fn yes() -> bool {
    true
}

/// Default of counts.
pub(super) fn one() -> PositiveCount {
    PositiveCount(1)
}

fn upward() -> [f64; 3] {
    [0.0, 0.0, 1.0]
}

/// A closed line in the frame's plane.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(tag = "shape", rename_all = "kebab-case", deny_unknown_fields)]
pub enum Outline {
    /// A circle.
    Circle {
        /// Radius.
        radius: Positive,
        /// Centre of the outline relative to the frame's centre, along the frame's x, y.
        #[serde(default)]
        center: [f64; 2],
    },
    /// An ellipse.
    Ellipse {
        /// Semi-axes.
        semi_axes: [Positive; 2],
        /// Angle of the first axis from the frame's x towards its y, degrees.
        #[serde(default)]
        angle: f64,
        /// Centre of the outline relative to the frame's centre, along the frame's x, y.
        #[serde(default)]
        center: [f64; 2],
    },
    /// A polygon that does not cross itself.
    Polygon {
        /// Vertices from the frame's centre, along its x, y; the last joins the first.
        #[schemars(length(min = 3))]
        vertices: Vec<[f64; 2]>,
    },
}

/// What a cell of a mesh frame represents.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum FramePoints {
    /// A face of the contact group.
    Faces,
    /// A node with its tributary area: the parts of the adjacent faces nearest to it.
    Nodes,
}

/// Initial gap between the undeformed surfaces. Shapes belong to body 2, above the plane z = 0, and are parabolic approximations unless `exact = true`.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(tag = "kind", rename_all = "kebab-case", deny_unknown_fields)]
#[allow(missing_docs)]
pub enum Gap {
    /// r^2 / (2 radius).
    Sphere {
        /// Radius.
        radius: Positive,
        /// The sphere itself instead of its paraboloid.
        #[serde(default)]
        exact: bool,
        /// Position of the lowest point from the frame's centre, along its x, y.
        #[serde(default)]
        offset: [f64; 2],
    },
    /// `x^2 / (2 radii[0]) + y^2 / (2 radii[1])`.
    Ellipsoid {
        /// Radii of curvature along the two axes. Excludes `semi_axes`.
        radii: Option<[Positive; 2]>,
        /// Semi-axes [a, b, c], c along n: radii of curvature a^2 / c, b^2 / c. Excludes `radii`.
        semi_axes: Option<[Positive; 3]>,
        /// Angle of the first axis from +x towards +y, degrees.
        #[serde(default)]
        angle: f64,
        /// The ellipsoid itself instead of its paraboloid; needs `semi_axes`.
        #[serde(default)]
        exact: bool,
        /// Position of the lowest point from the frame's centre, along its x, y.
        #[serde(default)]
        offset: [f64; 2],
    },
    /// Parabola across the cylinder's axis.
    Cylinder {
        /// Radius.
        radius: Positive,
        /// Angle of the axis from +x towards +y, degrees.
        #[serde(default)]
        angle: f64,
        /// The circle itself instead of its parabola.
        #[serde(default)]
        exact: bool,
        /// Position of a point of the lowest line relative to the frame's centre, along the frame's x, y.
        #[serde(default)]
        offset: [f64; 2],
    },
    /// r tan(slope).
    Cone {
        /// Angle between the cone's flank and the surface, degrees.
        #[schemars(extend("exclusiveMinimum" = 0, "exclusiveMaximum" = 90))]
        slope: f64,
        /// Position of the tip from the frame's centre, along its x, y.
        #[serde(default)]
        offset: [f64; 2],
    },
    /// No gap at all.
    Flat {},
    /// coefficient r^exponent.
    Power {
        /// Exponent.
        exponent: Positive,
        /// Coefficient.
        coefficient: Positive,
        /// Position of the lowest point from the frame's centre, along its x, y.
        #[serde(default)]
        offset: [f64; 2],
    },
    /// Heights given in a file.
    Heights {
        /// CSV or NPY file of heights, relative to the scene file; row = index along x, column = index along y.
        file: String,
        /// Spacing of the values along x, y; the values are centred in the frame and interpolated. Default: one value per cell, no interpolation.
        spacing: Option<[Positive; 2]>,
        /// Position of the centre of the height map relative to the frame's centre, along the frame's x, y; needs `spacing`.
        #[serde(default)]
        offset: [f64; 2],
        /// Angle of the heights' x from +x towards +y, degrees; needs `spacing`. Default the frame's azimuth.
        angle: Option<f64>,
    },
    /// The distance of the two meshed surfaces along the normal.
    Mesh {},
}

/// A number above zero.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize, JsonSchema)]
#[serde(transparent)]
#[schemars(inline)]
pub struct Positive(#[schemars(extend("exclusiveMinimum" = 0))] pub f64);

/// A whole number, at least 1.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(transparent)]
#[schemars(inline)]
pub struct PositiveCount(#[schemars(range(min = 1))] pub usize);
