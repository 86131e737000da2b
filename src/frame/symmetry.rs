//! Cells on symmetry planes. The model contains half of the whole cell, or a quarter at two planes.

use std::collections::HashMap;

use nalgebra::Matrix3;

use super::ContactFrame;
use crate::geometry::Point;

/// Mesh nodes on symmetry planes. The flags state whether the node lies on a plane normal to global x, y, z.
pub type SymmetryNodes = HashMap<usize, [bool; 3]>;

/// Maximum distance of a cell's corner from a plane on which it lies, relative to the size of the cell.
const PLANE_TOLERANCE: f64 = 1e-6;

/// Length of the tangential component of a symmetry plane's normal in a cell, up to which the plane gives no projector.
const MIN_TANGENT_COMPONENT: f64 = 1e-6;

/// Absolute value below which a component of a unit vector counts as a rounding error.
const ZERO_COMPONENT: f64 = 1e-12;

impl ContactFrame {
    /// Cells on symmetry planes, ascending, with the projector P onto the local vectors (x, y, n) that are parallel to
    /// these planes.
    ///
    /// P = 1 - m m^T, where m is the normalised tangential component of the plane's normal in the cell. Where two
    /// planes meet, P keeps only n. In the directions that P removes, the traction and the relative tangential
    /// displacement vanish.
    pub fn symmetry_projectors(&self) -> Vec<(usize, Matrix3<f64>)> {
        let Some(planes) = &self.symmetry_planes else { return Vec::new() };
        planes
            .iter()
            .enumerate()
            .filter_map(|(cell, &planes)| Some((cell, self.projector(cell, planes)?)))
            .collect()
    }

    fn projector(&self, cell: usize, planes: [bool; 3]) -> Option<Matrix3<f64>> {
        let tangent = |c: usize| {
            let mut m = self.triads[cell].to_local(&Point::ith(c, 1.0));
            m.z = 0.0;
            // Removing rounding errors makes P diagonal if m lies along a local axis. The component along this axis then vanishes
            // exactly.
            let m = m
                .try_normalize(MIN_TANGENT_COMPONENT)?
                .map(|x| if x.abs() < ZERO_COMPONENT { 0.0 } else { x });
            Some(m.normalize())
        };
        let tangents: Vec<Point> = (0..3).filter(|&c| planes[c]).filter_map(tangent).collect();
        match tangents[..] {
            [] => None,
            [m] => Some(Matrix3::identity() - m * m.transpose()),
            _ => Some(Matrix3::from_diagonal(&Point::z())),
        }
    }

    /// Orthonormal normals of the symmetry planes on which cells lie or at which the frame ends, in the frame's axes (x, y, n).
    pub fn symmetry_normals(&self) -> Vec<Point> {
        let on = |c: usize| {
            self.symmetry_bounds[c] || self.symmetry_planes.iter().flatten().any(|planes| planes[c])
        };
        (0..3).filter(|&c| on(c)).map(|c| self.axes.to_local(&Point::ith(c, 1.0))).collect()
    }
}

pub(super) struct ReflectedCell {
    pub corners: Vec<Point>,
    pub images: f64,
    /// Whether a plane normal to global x, y, z reflects the cell.
    pub planes: [bool; 3],
}

/// Completes a cell by reflection at symmetry planes, from the `corners` of its part in the model. `open` means that
/// the part is at the border of the faces, so that its first corner is the node. A plane counts only if it contains an
/// edge of the part at the node.
pub(super) fn reflect_cell(corners: &[Point], open: bool, planes: [bool; 3]) -> ReflectedCell {
    let mut whole = ReflectedCell { corners: corners.to_vec(), images: 1.0, planes: [false; 3] };
    if !open {
        return whole;
    }
    let node = corners[0];
    // Midpoints of edges and faces. The fan closes around the node when a reflection joins both of its ends.
    let (mut fan, mut closed) = (corners[1..].to_vec(), false);
    for c in (0..3).filter(|&c| planes[c]) {
        let size = corners.iter().map(|x| (x - node).norm()).fold(0.0, f64::max);
        let on = |x: &Point| (x[c] - node[c]).abs() <= PLANE_TOLERANCE * size;
        let image = |x: &Point| {
            let mut image = *x;
            image[c] = 2.0 * node[c] - x[c];
            image
        };
        let (Some(first), Some(last)) = (fan.first().map(on), fan.last().map(on)) else { continue };
        if closed || !(first || last) || fan.iter().all(on) {
            continue;
        }
        let images: Vec<Point> = fan.iter().rev().map(image).collect();
        let inner = images.len() - 1;
        fan = match (first, last) {
            (true, true) => [&fan[..], &images[1..inner]].concat(),
            (true, false) => [&images[..inner], &fan[..]].concat(),
            _ => [&fan[..], &images[1..]].concat(),
        };
        closed = first && last;
        whole.images *= 2.0;
        whole.planes[c] = true;
    }
    whole.corners = if closed { fan } else { [&[node], &fan[..]].concat() };
    whole
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::frame::faces::vector_area;

    /// Truth: a quarter at two planes, or a half at one plane, is reflected to the square of side 2 around the origin. A quarter at
    /// one plane gives half of the square. A plane that contains the whole part, or only its node, does not reflect it.
    #[test]
    fn parts_of_a_square_make_it_whole() {
        let point = |x: f64, y: f64| Point::new(x, y, 0.0);
        let quarter = [point(0.0, 0.0), point(1.0, 0.0), point(1.0, 1.0), point(0.0, 1.0)];
        let half = [
            point(0.0, 0.0),
            point(1.0, 0.0),
            point(1.0, 1.0),
            point(0.0, 1.0),
            point(-1.0, 1.0),
            point(-1.0, 0.0),
        ];
        let cases = [
            (&quarter[..], [true, true, false], 4.0, 4.0, 8),
            (&half[..], [false, true, false], 2.0, 4.0, 8),
            (&quarter[..], [false, true, false], 2.0, 2.0, 6),
            (&quarter[..], [true, false, false], 2.0, 2.0, 6),
        ];
        for (part, planes, images, area, corners) in cases {
            let whole = reflect_cell(part, true, planes);
            assert_eq!((whole.images, whole.planes), (images, planes));
            assert_eq!(whole.corners.len(), corners);
            assert_eq!(vector_area(&whole.corners), point(0.0, 0.0) + Point::z() * area);
        }
        assert_eq!(
            reflect_cell(&quarter, true, [false, false, true]).images,
            1.0,
            "the part itself lies in the plane"
        );
        let point_only = [point(0.0, 0.0), point(1.0, 0.5), point(1.0, 1.0), point(0.5, 1.0)];
        assert_eq!(reflect_cell(&point_only, true, [true, true, false]).images, 1.0);
    }
}
