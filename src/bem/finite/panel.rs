//! Geometry of surface elements.

use super::interpolation::Interpolation;
use crate::element::ElementKind;
use crate::geometry::Point;

/// Surface element. The order of its nodes gives the outward normal.
#[derive(Debug, Clone, PartialEq)]
pub struct Panel {
    /// Element kind: triangle or quadrilateral.
    pub kind: ElementKind,
    /// Nodes in the order of gmsh, mm.
    pub nodes: Vec<Point>,
}

impl Panel {
    /// Whether the element is a triangle.
    pub fn is_triangle(&self) -> bool {
        self.kind.n_corners() == 3
    }

    /// Point at `xi` of the reference element, mm.
    pub fn position(&self, xi: [f64; 2]) -> Point {
        self.nodes.iter().zip(self.kind.face_values(xi)).map(|(node, value)| node * value).sum()
    }

    /// Derivatives of the position along the directions of the reference element.
    pub fn tangents(&self, xi: [f64; 2]) -> [Point; 2] {
        let gradients = self.kind.face_gradients(xi);
        [0, 1].map(|axis| self.nodes.iter().zip(&gradients).map(|(node, g)| node * g[axis]).sum())
    }

    /// Outward normal times the Jacobian (area per area of the reference element).
    pub fn area_vector(&self, xi: [f64; 2]) -> Point {
        let [a, b] = self.tangents(xi);
        a.cross(&b)
    }

    /// Element for the `interpolation`: six nodes (triangle) or nine nodes (quadrilateral) if quadratic, otherwise the
    /// unchanged element.
    pub fn with_second_order_nodes(self, interpolation: Interpolation) -> Self {
        let kind = if self.is_triangle() { ElementKind::Tri6 } else { ElementKind::Quad9 };
        if interpolation != Interpolation::Quadratic || self.kind == kind {
            return self;
        }
        let nodes = kind.face_reference_nodes().iter().map(|xi| self.position(*xi)).collect();
        Self { kind, nodes }
    }

    pub(super) fn corners(&self) -> &'static [[f64; 2]] {
        &self.kind.face_reference_nodes()[..self.kind.n_corners()]
    }

    pub(super) fn is_affine(&self) -> bool {
        let first = self.tangents(self.corners()[0]);
        let size = first[0].norm().max(first[1].norm());
        let same = |xi: &[f64; 2]| {
            let other = self.tangents(*xi);
            (0..2).all(|axis| (first[axis] - other[axis]).norm() <= 1e-9 * size)
        };
        self.kind.face_reference_nodes().iter().all(same)
    }
}
