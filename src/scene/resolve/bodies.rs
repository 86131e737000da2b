//! Resolves finite-element bodies: materials, meshes, groups, supports and loads. Boundary-element bodies use some of
//! the functions.

use std::collections::BTreeSet;
use std::path::Path;
use std::sync::Arc;

use super::loads::refuse_empty_name;
use super::materials::{ElasticMaterial, Materials, find_material};
use super::resolver::Resolver;
use super::{orientations, placements, support_conflicts};
use crate::body::LoadCase;
use crate::element::ElementKind;
use crate::error::Result;
use crate::fem::{self, RigidBodyModes};
use crate::geometry::AXIS_NAMES;
use crate::material::RegionMaterial;
use crate::mesh::faces::group_faces;
use crate::mesh::{Mesh, PhysicalGroup};
use crate::scene::document::join_key;
use crate::scene::plan::{BodyMaterial, BodyPlan, GroupLoad, MeshedBodyPlan, PrescribedDisplacement};
use crate::scene::spec::body::{
    BodyForce, Component, Displaced, Element, FeBody, NamedBodyForce, TemperatureChange,
};

/// Resolves the finite-element body at `key`, with its mesh.
pub(super) fn resolve_fe(
    r: &mut Resolver,
    key: &str,
    body: &FeBody,
    materials: &Materials,
) -> Option<BodyPlan> {
    let supports = prescribed_displacements(r, key, body);
    let foundations_sound = check_foundations(r, key, body);
    let Some(mesh) = read_mesh(r, key, &body.mesh) else {
        find_material(r, key, &body.material, None, materials);
        return None;
    };
    check_quality(r, &format!("{key}.mesh"), &mesh);
    // `check_quality` reports a mesh without volume elements.
    mesh.volume_cells().next()?;
    let regions = placements::resolve(r, key, body, &mesh, materials);
    let before = r.diagnostics.len();
    check_groups(r, key, body, &mesh);
    check_load_names(r, key, body);
    let groups_found = r.diagnostics.len() == before;
    check_contact(r, key, body, &mesh);
    check_element(r, key, body.element, &mesh);
    let symmetry = symmetry_supports(r, key, body, &mesh);
    let supports = [supports?, symmetry?].concat();
    let spec = meshed_plan(body, mesh, supports, regions?, materials).filter(|_| foundations_sound)?;
    if groups_found {
        check_rigid_body_modes(r, key, body, &spec);
        placements::check(r, key, body, &spec);
    }
    Some(BodyPlan::Fe(Box::new(spec)))
}

/// Plan of a meshed body. `None` if its material is invalid; the error is reported with the material.
pub(super) fn meshed_plan(
    body: &FeBody,
    mesh: Arc<Mesh>,
    supports: Vec<PrescribedDisplacement>,
    regions: Vec<(Option<String>, RegionMaterial)>,
    materials: &Materials,
) -> Option<MeshedBodyPlan> {
    let body_force_case = match &body.body_force {
        BodyForce::Value(_) => LoadCase::default(),
        BodyForce::Load(NamedBodyForce { name, preload, .. }) => load_case(name, *preload),
    };
    Some(MeshedBodyPlan {
        material: body_material(body, materials)?,
        has_fibre: has_fibre(body),
        mesh,
        mesh_name: body.mesh.clone(),
        contact: body.contact.clone(),
        supports,
        foundations: body.foundation.clone(),
        pressures: (body.pressure.iter())
            .map(|load| GroupLoad {
                group: load.group.clone(),
                value: load.value,
                case: load_case(&load.name, load.preload),
            })
            .collect(),
        tractions: (body.traction.iter())
            .map(|load| GroupLoad {
                group: load.group.clone(),
                value: load.value,
                case: load_case(&load.name, load.preload),
            })
            .collect(),
        body_force: body.body_force.value(),
        body_force_case,
        temperature: body.temperature_change.clone().map(Into::into),
        regions,
        element: body.element,
        near_field: body.near_field,
    })
}

/// Reports empty names of loads and prescribed displacements.
pub(super) fn check_load_names(r: &mut Resolver, key: &str, body: &FeBody) {
    let pressures = body.pressure.iter().map(|load| load.name.as_deref());
    let tractions = body.traction.iter().map(|load| load.name.as_deref());
    let displaced = body.displaced.iter().map(|load| load.name.as_deref());
    let lists: [(&str, Vec<_>); 3] = [
        ("pressure", pressures.collect()),
        ("traction", tractions.collect()),
        ("displaced", displaced.collect()),
    ];
    for (list, names) in lists {
        for (i, name) in names.into_iter().enumerate() {
            refuse_empty_name(r, &format!("{key}.{list}.{i}"), name);
        }
    }
    if let BodyForce::Load(load) = &body.body_force {
        refuse_empty_name(r, &format!("{key}.body_force"), load.name.as_deref());
    }
    if let Some(TemperatureChange::Load(load)) = &body.temperature_change {
        refuse_empty_name(r, &format!("{key}.temperature_change"), load.name.as_deref());
    }
}

fn load_case(name: &Option<String>, preload: bool) -> LoadCase {
    LoadCase { name: name.clone(), preload }
}

/// Material of the body, with its fibre direction if uniform. Errors are reported with the material.
fn body_material(body: &FeBody, materials: &Materials) -> Option<BodyMaterial> {
    let ElasticMaterial { stiffness, isotropic, expansion, .. } = materials.get(&body.material)?.clone()?;
    let fibre = body.fibre.as_ref().and_then(orientations::uniform_angles);
    Some(BodyMaterial { name: body.material.clone(), stiffness, isotropic, expansion, fibre })
}

fn has_fibre(body: &FeBody) -> bool {
    let regions = body.regions.values();
    body.fibre.is_some()
        || body.layup.is_some()
        || regions.into_iter().any(|region| region.fibre.is_some() || region.layup.is_some())
}

pub(super) fn check_contact(r: &mut Resolver, key: &str, body: &FeBody, mesh: &Mesh) {
    // `check_groups` reports missing groups.
    if mesh.group_of_dim(&body.contact, 2).is_err() {
        return;
    }
    let mend = "name a physical group of surfaces on the outside of the solids";
    r.accept(group_faces(mesh, &body.contact), &format!("{key}.contact"), ["this group", mend]);
}

/// Reports contradictory supports and unconstrained parts of the mesh. Notes unconstrained rigid-body modes.
fn check_rigid_body_modes(r: &mut Resolver, key: &str, body: &FeBody, spec: &MeshedBodyPlan) {
    if support_conflicts::report_conflicts(r, spec) > 0 {
        return;
    }
    let lists = [("fixed", body.fixed.is_empty()), ("displaced", body.displaced.is_empty())];
    let list = lists.into_iter().find(|(_, empty)| !empty);
    let place = list.map_or_else(|| key.to_owned(), |(list, _)| format!("{key}.{list}"));
    let help = "constrain every part of the body that is not connected to the others, or connect the parts; \
                only a body of one connected part may have rigid-body modes";
    let modes = fem::find_rigid_body_modes(&spec.fem_spec(key));
    report_rigid_body_modes(r, key, modes, &spec.supports, [&place, help]);
}

/// Notes unconstrained rigid-body modes. An error in `modes` is reported at the support that causes it, else at
/// `place`.
pub(super) fn report_rigid_body_modes(
    r: &mut Resolver,
    key: &str,
    modes: Result<Option<RigidBodyModes>>,
    supports: &[PrescribedDisplacement],
    [place, help]: [&str; 2],
) {
    match modes {
        Ok(None) => {}
        Ok(Some(free)) => r.note(format!(
            "{key} has unconstrained rigid-body modes ({}): only contact forces can balance loads along these motions",
            free.names.join(", ")
        )),
        Err(error) => {
            let named = |support: &&PrescribedDisplacement| error.group.as_ref() == Some(&support.group);
            let place = supports.iter().find(named).map_or(place, |support| &support.key);
            r.report(place, error.message().to_owned(), "these supports", help);
        }
    }
}

pub(super) fn prescribed_displacements(
    r: &mut Resolver,
    key: &str,
    body: &FeBody,
) -> Option<Vec<PrescribedDisplacement>> {
    let mut supports: Vec<PrescribedDisplacement> = Vec::new();
    for (i, fixed) in body.fixed.iter().enumerate() {
        check_repeated_components(r, &format!("{key}.fixed.{i}.components"), &fixed.components);
        let mut support = PrescribedDisplacement::free(format!("{key}.fixed.{i}"), &fixed.group);
        fixed.components.iter().for_each(|component| support.values[*component as usize] = Some(0.0));
        supports.push(support);
    }
    let mut sound = true;
    for (i, displaced) in body.displaced.iter().enumerate() {
        check_repeated_components(r, &format!("{key}.displaced.{i}.components"), &displaced.components);
        match prescribed_displacement(r, &format!("{key}.displaced.{i}"), displaced) {
            Some(support) => supports.push(support),
            None => sound = false,
        }
    }
    sound.then_some(supports)
}

fn prescribed_displacement(
    r: &mut Resolver,
    key: &str,
    displaced: &Displaced,
) -> Option<PrescribedDisplacement> {
    let wanted = displaced.components.len();
    let mut sound = true;
    let mut count = |name: &str, found: usize| {
        if found != wanted {
            r.report(
                &format!("{key}.{name}"),
                format!("`{name}` has {found} entries for {wanted} components"),
                &format!("one entry of `{name}` per component"),
                format!("give one entry of `{name}` for each of `components`, in the same order"),
            );
            sound = false;
        }
    };
    let constant = displaced.gradient.is_empty();
    let zeros = vec![0.0; wanted];
    let value = displaced.value.as_ref().unwrap_or(&zeros);
    count("value", value.len());
    count("gradient", if constant { wanted } else { displaced.gradient.len() });
    if constant && displaced.value.is_none() {
        let message = "a prescribed displacement has neither `value` nor `gradient`";
        r.report(key, message, "lacks `value`", "add `value`, or `gradient`, or use `fixed`");
        sound = false;
    }
    let mut support = PrescribedDisplacement::free(key.to_owned(), &displaced.group);
    support.case = load_case(&displaced.name, displaced.preload);
    for (component, value) in displaced.components.iter().zip(value) {
        support.values[*component as usize] = Some(*value);
    }
    for (component, row) in displaced.components.iter().zip(&displaced.gradient) {
        support.gradient[*component as usize] = *row;
    }
    sound.then_some(support)
}

/// Reports foundations whose stiffness is negative or zero. Returns whether all foundations are valid.
fn check_foundations(r: &mut Resolver, key: &str, body: &FeBody) -> bool {
    let mut sound = true;
    for (i, foundation) in body.foundation.iter().enumerate() {
        let values = foundation.stiffness.values();
        if values.iter().any(|k| *k < 0.0) || values.iter().all(|k| *k == 0.0) {
            let message = format!("the stiffness {values:?} of a foundation is not positive");
            let mend = "give a positive stiffness; of three components one or two may be 0";
            r.report(&format!("{key}.foundation.{i}.stiffness"), message, "not positive", mend);
            sound = false;
        }
    }
    sound
}

pub(super) fn symmetry_supports(
    r: &mut Resolver,
    key: &str,
    body: &FeBody,
    mesh: &Mesh,
) -> Option<Vec<PrescribedDisplacement>> {
    let mut supports = Vec::new();
    for (i, group) in body.symmetry.iter().enumerate() {
        let place = format!("{key}.symmetry.{i}");
        let mend = "name a plane surface group of the mesh whose normal is along x, y or z";
        let component = r.accept(fem::symmetry_component(mesh, group), &place, ["this group", mend]);
        if let Some(component) = component {
            let mut support = PrescribedDisplacement::free(place, group);
            support.values[component] = Some(0.0);
            supports.push(support);
            refuse_force_across(r, key, body, group, component);
        }
    }
    (supports.len() == body.symmetry.len()).then_some(supports)
}

/// Refuses a body force along the normal `component` of the plane of symmetry `group`.
fn refuse_force_across(r: &mut Resolver, key: &str, body: &FeBody, group: &str, component: usize) {
    if body.body_force.value()[component] != 0.0 {
        let message = format!(
            "the body force has a component along {}, across the plane of symmetry \"{group}\": on the other side of the plane it would act in the opposite direction",
            AXIS_NAMES[component]
        );
        let mend = "remove this component, or mesh the whole body";
        r.report(&format!("{key}.body_force"), message, "not symmetric", mend);
    }
}

/// Reports components that are named twice, which is probably a typing error.
fn check_repeated_components(r: &mut Resolver, key: &str, components: &[Component]) {
    let twice = |(i, component): (usize, &Component)| components[..i].contains(component);
    if components.iter().enumerate().any(twice) {
        r.report(
            key,
            "a component is named twice",
            "named twice",
            "name each of \"x\", \"y\", \"z\" at most once",
        );
    }
}

pub(super) fn read_mesh(r: &mut Resolver, key: &str, name: &str) -> Option<Arc<Mesh>> {
    let place = format!("{key}.mesh");
    let path = r.file(&place, name);
    if path.is_dir() {
        let message = format!("{} is a folder, not a mesh file", path.display());
        return r.refuse(
            &place,
            message,
            "a folder",
            format!("name the file in it{}", mesh_files_in_folder(&path.join("x"))),
        );
    }
    if !path.is_file() {
        let message = format!("there is no mesh file {}", path.display());
        let mend =
            format!("paths are relative to the folder of the scene file{}", mesh_files_in_folder(&path));
        return r.refuse(&place, message, "no such file", mend);
    }
    match r.meshes.read(&path) {
        Ok(mesh) => Some(mesh),
        Err(error) => r.refuse(
            &place,
            error.to_string(),
            "this file",
            "orthowear reads .msh files of gmsh, versions 2.2 and 4.1",
        ),
    }
}

/// Reports unsuitable volume elements. Notes repairs by the mesh reader and elements of poor quality.
pub(super) fn check_quality(r: &mut Resolver, place: &str, mesh: &Arc<Mesh>) {
    mesh.warnings.iter().for_each(|warning| r.note(format!("{place}: {warning}")));
    let mend = "every solid element needs a positive volume, and elements must not overlap";
    let quality = r.accept(r.meshes.quality(mesh), place, ["this mesh", mend]);
    let warnings = quality.iter().flat_map(|quality| quality.warnings());
    r.notes.extend(warnings.map(|warning| warning.at(place)));
}

const MAX_LISTED_MESHES: usize = 8;

fn mesh_files_in_folder(path: &Path) -> String {
    let folder = match path.parent() {
        Some(folder) if !folder.as_os_str().is_empty() => folder,
        _ => Path::new("."),
    };
    let Ok(entries) = std::fs::read_dir(folder) else { return String::new() };
    let mut names: Vec<String> = entries
        .filter_map(|entry| entry.ok()?.file_name().into_string().ok())
        .filter(|name| name.ends_with(".msh"))
        .collect();
    names.sort();
    let more = match names.len().saturating_sub(MAX_LISTED_MESHES) {
        0 => String::new(),
        more => format!(" and {more} more"),
    };
    names.truncate(MAX_LISTED_MESHES);
    if names.is_empty() {
        String::new()
    } else {
        format!("; .msh files in {}: {}{more}", folder.display(), names.join(", "))
    }
}

pub(super) fn check_groups(r: &mut Resolver, key: &str, body: &FeBody, mesh: &Mesh) {
    let mut check = |place: String, found: Result<&PhysicalGroup>| {
        r.accept(found, &place, ["this group", "name a physical group of the mesh"]);
    };
    let surface = |name: &str| mesh.group_of_dim(name, 2);
    check(format!("{key}.contact"), surface(&body.contact));
    for (i, fixed) in body.fixed.iter().enumerate() {
        check(format!("{key}.fixed.{i}.group"), mesh.group_of_any_dim(&fixed.group));
    }
    for (i, displaced) in body.displaced.iter().enumerate() {
        check(format!("{key}.displaced.{i}.group"), mesh.group_of_any_dim(&displaced.group));
    }
    for (i, foundation) in body.foundation.iter().enumerate() {
        check(format!("{key}.foundation.{i}.group"), surface(&foundation.group));
    }
    for (i, load) in body.pressure.iter().enumerate() {
        check(format!("{key}.pressure.{i}.group"), surface(&load.group));
    }
    for (i, load) in body.traction.iter().enumerate() {
        check(format!("{key}.traction.{i}.group"), surface(&load.group));
    }
    for group in body.regions.keys() {
        check(join_key(&format!("{key}.regions"), group), mesh.group_of_dim(group, 3));
    }
}

pub(super) fn check_element(r: &mut Resolver, key: &str, element: Option<Element>, mesh: &Mesh) {
    let Some(element) = element else { return };
    let (name, kind) = match element {
        Element::Hex8Eas => ("hex8-eas", ElementKind::Hex8),
        Element::Hex8Bbar => ("hex8-bbar", ElementKind::Hex8),
        other => (kind_of(other).name(), kind_of(other)),
    };
    if mesh.volume_cells().any(|cell| mesh.kind(cell) == kind) {
        return;
    }
    let message = format!("`element` = \"{name}\", but {} has no elements of that type", mesh.source);
    let kinds: BTreeSet<&str> = mesh.volume_cells().map(|cell| mesh.kind(cell).name()).collect();
    let kinds: Vec<&str> = kinds.into_iter().collect();
    let mend = format!("omit `element` to use the default for this mesh; it has {}", kinds.join(", "));
    r.report(&format!("{key}.element"), message, "not in the mesh", mend);
}

const fn kind_of(element: Element) -> ElementKind {
    match element {
        Element::Hex8Eas | Element::Hex8 | Element::Hex8Bbar => ElementKind::Hex8,
        Element::Hex20 => ElementKind::Hex20,
        Element::Hex27 => ElementKind::Hex27,
        Element::Tet4 => ElementKind::Tet4,
        Element::Tet10 => ElementKind::Tet10,
        Element::Wedge6 => ElementKind::Wedge6,
        Element::Wedge15 => ElementKind::Wedge15,
        Element::Wedge18 => ElementKind::Wedge18,
        Element::Pyramid5 => ElementKind::Pyramid5,
        Element::Pyramid13 => ElementKind::Pyramid13,
        Element::Pyramid14 => ElementKind::Pyramid14,
    }
}
