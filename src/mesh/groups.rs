use std::collections::BTreeSet;

use super::{Mesh, PhysicalGroup};
use crate::error::{Error, Result};

const DIM_NAMES: [&str; 4] = ["points", "lines", "surfaces", "volumes"];

pub(super) fn dim_name(dim: usize) -> &'static str {
    DIM_NAMES[dim.min(3)]
}

impl Mesh {
    /// Physical group `name`. If several dimensions share the name, the group of the highest dimension.
    ///
    /// # Errors
    /// If no group has the name.
    pub fn group(&self, name: &str) -> Result<&PhysicalGroup> {
        self.groups
            .iter()
            .filter(|group| group.name == name)
            .max_by_key(|group| group.dim)
            .ok_or_else(|| self.no_group(name))
    }

    /// Physical group `name` of dimension `dim`.
    ///
    /// # Errors
    /// If no group of this dimension has the name.
    pub fn group_of_dim(&self, name: &str, dim: usize) -> Result<&PhysicalGroup> {
        let found = self.group(name)?;
        self.groups.iter().find(|group| group.name == name && group.dim == dim).ok_or_else(|| {
            Error::input(format!(
                "the group \"{name}\" of {} is a group of {}, but {} are needed here; the mesh has {}",
                self.source,
                dim_name(found.dim),
                dim_name(dim),
                self.list_groups(Some(dim)),
            ))
        })
    }

    /// Physical group `name`, whatever its dimension.
    ///
    /// # Errors
    /// If no group has the name, if the group has no cells, or if groups of several dimensions have the name.
    pub fn group_of_any_dim(&self, name: &str) -> Result<&PhysicalGroup> {
        let group = self.group(name)?;
        if let Some(other) = self.groups.iter().find(|other| other.name == name && other.dim != group.dim) {
            return Err(Error::input(format!(
                "the name \"{name}\" belongs both to a group of {} and to a group of {} in {}; give them different names",
                dim_name(group.dim),
                dim_name(other.dim),
                self.source
            )));
        }
        if group.cells.is_empty() {
            return Err(Error::input(format!(
                "the group \"{name}\" of {} has no elements; include it in the mesh that gmsh saves, or name another group",
                self.source
            )));
        }
        Ok(group)
    }

    /// Nodes of the cells of the group `name`, ascending, without duplicates.
    ///
    /// # Errors
    /// As [`Mesh::group_of_any_dim`].
    pub fn group_nodes(&self, name: &str) -> Result<Vec<usize>> {
        Ok(self.nodes_of(self.group_of_any_dim(name)?))
    }

    /// Nodes of the cells of a group, ascending, without duplicates.
    pub fn nodes_of(&self, group: &PhysicalGroup) -> Vec<usize> {
        let nodes: BTreeSet<usize> =
            group.cells.iter().flat_map(|&cell| self.cell_nodes(cell).iter().copied()).collect();
        nodes.into_iter().collect()
    }

    fn no_group(&self, name: &str) -> Error {
        let plain = |name: &str| -> String { name.to_lowercase().chars().take(200).collect() };
        let wanted = plain(name);
        let closest = self
            .groups
            .iter()
            .map(|group| (strsim::levenshtein(&wanted, &plain(&group.name)), group.name.as_str()))
            .min()
            .filter(|(distance, _)| *distance <= 1 + name.chars().count() / 3);
        let hint = closest.map_or(String::new(), |(_, near)| format!(" Did you mean \"{near}\"?"));
        Error::input(format!(
            "{} has no physical group \"{name}\"; it has {}.{hint}",
            self.source,
            self.list_groups(None)
        ))
    }

    pub(super) fn list_groups(&self, dim: Option<usize>) -> String {
        let names: Vec<String> = self
            .groups
            .iter()
            .filter(|group| dim.is_none_or(|d| d == group.dim))
            .map(|group| match dim {
                Some(_) => format!("\"{}\"", group.name),
                None => format!("\"{}\" ({})", group.name, dim_name(group.dim)),
            })
            .collect();
        match (names.is_empty(), dim) {
            (false, _) => names.join(", "),
            (true, Some(d)) => format!("no physical group of {}", dim_name(d)),
            (true, None) => {
                "no physical groups; declare them in the .geo script with `Physical Surface(..)` and `Physical Volume(..)`"
                    .to_string()
            }
        }
    }
}
