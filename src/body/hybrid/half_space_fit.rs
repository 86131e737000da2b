//! Checks whether a half-space can represent a body under the frame, and determines its plane and stiffness.

use std::collections::HashSet;

use super::forces::{FaceId, PLANE_TOLERANCE, in_plane};
use super::inclusions::is_same_stiffness;
use super::locate::inverse_map;
use super::patch::ContactPatch;
use nalgebra::Matrix6;

use crate::bem::half_space::SurfaceGreen;
use crate::error::Result;
use crate::fem::{ElementMaterials, FeSpec, find_rigid_body_modes};
use crate::frame::{ContactFrame, Side};
use crate::geometry::{Point, Triad, bounds, format_number};
use crate::material::Stiffness;
use crate::mesh::faces::{SurfaceFace, group_faces, outer_faces};
use crate::mesh::{CellRef, Mesh};

/// Smallest distance from the patch to edges and supports, divided by the shorter half-side. Closer edges cause a peak
/// of the correction that a few polynomials do not resolve.
const MIN_EDGE_DISTANCE: f64 = 0.3;

/// Smallest distance to another material, divided by the shorter half-side. At smaller distances, ten polynomials along
/// each side do not resolve the effect of a material ten times softer or three times stiffer.
const MIN_MATERIAL_DISTANCE: f64 = 0.4;

/// Largest height difference of a curved surface under the frame, divided by the longer half-side.
pub const MAX_RISE: f64 = 0.05;

/// Largest angle between the patch normal and the normal of a face that counts as part of the curved contact surface,
/// radians.
const MAX_SLOPE_RAD: f64 = 0.2;

/// Half-widths of the smallest frame that messages propose, divided by the present half-widths.
const MIN_ADVISED_FACTOR: f64 = 0.05;

const MIN_SAMPLE_STEPS: usize = 8;
const MAX_SAMPLE_STEPS: usize = 64;

/// Half-space that represents a body under the frame.
#[derive(Debug, Clone, PartialEq)]
pub struct HalfSpaceFit {
    /// Rectangle of the frame on the surface of the body.
    pub patch: ContactPatch,
    /// Stiffness in global axes.
    pub stiffness: Stiffness,
    /// Whether the stiffness is isotropic.
    pub isotropic: bool,
    /// Smallest distance from the patch to an edge, a support or another material, mm.
    pub distance: f64,
    /// Whether the smallest distance is the distance to another material.
    pub limited_by_material: bool,
    /// Height difference of the surface under the frame, divided by the longer half-side.
    pub rise: f64,
    /// Faces of a curved surface around the patch. They are treated as part of the patch plane.
    pub curved_faces: Vec<FaceId>,
}

/// Reason why no half-space can represent a body.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Unsuitable(pub String);

impl HalfSpaceFit {
    /// Fits a half-space to the body with the contact group `contact`. Returns the reason if no half-space fits.
    ///
    /// # Errors
    /// If a group is missing, or the body is invalid.
    pub fn find(
        spec: &FeSpec,
        contact: &str,
        side: Side,
        frame: &ContactFrame,
    ) -> Result<std::result::Result<Self, Unsuitable>> {
        let unsuited = |why: &str| Ok(Err(Unsuitable(why.to_owned())));
        let Some(grid) = frame.grid else {
            return unsuited(
                "the cells of the frame are faces or nodes of a mesh (a half-space needs frame.kind = \"grid\")",
            );
        };
        if grid.periodic != [false; 2] {
            return unsuited("the frame is periodic");
        }
        if spec.temperature_change != 0.0 {
            return unsuited("the temperature of the body changes");
        }
        if find_rigid_body_modes(spec)?.is_some() {
            return unsuited("the body has unconstrained rigid-body modes");
        }
        let faces = group_faces(&spec.mesh, contact)?;
        let middle = Point::new(grid.center[0], grid.center[1], 0.0);
        let level = ContactPatch::on_body(&Triad::horizontal(grid.azimuth), side, middle, grid.half_width());
        let PatchSurface { patch, rise, curved_faces, owner } =
            match PatchSurface::find(&spec.mesh, &faces, level) {
                Ok(surface) => surface,
                Err(why) => return Ok(Err(why)),
            };
        let regions = ElementMaterials::new(spec)?;
        let own = regions.element(owner).expect("a face of a solid");
        let stiffness = regions.stiffness(own);
        let surroundings = Surroundings { spec, regions: &regions, stiffness, curved_faces: &curved_faces };
        let to_others = surroundings.distance_to_others(&patch);
        let to_edges = surroundings.distance_to_edges(&patch)?;
        if let Some(why) = surroundings.too_close(&patch, to_edges, to_others)? {
            return Ok(Err(why));
        }
        let distance = to_edges.min(to_others);
        if let Some(why) = supports(spec, &patch)? {
            return unsuited(why);
        }
        let stiffness = Stiffness::from_voigt(stiffness)?;
        let isotropic = stiffness.isotropic_constants().is_some();
        let local = stiffness.rotated(&patch.axes.0.transpose());
        if let Err(error) = SurfaceGreen::new(&local, Side::Lower) {
            return unsuited(error.message());
        }
        Ok(Ok(Self {
            patch,
            stiffness,
            isotropic,
            distance,
            limited_by_material: to_others == distance,
            rise,
            curved_faces,
        }))
    }

    /// Initial number of polynomial nodes along x and y of the patch. It increases as edges or other materials come
    /// closer.
    pub fn first_nodes(&self) -> [usize; 2] {
        self.patch.half_width.map(|half| {
            let nodes = match self.distance / half {
                distance if distance >= 4.0 => 4,
                distance if distance >= 2.0 => 5,
                distance if distance >= 1.0 => 6,
                _ => 7,
            };
            // At the same distance, the correction is less smooth near another material than near an edge.
            let more = if self.limited_by_material && self.distance < half { 2 } else { 0 };
            nodes + usize::from(!self.isotropic) + more
        })
    }
}

struct PatchSurface {
    patch: ContactPatch,
    rise: f64,
    curved_faces: Vec<FaceId>,
    /// Solid element behind a face under the frame.
    owner: CellRef,
}

impl PatchSurface {
    /// Finds the patch on the contact `faces` under the rectangle `level`, which lies at z = 0. Also finds the rise of
    /// the faces, and the faces of a curved surface.
    fn find(
        mesh: &Mesh,
        faces: &[SurfaceFace],
        level: ContactPatch,
    ) -> std::result::Result<Self, Unsuitable> {
        let under: Vec<&SurfaceFace> = faces.iter().filter(|face| touches(mesh, face, &level)).collect();
        let heights = under.iter().flat_map(|face| heights_under(mesh, face, &level));
        let [low, high] = bounds(heights);
        let tolerance = PLANE_TOLERANCE * level.size();
        if !low.is_finite() {
            return Err(Unsuitable("no face of the contact group lies under the frame".to_owned()));
        }
        let rise = if high - low > tolerance { (high - low) / level.size() } else { 0.0 };
        if rise > MAX_RISE {
            return Err(Unsuitable(format!(
                "its surface is too curved under the frame: heights differ by {}, more than {MAX_RISE} times the half-width of the frame{}",
                format_number(high - low),
                flatter_frame_advice(mesh, &under, &level, rise)
            )));
        }
        let height = if rise == 0.0 { 0.5 * (low + high) } else { level.outer_height(low, high) };
        let patch = ContactPatch { center: Point::new(level.center.x, level.center.y, height), ..level };
        let curved_faces =
            if rise == 0.0 { Vec::new() } else { curved_surface_faces(mesh, faces, &patch, rise) };
        // Only nodes of solid elements count: other mesh points, such as circle centres, do not belong to the body.
        let mut nodes = mesh.volume_cells().flat_map(|cell| mesh.cell_nodes(cell));
        if nodes.any(|&node| patch.local(&Point::from(mesh.points[node])).z > tolerance) {
            return Err(Unsuitable("the body extends above its contact plane".to_owned()));
        }
        Ok(Self { patch, rise, curved_faces, owner: under[0].owner })
    }
}

fn flatter_frame_advice(mesh: &Mesh, faces: &[&SurfaceFace], level: &ContactPatch, rise: f64) -> String {
    let (mut factor, mut rise) = (1.0, rise);
    while rise > MAX_RISE && factor >= MIN_ADVISED_FACTOR {
        // For a paraboloid, the ratio of rise to half-side is proportional to the half-side.
        factor *= 0.95 * MAX_RISE / rise;
        let half_width = level.half_width.map(|half| round_down(factor * half));
        let narrow = ContactPatch { half_width, ..*level };
        let heights = faces
            .iter()
            .filter(|face| touches(mesh, face, &narrow))
            .flat_map(|face| heights_under(mesh, face, &narrow));
        let [low, high] = bounds(heights);
        rise = (high - low) / narrow.size();
    }
    if factor < MIN_ADVISED_FACTOR || rise.is_nan() {
        return String::new();
    }
    let [x, y] = level.half_width.map(|half| format_number(round_down(factor * half)));
    format!("; frame.half_width up to [{x}, {y}] is allowed")
}

fn round_down(length: f64) -> f64 {
    let unit = 10f64.powf(length.log10().floor() - 2.0);
    (length / unit * (1.0 + 1e-9)).floor() * unit
}

fn touches(mesh: &Mesh, face: &SurfaceFace, patch: &ContactPatch) -> bool {
    (0..2).all(|axis| {
        let along = face.nodes.iter().map(|&node| patch.local(&mesh.points[node].into())[axis]);
        let [low, high] = bounds(along);
        let border = 1e-9 * patch.half_width[axis];
        low < patch.half_width[axis] - border && high > border - patch.half_width[axis]
    })
}

/// Sample points on a face, including its edges. The distance of adjacent points along the edges is at most `apart`,
/// unless [`MAX_SAMPLE_STEPS`] is reached.
fn points_of(mesh: &Mesh, face: &SurfaceFace, apart: f64) -> Vec<Point> {
    let n = face.kind.n_corners();
    let at = |k: usize| Point::from(mesh.points[face.nodes[k % n]]);
    let longest = (0..n).map(|k| (at(k + 1) - at(k)).norm()).fold(0.0, f64::max);
    let steps = ((longest / apart).ceil() as usize).clamp(MIN_SAMPLE_STEPS, MAX_SAMPLE_STEPS);
    let triangle = n == 3;
    let part = |k: usize| k as f64 / steps as f64;
    let pairs = (0..=steps).flat_map(|i| (0..=steps).map(move |j| (i, j)));
    let points = pairs.filter(|(i, j)| !triangle || i + j <= steps).map(|(i, j)| {
        let xi = [part(i), part(j)].map(|x| if triangle { x } else { 2.0 * x - 1.0 });
        let values = face.kind.face_values(xi);
        face.nodes.iter().zip(values).map(|(&node, value)| Point::from(mesh.points[node]) * value).sum()
    });
    points.collect()
}

/// Global z coordinates of sample points of a face under the rectangle of `patch`.
fn heights_under(mesh: &Mesh, face: &SurfaceFace, patch: &ContactPatch) -> Vec<f64> {
    let nodes: Vec<Point> = face.nodes.iter().map(|&node| patch.local(&mesh.points[node].into())).collect();
    let step = |k: usize, axis: usize| {
        patch.half_width[axis] * (2.0 * k as f64 / MIN_SAMPLE_STEPS as f64 - 1.0) * (1.0 - 1e-9)
    };
    let pairs = (0..=MIN_SAMPLE_STEPS).flat_map(|i| (0..=MIN_SAMPLE_STEPS).map(move |j| (i, j)));
    let height = |(i, j): (usize, usize)| {
        let xi = inverse_map(face, &nodes, [step(i, 0), step(j, 1)])?;
        let values = face.kind.face_values(xi);
        Some(face.nodes.iter().zip(values).map(|(&node, value)| mesh.points[node][2] * value).sum())
    };
    let under = |x: &Point| {
        let local = patch.local(x);
        (0..2).all(|axis| local[axis].abs() <= patch.half_width[axis] * (1.0 + 1e-9))
    };
    let own = points_of(mesh, face, f64::INFINITY).into_iter().filter(under).map(|x| x.z);
    own.chain(pairs.filter_map(height)).collect()
}

/// Outer faces near the patch that count as part of its curved surface. These are faces of the contact group, and faces
/// with a small slope and depth relative to the patch plane.
fn curved_surface_faces(mesh: &Mesh, faces: &[SurfaceFace], patch: &ContactPatch, rise: f64) -> Vec<FaceId> {
    let group: HashSet<FaceId> = faces.iter().map(SurfaceFace::id).collect();
    // A paraboloid is nine times as deep at three times the distance from its apex.
    let deepest = -9.0 * rise * patch.size();
    let goes_on = |face: &SurfaceFace| {
        let area = face.area_vector(mesh);
        let level = area.dot(&patch.axes.normal()) >= MAX_SLOPE_RAD.cos() * area.norm();
        let depth = |&node: &usize| patch.local(&mesh.points[node].into()).z;
        level && face.nodes.iter().all(|node| depth(node) >= deepest)
    };
    let near = |face: &&SurfaceFace| {
        let locals = face.nodes.iter().map(|&node| patch.local(&mesh.points[node].into()));
        let level = |x: Point| patch.distance(&Point::new(x.x, x.y, 0.0));
        locals.map(level).fold(f64::INFINITY, f64::min) <= patch.size()
    };
    let on_surface = |face: &&SurfaceFace| group.contains(&face.id()) || goes_on(face);
    let outer = outer_faces(mesh);
    outer.iter().filter(near).filter(on_surface).map(SurfaceFace::id).collect()
}

/// Body around the patch, searched for edges, supports and other materials that a half-space does not have.
struct Surroundings<'a> {
    spec: &'a FeSpec,
    regions: &'a ElementMaterials,
    /// Stiffness under the patch in global axes, MPa.
    stiffness: Matrix6<f64>,
    curved_faces: &'a [FaceId],
}

impl Surroundings<'_> {
    fn too_close(&self, patch: &ContactPatch, to_edges: f64, to_others: f64) -> Result<Option<Unsuitable>> {
        let shorter = patch.half_width[0].min(patch.half_width[1]);
        let limits = [
            ("an edge or a support of the body", to_edges, MIN_EDGE_DISTANCE),
            ("another material", to_others, MIN_MATERIAL_DISTANCE),
        ];
        let violated = limits.iter().find(|(_, found, share)| *found < share * shorter);
        let Some((what, distance, share)) = violated else { return Ok(None) };
        Ok(Some(Unsuitable(format!(
            "{what} is at a distance of {} from the frame, but at least {} is needed ({share} times the smaller half-width of the frame){}",
            format_number(*distance),
            format_number(share * shorter),
            self.smaller_frame_advice(patch, *distance, *share)?
        ))))
    }

    /// Phrase of a message that proposes half-widths of a smaller frame. The distance of the smaller frame from edges,
    /// supports and other materials is at least `share` times its shorter half-side. The present frame has the distance
    /// `distance`, mm.
    fn smaller_frame_advice(&self, patch: &ContactPatch, distance: f64, share: f64) -> Result<String> {
        let shorter = patch.half_width[0].min(patch.half_width[1]);
        // A smaller frame is farther from features beside the frame, but not from features below the frame.
        let beside = (distance + shorter) / ((1.0 + share) * shorter);
        let narrow = ContactPatch { half_width: patch.half_width.map(|half| beside * half), ..*patch };
        let least = self.distance_to_others(&narrow).min(self.distance_to_edges(&narrow)?);
        let far_enough = least >= share * beside * shorter * (1.0 - 1e-9);
        let factor = if far_enough { beside } else { distance / (share * shorter) };
        if factor < MIN_ADVISED_FACTOR {
            return Ok(String::new());
        }
        let [x, y] = patch.half_width.map(|half| format_number(round_down(factor * half)));
        Ok(format!("; frame.half_width up to [{x}, {y}] is allowed"))
    }

    /// Distance from the patch to supported nodes and to outer faces, mm. Faces in the patch plane and faces among
    /// `curved_faces` do not count.
    fn distance_to_edges(&self, patch: &ContactPatch) -> Result<f64> {
        let mesh = &self.spec.mesh;
        let surface: HashSet<FaceId> = self.curved_faces.iter().copied().collect();
        let elsewhere = |face: &&SurfaceFace| !in_plane(mesh, face, patch) && !surface.contains(&face.id());
        let apart = 0.5 * MIN_EDGE_DISTANCE * patch.half_width[0].min(patch.half_width[1]);
        let mut least = f64::INFINITY;
        let mut look = |x: &Point| least = least.min(patch.distance(&patch.local(x)));
        for face in outer_faces(mesh).iter().filter(elsewhere) {
            points_of(mesh, face, apart).iter().for_each(&mut look);
        }
        for support in &self.spec.supports {
            for node in mesh.group_nodes(&support.group)? {
                look(&mesh.points[node].into());
            }
        }
        Ok(least)
    }

    /// Distance from the patch to elements of another material, mm; infinite without such elements. Each element is
    /// replaced by its bounding box in the axes of the patch.
    fn distance_to_others(&self, patch: &ContactPatch) -> f64 {
        let (mesh, regions) = (&self.spec.mesh, self.regions);
        let other = |&i: &usize| !is_same_stiffness(&regions.stiffness(i), &self.stiffness);
        let distance = |i: usize| {
            let nodes = mesh.cell_nodes(regions.cells()[i]).iter();
            let locals: Vec<Point> = nodes.map(|&node| patch.local(&mesh.points[node].into())).collect();
            let [x, y, z] = [0, 1, 2].map(|axis| bounds(locals.iter().map(|local| local[axis])));
            let nearest = |[low, high]: [f64; 2]| 0.0_f64.clamp(low, high);
            patch.distance(&Point::new(nearest(x), nearest(y), z[1].min(0.0)))
        };
        (0..regions.n_elements()).filter(other).map(distance).fold(f64::INFINITY, f64::min)
    }
}

fn supports(spec: &FeSpec, patch: &ContactPatch) -> Result<Option<&'static str>> {
    let mesh = &spec.mesh;
    let mut outside = vec![false; mesh.n_points()];
    outer_faces(mesh).iter().for_each(|face| face.nodes.iter().for_each(|&node| outside[node] = true));
    for support in &spec.supports {
        if mesh.group_nodes(&support.group)?.iter().any(|&node| !outside[node]) {
            return Ok(Some("a support fixes nodes inside the body"));
        }
    }
    for foundation in &spec.foundations {
        if group_faces(mesh, &foundation.group)?.iter().any(|face| in_plane(mesh, face, patch)) {
            return Ok(Some("a foundation lies in the plane of the contact"));
        }
    }
    Ok(None)
}
