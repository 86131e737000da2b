//! Finite bodies of boundary elements: their closed surface, groups of it, supports.

use std::collections::BTreeMap;
use std::sync::Arc;

use super::Resolver;
use super::bodies::{
    check_contact, check_groups, check_quality, elastic, own_elastic, read_mesh, supports, symmetry,
};
use super::materials::Materials;
use crate::bem::finite::Interpolation;
use crate::mesh::faces::group_faces;
use crate::mesh::{Mesh, surface};
use crate::scene::keys::body::{BeBody, BoundaryElement, FeBody, NearField};
use crate::scene::keys::direction::Direction;
use crate::scene::plan::{BeSpec, BodySpec, MeshedSpec, Support};

/// The body at `key`.
pub(super) fn resolve(r: &mut Resolver, key: &str, body: BeBody, materials: &Materials) -> Option<BodySpec> {
    let interpolation = interpolation(body.element);
    let fibre = body.fibre;
    let body = as_meshed(body);
    let supports = supports(r, key, &body);
    elastic(r, key, &body.material, fibre, materials);
    let mesh = read_mesh(r, key, &body.mesh)?;
    let place = format!("{key}.mesh");
    if mesh.volume_cells().next().is_some() {
        check_quality(r, &place, &mesh);
    } else {
        r.notes.extend(mesh.warnings.iter().map(|warning| format!("{place}: {warning}")));
    }
    let before = r.mistakes.len();
    check_groups(r, key, &body, &mesh);
    check_surfaces(r, key, &body, &mesh);
    check_contact(r, key, &body, &mesh);
    let groups_found = r.mistakes.len() == before;
    let symmetry = symmetry(r, key, &body, &mesh);
    let surface = closed(r, &place, &mesh)?;
    let meshed = MeshedSpec {
        elastic: own_elastic(&body, materials)?,
        has_fibre: fibre.is_some(),
        mesh: Arc::new(surface),
        mesh_name: body.mesh.clone(),
        contact: body.contact.clone(),
        supports: [supports?, symmetry?].concat(),
        foundations: Vec::new(),
        pressures: body.pressure.iter().map(|load| (load.group.clone(), load.value)).collect(),
        tractions: body.traction.iter().map(|load| (load.group.clone(), load.value)).collect(),
        body_force: body.body_force,
        regions: Vec::new(),
        element: None,
        near_field: NearField::Mesh,
    };
    let has_solids = mesh.volume_cells().next().is_some();
    let solids = has_solids.then(|| Arc::new(mesh));
    let be = BeSpec { meshed, solids, interpolation };
    if groups_found {
        check_held(r, key, &be);
    }
    Some(BodySpec::Be(Box::new(be)))
}

/// The interpolation that a key names.
pub(super) fn interpolation(element: BoundaryElement) -> Interpolation {
    match element {
        BoundaryElement::Constant => Interpolation::Constant,
        BoundaryElement::Linear => Interpolation::Linear,
        BoundaryElement::Quadratic => Interpolation::Quadratic,
    }
}

/// The same keys of a body of finite elements.
fn as_meshed(body: BeBody) -> FeBody {
    let fibre = body.fibre.map(|fibre| Direction {
        tilt: Some(fibre.tilt),
        azimuth: Some(fibre.azimuth),
        field: None,
        file: None,
        cylindrical: None,
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
        regions: BTreeMap::new(),
        element: None,
        near_field: NearField::Mesh,
    }
}

/// Reports supports and loads on what is no outer surface: boundary elements have no nodes elsewhere.
fn check_surfaces(r: &mut Resolver, key: &str, body: &FeBody, mesh: &Mesh) {
    let fixed = body.fixed.iter().enumerate().map(|(i, fixed)| (format!("fixed.{i}"), &fixed.group));
    let displaced =
        body.displaced.iter().enumerate().map(|(i, other)| (format!("displaced.{i}"), &other.group));
    for (place, group) in fixed.chain(displaced) {
        // A missing group is reported with the others.
        if mesh.group_of_any_dim(group).is_err() {
            continue;
        }
        if let Err(error) = group_faces(mesh, group) {
            let mend = "name an outer surface group: a boundary-element body can only be supported on its surface, not \
                        at points, lines or interior faces";
            r.wrong(&format!("{key}.{place}.group"), error.message().to_owned(), "this group", mend);
        }
    }
}

/// The closed surface of a mesh, or of its solids.
pub(super) fn closed(r: &mut Resolver, place: &str, mesh: &Mesh) -> Option<Mesh> {
    let skin = mesh.volume_cells().next().is_some().then(|| surface::skin(mesh));
    match surface::outward(skin.as_ref().unwrap_or(mesh)) {
        Ok((mesh, notes)) => {
            r.notes.extend(notes.into_iter().map(|note| format!("{place}: {note}")));
            Some(mesh)
        }
        Err(error) => {
            let mend = "give the closed surface mesh of one body, or a volume mesh, whose boundary surface is extracted";
            r.wrong(place, error.message().to_owned(), "this mesh", mend);
            None
        }
    }
}

/// Reports supports that contradict one another, and notes that the body floats.
fn check_held(r: &mut Resolver, key: &str, be: &BeSpec) {
    match be.inputs(key).free_motions() {
        Ok(None) => {}
        Ok(Some(free)) => r.notes.push(format!(
            "{key} has unconstrained rigid-body modes ({}): only contact forces can balance its loads along them",
            free.names.join(", ")
        )),
        Err(error) => {
            let named = |support: &&Support| error.message().contains(&format!("\"{}\"", support.group));
            let list = be.meshed.supports.iter().find(named).map(|support| support.key.clone());
            let mend = "put each face into one support only, or prescribe the same value in both";
            r.wrong(
                &list.unwrap_or_else(|| key.to_owned()),
                error.message().to_owned(),
                "these supports",
                mend,
            );
        }
    }
}
