//! Blocks of the condensation benchmark, and their matrices.

use std::io::Write;
use std::path::Path;
use std::sync::Arc;

use orthowear::fem::{FeModel, FeSpec, HexFormulation, Support};
use orthowear::linalg::ordering::{NodeGraph, nested_dissection};
use orthowear::mesh::Mesh;

use crate::Outcome;
use crate::im7::im7;
use crate::structured::GradedBlock;

/// Names of the blocks. A number n means n^3 equal elements. "graded" is refined towards a patch of 24 x 24 elements.
pub const NAMES: [&str; 4] = ["20", "30", "40", "graded"];

pub struct Case {
    pub model: FeModel,
    /// Graph of the nodes, with an edge between two nodes of the same element.
    pub graph: NodeGraph,
    pub contact: Vec<usize>,
}

/// Elimination orders that are compared.
#[derive(Clone, Copy, PartialEq, Eq)]
pub enum Ordering {
    /// Nested dissection by METIS.
    Metis,
    /// Approximate minimum degree (faer's).
    Amd,
}

impl Case {
    /// Makes the block `name`, of orthotropic material (IM7, fibres at 30 degrees) and fixed at its base. The contact
    /// nodes lie on the top face, at most 0.5 mm from its centre along x and along y.
    pub fn new(name: &str) -> Outcome<Self> {
        let block = match name {
            "graded" => GradedBlock {
                patch_half_width: [0.5; 2],
                patch_cells: [24; 2],
                outer_cells: 6,
                first_depth: Some(1.0 / 24.0),
                ..GradedBlock::uniform([4.0; 2], 4.0, [24, 24, 14])
            },
            _ => GradedBlock::uniform([1.5; 2], 3.0, [name.parse()?; 3]),
        };
        let mesh = block.mesh()?;
        let contact = contact(&mesh, 0.5 + 1e-9);
        let cells: Vec<Vec<usize>> = mesh.volume_cells().map(|cell| mesh.cell_nodes(cell).to_vec()).collect();
        let graph = NodeGraph::from_elements(mesh.n_points(), cells.iter().map(Vec::as_slice));
        let base =
            Support { group: "base".into(), components: [true; 3], value: [0.0; 3], gradient: [[0.0; 3]; 3] };
        let model = FeModel::new(FeSpec {
            name: "block".into(),
            mesh: Arc::new(mesh),
            regions: vec![(None, im7(30.0)?.into())],
            formulation: HexFormulation::Enhanced,
            supports: vec![base],
            foundations: vec![],
            pressures: vec![],
            tractions: vec![],
            body_force: [0.0; 3],
            temperature_change: 0.0,
        })?;
        Ok(Self { model, graph, contact })
    }

    /// Elimination order of the rows, with the contact rows last, and the number of contact rows.
    pub fn order(&self, ordering: Ordering) -> Outcome<(Vec<usize>, usize)> {
        let held = |node: &usize| self.model.free_dof(*node, 0).is_some();
        let nodes: Vec<usize> = (0..self.graph.n_nodes()).filter(held).collect();
        let nodes = match ordering {
            Ordering::Metis => nested_dissection(&self.graph, &nodes, &self.contact)?,
            Ordering::Amd => self.minimum_degree(&nodes)?,
        };
        let rows = nodes.iter().flat_map(|&node| (0..3).filter_map(move |c| self.model.free_dof(node, c)));
        Ok((rows.collect(), 3 * self.contact.len()))
    }

    fn minimum_degree(&self, nodes: &[usize]) -> Outcome<Vec<usize>> {
        use faer::dyn_stack::{MemBuffer, MemStack};
        use faer::sparse::SymbolicSparseColMatRef;
        use faer::sparse::linalg::amd;
        let mut local = vec![usize::MAX; self.graph.n_nodes()];
        let first: Vec<usize> = nodes.iter().copied().filter(|node| !self.contact.contains(node)).collect();
        first.iter().enumerate().for_each(|(i, &node)| local[node] = i);
        let (mut offsets, mut rows) = (vec![0], Vec::new());
        for &node in &first {
            let mut own: Vec<usize> = self
                .graph
                .neighbours(node)
                .iter()
                .map(|&other| local[other])
                .filter(|&i| i != usize::MAX)
                .collect();
            own.push(local[node]);
            own.sort_unstable();
            rows.extend(own);
            offsets.push(rows.len());
        }
        let n = first.len();
        let (mut order, mut inverse) = (vec![0usize; n], vec![0usize; n]);
        let mut memory = MemBuffer::new(amd::order_scratch::<usize>(n, rows.len()));
        amd::order(
            &mut order,
            &mut inverse,
            SymbolicSparseColMatRef::new_checked(n, n, &offsets, None, &rows),
            Default::default(),
            MemStack::new(&mut memory),
        )
        .map_err(|error| format!("{error:?}"))?;
        Ok(order.into_iter().map(|i| first[i]).chain(self.contact.iter().copied()).collect())
    }

    /// Writes the stiffness matrix (lower triangle by columns), the METIS order and the contact rows, little-endian.
    /// The file contains as i64: n, number of entries, number of contact rows; column offsets, row indices, order,
    /// contact rows. The values follow as f64.
    pub fn write(&self, path: &Path) -> Outcome<()> {
        let (order, n_contact) = self.order(Ordering::Metis)?;
        let (offsets, rows, values) = self.model.stiffness().lower();
        let mut file = std::io::BufWriter::new(std::fs::File::create(path)?);
        let sizes = [self.model.n_free(), rows.len(), n_contact];
        let contact = &order[order.len() - n_contact..];
        for list in [&sizes[..], offsets, rows, &order, contact] {
            for &value in list {
                file.write_all(&(value as i64).to_le_bytes())?;
            }
        }
        for value in values {
            file.write_all(&value.to_le_bytes())?;
        }
        Ok(file.flush()?)
    }
}

fn contact(mesh: &Mesh, half: f64) -> Vec<usize> {
    let on = |x: &[f64; 3]| x[2].abs() < 1e-9 && x[0].abs() < half && x[1].abs() < half;
    mesh.points.iter().enumerate().filter(|(_, x)| on(x)).map(|(node, _)| node).collect()
}
