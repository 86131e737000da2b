//! `[frame]` and `[gap]`.

use schemars::JsonSchema;
use serde::Deserialize;

/// Contact frame: the cells on which contact may occur. Tractions are constant on each cell.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(tag = "kind", rename_all = "kebab-case", deny_unknown_fields)]
#[allow(missing_docs)]
pub enum Frame {
    /// Uniform rectangular cells in the plane z = 0.
    Grid {
        /// Half side lengths of the frame along its x and y.
        half_width: [Positive; 2],
        /// Number of cells along the frame's x and y.
        cells: [PositiveCount; 2],
        /// Centre of the frame in global x, y.
        #[serde(default)]
        center: [f64; 2],
        /// Angle from global x to the frame's x, positive towards global y, degrees.
        #[serde(default)]
        azimuth: f64,
        /// Outline of a flat punch: cells whose centres lie outside are never in contact.
        outline: Option<Outline>,
        /// Whether the problem is periodic along the frame's x and y; not available with meshed bodies.
        #[serde(default)]
        periodic: [bool; 2],
        /// Whether the frame is enlarged when the worn contact reaches its edge. If false, the run then stops with exit
        /// code 3.
        #[serde(default = "yes")]
        grow: bool,
    },
    /// The contact group of a meshed body, divided into cells by its mesh.
    Mesh {
        /// Body whose contact faces form the cells, 1 or 2; default: the meshed body with the smaller faces.
        #[schemars(range(min = 1, max = 2))]
        body: Option<u8>,
        /// One cell per face ("faces") or per node ("nodes") of the contact group.
        ///
        /// Default: "nodes" for first-order faces of a finite-element body if neither body is a half-space, else "faces".
        points: Option<FramePoints>,
        /// Origin of gap shapes, rotations and moments in global x, y.
        #[serde(default)]
        center: [f64; 2],
        /// Angle from global x to the cells' x, positive towards global y, degrees.
        #[serde(default)]
        azimuth: f64,
        /// Direction from body 1 to body 2; `approach` moves body 2 in the opposite direction.
        #[serde(default = "upward")]
        normal: [f64; 3],
    },
}

/// Default value of boolean keys that are true if absent.
pub(super) fn yes() -> bool {
    true
}

/// Default value of counts that are 1 if absent.
pub(super) fn one() -> PositiveCount {
    PositiveCount(1)
}

fn upward() -> [f64; 3] {
    [0.0, 0.0, 1.0]
}

/// Edge of a flat punch: a closed line in the frame's plane.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(tag = "shape", rename_all = "kebab-case", deny_unknown_fields)]
pub enum Outline {
    /// Circle.
    Circle {
        /// Radius of the circle.
        radius: Positive,
        /// Centre of the outline relative to the frame's centre, along the frame's x, y.
        #[serde(default)]
        center: [f64; 2],
    },
    /// Ellipse.
    Ellipse {
        /// Semi-axes of the ellipse.
        semi_axes: [Positive; 2],
        /// Angle of the first axis from the frame's x towards its y, degrees.
        #[serde(default)]
        angle: f64,
        /// Centre of the outline relative to the frame's centre, along the frame's x, y.
        #[serde(default)]
        center: [f64; 2],
    },
    /// Polygon that does not intersect itself.
    Polygon {
        /// Vertices in order, relative to the frame's centre, along the frame's x, y. The last is joined to the first.
        #[schemars(length(min = 3))]
        vertices: Vec<[f64; 2]>,
    },
}

/// Part of the contact surface that a cell of a mesh frame represents.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum FramePoints {
    /// One cell per face of the contact group.
    Faces,
    /// One cell per node. The cell consists of the parts of the adjacent faces nearest to the node (tributary area).
    Nodes,
}

/// Initial gap between the undeformed surfaces.
///
/// The shape is the surface of body 2 above the plane z = 0. Curved surfaces are parabolic approximations unless
/// `exact = true`. r is the distance from the lowest point or tip, along the plane.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(tag = "kind", rename_all = "kebab-case", deny_unknown_fields)]
#[allow(missing_docs)]
pub enum Gap {
    /// Sphere: gap r^2 / (2 radius).
    Sphere {
        /// Radius of the sphere.
        radius: Positive,
        /// Whether the exact sphere is used instead of its paraboloid.
        #[serde(default)]
        exact: bool,
        /// Position of the lowest point relative to the frame's centre, along the frame's x, y.
        #[serde(default)]
        offset: [f64; 2],
    },
    /// Ellipsoid: gap `x^2 / (2 radii[0]) + y^2 / (2 radii[1])`, x and y along its first and second axis.
    Ellipsoid {
        /// Radii of curvature along the two axes. Excludes `semi_axes`.
        radii: Option<[Positive; 2]>,
        /// Semi-axes [a, b, c], with c along the normal n. The radii of curvature are a^2 / c and b^2 / c. Excludes
        /// `radii`.
        semi_axes: Option<[Positive; 3]>,
        /// Angle of the first axis from +x towards +y, degrees.
        #[serde(default)]
        angle: f64,
        /// Whether the exact ellipsoid is used instead of its paraboloid; needs `semi_axes`.
        #[serde(default)]
        exact: bool,
        /// Position of the lowest point relative to the frame's centre, along the frame's x, y.
        #[serde(default)]
        offset: [f64; 2],
    },
    /// Cylinder with its axis along the surface: gap y^2 / (2 radius), y across the axis.
    Cylinder {
        /// Radius of the cylinder.
        radius: Positive,
        /// Angle of the cylinder's axis from +x towards +y, degrees.
        #[serde(default)]
        angle: f64,
        /// Whether the exact cylinder is used instead of its parabola.
        #[serde(default)]
        exact: bool,
        /// Position of a point of the lowest line relative to the frame's centre, along the frame's x, y.
        #[serde(default)]
        offset: [f64; 2],
    },
    /// Cone: gap r tan(slope).
    Cone {
        /// Angle between the cone's flank and the surface, degrees.
        #[schemars(extend("exclusiveMinimum" = 0, "exclusiveMaximum" = 90))]
        slope: f64,
        /// Position of the tip relative to the frame's centre, along the frame's x, y.
        #[serde(default)]
        offset: [f64; 2],
    },
    /// Flat surfaces: no gap.
    Flat {},
    /// Power law: gap coefficient r^exponent.
    Power {
        /// Exponent of r.
        exponent: Positive,
        /// Coefficient of r^exponent.
        coefficient: Positive,
        /// Position of the lowest point relative to the frame's centre, along the frame's x, y.
        #[serde(default)]
        offset: [f64; 2],
    },
    /// Gap heights from a file. The smallest height in the cells is subtracted, so that the lowest cell has gap 0
    /// (first touch).
    Heights {
        /// CSV or NPY file of gap heights, relative to the scene file; row = index along x, column = index along y.
        file: String,
        /// Spacing of the heights along x, y; default: one height per cell.
        ///
        /// With a spacing, the height map is centred in the frame, and its heights are interpolated at the cells.
        spacing: Option<[Positive; 2]>,
        /// Position of the centre of the height map relative to the frame's centre, along the frame's x, y; needs `spacing`.
        #[serde(default)]
        offset: [f64; 2],
        /// Angle of the height map's x from +x towards +y, degrees; needs `spacing`. Default: the frame's azimuth.
        angle: Option<f64>,
    },
    /// Distance of the meshed surfaces along the normal; a body without a mesh is the plane z = 0.
    Mesh {
        /// Position of body 2 at approach 0: "first-touch" (default) or "as-meshed".
        #[serde(default)]
        reference: GapReference,
    },
}

/// Position of body 2 at approach 0.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum GapReference {
    /// Body 2 is moved along n until the surfaces first touch.
    #[default]
    FirstTouch,
    /// Body 2 keeps the position of its mesh. Overlap of the surfaces acts as a load named "interference".
    AsMeshed,
}

/// Number above zero.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize, JsonSchema)]
#[serde(transparent)]
#[schemars(inline)]
pub struct Positive(#[schemars(extend("exclusiveMinimum" = 0))] pub f64);

/// Whole number, at least 1.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(transparent)]
#[schemars(inline)]
pub struct PositiveCount(#[schemars(range(min = 1))] pub usize);
