//! Resolves the materials of the regions of a meshed body: oriented materials and laminates.

use std::collections::HashSet;

use nalgebra::Matrix3;

use super::materials::{Materials, find_material};
use super::orientations;
use super::resolver::Resolver;
use crate::fem;
use crate::geometry::{bounds, fibre_axes};
use crate::material::{Orientation, PlacedMaterial, Ply, RegionMaterial};
use crate::mesh::{CellRef, Mesh};
use crate::scene::document::join_key;
use crate::scene::plan::{BodyMaterial, MeshedBodyPlan};
use crate::scene::spec::body::{FeBody, Region};
use crate::scene::spec::direction::Layup;

/// Maximum number of plies of a layup before mirroring (`symmetric`). The schema has the same limit for `repeat`.
const MAX_PLIES: usize = 100_000;

/// Materials of the regions of the body at `key`. The first one belongs to all elements outside the volume groups of
/// `regions`.
pub(super) fn resolve(
    r: &mut Resolver,
    key: &str,
    body: &FeBody,
    mesh: &Mesh,
    materials: &Materials,
) -> Option<Vec<(Option<String>, RegionMaterial)>> {
    check_fibre_or_layup(r, key, body.fibre.is_some(), body.layup.is_some());
    let whole = BodyContext { key, body, mesh, materials };
    // The fibre direction of the body is resolved once, although regions may use it too. Its errors are then reported
    // once.
    let own_fibre = match &body.fibre {
        Some(fibre) => orientations::resolve(r, &format!("{key}.fibre"), fibre, mesh),
        None => Some(Orientation::Uniform(Matrix3::identity())),
    };
    let own = match &body.layup {
        Some(layup) => {
            // This reports an undefined material of the body. Plies and regions that use this material do not report it
            // again.
            find_material(r, key, &body.material, None, materials);
            whole.layup(r, &format!("{key}.layup"), layup, &body.material, None)
        }
        None => own_fibre.clone().and_then(|fibre| whole.single(r, key, &body.material, fibre)),
    };
    let mut regions = vec![own.clone().map(|own| (None, own))];
    for (group, region) in &body.regions {
        let place = join_key(&format!("{key}.regions"), group);
        check_fibre_or_layup(r, &place, region.fibre.is_some(), region.layup.is_some());
        let material = region.material.as_ref().unwrap_or(&body.material);
        let filling = match (&region.layup, &region.fibre) {
            (Some(layup), _) => whole.layup(r, &format!("{place}.layup"), layup, material, Some(group)),
            (None, Some(fibre)) => orientations::resolve(r, &format!("{place}.fibre"), fibre, mesh)
                .and_then(|fibre| whole.single(r, &place, material, fibre)),
            (None, None) if region.material.is_none() => own.clone(),
            (None, None) => own_fibre.clone().and_then(|fibre| whole.single(r, &place, material, fibre)),
        };
        regions.push(filling.map(|filling| (Some(group.clone()), filling)));
    }
    regions.into_iter().collect()
}

fn check_fibre_or_layup(r: &mut Resolver, key: &str, fibre: bool, layup: bool) {
    if fibre && layup {
        let mend = "remove `fibre`: each ply gives its fibre direction as `angle`";
        r.report(&format!("{key}.layup"), "`fibre` and `layup` are both given", "one of the two", mend);
    }
}

struct BodyContext<'a> {
    key: &'a str,
    body: &'a FeBody,
    mesh: &'a Mesh,
    materials: &'a Materials,
}

impl BodyContext<'_> {
    fn single(
        &self,
        r: &mut Resolver,
        key: &str,
        material: &str,
        fibre: Orientation,
    ) -> Option<RegionMaterial> {
        let elastic = self.find_material(r, key, material)?;
        Some(RegionMaterial::Single(Box::new(placed(elastic, fibre))))
    }

    /// Finds the material `name`. An undefined material of the body is reported only at the key of the body.
    fn find_material(&self, r: &mut Resolver, key: &str, name: &str) -> Option<BodyMaterial> {
        if name == self.body.material && key != self.key && !self.materials.contains_key(name) {
            return None;
        }
        find_material(r, key, name, None, self.materials)
    }

    /// Laminate of the volume group `group`, with plies from bottom to top. Without `group`: laminate of all elements,
    /// except those of regions with their own material, fibre or layup.
    fn layup(
        &self,
        r: &mut Resolver,
        key: &str,
        layup: &Layup,
        material: &str,
        group: Option<&String>,
    ) -> Option<RegionMaterial> {
        let n_plies = layup.plies.len().saturating_mul(layup.repeat.0);
        if n_plies > MAX_PLIES {
            return r.refuse(
                &format!("{key}.repeat"),
                format!("{} plies repeated {} times are {n_plies} plies", layup.plies.len(), layup.repeat.0),
                &format!("at most {MAX_PLIES} plies"),
                "repeat them less often, or join plies of the same angle",
            );
        }
        let mut stack = Vec::new();
        for (i, ply) in layup.plies.iter().enumerate() {
            let name = ply.material.as_deref().unwrap_or(material);
            let place = if ply.material.is_some() { format!("{key}.plies.{i}") } else { key.to_owned() };
            let elastic = self.find_material(r, &place, name);
            let fibre = Orientation::Uniform(fibre_axes(0.0, ply.angle.to_radians()));
            stack.push(elastic.map(|elastic| (ply.thickness.0, placed(elastic, fibre))));
        }
        let stack: Vec<(f64, PlacedMaterial)> = stack.into_iter().collect::<Option<_>>()?;
        let mut all: Vec<&(f64, PlacedMaterial)> = (0..layup.repeat.0).flat_map(|_| &stack).collect();
        if layup.symmetric {
            all.extend(all.clone().into_iter().rev());
        }
        let Some([low, high]) = self.z_range(group) else {
            return r.refuse(
                key,
                "no elements are left for this layup: the group is empty, or every element belongs to a region with \
                 its own `material`, `fibre` or `layup`",
                "no elements",
                "remove the layup, or remove `material`, `fibre` and `layup` from the regions that should have it",
            );
        };
        let bottom = layup.bottom.unwrap_or(low);
        let mut z = bottom;
        let plies = all.into_iter().map(|(thickness, placed)| {
            let lower = z;
            z += thickness;
            Ply { z_range: [lower, z], material: placed.clone() }
        });
        let plies: Vec<Ply> = plies.collect();
        if ((z - bottom) / (high - low) - 1.0).abs() > 1e-6 {
            r.note(format!(
                "{key}: the total thickness of the plies is {:.6} (z = {bottom:.6} to {z:.6}), but the elements extend \
                 from z = {low:.6} to {high:.6}",
                z - bottom
            ));
        }
        Some(RegionMaterial::Layup(plies))
    }

    /// Range of z of the elements of a layup. `None` if the layup has no elements or its elements have no height.
    fn z_range(&self, group: Option<&String>) -> Option<[f64; 2]> {
        let own =
            |region: &Region| region.fibre.is_some() || region.layup.is_some() || region.material.is_some();
        let cells_of = |name: &String| self.mesh.group_of_dim(name, 3).map(|group| group.cells.clone());
        let cells: Vec<CellRef> = match group {
            Some(name) => cells_of(name).ok()?,
            None => {
                let taken: HashSet<CellRef> = (self.body.regions.iter())
                    .filter(|(_, region)| own(region))
                    .filter_map(|(name, _)| cells_of(name).ok())
                    .flatten()
                    .collect();
                self.mesh.volume_cells().filter(|cell| !taken.contains(cell)).collect()
            }
        };
        let nodes = cells.iter().flat_map(|&cell| self.mesh.cell_nodes(cell));
        let [low, high] = bounds(nodes.map(|&node| self.mesh.points[node][2]));
        (low < high).then_some([low, high])
    }
}

/// Material with its orientation. The orientation of an isotropic material has no effect, so a uniform one is replaced
/// by the identity.
fn placed(elastic: BodyMaterial, fibre: Orientation) -> PlacedMaterial {
    let orientation = match fibre {
        Orientation::Uniform(_) if elastic.isotropic => Orientation::Uniform(Matrix3::identity()),
        other => other,
    };
    let BodyMaterial { name, stiffness, expansion, .. } = elastic;
    PlacedMaterial { name, stiffness, expansion, orientation }
}

/// Reports elements without material or orientation, and plies without elements. Notes empty volume groups, and
/// elements that lie in several plies.
pub(super) fn check(r: &mut Resolver, key: &str, body: &FeBody, spec: &MeshedBodyPlan) {
    for group in body.regions.keys() {
        if spec.mesh.group_of_dim(group, 3).is_ok_and(|group| group.cells.is_empty()) {
            r.note(format!(
                "{}: the group has no elements in {}",
                join_key(&format!("{key}.regions"), group),
                spec.mesh.source
            ));
        }
    }
    // Errors of elements and groups are reported elsewhere.
    let Ok(findings) = fem::check_materials(&spec.fem_spec(key)) else { return };
    for (index, finding) in findings.into_iter().enumerate() {
        let place = match &spec.regions[index].0 {
            Some(group) => join_key(&format!("{key}.regions"), group),
            None if body.layup.is_some() => format!("{key}.layup"),
            None => format!("{key}.fibre"),
        };
        let mend = "each element needs a material and a direction";
        for mistake in finding.errors {
            r.report(&place, mistake, "does not fit the mesh", mend);
        }
        finding.notes.iter().for_each(|note| r.note(format!("{place}: {note}")));
    }
}
