//! Displacement and displacement gradient on the surface of a body.
//!
//! The element polynomials give the tangential derivatives G. For elements with one node, G is fitted to the
//! neighbours. The normal derivative a follows from the traction t and the unit normal n: a = T⁻¹ (t - (C : G) n) with
//! T_ik = C_ijkl n_j n_l.
//!
//! # Source
//! Brebbia, Telles and Wrobel (1984), Boundary Element Techniques, section 6.9.

use std::collections::HashMap;

use nalgebra::{Matrix2, Matrix3};

use super::body_force::inverse_acoustic_tensor;
use super::elements::BoundaryElements;
use super::interpolation::Interpolation;
use super::panel::Panel;
use super::system::SurfaceState;
use crate::geometry::Point;

/// Smallest cosine of the angle between the normals of neighbours with a smooth connection (45 degrees).
const MIN_SMOOTH_COSINE: f64 = 0.707;

/// Singular values below this multiple of the norm are neglected in the fit. They occur if the neighbours lie on a
/// line.
const ON_A_LINE: f64 = 1e-9;

/// Displacement and traction of a surface between its nodes.
pub struct SurfaceSolution<'a> {
    elements: &'a BoundaryElements,
    state: &'a SurfaceState,
    /// Surface gradients of elements with one node; empty otherwise.
    slopes: Vec<Matrix3<f64>>,
}

impl BoundaryElements {
    /// Interpolation of `state` between the nodes.
    pub fn surface_solution<'a>(&'a self, state: &'a SurfaceState) -> SurfaceSolution<'a> {
        let constant = self.interpolation() == Interpolation::Constant;
        SurfaceSolution {
            elements: self,
            state,
            slopes: if constant { self.fit_constant_gradients(state) } else { Vec::new() },
        }
    }

    /// Surface gradients of elements with one node, from linear functions that are fitted to the neighbours.
    fn fit_constant_gradients(&self, state: &SurfaceState) -> Vec<Matrix3<f64>> {
        let corners = |panel: &Panel| -> Vec<[u64; 3]> {
            let bits = |xi: &[f64; 2]| <[f64; 3]>::from(panel.position(*xi)).map(|x| (x + 0.0).to_bits());
            panel.corners().iter().map(bits).collect()
        };
        let mut around: HashMap<[u64; 3], Vec<usize>> = HashMap::new();
        for i in 0..self.n_elements() {
            corners(self.panel(i)).into_iter().for_each(|corner| around.entry(corner).or_default().push(i));
        }
        let (positions, normals) = (self.positions(), self.normals());
        let u = |i: usize| Point::from(state.displacement[i]);
        let of_element = |i: usize| {
            let mut others: Vec<usize> =
                corners(self.panel(i)).iter().flat_map(|corner| around[corner].iter().copied()).collect();
            others.sort_unstable();
            others.dedup();
            others.retain(|&j| j != i && normals[j].dot(&normals[i]) > MIN_SMOOTH_COSINE);
            let a = normals[i].cross(&Point::ith(normals[i].iamin(), 1.0)).normalize();
            let plane = nalgebra::Matrix3x2::from_columns(&[a, normals[i].cross(&a)]);
            let (mut squares, mut changes) = (Matrix2::zeros(), nalgebra::Matrix3x2::zeros());
            for j in others {
                let x = plane.transpose() * (positions[j] - positions[i]);
                squares += x * x.transpose();
                changes += (u(j) - u(i)) * x.transpose();
            }
            let inverse = squares.pseudo_inverse(ON_A_LINE * squares.norm()).unwrap_or_default();
            changes * inverse * plane.transpose()
        };
        (0..self.n_elements()).map(of_element).collect()
    }
}

impl SurfaceSolution<'_> {
    /// Interpolates nodal values at `xi` of element `i`.
    pub fn interpolate(&self, values: &[[f64; 3]], i: usize, xi: [f64; 2]) -> Point {
        let nodes = self.elements.nodes_of(i);
        nodes
            .zip(self.elements.reference_nodes_of(i).values(xi))
            .map(|(node, n)| Point::from(values[node]) * n)
            .sum()
    }

    /// Displacement at `xi` of element `i`, mm.
    pub fn displacement(&self, i: usize, xi: [f64; 2]) -> Point {
        self.interpolate(&self.state.displacement, i, xi)
    }

    /// Traction on the body at `xi` of element `i`, MPa.
    pub fn traction(&self, i: usize, xi: [f64; 2]) -> Point {
        self.interpolate(&self.state.traction, i, xi)
    }

    /// Surface gradient of the displacement at `xi` of element `i`. Rows are components, columns are directions. The
    /// derivative along the normal is set to zero.
    pub fn surface_gradient(&self, i: usize, xi: [f64; 2]) -> Matrix3<f64> {
        if let Some(slope) = self.slopes.get(i) {
            return *slope;
        }
        let [a, b] = self.elements.panel(i).tangents(xi);
        let area = a.cross(&b);
        let gradients = self.elements.reference_nodes_of(i).gradients(xi);
        let change = |d: usize| -> Point {
            let nodes = self.elements.nodes_of(i).zip(&gradients);
            nodes.map(|(node, g)| Point::from(self.state.displacement[node]) * g[d]).sum()
        };
        // Dual tangents: g^1 = g_2 x n / |g_1 x g_2|, g^2 = n x g_1 / |g_1 x g_2|.
        let dual = [b.cross(&area), area.cross(&a)].map(|x| x / area.norm_squared());
        change(0) * dual[0].transpose() + change(1) * dual[1].transpose()
    }

    /// Displacement gradient at `xi` of element `i`. The normal derivative follows from the traction.
    pub fn gradient(&self, i: usize, xi: [f64; 2]) -> Matrix3<f64> {
        let stiffness = self.elements.stiffness();
        let n = self.elements.panel(i).area_vector(xi).normalize();
        let inner = self.surface_gradient(i, xi);
        let rest = self.traction(i, xi) - stiffness.stress(&inner) * n;
        inner + inverse_acoustic_tensor(stiffness, &n) * rest * n.transpose()
    }

    /// Stress at `xi` of element `i`, MPa.
    pub fn stress(&self, i: usize, xi: [f64; 2]) -> Matrix3<f64> {
        self.elements.stiffness().stress(&self.gradient(i, xi))
    }
}
