//! Resolves the contact frame and the initial gap.

use crate::frame::height_table::HeightTable;
use crate::frame::{self, ContactFrame, GapShape, InitialGap, Side, height_file};
use crate::scene::plan::{BodyPlan, FramePlan, MeshedBodyPlan};
use crate::scene::schema_check::MAGNITUDE_RANGE;
use crate::scene::spec::frame::{Frame, FramePoints, Gap, GapReference, Outline};

use super::resolver::Resolver;

pub(super) fn resolve_frame(r: &mut Resolver, bodies: &[Option<BodyPlan>; 2]) -> Option<FramePlan> {
    match r.section("frame")? {
        Frame::Grid { half_width, cells, center, azimuth, outline, periodic, grow } => {
            let (half_width, cells) = (half_width.map(|w| w.0), cells.map(|n| n.0));
            let azimuth = azimuth.to_radians();
            if periodic != [false; 2] {
                check_periodic(r, bodies, cells, periodic)?;
            }
            let outline = match outline {
                Some(outline) => Some(resolve_outline(r, outline)?),
                None => None,
            };
            let beyond = |outline| extends_beyond_frame(outline, half_width, periodic);
            if outline.as_ref().is_some_and(beyond) {
                r.note("frame.outline extends beyond the frame and is cut at its edge; contact at that edge triggers a warning");
            }
            Some(FramePlan::Grid { half_width, cells, center, azimuth, periodic, outline, grow })
        }
        Frame::Mesh { body, points, center, azimuth, normal } => {
            let azimuth = azimuth.to_radians();
            if normal == [0.0; 3] {
                let mend = "the direction from body 1 to body 2, e.g. [0.0, 0.0, 1.0]";
                let message = "the normal [0, 0, 0] has no direction";
                return r.refuse("frame.normal", message, "no direction", mend);
            }
            let body = frame_body(r, body, bodies)?;
            let points = points.unwrap_or_else(|| default_frame_points(bodies, body));
            Some(FramePlan::Mesh { body, points, center, azimuth, normal })
        }
    }
}

/// Reports settings that a periodic frame excludes. Returns `None` if the scene has any of them.
fn check_periodic(
    r: &mut Resolver,
    bodies: &[Option<BodyPlan>; 2],
    cells: [usize; 2],
    periodic: [bool; 2],
) -> Option<()> {
    let before = r.diagnostics.len();
    for (index, body) in bodies.iter().enumerate() {
        if body.as_ref().is_some_and(|body| body.as_meshed().is_some()) {
            let message = format!(
                "a periodic frame allows only half-spaces and rigid bodies, but body{} has a mesh",
                index + 1
            );
            let mend = "remove `periodic` and use symmetry planes of the mesh (`symmetry`), or make the body a half-space";
            r.report("frame.periodic", message, "not with a meshed body", mend);
        }
    }
    if periodic == [true; 2] && cells == [1, 1] {
        let message = "a frame of one cell that is periodic in both directions carries only a uniform pressure, which causes no relative displacement";
        r.report("frame.cells", message, "one cell", "give the frame more cells along x or y");
    }
    let coupling = r.document.get("solver.coupling").map(|node| node.to_serde_json());
    if coupling.is_some_and(|word| word == "block") {
        let message = "coupling = \"block\" does not support periodic frames";
        r.report("solver.coupling", message, "with a periodic frame", "remove it: \"schur\" is the default");
    }
    (r.diagnostics.len() == before).then_some(())
}

fn extends_beyond_frame(outline: &frame::Outline, half_width: [f64; 2], periodic: [bool; 2]) -> bool {
    let extent = outline.extent();
    (0..2).any(|k| !periodic[k] && extent[k].iter().any(|x| x.abs() > half_width[k] * (1.0 + 1e-9)))
}

/// Mean area of the contact faces of a body. Infinite if the faces are invalid, which is reported elsewhere.
fn mean_face_area(fe: &MeshedBodyPlan) -> f64 {
    ContactFrame::from_faces(&fe.mesh, &fe.contact, Side::Lower, [0.0; 2], 0.0)
        .map_or(f64::INFINITY, |frame| frame.mean_cell_area())
}

/// Default of `frame.points`. The default is one cell per node if the body has finite elements with linear contact
/// faces and neither body is a half-space. Otherwise it is one cell per face.
///
/// The reason: with one cell per linear face, a checkerboard of tractions would displace neither body. A half-space
/// responds to the traction of every cell.
fn default_frame_points(bodies: &[Option<BodyPlan>; 2], body: usize) -> FramePoints {
    let half_space = bodies
        .iter()
        .flatten()
        .any(|body| matches!(body, BodyPlan::HalfSpace(_) | BodyPlan::TruncatedHalfSpace(_)));
    // A boundary-element body has one cell per face by default, because its nodes lie inside the faces.
    let own = bodies[body].as_ref().and_then(BodyPlan::as_fe);
    if !half_space && own.is_some_and(MeshedBodyPlan::has_linear_contact_faces) {
        FramePoints::Nodes
    } else {
        FramePoints::Faces
    }
}

/// Index of the body whose faces are the cells. Default: the meshed body with the smaller mean face area.
fn frame_body(r: &mut Resolver, wanted: Option<u8>, bodies: &[Option<BodyPlan>; 2]) -> Option<usize> {
    // Errors of a body itself are reported elsewhere.
    let [Some(body1), Some(body2)] = bodies else { return None };
    let faces = [body1, body2].map(|body| body.as_meshed().map(mean_face_area));
    match (wanted, faces) {
        (None, [None, None]) => {
            let message = "frame.kind = \"mesh\" needs a meshed body, but neither body has a mesh";
            r.refuse("frame.kind", message, "no mesh", "write kind = \"grid\" with half_width and cells")
        }
        (None, [Some(a), Some(b)]) => Some(usize::from(b < a)),
        (None, [a, _]) => Some(usize::from(a.is_none())),
        (Some(body), faces) => {
            let index = usize::from(body == 2);
            if faces[index].is_none() {
                let message = format!("the frame takes the faces of body {body}, which has no mesh");
                return r.refuse(
                    "frame.body",
                    message,
                    "no mesh",
                    format!("write body = {}, or kind = \"grid\"", 3 - body),
                );
            }
            Some(index)
        }
    }
}

/// Resolves the initial gap. Its angles are measured from the frame's x.
pub(super) fn resolve_gap(
    r: &mut Resolver,
    frame: Option<&FramePlan>,
    bodies: &[Option<BodyPlan>; 2],
) -> Option<InitialGap> {
    let turned = |angle: f64| angle.to_radians() - frame.map_or(0.0, FramePlan::azimuth);
    let plain = |shape: GapShape, offset: [f64; 2]| InitialGap { offset, ..shape.into() };
    Some(match r.section("gap")? {
        Gap::Sphere { radius, exact, offset } => {
            InitialGap { exact, ..plain(GapShape::Sphere { radius: radius.0 }, offset) }
        }
        Gap::Ellipsoid { radii, semi_axes, angle, exact, offset } => {
            let (radii, semi_axes) = (radii.map(|r| r.map(|x| x.0)), semi_axes.map(|s| s.map(|x| x.0)));
            InitialGap { exact, ..plain(ellipsoid(r, radii, semi_axes, turned(angle), exact)?, offset) }
        }
        Gap::Cylinder { radius, angle, exact, offset } => InitialGap {
            exact,
            ..plain(GapShape::Cylinder { radius: radius.0, angle: turned(angle) }, offset)
        },
        Gap::Cone { slope, offset } => plain(GapShape::Cone { slope: slope.to_radians() }, offset),
        Gap::Flat {} => GapShape::Flat.into(),
        Gap::Power { exponent, coefficient, offset } => {
            plain(GapShape::Power { exponent: exponent.0, coefficient: coefficient.0 }, offset)
        }
        Gap::Heights { file, spacing, offset, angle } => {
            let angle = angle.map_or(0.0, turned);
            let heights = heights(r, &file, spacing.map(|s| s.map(|x| x.0)), angle, frame)?;
            plain(GapShape::Heights(heights), offset)
        }
        Gap::Mesh { reference } => {
            let meshed = bodies.iter().flatten().any(|body| body.as_meshed().is_some());
            if !meshed && bodies.iter().all(Option::is_some) {
                let message = "the gap comes from the meshes, but neither body has one";
                let mend = "name a shape, e.g. kind = \"sphere\" with radius";
                return r.refuse("gap.kind", message, "no mesh", mend);
            }
            InitialGap { as_meshed: reference == GapReference::AsMeshed, ..GapShape::Mesh.into() }
        }
    })
}

fn ellipsoid(
    r: &mut Resolver,
    radii: Option<[f64; 2]>,
    semi_axes: Option<[f64; 3]>,
    angle: f64,
    exact: bool,
) -> Option<GapShape> {
    match (radii, semi_axes) {
        (Some(_), Some(_)) => {
            let message = "an ellipsoid has either `radii` or `semi_axes`, not both";
            r.refuse("gap.semi_axes", message, "together with `radii`", "remove one of the two")
        }
        (None, None) => {
            let mend = "add `radii`: the radii of curvature along the two axes, or `semi_axes` = [a, b, c]";
            r.refuse("gap", "`gap` lacks `radii`", "lacks `radii`", mend)
        }
        (Some(_), None) if exact => {
            let message = "two radii of curvature do not define an exact ellipsoid";
            let mend = "give `semi_axes` = [a, b, c] (radii a^2 / c, b^2 / c) instead of `radii`, or leave out `exact`";
            r.refuse("gap.exact", message, "needs `semi_axes`", mend)
        }
        (Some(radii), None) => Some(GapShape::Ellipsoid { radii, angle }),
        (None, Some(semi_axes)) => Some(GapShape::SemiAxes { semi_axes, angle }),
    }
}

/// Reads gap heights from a CSV or NPY file. `angle` is measured from the frame's x.
fn heights(
    r: &mut Resolver,
    file: &str,
    spacing: Option<[f64; 2]>,
    angle: f64,
    frame: Option<&FramePlan>,
) -> Option<HeightTable> {
    let path = r.file("gap.file", file);
    let array = match height_file::read(&path) {
        Ok(array) => array,
        Err(error) => {
            let message =
                format!("the file of heights {} cannot be used: {}", path.display(), error.message());
            let mend = "a CSV file of numbers (one line per index along x, one column per index along y) or a .npy file of a \
                        2-D array";
            return r.refuse("gap.file", message, "this file", mend);
        }
    };
    let shape = array.shape;
    if let Some(bad) = array.values.iter().position(|value| value.abs() > MAGNITUDE_RANGE[1]) {
        let (row, column) = (bad / shape[1] + 1, bad % shape[1] + 1);
        let message = format!("the height in row {row}, column {column} is {:e}", array.values[bad]);
        return r.refuse(
            "gap.file",
            message,
            "this file",
            format!("heights must not exceed {:e} in magnitude", MAGNITUDE_RANGE[1]),
        );
    }
    if let (None, Some(FramePlan::Grid { cells, .. })) = (spacing, frame)
        && *cells != shape
    {
        let message = format!(
            "the file has {} lines of {} values, but the frame has {} x {} cells",
            shape[0], shape[1], cells[0], cells[1]
        );
        return r.refuse(
            "gap.file",
            message,
            "one value per cell",
            "match frame.cells, or give `spacing` to interpolate",
        );
    }
    Some(HeightTable { values: array.values, shape, spacing, angle })
}

fn resolve_outline(r: &mut Resolver, outline: Outline) -> Option<frame::Outline> {
    let outline = match outline {
        Outline::Circle { radius, center } => frame::Outline::Circle { radius: radius.0, center },
        Outline::Ellipse { semi_axes, angle, center } => {
            frame::Outline::Ellipse { semi_axes: semi_axes.map(|x| x.0), angle: angle.to_radians(), center }
        }
        Outline::Polygon { vertices } => frame::Outline::Polygon { vertices },
    };
    let mend = "give the vertices in order around the outline, in coordinates of the frame";
    r.accept(outline.check(), "frame.outline", ["this outline", mend]).map(|()| outline)
}
