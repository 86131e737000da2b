//! Contact frames with one cell per face of a meshed body.

use std::borrow::Cow;

use super::clip::area_and_centroid;
use super::facets::face_polygon;
use super::symmetry::reflect_cell;
use super::{ContactFrame, Side};
use crate::error::{Context, Error, Result};
use crate::flexibility::per_cell::PerCell;
use crate::geometry::{Point, Triad, fan_area_vectors};
use crate::mesh::Mesh;
use crate::mesh::faces::group_faces;

impl ContactFrame {
    /// One cell per face of the physical group `group` of the mesh of body `side`, in the group's order.
    ///
    /// A cell is the outline of a face. Its area and centre are computed in the projection along its mean normal. A
    /// curved edge of order 2 becomes two straight edges through its middle node. The cell normal is the outward normal
    /// of the face on body 1, and the opposite direction on body 2. The local x follows the direction `azimuth`
    /// (radians from global x).
    ///
    /// `center` is the origin of gap shapes and moments in global x, y. The z of this origin is the mean height of the
    /// cells. The frame's own n is vertical until [`ContactFrame::with_normal`] replaces it.
    ///
    /// # Errors
    /// If the group is missing, empty or not made of outer faces, or a face has no area.
    pub fn from_faces(mesh: &Mesh, group: &str, side: Side, center: [f64; 2], azimuth: f64) -> Result<Self> {
        let faces = group_faces(mesh, group).context(|| format!("contact frame of {}", side.name()))?;
        let mut cells = FrameBuilder::default();
        let toward = Point::new(azimuth.cos(), azimuth.sin(), 0.0);
        for face in &faces {
            cells.push(face_polygon(mesh, face, side), toward).ok_or_else(|| {
                Error::input(format!(
                    "element {} ({}) of {} has no area: fix the mesh there",
                    face.tag,
                    face.kind.name(),
                    mesh.source
                ))
            })?;
        }
        Ok(cells.frame(center, azimuth))
    }

    /// Replaces the frame's own direction n (towards body 2). The axis x is the direction of the azimuth, projected onto the plane
    /// normal to n. The cells keep their own axes.
    pub fn with_normal(mut self, normal: Point) -> Self {
        let toward = Point::new(self.azimuth.cos(), self.azimuth.sin(), 0.0);
        self.axes = Triad::from_normal(normal, toward);
        self
    }

    /// Retains the cells for which `kept` holds. The result is no grid.
    pub fn retain_cells(mut self, kept: &[bool]) -> Self {
        if self.polygons.is_none() {
            self.polygons = Some(self.all_corners().map(Cow::into_owned).collect());
        }
        (self.grid, self.grid_indices) = (None, None);
        self.select(kept)
    }

    /// Retains the cells for which `kept` holds; `grid` and `grid_indices` stay unchanged.
    pub(super) fn select(mut self, kept: &[bool]) -> Self {
        fn only<T>(values: &mut Vec<T>, kept: &[bool]) {
            let mut flags = kept.iter();
            values.retain(|_| flags.next().is_some_and(|&keep| keep));
        }
        let all = self.n_cells();
        only(&mut self.centers, kept);
        only(&mut self.areas, kept);
        self.triads.keep(kept);
        self.polygons.iter_mut().for_each(|polygons| only(polygons, kept));
        self.candidates.iter_mut().for_each(|candidates| only(candidates, kept));
        self.symmetry_planes.iter_mut().for_each(|planes| only(planes, kept));
        self.body_ends.iter_mut().for_each(|ends| only(ends, kept));
        self.n_excluded += all - self.n_cells();
        self
    }
}

#[derive(Default)]
pub(super) struct FrameBuilder {
    centers: Vec<Point>,
    polygons: Vec<Vec<Point>>,
    areas: Vec<f64>,
    triads: Vec<Triad>,
    planes: Vec<[bool; 3]>,
}

impl FrameBuilder {
    /// Adds the cell with `corners`, counter-clockwise seen against its normal. The local x of the cell follows
    /// `toward`. `None` for a cell without area.
    pub(super) fn push(&mut self, corners: Vec<Point>, toward: Point) -> Option<()> {
        self.push_part(corners, false, [false; 3], toward)
    }

    /// Adds a cell that symmetry planes may cut, by the `corners` of its part in the model ([`reflect_cell`]). The axes and the
    /// centre refer to the whole cell, the area refers to the part.
    pub(super) fn push_part(
        &mut self,
        corners: Vec<Point>,
        open: bool,
        planes: [bool; 3],
        toward: Point,
    ) -> Option<()> {
        let whole = reflect_cell(&corners, open, planes);
        let mut vector_area = vector_area(&whole.corners);
        // The components along the plane normals are only rounding errors.
        (0..3).filter(|&c| whole.planes[c]).for_each(|c| vector_area[c] = 0.0);
        let size = whole.corners.iter().map(|x| (x - corners[0]).norm_squared()).fold(0.0, f64::max);
        if vector_area.norm() <= 1e-12 * size {
            return None;
        }
        let triad = Triad::from_normal(vector_area, toward);
        let mean = whole.corners.iter().sum::<Point>() / whole.corners.len() as f64;
        let plane: Vec<[f64; 2]> = whole
            .corners
            .iter()
            .map(|x| {
                let local = triad.to_local(&(x - mean));
                [local.x, local.y]
            })
            .collect();
        let (area, [x, y]) = area_and_centroid(&plane);
        let mut center = mean + triad.to_global(&Point::new(x, y, 0.0));
        (0..3).filter(|&c| whole.planes[c]).for_each(|c| center[c] = corners[0][c]);
        self.centers.push(center);
        self.polygons.push(corners);
        self.areas.push(area / whole.images);
        self.triads.push(triad);
        self.planes.push(whole.planes);
        Some(())
    }

    pub(super) fn frame(self, center: [f64; 2], azimuth: f64) -> ContactFrame {
        let total: f64 = self.areas.iter().sum();
        let on_planes = self.planes.iter().any(|planes| planes.contains(&true));
        let height: f64 = self.areas.iter().zip(&self.centers).map(|(area, x)| area * x.z).sum();
        ContactFrame {
            centers: self.centers,
            polygons: Some(self.polygons),
            areas: self.areas,
            triads: PerCell::Each(self.triads),
            origin: Point::new(center[0], center[1], height / total),
            azimuth,
            axes: Triad::horizontal(azimuth),
            grid: None,
            grid_indices: None,
            n_excluded: 0,
            symmetry_bounds: [false; 3],
            body_ends: None,
            candidates: None,
            symmetry_planes: on_planes.then_some(self.planes),
        }
    }
}

pub(super) fn vector_area(corners: &[Point]) -> Point {
    fan_area_vectors(corners.len(), |i| corners[i]).sum()
}
