//! Element stiffness, and the stress, strain energy and nodal forces of an element for given nodal displacements.

use nalgebra::{Matrix6, Vector6};

use super::element_rules::{ElementVisitor, RuleSet, SolidElement, visit_element};
use super::enhanced_strain::{EnhancedStrain, map_gauss_points};
use super::integration_points::{
    ElementDefect, ElementState, MappedPoint, PointStress, ReferencePoint, map_point, unit_strain,
};
use super::mean_dilatation::MeanDilatation;
use super::spec::HexFormulation;
use crate::element::{ElementKind, Hex8};
use crate::quadrature::RulePoint;

pub(super) fn packed_len(kind: ElementKind) -> usize {
    let n = 3 * kind.n_nodes();
    n * (n + 1) / 2
}

fn strain<const N: usize>(point: &MappedPoint<N>, u: &[[f64; 3]; N]) -> Vector6<f64> {
    let mut strain = Vector6::zeros();
    for (g, u) in point.gradients.iter().zip(u) {
        for (component, &displacement) in u.iter().enumerate() {
            for (row, value) in unit_strain(g, component) {
                strain[row] += value * displacement;
            }
        }
    }
    strain
}

/// Adds Bᵀ C B of one integration point, times the volume of the point, to the packed lower triangle, row by row. B
/// maps nodal displacements to strain, and C strain to stress.
fn add_stiffness<const N: usize>(point: &MappedPoint<N>, c: &Matrix6<f64>, packed: &mut [f64]) {
    // C B times the volume: three columns of six entries for each node.
    let stress: [[[f64; 6]; 3]; N] = point.gradients.map(|g| {
        std::array::from_fn(|component| {
            let mut column = [0.0; 6];
            for (row, value) in unit_strain(&g, component) {
                for (i, sum) in column.iter_mut().enumerate() {
                    *sum += c[(i, row)] * (value * point.volume);
                }
            }
            column
        })
    });
    let mut k = 0;
    for (a, g) in point.gradients.iter().enumerate() {
        for component in 0..3 {
            let row = unit_strain(g, component);
            for column in stress.iter().flatten().take(3 * a + component + 1) {
                packed[k] +=
                    row[0].1 * column[row[0].0] + row[1].1 * column[row[1].0] + row[2].1 * column[row[2].0];
                k += 1;
            }
        }
    }
}

/// Computes the stiffness of an element as a packed lower triangle, row by row. Does not allocate.
pub(super) fn element_stiffness(
    kind: ElementKind,
    nodes: &[[f64; 3]],
    c: &Matrix6<f64>,
    formulation: HexFormulation,
    rules: &RuleSet,
    packed: &mut [f64],
) -> Result<(), ElementDefect> {
    packed.fill(0.0);
    if kind == ElementKind::Hex8 && formulation != HexFormulation::Standard {
        return mixed_stiffness(nodes, c, formulation, rules, packed);
    }
    visit_element(kind, StiffnessKernel { nodes, c, rules, packed })
}

/// Computes ∫ Bᵀ C B dV. B maps nodal displacements to the strain of the displacement interpolation, and C strain to
/// stress.
struct StiffnessKernel<'a> {
    nodes: &'a [[f64; 3]],
    c: &'a Matrix6<f64>,
    rules: &'a RuleSet,
    packed: &'a mut [f64],
}

impl ElementVisitor for StiffnessKernel<'_> {
    type Output = Result<(), ElementDefect>;

    fn visit_element<S: SolidElement<N>, const N: usize>(self) -> Self::Output {
        let nodes = as_node_array::<N>(self.nodes);
        for sample in &S::rules(self.rules).stiffness {
            add_stiffness(&map_point(nodes, sample)?, self.c, self.packed);
        }
        Ok(())
    }
}

fn mixed_stiffness(
    nodes: &[[f64; 3]],
    c: &Matrix6<f64>,
    formulation: HexFormulation,
    rules: &RuleSet,
    packed: &mut [f64],
) -> Result<(), ElementDefect> {
    let (nodes, rule) = (as_node_array::<8>(nodes), &Hex8::rules(rules).stiffness);
    let mapped = map_gauss_points(nodes, rule)?;
    if formulation == HexFormulation::MeanDilatation {
        MeanDilatation::new(&mapped).add_stiffness(&mapped, c, packed);
    } else {
        mapped.iter().for_each(|point| add_stiffness(point, c, packed));
        EnhancedStrain::new(nodes, rule, &mapped, c)?.condense(packed);
    }
    Ok(())
}

fn as_node_array<const N: usize>(values: &[[f64; 3]]) -> &[[f64; 3]; N] {
    values.try_into().expect("as many nodes as the kind has")
}

/// Stress, energy and nodal forces of an element for `strains` at the points of `rule`. The forces are ∫ Bᵀ σ dV, where B maps
/// nodal displacements to the strain of the displacement interpolation.
fn state_of_strains<const N: usize>(
    rule: &[ReferencePoint<N>],
    mapped: &[MappedPoint<N>],
    strains: &[Vector6<f64>],
    c: &Matrix6<f64>,
) -> ElementState {
    let mut state =
        ElementState { points: Vec::with_capacity(mapped.len()), energy: 0.0, forces: vec![[0.0; 3]; N] };
    for ((sample, point), strain) in rule.iter().zip(mapped).zip(strains) {
        let stress = c * strain;
        state.energy += 0.5 * point.volume * stress.dot(strain);
        add_stress_forces(point, &stress, &mut state.forces);
        state.points.push(PointStress { values: sample.values.to_vec(), volume: point.volume, stress });
    }
    state
}

/// Nodal forces ∫ Bᵀ σ dV of a uniform stress in an element, `[n_nodes]`. B maps nodal displacements to the strain of
/// the displacement interpolation. Mean dilatation gives the same forces. Enhanced modes add no forces, because the
/// means of their strains vanish.
pub(super) fn forces_of_uniform_stress(
    kind: ElementKind,
    nodes: &[[f64; 3]],
    stress: &Vector6<f64>,
    rules: &RuleSet,
) -> Result<Vec<[f64; 3]>, ElementDefect> {
    visit_element(kind, UniformStressKernel { nodes, stress, rules })
}

struct UniformStressKernel<'a> {
    nodes: &'a [[f64; 3]],
    stress: &'a Vector6<f64>,
    rules: &'a RuleSet,
}

impl ElementVisitor for UniformStressKernel<'_> {
    type Output = Result<Vec<[f64; 3]>, ElementDefect>;

    fn visit_element<S: SolidElement<N>, const N: usize>(self) -> Self::Output {
        let nodes = as_node_array::<N>(self.nodes);
        let mut forces = vec![[0.0; 3]; N];
        for sample in &S::rules(self.rules).stiffness {
            add_stress_forces(&map_point(nodes, sample)?, self.stress, &mut forces);
        }
        Ok(forces)
    }
}

/// Adds the nodal forces Bᵀ σ of the stress at one point, times its volume.
fn add_stress_forces<const N: usize>(point: &MappedPoint<N>, stress: &Vector6<f64>, forces: &mut [[f64; 3]]) {
    for (force, g) in forces.iter_mut().zip(&point.gradients) {
        for (component, sum) in force.iter_mut().enumerate() {
            *sum +=
                unit_strain(g, component).iter().map(|&(row, v)| v * stress[row]).sum::<f64>() * point.volume;
        }
    }
}

/// Stress, energy and nodal forces of an element for the nodal displacements `u`.
pub(super) fn element_state(
    kind: ElementKind,
    nodes: &[[f64; 3]],
    u: &[[f64; 3]],
    c: &Matrix6<f64>,
    formulation: HexFormulation,
    rules: &RuleSet,
) -> Result<ElementState, ElementDefect> {
    if kind == ElementKind::Hex8 && formulation != HexFormulation::Standard {
        return mixed_state(nodes, u, c, formulation, rules);
    }
    visit_element(kind, StateKernel { nodes, u, c, rules })
}

struct StateKernel<'a> {
    nodes: &'a [[f64; 3]],
    u: &'a [[f64; 3]],
    c: &'a Matrix6<f64>,
    rules: &'a RuleSet,
}

impl ElementVisitor for StateKernel<'_> {
    type Output = Result<ElementState, ElementDefect>;

    fn visit_element<S: SolidElement<N>, const N: usize>(self) -> Self::Output {
        let (nodes, u, rules) =
            (as_node_array::<N>(self.nodes), as_node_array::<N>(self.u), S::rules(self.rules));
        let mapped: Vec<MappedPoint<N>> =
            rules.stiffness.iter().map(|sample| map_point(nodes, sample)).collect::<Result<_, _>>()?;
        let strains: Vec<Vector6<f64>> = mapped.iter().map(|point| strain(point, u)).collect();
        Ok(state_of_strains(&rules.stiffness, &mapped, &strains, self.c))
    }
}

fn mixed_state(
    nodes: &[[f64; 3]],
    u: &[[f64; 3]],
    c: &Matrix6<f64>,
    formulation: HexFormulation,
    rules: &RuleSet,
) -> Result<ElementState, ElementDefect> {
    let (nodes, u, rules) = (as_node_array::<8>(nodes), as_node_array::<8>(u), Hex8::rules(rules));
    let mapped = map_gauss_points(nodes, &rules.stiffness)?;
    let mut strains = mapped.map(|point| strain(&point, u));
    let mean = (formulation == HexFormulation::MeanDilatation).then(|| MeanDilatation::new(&mapped));
    match &mean {
        Some(mean) => mean.correct_strains(u, &mut strains),
        None => {
            let enhanced = EnhancedStrain::new(nodes, &rules.stiffness, &mapped, c)?.strains(u);
            strains.iter_mut().zip(enhanced).for_each(|(sum, part)| *sum += part);
        }
    }
    let mut state = state_of_strains(&rules.stiffness, &mapped, &strains, c);
    if let Some(mean) = mean {
        mean.correct_forces(&mapped, &mut state);
    }
    Ok(state)
}

/// Stress of the displacement interpolation at the points of `rule`. Not valid for hexahedra with enhanced strains or mean
/// dilatation.
pub(super) fn stresses_at(
    kind: ElementKind,
    nodes: &[[f64; 3]],
    u: &[[f64; 3]],
    c: &Matrix6<f64>,
    rule: &[RulePoint<3>],
) -> Result<Vec<PointStress>, ElementDefect> {
    visit_element(kind, StressKernel { nodes, u, c, rule })
}

struct StressKernel<'a> {
    nodes: &'a [[f64; 3]],
    u: &'a [[f64; 3]],
    c: &'a Matrix6<f64>,
    rule: &'a [RulePoint<3>],
}

impl ElementVisitor for StressKernel<'_> {
    type Output = Result<Vec<PointStress>, ElementDefect>;

    fn visit_element<S: SolidElement<N>, const N: usize>(self) -> Self::Output {
        let (nodes, u) = (as_node_array::<N>(self.nodes), as_node_array::<N>(self.u));
        let state = |&(xi, weight): &RulePoint<3>| {
            let (values, gradients) = (S::values(xi), S::gradients(xi));
            let point = map_point(nodes, &ReferencePoint { xi, weight, values, gradients })?;
            let stress = self.c * strain(&point, u);
            Ok(PointStress { values: values.to_vec(), volume: point.volume, stress })
        };
        self.rule.iter().map(state).collect()
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::{DMatrix, SymmetricEigen};

    use super::super::element_rules::ALL;
    use super::*;
    use crate::element::ShapeFunctions;
    use crate::material::{Orthotropic, Stiffness};

    fn unpacked(packed: &[f64], n: usize) -> DMatrix<f64> {
        DMatrix::from_fn(n, n, |i, j| packed[i.max(j) * (i.max(j) + 1) / 2 + i.min(j)])
    }

    fn orthotropic() -> Stiffness {
        Stiffness::orthotropic(&Orthotropic {
            e1: 140e3,
            e2: 10e3,
            e3: 9e3,
            g12: 5.2e3,
            g13: 4.8e3,
            g23: 3.3e3,
            nu12: 0.30,
            nu13: 0.28,
            nu23: 0.45,
        })
        .unwrap()
        .rotated(&crate::geometry::fibre_axes(0.6, 0.3))
    }

    /// Truth: the stiffness of a free element has six zero eigenvalues, and all other eigenvalues are positive
    /// (`rigid-body-modes` in docs/verification.md). Tolerance of zero: 1e-12 of the largest eigenvalue.
    #[test]
    fn six_zero_modes() {
        let rules = RuleSet::new();
        let distort = |x: [f64; 3]| {
            [x[0] + 0.2 * x[1] * x[2], x[1] * (1.3 + 0.2 * x[0]), 0.7 * x[2] + 0.3 * x[0] + 0.1 * x[0] * x[1]]
        };
        let slender = |x: [f64; 3]| [30.0 * x[0], x[1], x[2]];
        let check = |kind: ElementKind, nodes: Vec<[f64; 3]>, formulation| {
            let n = 3 * kind.n_nodes();
            let mut packed = vec![0.0; packed_len(kind)];
            element_stiffness(kind, &nodes, orthotropic().voigt(), formulation, &rules, &mut packed).unwrap();
            let mut values: Vec<f64> =
                SymmetricEigen::new(unpacked(&packed, n)).eigenvalues.iter().copied().collect();
            values.sort_by(f64::total_cmp);
            let largest = values[n - 1];
            assert!(values[..6].iter().all(|v| v.abs() < 1e-12 * largest), "{values:?}");
            // Slender quadratic, wedge and pyramid elements may have smaller nonzero eigenvalues.
            let least = if matches!(kind, ElementKind::Hex8 | ElementKind::Tet4) { 1e-7 } else { 1e-9 };
            assert!(values[6] > least * largest, "{values:?}");
        };
        for formulation in HexFormulation::ALL {
            check(ElementKind::Hex8, Hex8::NODES.map(distort).to_vec(), formulation);
            check(ElementKind::Hex8, Hex8::NODES.map(slender).to_vec(), formulation);
        }
        struct Nodes;
        impl ElementVisitor for Nodes {
            type Output = Vec<[f64; 3]>;
            fn visit_element<S: SolidElement<N>, const N: usize>(self) -> Self::Output {
                S::NODES.to_vec()
            }
        }
        for &kind in ALL.iter().filter(|&&kind| kind != ElementKind::Hex8) {
            let nodes = visit_element(kind, Nodes);
            check(kind, nodes.iter().map(|&x| distort(x)).collect(), HexFormulation::Enhanced);
            check(kind, nodes.iter().map(|&x| slender(x)).collect(), HexFormulation::Enhanced);
        }
    }

    /// Truth: nodal forces are K u and the energy is ½ uᵀ K u, with K from [`element_stiffness`]. Tolerance: rounding.
    #[test]
    fn forces_are_stiffness_times_displacements() {
        let rules = RuleSet::new();
        let nodes = Hex8::NODES
            .map(|x| [x[0] + 0.2 * x[1] * x[2], x[1] * (1.3 + 0.2 * x[0]), 0.7 * x[2] + 0.3 * x[0]]);
        let u: Vec<[f64; 3]> =
            (0..8).map(|a| [0.1 * a as f64, (a * a % 5) as f64, (a * 3 % 7) as f64]).collect();
        for formulation in HexFormulation::ALL {
            let c = orthotropic();
            let mut packed = vec![0.0; packed_len(ElementKind::Hex8)];
            element_stiffness(ElementKind::Hex8, &nodes, c.voigt(), formulation, &rules, &mut packed)
                .unwrap();
            let flat = nalgebra::DVector::from_iterator(24, u.iter().flatten().copied());
            let wanted = unpacked(&packed, 24) * &flat;
            let state = element_state(ElementKind::Hex8, &nodes, &u, c.voigt(), formulation, &rules).unwrap();
            for (force, wanted_force) in state.forces.iter().flatten().zip(&wanted) {
                assert!((force - wanted_force).abs() < 1e-12 * wanted.amax());
            }
            assert!((state.energy / (0.5 * flat.dot(&wanted)) - 1.0).abs() < 1e-12);
        }
    }
}
