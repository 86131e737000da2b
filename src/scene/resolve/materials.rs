//! Materials: engineering constants to stiffnesses.

use std::collections::BTreeMap;

use nalgebra::Matrix6;

use super::Resolver;
use crate::error::Result;
use crate::material::strength::Limit;
use crate::material::{Orthotropic, Stiffness};
use crate::scene::keys::material::Material;

/// Materials by name; `None` where the constants are wrong (and reported).
pub(super) type Materials = BTreeMap<String, Option<(Stiffness, bool)>>;

/// The stiffness of each material and whether it is isotropic.
pub(super) fn resolve(r: &mut Resolver) -> Materials {
    let mut materials = Materials::new();
    for name in r.names("materials") {
        let key = format!("materials.{name}");
        let found: Option<Material> = r.section(&key);
        let stiffness = found.and_then(|material| match stiffness(&material) {
            Ok(stiffness) => Some((stiffness, matches!(material, Material::Isotropic { .. }))),
            Err(error) => {
                let mend = if matches!(material, Material::Isotropic { .. }) {
                    "E above 0 and nu between -1 and 0.5, both excluded"
                } else {
                    "nu_ij is the contraction along j under tension along i, and nu_ji = nu_ij E_j / E_i"
                };
                r.wrong(
                    &key,
                    format!("the material `{name}` is not admissible: {}", error.message()),
                    "not admissible",
                    mend,
                );
                None
            }
        });
        materials.insert(name, stiffness);
    }
    materials
}

/// What the materials bear, of those for which the scene says it.
pub(super) fn limits(r: &mut Resolver) -> BTreeMap<String, Limit> {
    let mut limits = BTreeMap::new();
    for name in r.names("materials") {
        let key = format!("materials.{name}");
        // A section that cannot be read is reported with the stiffness.
        let (clean, before) = (std::mem::replace(&mut r.clean, false), r.mistakes.len());
        let found: Option<Material> = r.section(&key);
        r.clean = clean;
        r.mistakes.truncate(before);
        let Some(limit) = found.and_then(|material| material.limit()) else { continue };
        match limit.check() {
            Ok(()) => {
                limits.insert(name, limit);
            }
            Err(error) => {
                let place = if let Limit::Yield(_) = limit { "yield" } else { "strength" };
                let mend = "strengths are positive, also those of compression";
                r.wrong(&format!("{key}.{place}"), error.message().to_owned(), "not admissible", mend);
            }
        }
    }
    limits
}

fn stiffness(material: &Material) -> Result<Stiffness> {
    match *material {
        Material::Isotropic { E, nu, .. } => Stiffness::isotropic(E, nu),
        Material::TransverselyIsotropic { E1, E2, G12, nu12, nu23, .. } => {
            Stiffness::transversely_isotropic(E1, E2, G12, nu12, nu23)
        }
        Material::Orthotropic { E1, E2, E3, G12, G13, G23, nu12, nu13, nu23, .. } => {
            Stiffness::orthotropic(&Orthotropic {
                e1: E1,
                e2: E2,
                e3: E3,
                g12: G12,
                g13: G13,
                g23: G23,
                nu12,
                nu13,
                nu23,
            })
        }
        Material::Stiffness { ref C, .. } => Stiffness::from_voigt(Matrix6::from_fn(|i, j| C[i][j])),
    }
}
