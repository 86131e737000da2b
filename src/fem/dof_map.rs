//! Numbering of the free displacement components, and values of the prescribed components.

use super::element_materials::ElementMaterials;
use super::spec::FeSpec;
use crate::error::{Error, Result};
use crate::geometry::{AXIS_NAMES, format_number, format_point};
use crate::mesh::Mesh;

const UNASSIGNED: usize = usize::MAX;

/// Free and prescribed displacement components of the mesh nodes; component `c` of node `i` is dof 3 i + c.
#[derive(Debug, Clone)]
pub(super) struct DofMap {
    /// Row of each dof in the system of the free dofs, `[3 n_points]`; `UNASSIGNED` for other dofs.
    row_of_dof: Vec<usize>,
    /// Dof of each row, `[n_free]`.
    dof_of_row: Vec<usize>,
    /// Index of the support that prescribes each dof, `[3 n_points]`; `UNASSIGNED` for other dofs.
    support_of_dof: Vec<usize>,
    /// Prescribed displacement, mm, `[3 n_points]`; 0 for other dofs.
    prescribed: Vec<f64>,
    pub solid_nodes: Vec<usize>,
    pub is_solid_node: Vec<bool>,
}

impl DofMap {
    /// Numbers the free dofs by node, then by component.
    ///
    /// # Errors
    /// If the group of a support is missing or not on the body, or a value is not finite. If two supports contradict one another,
    /// or no dof is free.
    pub fn new(spec: &FeSpec, regions: &ElementMaterials) -> Result<Self> {
        let n_points = spec.mesh.n_points();
        let mut is_solid_node = vec![false; n_points];
        for &cell in &regions.cells {
            spec.mesh.cell_nodes(cell).iter().for_each(|&node| is_solid_node[node] = true);
        }
        let mut dofs = Self {
            row_of_dof: vec![UNASSIGNED; 3 * n_points],
            dof_of_row: Vec::new(),
            support_of_dof: vec![UNASSIGNED; 3 * n_points],
            prescribed: vec![0.0; 3 * n_points],
            solid_nodes: (0..n_points).filter(|&node| is_solid_node[node]).collect(),
            is_solid_node,
        };
        for index in 0..spec.supports.len() {
            dofs.prescribe(spec, index).map_err(|error| error.at_group(&spec.supports[index].group))?;
        }
        for &node in &dofs.solid_nodes {
            for dof in 3 * node..3 * node + 3 {
                if dofs.support_of_dof[dof] == UNASSIGNED {
                    dofs.row_of_dof[dof] = dofs.dof_of_row.len();
                    dofs.dof_of_row.push(dof);
                }
            }
        }
        if dofs.dof_of_row.is_empty() {
            return Err(Error::input("all nodes are fixed: nothing can deform; make the body rigid instead"));
        }
        Ok(dofs)
    }

    fn prescribe(&mut self, spec: &FeSpec, index: usize) -> Result<()> {
        let support = &spec.supports[index];
        for node in spec.mesh.group_nodes(&support.group)? {
            if !self.is_solid_node[node] {
                return Err(not_on_body(&spec.mesh, &support.group, node));
            }
            for component in (0..3).filter(|&c| support.components[c]) {
                let far: f64 =
                    support.gradient[component].iter().zip(&spec.mesh.points[node]).map(|(g, x)| g * x).sum();
                let (dof, value) = (3 * node + component, support.value[component] + far);
                if !value.is_finite() {
                    return Err(Error::input(format!(
                        "the displacement of group \"{}\" along {} is {value}; it must be a finite number",
                        support.group, AXIS_NAMES[component]
                    )));
                }
                let earlier = self.support_of_dof[dof];
                if earlier != UNASSIGNED && self.prescribed[dof] != value {
                    return Err(Error::input(format!(
                        "the groups \"{}\" and \"{}\" share a node at {} but prescribe different displacements \
                         along {}: {} and {}",
                        spec.supports[earlier].group,
                        support.group,
                        format_point(&spec.mesh.points[node]),
                        AXIS_NAMES[component],
                        format_number(self.prescribed[dof]),
                        format_number(value),
                    )));
                }
                (self.support_of_dof[dof], self.prescribed[dof]) = (index, value);
            }
        }
        Ok(())
    }

    pub fn n_free(&self) -> usize {
        self.dof_of_row.len()
    }

    /// Row of a dof in the system; `None` if the dof is prescribed or on no solid.
    pub fn row(&self, dof: usize) -> Option<usize> {
        Some(self.row_of_dof[dof]).filter(|&row| row != UNASSIGNED)
    }

    pub fn dofs_of_rows(&self) -> &[usize] {
        &self.dof_of_row
    }

    /// Prescribed displacement of a dof; `None` if the dof is free or on no solid.
    pub fn prescribed(&self, dof: usize) -> Option<f64> {
        (self.support_of_dof[dof] != UNASSIGNED).then(|| self.prescribed[dof])
    }

    /// Prescribed displacement of each dof, 0 where it is free or on no solid, mm.
    pub fn prescribed_displacements(&self) -> &[f64] {
        &self.prescribed
    }
}

fn not_on_body(mesh: &Mesh, group: &str, node: usize) -> Error {
    Error::input(format!(
        "the group \"{group}\" of {} has a node at {} that belongs to no solid element; a support must lie on the \
         body",
        mesh.source,
        format_point(&mesh.points[node])
    ))
}
