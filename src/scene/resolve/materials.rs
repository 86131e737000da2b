//! Resolves materials: stiffness matrices from engineering constants.

use std::collections::BTreeMap;

use nalgebra::Matrix6;

use super::resolver::Resolver;
use crate::error::Result;
use crate::material::strength::MaterialStrength;
use crate::material::{Orthotropic, Stiffness};
use crate::scene::document::{Location, TomlValue, join_key};
use crate::scene::plan::BodyMaterial;
use crate::scene::spec::body::UniformFibre;
use crate::scene::spec::material::Material;
use crate::scene::suggest::{closest, quoted_list};

/// Maximum condition number of a stiffness matrix. The relative rounding error of its inverse is about 1e-16 times the
/// condition number.
const MAX_CONDITION: f64 = 1e12;

/// Ratio of the largest to the smallest modulus above which the moduli are reported as the cause of a nearly singular
/// stiffness.
const MAX_MODULUS_RATIO: f64 = 1e8;

/// Materials by name. `None` if the constants are invalid, which is reported.
pub(super) type Materials = BTreeMap<String, Option<ElasticMaterial>>;

#[derive(Clone)]
pub(super) struct ElasticMaterial {
    pub stiffness: Stiffness,
    pub isotropic: bool,
    /// Coefficients of thermal expansion along the material axes, if given.
    pub expansion: Option<[f64; 3]>,
    pub strength: Option<MaterialStrength>,
}

pub(super) fn resolve(r: &mut Resolver) -> Materials {
    let mut materials = Materials::new();
    let names = r.names("materials");
    // A body with a misspelt material name makes the correct material look unused. Unused materials are therefore noted
    // only if all names are defined.
    let all_defined = material_keys(r)
        .iter()
        .all(|(key, _)| material_name(r, key).is_none_or(|used| names.iter().any(|name| name == used)));
    for name in names {
        let key = join_key("materials", &name);
        let material: Option<Material> = r.section(&key);
        let elastic = material.and_then(|material| elastic_material(r, &key, &name, &material));
        if all_defined && material_users(r, &name).is_empty() {
            r.note(format!("the material `{name}` is not used by any body"));
        }
        materials.insert(name, elastic);
    }
    materials
}

fn elastic_material(r: &mut Resolver, key: &str, name: &str, material: &Material) -> Option<ElasticMaterial> {
    let isotropic = matches!(material, Material::Isotropic { .. });
    let stiffness = stiffness(material);
    // The schema check reports moduli that are not positive.
    let positive = moduli(material).iter().all(|(_, modulus)| *modulus > 0.0);
    if let (Err(error), true) = (&stiffness, positive) {
        let mend = match material {
            Material::Isotropic { .. } => {
                "nu must lie between -1 and 0.5, both excluded; nearly incompressible: 0.4999"
            }
            Material::Stiffness { .. } => "",
            _ => "nu_ij is the contraction along j under tension along i, and nu_ji = nu_ij E_j / E_i",
        };
        let users = material_users(r, name);
        let message = format!("the material `{name}`{users} is not admissible: {}", error.message());
        r.report(&place_of_constants(r, key, isotropic), message, "not admissible", mend);
    }
    let singular = stiffness.as_ref().ok().and_then(|stiffness| near_singularity(material, stiffness));
    if let Some((why, mend)) = &singular {
        let message = format!("the material `{name}`{} is nearly singular: {why}", material_users(r, name));
        r.report(&place_of_constants(r, key, isotropic), message, "nearly singular", *mend);
    }
    let strength = material.strength_limit();
    if let Some(strength) = strength {
        let place = if isotropic { "yield" } else { "strength" };
        let mend = "give all strengths as positive numbers, also those in compression";
        r.accept(strength.check(), &format!("{key}.{place}"), ["not admissible", mend]);
    }
    let expansion = thermal_expansion(r, key, name, material)?;
    let stiffness = stiffness.ok().filter(|_| singular.is_none())?;
    Some(ElasticMaterial { stiffness, isotropic, expansion, strength })
}

/// Coefficients of thermal expansion along the material axes; `Some(None)` if the material has none. `None` if some
/// coefficients are missing or invalid; the error is reported.
fn thermal_expansion(
    r: &mut Resolver,
    key: &str,
    name: &str,
    material: &Material,
) -> Option<Option<[f64; 3]>> {
    let found = material.thermal_expansions();
    let missing = found.iter().find(|(_, value)| value.is_none()).map(|(key, _)| *key);
    let given = found.iter().find(|(_, value)| value.is_some()).map(|(key, _)| *key);
    // The schema check reports numbers that are not finite. Their coefficient is `None` here although the key exists.
    let is_wrong = |(place, value): &(&str, Option<f64>)| {
        value.is_none() && r.document.get(&join_key(key, place)).is_some()
    };
    if found.iter().any(is_wrong) {
        return None;
    }
    if let (Some(missing), Some(given)) = (missing, given) {
        return r.refuse(
            &join_key(key, given),
            format!("the material `{name}` has `{given}`, but no `{missing}`"),
            &format!("without `{missing}`"),
            "give the coefficients of thermal expansion along all axes, or none",
        );
    }
    let [a, b, c] = found.map(|(_, value)| value);
    Some(a.zip(b).zip(c).map(|((a, b), c)| [a, b, c]))
}

/// Key at which an error of several constants together is reported.
///
/// The key is `key` if an override (`--set`) sets the whole material. Otherwise it is `nu` for an isotropic material.
/// For other materials it is the first constant that an override sets, with Poisson's ratios first. Without overrides
/// it is `key`.
fn place_of_constants(r: &Resolver, key: &str, isotropic: bool) -> String {
    let by_option = |place: &str| matches!(r.document.location(place), Location::SetOption(_));
    if isotropic && !by_option(key) {
        return join_key(key, "nu");
    }
    if by_option(key) {
        return key.to_owned();
    }
    let mut set: Vec<String> =
        r.names(key).into_iter().filter(|name| by_option(&join_key(key, name))).collect();
    set.sort_by_key(|name| !name.starts_with("nu"));
    set.first().map_or_else(|| key.to_owned(), |name| join_key(key, name))
}

fn moduli(material: &Material) -> Vec<(&'static str, f64)> {
    match *material {
        Material::Isotropic { E, .. } => vec![("E", E.0)],
        Material::TransverselyIsotropic { E1, E2, G12, .. } => {
            vec![("E1", E1.0), ("E2", E2.0), ("G12", G12.0)]
        }
        Material::Orthotropic { E1, E2, E3, G12, G13, G23, .. } => {
            vec![("E1", E1.0), ("E2", E2.0), ("E3", E3.0), ("G12", G12.0), ("G13", G13.0), ("G23", G23.0)]
        }
        Material::Stiffness { .. } => Vec::new(),
    }
}

/// Reason and remedy if the stiffness is numerically singular in double precision.
fn near_singularity(material: &Material, stiffness: &Stiffness) -> Option<(String, &'static str)> {
    let eigenvalues = stiffness.voigt().symmetric_eigenvalues();
    if eigenvalues.max() <= MAX_CONDITION * eigenvalues.min() {
        return None;
    }
    let moduli = moduli(material);
    let by_size = |a: &&(&str, f64), b: &&(&str, f64)| a.1.total_cmp(&b.1);
    let (reason, mend) = match (moduli.iter().min_by(by_size), moduli.iter().max_by(by_size)) {
        (Some((small, least)), Some((large, most))) if *most > MAX_MODULUS_RATIO * least => {
            let reason = format!("{small} = {least:e} is too small compared with {large} = {most:e}");
            (reason, "give all moduli in the same unit")
        }
        (Some(_), _) => {
            let ratios = if moduli.len() == 1 { "nu is" } else { "the Poisson's ratios are" };
            let reason = format!("{ratios} too close to the limit of admissible values");
            (reason, "give Poisson's ratios farther from their limits")
        }
        _ => ("some strain causes almost no stress".to_owned(), "give all entries in the same unit"),
    };
    let reason = format!(
        "{reason}; the eigenvalues of the stiffness matrix differ by a factor of more than {MAX_CONDITION:e}"
    );
    Some((reason, mend))
}

/// Bodies, volume groups and plies that use the material `name`, in parentheses for messages.
fn material_users(r: &Resolver, name: &str) -> String {
    let users = material_keys(r).into_iter().filter(|(key, _)| material_name(r, key) == Some(name));
    let places: Vec<String> = users.map(|(_, place)| place).collect();
    if places.is_empty() { String::new() } else { format!(" ({})", places.join(", ")) }
}

fn material_name<'a>(r: &Resolver<'a>, key: &str) -> Option<&'a str> {
    match r.document.get(key).map(|node| &node.value) {
        Some(TomlValue::String(text)) => Some(text.as_str()),
        _ => None,
    }
}

/// Keys that may contain the name of a material. Each key comes with its body, volume group or ply for messages.
fn material_keys(r: &Resolver) -> Vec<(String, String)> {
    let mut places = Vec::new();
    for body in ["body1", "body2"] {
        places.push((format!("{body}.material"), body.to_owned()));
        let regions = format!("{body}.regions");
        let mut owners = vec![body.to_owned()];
        for group in r.names(&regions) {
            let region = join_key(&regions, &group);
            places.push((format!("{region}.material"), format!("group \"{group}\" of {body}")));
            owners.push(region);
        }
        for layup in owners.iter().map(|owner| format!("{owner}.layup")) {
            let plies = format!("{layup}.plies");
            let ply = |i: usize| (format!("{plies}.{i}.material"), format!("ply {} of {layup}", i + 1));
            places.extend((0..r.list_length(&plies)).map(ply));
        }
    }
    places
}

fn stiffness(material: &Material) -> Result<Stiffness> {
    match *material {
        Material::Isotropic { E, nu, .. } => Stiffness::isotropic(E.0, nu),
        Material::TransverselyIsotropic { E1, E2, G12, nu12, nu23, .. } => {
            Stiffness::transversely_isotropic(E1.0, E2.0, G12.0, nu12, nu23)
        }
        Material::Orthotropic { E1, E2, E3, G12, G13, G23, nu12, nu13, nu23, .. } => {
            Stiffness::orthotropic(&Orthotropic {
                e1: E1.0,
                e2: E2.0,
                e3: E3.0,
                g12: G12.0,
                g13: G13.0,
                g23: G23.0,
                nu12,
                nu13,
                nu23,
            })
        }
        Material::Stiffness { ref C, .. } => Stiffness::from_voigt(Matrix6::from_fn(|i, j| C[i][j])),
    }
}

/// The material `name` with the fibre direction `fibre`. An undefined name is reported at the key `material` of the
/// table `key`.
pub(super) fn find_material(
    r: &mut Resolver,
    key: &str,
    name: &str,
    fibre: Option<UniformFibre>,
    materials: &Materials,
) -> Option<BodyMaterial> {
    let Some(found) = materials.get(name) else {
        let names: Vec<&str> = materials.keys().map(String::as_str).collect();
        let mut mend = format!("defined materials: {}", quoted_list(&names, "`"));
        if let Some(word) = closest(name, &names) {
            mend = format!("did you mean `{word}`? {mend}");
        } else if names.is_empty() {
            mend = format!("add a table [{}]", join_key("materials", name));
        }
        return r.refuse(
            &format!("{key}.material"),
            format!("the material `{name}` is not defined"),
            "not defined",
            mend,
        );
    };
    let ElasticMaterial { stiffness, isotropic, expansion, .. } = found.clone()?;
    let fibre = fibre.map(Into::into);
    Some(BodyMaterial { name: name.to_owned(), stiffness, isotropic, expansion, fibre })
}
