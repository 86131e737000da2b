//! Other descriptions of the bodies, for comparisons.

use std::sync::Arc;

use super::Resolver;
use super::bodies::{check_element, check_quality, read_mesh};
use super::boundary::{closed, interpolation};
use crate::mesh::Mesh;
use crate::mesh::faces::group_faces;
use crate::scene::keys::compare::{Compare, Others};
use crate::scene::plan::{BodySpec, MeshedSpec};
use crate::scene::variant::{CompareSpec, OtherMeshes, Pair};

/// The section `compare`, for these bodies.
pub(super) fn resolve(r: &mut Resolver, bodies: &[Option<BodySpec>; 2]) -> Option<CompareSpec> {
    let Compare { variants, body1, body2 } = r.section_or_default("compare")?;
    let mut pairs = Vec::new();
    for (i, text) in variants.iter().flatten().enumerate() {
        let key = format!("compare.variants.{i}");
        match text.parse::<Pair>() {
            Ok(pair) if pairs.contains(&pair) => {
                r.wrong(&key, format!("the variant {pair} is named twice"), "named twice", "name it once");
            }
            Ok(pair) => pairs.push(pair),
            Err(message) => {
                r.wrong(&key, message, "not a variant", "write FE, BE, HS, THS or rigid for each body")
            }
        }
    }
    let [body1, body2] = [(body1, "body1"), (body2, "body2")];
    let others = [other(r, body1, bodies[0].as_ref()), other(r, body2, bodies[1].as_ref())];
    Some(CompareSpec { variants: variants.map(|_| pairs), others })
}

/// The other meshes of a body.
fn other(r: &mut Resolver, (keys, name): (Others, &str), body: Option<&BodySpec>) -> OtherMeshes {
    let place = format!("compare.{name}");
    let of_kind = |kind: &str| format!("{place}.{kind}");
    let given = |kind: &str| r.document.get(&of_kind(kind)).is_some();
    let (be, fe) = (given("be"), given("fe"));
    for (is_given, kind, fits) in
        [(be, "be", matches!(body, Some(BodySpec::Fe(_)))), (fe, "fe", matches!(body, Some(BodySpec::Be(_))))]
    {
        if is_given && !fits && body.is_some() {
            let other = if kind == "be" { "fe" } else { "be" };
            let message = format!("compare.{name}.{kind} applies only if {name}.kind = \"{other}\"");
            let mend = format!("remove it; the keys of a body of kind \"{kind}\" belong in [{name}]");
            r.wrong(&of_kind(kind), message, "does not fit", mend);
        }
    }
    let meshed = body.and_then(BodySpec::meshed);
    let surface = keys.be.mesh.as_ref().zip(meshed).and_then(|(file, meshed)| {
        let key = of_kind("be");
        let mesh = read_mesh(r, &key, file)?;
        let mesh = closed(r, &format!("{key}.mesh"), &mesh)?;
        check_groups(r, &format!("{key}.mesh"), meshed, &mesh)
    });
    let solids = keys.fe.mesh.as_ref().zip(meshed).and_then(|(file, meshed)| {
        let key = of_kind("fe");
        let mesh = read_mesh(r, &key, file)?;
        check_quality(r, &format!("{key}.mesh"), &mesh);
        mesh.volume_cells().next()?;
        check_element(r, &key, keys.fe.element, &mesh);
        check_groups(r, &format!("{key}.mesh"), meshed, &mesh)
    });
    if let (None, Some(BodySpec::Be(be))) = (&keys.fe.mesh, body)
        && let Some(solids) = &be.solids
    {
        check_element(r, &of_kind("fe"), keys.fe.element, solids);
    }
    OtherMeshes {
        surface,
        interpolation: interpolation(keys.be.element),
        solids,
        element: keys.fe.element,
        near_field: keys.fe.near_field,
    }
}

/// The mesh, unless it lacks groups of the body's own: those are reported.
fn check_groups(r: &mut Resolver, place: &str, meshed: &MeshedSpec, mesh: &Mesh) -> Option<Arc<Mesh>> {
    let before = r.mistakes.len();
    // What is no group of surfaces stands in the way of the variant, not of the scene.
    for group in meshed.groups().filter(|group| group_faces(&meshed.mesh, group).is_ok()) {
        if let Err(error) = group_faces(mesh, group) {
            let mend =
                "the second mesh of a body needs the same contact, support and load groups as the first";
            r.wrong(place, error.message().to_owned(), "this mesh", mend);
        }
    }
    (r.mistakes.len() == before).then(|| Arc::new(mesh.clone()))
}
