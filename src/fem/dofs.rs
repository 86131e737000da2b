//! Unknowns: which displacement components are free, which prescribed.

use super::regions::Regions;
use super::spec::FeSpec;
use crate::error::{Error, Result};
use crate::geometry::{number, place};
use crate::mesh::Mesh;

const NONE: usize = usize::MAX;
/// Names of the displacement components.
pub(super) const COMPONENTS: [&str; 3] = ["x", "y", "z"];

/// Free and prescribed displacement components of the mesh nodes; component `c` of node `i` is dof 3 i + c.
#[derive(Debug, Clone)]
pub(super) struct Dofs {
    /// Row of each dof in the system of the free ones, `[3 n_points]`.
    row: Vec<usize>,
    /// Dof of each row, `[n_free]`.
    dof: Vec<usize>,
    /// Index of the support that prescribes each dof, `[3 n_points]`.
    support: Vec<usize>,
    /// Prescribed displacement, 0 elsewhere, mm, `[3 n_points]`.
    prescribed: Vec<f64>,
    /// Nodes of solid cells, ascending.
    pub nodes: Vec<usize>,
    /// Whether each mesh node is one of them, `[n_points]`.
    pub in_solid: Vec<bool>,
}

impl Dofs {
    /// Numbers the free dofs by node, then component.
    ///
    /// # Errors
    /// If a support's group is missing or not on the body, a value is not finite, two supports contradict, or nothing
    /// is free.
    pub fn new(spec: &FeSpec, regions: &Regions) -> Result<Self> {
        let n_points = spec.mesh.n_points();
        let mut in_solid = vec![false; n_points];
        for &cell in &regions.cells {
            spec.mesh.cell_nodes(cell).iter().for_each(|&node| in_solid[node] = true);
        }
        let mut dofs = Self {
            row: vec![NONE; 3 * n_points],
            dof: Vec::new(),
            support: vec![NONE; 3 * n_points],
            prescribed: vec![0.0; 3 * n_points],
            nodes: (0..n_points).filter(|&node| in_solid[node]).collect(),
            in_solid,
        };
        for index in 0..spec.supports.len() {
            dofs.prescribe(spec, index)?;
        }
        for &node in &dofs.nodes {
            for dof in 3 * node..3 * node + 3 {
                if dofs.support[dof] == NONE {
                    dofs.row[dof] = dofs.dof.len();
                    dofs.dof.push(dof);
                }
            }
        }
        if dofs.dof.is_empty() {
            return Err(Error::input("all nodes are fixed: nothing can deform; make the body rigid instead"));
        }
        Ok(dofs)
    }

    fn prescribe(&mut self, spec: &FeSpec, index: usize) -> Result<()> {
        let support = &spec.supports[index];
        for node in spec.mesh.group_nodes(&support.group)? {
            if !self.in_solid[node] {
                return Err(not_on_body(&spec.mesh, &support.group, node));
            }
            for component in (0..3).filter(|&c| support.components[c]) {
                let far: f64 =
                    support.gradient[component].iter().zip(&spec.mesh.points[node]).map(|(g, x)| g * x).sum();
                let (dof, value) = (3 * node + component, support.value[component] + far);
                if !value.is_finite() {
                    return Err(Error::input(format!(
                        "the displacement of group \"{}\" along {} is {value}; it must be a finite number",
                        support.group, COMPONENTS[component]
                    )));
                }
                let earlier = self.support[dof];
                if earlier != NONE && self.prescribed[dof] != value {
                    return Err(Error::input(format!(
                        "the groups \"{}\" and \"{}\" share a node at {} but prescribe different displacements \
                         along {}: {} and {}",
                        spec.supports[earlier].group,
                        support.group,
                        place(&spec.mesh.points[node]),
                        COMPONENTS[component],
                        number(self.prescribed[dof]),
                        number(value),
                    )));
                }
                (self.support[dof], self.prescribed[dof]) = (index, value);
            }
        }
        Ok(())
    }

    /// Number of free dofs.
    pub fn n_free(&self) -> usize {
        self.dof.len()
    }

    /// Row of a dof in the system, `None` if it is prescribed or on no solid.
    pub fn row(&self, dof: usize) -> Option<usize> {
        Some(self.row[dof]).filter(|&row| row != NONE)
    }

    /// Dof of each row, `[n_free]`.
    pub fn dofs_of_rows(&self) -> &[usize] {
        &self.dof
    }

    /// Prescribed displacement of a dof, `None` if it is free or on no solid.
    pub fn prescribed(&self, dof: usize) -> Option<f64> {
        (self.support[dof] != NONE).then(|| self.prescribed[dof])
    }

    /// Displacement of all mesh nodes, `[n_points]`, from that of the free dofs, `[n_free]`.
    pub fn expand(&self, free: &[f64]) -> Vec<[f64; 3]> {
        let value = |dof: usize| self.row(dof).map_or(self.prescribed[dof], |row| free[row]);
        (0..self.in_solid.len())
            .map(|node| [value(3 * node), value(3 * node + 1), value(3 * node + 2)])
            .collect()
    }
}

fn not_on_body(mesh: &Mesh, group: &str, node: usize) -> Error {
    Error::input(format!(
        "the group \"{group}\" of {} has a node at {} that belongs to no solid element; a support must lie on the \
         body",
        mesh.source,
        place(&mesh.points[node])
    ))
}
