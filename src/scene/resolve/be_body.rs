//! Resolves finite bodies of boundary elements: closed surface, groups, supports and loads.

use std::collections::BTreeMap;
use std::sync::Arc;

use super::bodies::{
    check_contact, check_groups, check_load_names, check_quality, meshed_plan, prescribed_displacements,
    read_mesh, report_rigid_body_modes, symmetry_supports,
};
use super::materials::{Materials, find_material};
use super::resolver::Resolver;
use crate::mesh::faces::group_faces;
use crate::mesh::{Mesh, closed_surface};
use crate::scene::plan::{BeBodyPlan, BodyPlan, PrescribedDisplacement};
use crate::scene::spec::body::{BeBody, FeBody, NearField};
use crate::scene::spec::direction::FibreDirection;

pub(super) fn resolve(r: &mut Resolver, key: &str, body: BeBody, materials: &Materials) -> Option<BodyPlan> {
    let interpolation = body.element;
    let fibre = body.fibre;
    let body = as_fe_keys(body);
    let supports = prescribed_displacements(r, key, &body);
    find_material(r, key, &body.material, fibre, materials);
    let mesh = read_mesh(r, key, &body.mesh)?;
    let place = format!("{key}.mesh");
    if mesh.volume_cells().next().is_some() {
        check_quality(r, &place, &mesh);
    } else {
        mesh.warnings.iter().for_each(|warning| r.note(format!("{place}: {warning}")));
    }
    let before = r.diagnostics.len();
    check_groups(r, key, &body, &mesh);
    check_load_names(r, key, &body);
    check_surface_groups(r, key, &body, &mesh);
    check_contact(r, key, &body, &mesh);
    let groups_found = r.diagnostics.len() == before;
    let symmetry = symmetry_supports(r, key, &body, &mesh);
    let surface = closed_surface(r, &place, &mesh)?;
    let supports = [supports?, symmetry?].concat();
    let meshed = meshed_plan(&body, Arc::new(surface), supports, Vec::new(), materials)?;
    let has_solids = mesh.volume_cells().next().is_some();
    let solids = has_solids.then_some(mesh);
    let be = BeBodyPlan { meshed, solids, interpolation };
    if groups_found {
        check_rigid_body_modes(r, key, &be);
    }
    Some(BodyPlan::Be(Box::new(be)))
}

fn as_fe_keys(body: BeBody) -> FeBody {
    let fibre = body.fibre.map(|fibre| FibreDirection {
        tilt: Some(fibre.tilt),
        azimuth: Some(fibre.azimuth),
        ..FibreDirection::default()
    });
    FeBody {
        material: body.material,
        fibre,
        layup: None,
        mesh: body.mesh,
        contact: body.contact,
        fixed: body.fixed,
        displaced: body.displaced,
        symmetry: body.symmetry,
        foundation: Vec::new(),
        pressure: body.pressure,
        traction: body.traction,
        body_force: body.body_force,
        temperature_change: body.temperature_change,
        regions: BTreeMap::new(),
        element: None,
        near_field: NearField::Mesh,
    }
}

/// Reports supports that are not on the outer surface. All nodes of boundary elements lie on the outer surface.
fn check_surface_groups(r: &mut Resolver, key: &str, body: &FeBody, mesh: &Mesh) {
    let fixed = body.fixed.iter().enumerate().map(|(i, fixed)| (format!("fixed.{i}"), &fixed.group));
    let displaced =
        body.displaced.iter().enumerate().map(|(i, other)| (format!("displaced.{i}"), &other.group));
    for (place, group) in fixed.chain(displaced) {
        // `check_groups` reports missing groups.
        if mesh.group_of_any_dim(group).is_err() {
            continue;
        }
        let mend = "name an outer surface group: a boundary-element body can only be supported on its surface, not \
                    at points, lines or interior faces";
        r.accept(group_faces(mesh, group), &format!("{key}.{place}.group"), ["this group", mend]);
    }
}

/// Returns the closed surface of a body, with outward normals. It is `mesh` itself, or the boundary surface of a volume
/// mesh.
pub(super) fn closed_surface(r: &mut Resolver, place: &str, mesh: &Mesh) -> Option<Mesh> {
    let skin = mesh.volume_cells().next().is_some().then(|| closed_surface::boundary_surface(mesh));
    let oriented = closed_surface::orient_outward(skin.as_ref().unwrap_or(mesh));
    let mend = "give a closed surface mesh of one body, or a volume mesh; the boundary surface of a volume mesh is extracted";
    let (mesh, notes) = r.accept(oriented, place, ["this mesh", mend])?;
    notes.iter().for_each(|note| r.note(format!("{place}: {note}")));
    Some(mesh)
}

fn check_rigid_body_modes(r: &mut Resolver, key: &str, be: &BeBodyPlan) {
    let help = "put each face into one support only, or prescribe the same value in both";
    let modes = be.bem_spec(key).free_motions();
    if modes.is_ok() {
        report_shared_dofs(r, key, be);
    }
    report_rigid_body_modes(r, key, modes, &be.meshed.supports, [key, help]);
}

/// Reports a node that several loads displace along one direction. The check of all loads together accepts the node if
/// the values at amplitude 1 are equal. The amplitudes may differ in later steps, so only one load may displace a node
/// along a direction.
fn report_shared_dofs(r: &mut Resolver, key: &str, be: &BeBodyPlan) {
    let Some(error) = be.load_specs(key).into_iter().find_map(|(_, spec)| spec.free_motions().err()) else {
        return;
    };
    let of_group = |support: &&PrescribedDisplacement| error.group.as_ref() == Some(&support.group);
    let Some(support) = be.meshed.supports.iter().rfind(of_group) else { return };
    let message = format!(
        "faces of the group \"{}\" are displaced by different loads along the same direction",
        support.group
    );
    let mend =
        "give these displacements the same `name` and `preload`, or put each face into one of them only";
    r.report(&support.key, message, "this displacement", mend);
}
