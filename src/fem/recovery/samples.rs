//! Stress samples in the elements: at superconvergent points, and at the points of energy integrals.

use std::collections::BTreeMap;

use nalgebra::Vector6;

use super::evaluate_element;
use super::patch::PolynomialSpace;
use crate::element::ElementKind;
use crate::error::Result;
use crate::fem::assembly::ElementContext;
use crate::fem::element_kernels::stresses_at;
use crate::fem::integration_points::PointStress;
use crate::fem::thermal::ThermoelasticState;
use crate::quadrature::{RulePoint, hexahedron, pyramid, tetrahedron, wedge};

#[derive(Debug, Clone)]
pub(super) struct StressSample {
    pub position: [f64; 3],
    /// Volume that the sample represents, mm3.
    pub volume: f64,
    pub stress: Vector6<f64>,
}

/// Integration rules by element kind, where they differ from the stiffness rules.
#[derive(Debug, Clone)]
pub(super) struct RecoveryRules {
    superconvergent: BTreeMap<ElementKind, Vec<RulePoint<3>>>,
    energy: BTreeMap<ElementKind, Vec<RulePoint<3>>>,
}

impl RecoveryRules {
    pub fn new() -> Self {
        // Points of second-order elements are their Barlow points. Wedges and pyramids use the rules whose points are
        // closest to Barlow points.
        let superconvergent = [
            (ElementKind::Hex20, hexahedron(2)),
            (ElementKind::Hex27, hexahedron(2)),
            (ElementKind::Tet10, tetrahedron(2)),
            (ElementKind::Wedge15, wedge(2, 2)),
            (ElementKind::Wedge18, wedge(2, 2)),
            (ElementKind::Pyramid13, pyramid(2)),
            (ElementKind::Pyramid14, pyramid(2)),
        ];
        // These rules are exact for the square of a polynomial of the element's degree. The stiffness rules of tetrahedra have too
        // few points.
        let energy = [(ElementKind::Tet4, tetrahedron(2)), (ElementKind::Tet10, tetrahedron(4))];
        Self { superconvergent: superconvergent.into(), energy: energy.into() }
    }
}

/// Polynomial space of the recovered stress, with the degree of the displacement interpolation.
pub(super) fn recovery_space(kind: ElementKind) -> PolynomialSpace {
    match (kind.n_nodes() > kind.n_corners(), kind.n_corners()) {
        (false, _) => PolynomialSpace::Linear,
        (true, 8) => PolynomialSpace::Triquadratic,
        (true, _) => PolynomialSpace::Quadratic,
    }
}

/// Stress of element `i` at the points of `rule`; `None` stands for the stiffness rule.
fn point_stresses(
    elements: ElementContext,
    i: usize,
    state: ThermoelasticState,
    rule: Option<&Vec<RulePoint<3>>>,
) -> Result<Vec<PointStress>> {
    let mut stresses = match rule {
        None => evaluate_element(elements, i, state.displacement)?.points,
        Some(rule) => stresses_at_rule(elements, i, state.displacement, rule)?,
    };
    let thermal = state.thermal_stress(elements, i);
    stresses.iter_mut().for_each(|point| point.stress -= thermal);
    Ok(stresses)
}

fn stresses_at_rule(
    elements: ElementContext,
    i: usize,
    u: &[[f64; 3]],
    rule: &[RulePoint<3>],
) -> Result<Vec<PointStress>> {
    let cell = elements.regions.cells[i];
    let nodal: Vec<[f64; 3]> = elements.mesh.cell_nodes(cell).iter().map(|&node| u[node]).collect();
    let (kind, points) = (elements.mesh.kind(cell), elements.node_coordinates(cell));
    stresses_at(kind, &points, &nodal, &elements.regions.stiffness(i), rule)
        .map_err(|unsound| elements.defect_error(cell, unsound))
}

fn samples_at(
    elements: ElementContext,
    i: usize,
    state: ThermoelasticState,
    rule: Option<&Vec<RulePoint<3>>>,
) -> Result<Vec<StressSample>> {
    let nodes = elements.mesh.cell_nodes(elements.regions.cells[i]);
    let points = &elements.mesh.points;
    let sample = |point: PointStress| {
        let coordinate =
            |c: usize| nodes.iter().zip(&point.values).map(|(&node, value)| points[node][c] * value).sum();
        StressSample { position: [0, 1, 2].map(coordinate), volume: point.volume, stress: point.stress }
    };
    Ok(point_stresses(elements, i, state, rule)?.into_iter().map(sample).collect())
}

pub(super) fn integration_point_samples(
    elements: ElementContext,
    i: usize,
    state: ThermoelasticState,
) -> Result<Vec<StressSample>> {
    samples_at(elements, i, state, None)
}

/// Stress of element `i` at its superconvergent points; for linear elements the mean stress at the centre.
pub(super) fn superconvergent_samples(
    elements: ElementContext,
    i: usize,
    state: ThermoelasticState,
    rules: &RecoveryRules,
) -> Result<Vec<StressSample>> {
    let rule = rules.superconvergent.get(&elements.mesh.kind(elements.regions.cells[i]));
    let points = samples_at(elements, i, state, rule)?;
    if rule.is_some() {
        return Ok(points);
    }
    let volume: f64 = points.iter().map(|point| point.volume).sum();
    let mut mean = StressSample { position: [0.0; 3], volume, stress: Vector6::zeros() };
    for point in points {
        let share = point.volume / volume;
        mean.stress += point.stress * share;
        (0..3).for_each(|c| mean.position[c] += share * point.position[c]);
    }
    Ok(vec![mean])
}

/// Stress of element `i` at the points for integrating the squared difference between recovered and element stress.
pub(super) fn energy_points(
    elements: ElementContext,
    i: usize,
    state: ThermoelasticState,
    rules: &RecoveryRules,
) -> Result<Vec<PointStress>> {
    point_stresses(elements, i, state, rules.energy.get(&elements.mesh.kind(elements.regions.cells[i])))
}
