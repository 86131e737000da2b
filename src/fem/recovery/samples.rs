//! Stress inside the elements: at the points where it is most accurate, and at those of an integral of its square.

use nalgebra::Vector6;

use crate::element::{ElementKind, ShapeFunctions, Tet4};
use crate::error::Result;
use crate::fem::assembly::Elements;
use crate::fem::element::{PointState, state};
use crate::quadrature::tetrahedron;

/// Stress at a point of an element.
#[derive(Debug, Clone)]
pub(super) struct Sample {
    pub position: [f64; 3],
    /// Its share of the volume.
    pub volume: f64,
    pub stress: Vector6<f64>,
}

/// A point of the integral of a square over an element.
pub(super) struct EnergyPoint {
    /// Shape functions there, `[n_nodes]`.
    pub values: Vec<f64>,
    pub volume: f64,
    pub stress: Vector6<f64>,
}

/// Degree of the polynomials that an element's stress is recovered with: that of its displacement.
pub(super) fn degree(kind: ElementKind) -> usize {
    if kind.n_nodes() == kind.n_corners() { 1 } else { 2 }
}

fn point_states(elements: Elements, i: usize, u: &[[f64; 3]]) -> Result<Vec<PointState>> {
    let cell = elements.regions.cells[i];
    let nodal: Vec<[f64; 3]> = elements.mesh.cell_nodes(cell).iter().map(|&node| u[node]).collect();
    let (kind, points) = (elements.mesh.kind(cell), elements.points(cell));
    state(kind, &points, &nodal, &elements.material(i), elements.formulation, elements.rules)
        .map(|state| state.points)
        .map_err(|inverted| elements.inverted(cell, inverted))
}

fn position(elements: Elements, i: usize, values: &[f64]) -> [f64; 3] {
    let nodes = elements.mesh.cell_nodes(elements.regions.cells[i]);
    let points = &elements.mesh.points;
    std::array::from_fn(|c| nodes.iter().zip(values).map(|(&node, value)| points[node][c] * value).sum())
}

/// Stress of element `i` at its integration points.
pub(super) fn at_integration_points(elements: Elements, i: usize, u: &[[f64; 3]]) -> Result<Vec<Sample>> {
    let sample = |point: PointState| Sample {
        position: position(elements, i, &point.values),
        volume: point.volume,
        stress: point.stress,
    };
    Ok(point_states(elements, i, u)?.into_iter().map(sample).collect())
}

/// Stress of element `i` where it is one order more accurate than elsewhere: the mean, at the centre, of a linear
/// element.
pub(super) fn superconvergent(elements: Elements, i: usize, u: &[[f64; 3]]) -> Result<Vec<Sample>> {
    let points = at_integration_points(elements, i, u)?;
    let volume: f64 = points.iter().map(|point| point.volume).sum();
    let mut mean = Sample { position: [0.0; 3], volume, stress: Vector6::zeros() };
    for point in points {
        let share = point.volume / volume;
        mean.stress += point.stress * share;
        (0..3).for_each(|c| mean.position[c] += share * point.position[c]);
    }
    Ok(vec![mean])
}

/// Points of a rule that integrates the square of the difference of a recovered and the element's own stress.
pub(super) fn energy_points(elements: Elements, i: usize, u: &[[f64; 3]]) -> Result<Vec<EnergyPoint>> {
    let states = point_states(elements, i, u)?;
    let energy_point = |p: PointState| EnergyPoint { values: p.values, volume: p.volume, stress: p.stress };
    if elements.mesh.kind(elements.regions.cells[i]) != ElementKind::Tet4 {
        return Ok(states.into_iter().map(energy_point).collect());
    }
    // Constant stress, linear recovered one: the square needs degree 2.
    let (volume, stress) = (states[0].volume, states[0].stress);
    let point = |(xi, weight): ([f64; 3], f64)| EnergyPoint {
        values: Tet4::values(xi).to_vec(),
        volume: 6.0 * weight * volume,
        stress,
    };
    Ok(tetrahedron(2).into_iter().map(point).collect())
}
