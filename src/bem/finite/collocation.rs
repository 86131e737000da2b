//! Collocation equations over a cluster tree of elements.

use nalgebra::DMatrix;

use super::elements::BoundaryElements;
use super::influence::Influence;
use super::problem::BoundaryValueProblem;
use crate::linalg::hierarchical::{
    BoundingBox, ClusterTree, CollocationKernel, CollocationLayout, ElementNumbering,
};

const LEAF: usize = 8;

/// Two clusters are admissible, with a low-rank block, if the smaller diameter is at most this multiple of their
/// distance.
const ADMISSIBILITY: f64 = 2.0;

/// Elements and nodes in tree order.
pub(super) struct TreeOrder {
    pub elements: Vec<usize>,
    pub nodes: Vec<usize>,
    /// Element and local node index of each node.
    pub node_locations: Vec<(usize, usize)>,
}

pub(super) struct BoundaryKernel<'a> {
    pub problem: &'a BoundaryValueProblem<'a>,
    pub order: &'a TreeOrder,
    pub traction_scale: f64,
    pub motions: &'a DMatrix<f64>,
    pub summed_columns: SummedColumns,
}

/// Additional columns of the equations. Each column is a sum over all elements, and only the sum is stored.
pub(super) struct SummedColumns {
    /// Whether columns for rigid translations of the dofs with prescribed displacement are included.
    pub prescribed_translations: bool,
    /// Divisor of the boundary values of each load.
    pub load_scales: Vec<f64>,
    /// Scale of the columns of the free rigid motions, and number of these motions.
    pub motions: (f64, usize),
}

impl SummedColumns {
    pub fn count(&self) -> usize {
        3 * usize::from(self.prescribed_translations) + self.load_scales.len() + self.motions.1
    }
}

impl TreeOrder {
    pub fn dof(&self, at: usize) -> usize {
        3 * self.nodes[at / 3] + at % 3
    }

    pub fn new(elements: &BoundaryElements, order: &[usize]) -> Self {
        let node_locations: Vec<(usize, usize)> =
            order.iter().flat_map(|&i| (0..elements.nodes_of(i).len()).map(move |node| (i, node))).collect();
        let nodes = node_locations.iter().map(|&(i, node)| elements.nodes_of(i).start + node).collect();
        Self { elements: order.to_vec(), nodes, node_locations }
    }
}

impl CollocationKernel for BoundaryKernel<'_> {
    fn entries(&self, node: usize, element: usize, values: &mut [f64]) {
        let BoundaryValueProblem { elements, displacement_known, loads, .. } = self.problem;
        let scales = &self.summed_columns.load_scales;
        let element = self.order.elements[element];
        let influence = influence(elements, self.order.node_locations[node], element);
        let nodes = elements.nodes_of(element);
        let (values, summed) = values.split_at_mut(9 * nodes.len());
        summed.fill(0.0);
        let (translations, summed) =
            summed.split_at_mut(if self.summed_columns.prescribed_translations { 9 } else { 0 });
        let (of_loads, of_motions) = summed.split_at_mut(3 * scales.len());
        for (a, node) in nodes.enumerate() {
            let (single, double) = (&influence.single_layer[a], &influence.double_layer[a]);
            for c in 0..3 {
                let dof = 3 * node + c;
                let (unknown, of_held) = if displacement_known[dof] {
                    (single.column(c) * -self.traction_scale, -double.column(c))
                } else {
                    (double.column(c).into_owned(), single.column(c).into_owned())
                };
                values[3 * (3 * a + c)..][..3].copy_from_slice(unknown.as_slice());
                if displacement_known[dof] {
                    (0..3).for_each(|r| translations[3 * c + r] -= of_held[r]);
                }
                for ((load, scale), sum) in loads.iter().zip(scales).zip(of_loads.chunks_exact_mut(3)) {
                    let value = load.at_dofs[dof] / scale;
                    (0..3).for_each(|r| sum[r] += of_held[r] * value);
                }
            }
            for j in 0..self.summed_columns.motions.1 {
                let motion = self.motions.fixed_view::<3, 1>(3 * node, j);
                let balance = single * motion * (self.traction_scale * self.summed_columns.motions.0);
                (0..3).for_each(|r| of_motions[3 * j + r] += balance[r]);
            }
        }
    }
}

/// Block structure over the cluster tree of the elements, with `summed` additional columns.
pub(super) fn layout(elements: &BoundaryElements, summed: usize) -> CollocationLayout {
    let n = elements.n_elements();
    let extent = |i: usize| -> BoundingBox<3> {
        let nodes = &elements.panel(i).nodes;
        let bound = |with: fn(f64, f64) -> f64| {
            let first: [f64; 3] = nodes[0].into();
            nodes.iter().fold(first, |bound, x| [0, 1, 2].map(|k| with(bound[k], x[k])))
        };
        [bound(f64::min), bound(f64::max)]
    };
    let extents: Vec<BoundingBox<3>> = (0..n).map(extent).collect();
    let middle = |i: usize| -> [f64; 3] { [0, 1, 2].map(|k| 0.5 * (extents[i][0][k] + extents[i][1][k])) };
    let middles: Vec<[f64; 3]> = (0..n).map(middle).collect();
    let tree = ClusterTree::new(&middles, &extents, LEAF);
    let counts: Vec<usize> = tree.order.iter().map(|&i| elements.nodes_of(i).len()).collect();
    CollocationLayout::new(tree, ElementNumbering::new(counts.into_iter(), summed), ADMISSIBILITY)
}

pub(super) fn influence(elements: &BoundaryElements, (i, node): (usize, usize), element: usize) -> Influence {
    if i == element {
        return elements.influence_on_element(i, node);
    }
    let y = elements.panel(i).position(elements.reference_nodes_of(i).reference_points()[node]);
    elements.influence_off_element(element, &y)
}
