//! Boundary elements of the surface of a body, with their nodes.

use std::ops::Range;

use nalgebra::Matrix3;
use rayon::prelude::*;

use super::influence::{ElementView, Influence, InfluenceIntegrator, NodalState, PreparedElement};
use super::interpolation::{ElementNodes, Interpolation};
use super::panel::Panel;
use crate::bem::DisplacementGradient;
use crate::bem::full_space::FullSpaceField;
use crate::geometry::Point;
use crate::geometry::ball_tree::{Ball, BallTree};
use crate::material::Stiffness;

/// Distance from the point `from` along the unit vector `along` to a convex polygon; `None` if the ray misses the
/// polygon.
fn depth(from: &Point, along: &Point, corners: &[Point]) -> Option<f64> {
    (1..corners.len() - 1).find_map(|k| {
        let (u, v) = (corners[k] - corners[0], corners[k + 1] - corners[0]);
        let normal = u.cross(&v);
        let distance = normal.dot(&(corners[0] - from)) / normal.dot(along);
        let x = from + along * distance - corners[0];
        let square = normal.norm_squared();
        let [s, t] = [x.cross(&v).dot(&normal) / square, u.cross(&x).dot(&normal) / square];
        (distance > 0.0 && s >= 0.0 && t >= 0.0 && s + t <= 1.0).then_some(distance)
    })
}

/// Elements of a surface with the kernels of the material.
#[derive(Debug)]
pub struct BoundaryElements {
    kernels: InfluenceIntegrator,
    interpolation: Interpolation,
    prepared: Vec<PreparedElement>,
    /// Reference nodes of triangles and of quadrilaterals.
    nodes: [ElementNodes; 2],
    /// First node of each element; the last entry is the number of nodes.
    first: Vec<usize>,
}

impl BoundaryElements {
    /// Elements with the point-force `field` of the material. The integrals have an error of about `accuracy`, relative to their
    /// largest values.
    pub fn new(
        panels: Vec<Panel>,
        interpolation: Interpolation,
        stiffness: &Stiffness,
        field: FullSpaceField,
        accuracy: f64,
    ) -> Self {
        let kernels = InfluenceIntegrator::new(stiffness.clone(), field, accuracy);
        let nodes = [true, false].map(|triangle| ElementNodes::new(interpolation, triangle));
        let mut first = vec![0];
        for panel in &panels {
            let last = first[first.len() - 1];
            first.push(last + interpolation.n_nodes(panel.is_triangle()));
        }
        let ready = panels.into_par_iter().map(|panel| {
            let nodes = &nodes[usize::from(!panel.is_triangle())];
            PreparedElement::new(
                &kernels,
                panel.with_second_order_nodes(interpolation),
                nodes,
                interpolation.degree(),
            )
        });
        let prepared = ready.collect();
        Self { kernels, interpolation, prepared, nodes, first }
    }

    /// Interpolation of displacement and traction over an element.
    pub fn interpolation(&self) -> Interpolation {
        self.interpolation
    }

    /// Stiffness of the material.
    pub fn stiffness(&self) -> &Stiffness {
        &self.kernels.stiffness
    }

    /// Number of elements.
    pub fn n_elements(&self) -> usize {
        self.prepared.len()
    }

    /// Geometry of element `i`.
    pub fn panel(&self, i: usize) -> &Panel {
        &self.prepared[i].panel
    }

    /// Number of nodes.
    pub fn n_nodes(&self) -> usize {
        self.first[self.prepared.len()]
    }

    /// Numbers of the nodes of element `i`.
    pub fn nodes_of(&self, i: usize) -> Range<usize> {
        self.first[i]..self.first[i + 1]
    }

    /// Nodes of element `i` in its reference element.
    pub fn reference_nodes_of(&self, i: usize) -> &ElementNodes {
        &self.nodes[usize::from(!self.panel(i).is_triangle())]
    }

    fn each_node<T>(&self, of: impl Fn(&Panel, usize, &ElementNodes) -> T) -> Vec<T> {
        let mut all = Vec::with_capacity(self.n_nodes());
        for i in 0..self.n_elements() {
            let nodes = self.reference_nodes_of(i);
            all.extend((0..nodes.reference_points().len()).map(|node| of(self.panel(i), node, nodes)));
        }
        all
    }

    /// Positions of the nodes, mm.
    pub fn positions(&self) -> Vec<Point> {
        self.each_node(|panel, node, nodes| panel.position(nodes.reference_points()[node]))
    }

    /// Outward unit normals at the nodes.
    pub fn normals(&self) -> Vec<Point> {
        self.each_node(|panel, node, nodes| panel.area_vector(nodes.reference_points()[node]).normalize())
    }

    /// Nodal areas ∫ N_a dS by the quadrature rule of the nodes, mm².
    pub fn areas(&self) -> Vec<f64> {
        self.each_node(|panel, node, nodes| {
            nodes.weights()[node] * panel.area_vector(nodes.reference_points()[node]).norm()
        })
    }

    /// Element with the largest ratio of node spacing to body thickness, and this ratio. The thickness is the distance
    /// along the inward ray from the element's centre to the nearest element without common corners. `None` if no ray
    /// meets such an element.
    pub fn max_spacing_to_thickness(&self) -> Option<(usize, f64)> {
        let corners = |panel: &Panel| -> Vec<Point> {
            let places = &panel.kind.face_reference_nodes()[..panel.kind.n_corners()];
            places.iter().map(|xi| panel.position(*xi)).collect()
        };
        let all: Vec<Vec<Point>> = self.prepared.iter().map(|ready| corners(&ready.panel)).collect();
        let tree = BallTree::new(all.iter().map(|corners| Ball::around(corners)).collect());
        let of_element = |i: usize| {
            let panel = self.panel(i);
            let middle = if panel.is_triangle() { [1.0 / 3.0; 2] } else { [0.0; 2] };
            let (from, area) = (panel.position(middle), panel.area_vector(middle));
            let inward = -area.normalize();
            // Elements that share a corner with this element, such as at a sharp edge, do not limit the thickness.
            let joined = |corners: &[Point]| corners.iter().any(|corner| all[i].contains(corner));
            let mut passed = Vec::new();
            tree.query(&from, &inward, 0.0, &mut passed);
            let hits = passed.into_iter().map(|other| &all[other]);
            let hits = hits.filter_map(|corners| depth(&from, &inward, corners).filter(|_| !joined(corners)));
            let thickness = hits.fold(f64::INFINITY, f64::min);
            let size = area.norm() * if panel.is_triangle() { 0.5 } else { 4.0 };
            let spacing = (size / self.nodes_of(i).len() as f64).sqrt();
            (i, spacing / thickness)
        };
        let ratios: Vec<(usize, f64)> = (0..self.n_elements()).into_par_iter().map(of_element).collect();
        ratios.into_iter().filter(|(_, ratio)| *ratio > 0.0).max_by(|a, b| a.1.total_cmp(&b.1))
    }

    fn element(&self, i: usize) -> ElementView<'_> {
        ElementView { prepared: &self.prepared[i], nodes: self.reference_nodes_of(i) }
    }

    /// Influence of element `i` at a point off the element.
    pub fn influence_off_element(&self, i: usize, y: &Point) -> Influence {
        self.kernels.off_element(self.element(i), y)
    }

    /// Principal value of the integral of the traction kernel over the plane element `i`, at its node `node`.
    pub fn principal_value(&self, i: usize, node: usize) -> Matrix3<f64> {
        self.kernels.principal_value(self.element(i), node)
    }

    pub(super) fn add_field(
        &self,
        i: usize,
        y: &Point,
        nodal: &[NodalState],
        sum: &mut DisplacementGradient,
    ) {
        self.kernels.add_field(self.element(i), y, nodal, sum);
    }

    /// Influence of element `i` at its own node `node`. The traction-kernel block of this node is strongly singular and
    /// is set to zero.
    pub fn influence_on_element(&self, i: usize, node: usize) -> Influence {
        self.kernels.on_element(self.element(i), node)
    }
}
