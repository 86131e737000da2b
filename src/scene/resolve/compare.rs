//! Resolves the variants of the bodies for comparisons.

use std::sync::Arc;

use super::be_body::closed_surface;
use super::bodies::{check_element, check_quality, read_mesh};
use super::resolver::Resolver;
use crate::mesh::Mesh;
use crate::mesh::faces::group_faces;
use crate::scene::plan::{BodyPlan, MeshedBodyPlan};
use crate::scene::spec::compare::{AlternativeModels, Compare};
use crate::scene::variant::{AlternativeMeshes, ComparePlan, DiscretisationPair};

pub(super) fn resolve(r: &mut Resolver, bodies: &[Option<BodyPlan>; 2]) -> Option<ComparePlan> {
    let Compare { variants, body1, body2 } = r.section_or_default("compare")?;
    let mut pairs = Vec::new();
    for (i, text) in variants.iter().flatten().enumerate() {
        let key = format!("compare.variants.{i}");
        match text.parse::<DiscretisationPair>() {
            Ok(pair) if pairs.contains(&pair) => {
                r.report(&key, format!("the variant {pair} is named twice"), "named twice", "name it once");
            }
            Ok(pair) => pairs.push(pair),
            Err(message) => {
                r.report(&key, message, "not a variant", "write FE, BE, HS, THS or rigid for each body")
            }
        }
    }
    let alternatives = [
        alternative_meshes(r, body1, "body1", bodies[0].as_ref()),
        alternative_meshes(r, body2, "body2", bodies[1].as_ref()),
    ];
    Some(ComparePlan { variants: variants.map(|_| pairs), alternatives })
}

fn alternative_meshes(
    r: &mut Resolver,
    keys: AlternativeModels,
    name: &str,
    body: Option<&BodyPlan>,
) -> AlternativeMeshes {
    let place = format!("compare.{name}");
    let of_kind = |kind: &str| format!("{place}.{kind}");
    let given = |kind: &str| r.document.get(&of_kind(kind)).is_some();
    let (be, fe) = (given("be"), given("fe"));
    for (is_given, kind, fits) in
        [(be, "be", matches!(body, Some(BodyPlan::Fe(_)))), (fe, "fe", matches!(body, Some(BodyPlan::Be(_))))]
    {
        if is_given && !fits && body.is_some() {
            let other = if kind == "be" { "fe" } else { "be" };
            let message = format!("compare.{name}.{kind} applies only if {name}.kind = \"{other}\"");
            let mend = format!("remove it; the keys of a body of kind \"{kind}\" belong in [{name}]");
            r.report(&of_kind(kind), message, "does not fit", mend);
        }
    }
    let meshed = body.and_then(BodyPlan::as_meshed);
    let surface = keys.be.mesh.as_ref().zip(meshed).and_then(|(file, meshed)| {
        let key = of_kind("be");
        let mesh = read_mesh(r, &key, file)?;
        let mesh = Arc::new(closed_surface(r, &format!("{key}.mesh"), &mesh)?);
        mesh_with_groups(r, &format!("{key}.mesh"), meshed, &mesh)
    });
    let solids = keys.fe.mesh.as_ref().zip(meshed).and_then(|(file, meshed)| {
        let key = of_kind("fe");
        let mesh = read_mesh(r, &key, file)?;
        check_quality(r, &format!("{key}.mesh"), &mesh);
        mesh.volume_cells().next()?;
        check_element(r, &key, keys.fe.element, &mesh);
        mesh_with_groups(r, &format!("{key}.mesh"), meshed, &mesh)
    });
    if let (None, Some(BodyPlan::Be(be))) = (&keys.fe.mesh, body)
        && let Some(solids) = &be.solids
    {
        check_element(r, &of_kind("fe"), keys.fe.element, solids);
    }
    AlternativeMeshes {
        surface,
        interpolation: keys.be.element,
        solids,
        element: keys.fe.element,
        near_field: keys.fe.near_field,
    }
}

/// Returns `mesh` if it has all surface groups of the body. Otherwise reports the missing groups and returns `None`.
fn mesh_with_groups(
    r: &mut Resolver,
    place: &str,
    meshed: &MeshedBodyPlan,
    mesh: &Arc<Mesh>,
) -> Option<Arc<Mesh>> {
    let before = r.diagnostics.len();
    // Only outer surface groups are required. If another group is missing, the scene is valid, but a variant may be
    // impossible.
    for group in meshed.groups().filter(|group| group_faces(&meshed.mesh, group).is_ok()) {
        let mend = "the second mesh of a body needs the same contact, support and load groups as the first";
        r.accept(group_faces(mesh, group), place, ["this mesh", mend]);
    }
    (r.diagnostics.len() == before).then(|| mesh.clone())
}
