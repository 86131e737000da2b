//! Detects elements that lock in nearly incompressible materials.

use std::collections::BTreeSet;

use crate::element::ElementKind;
use crate::error::Warning;
use crate::fem::{ElementMaterials, HexFormulation};
use crate::geometry::format_number;
use crate::material::Stiffness;
use crate::mesh::Mesh;
use crate::scene::plan::MeshedBodyPlan;

/// Volumetric Poisson's ratio from which standard first-order elements are too stiff by some percent. For an isotropic
/// material, this ratio is Poisson's ratio. Loads of a block under a rigid sphere with `hex8` were compared with mean
/// dilatation. They are 2.5, 8, 31 and 154 % larger at ratios of 0.3, 0.45, 0.49 and 0.499.
const LOCKING_RATIO_STANDARD: f64 = 0.445;

/// As [`LOCKING_RATIO_STANDARD`], for enhanced hexahedra. At ratios of 0.45, 0.49, 0.499 and 0.4999, loads are 0, 1.2,
/// 5 and 18 % too large.
const LOCKING_RATIO_ENHANCED: f64 = 0.498;

/// Volumetric Poisson's ratio from which elements of a kind lock.
fn limit(kind: ElementKind, formulation: HexFormulation) -> Option<f64> {
    match (kind, formulation) {
        (ElementKind::Tet4 | ElementKind::Wedge6 | ElementKind::Pyramid5, _) => Some(LOCKING_RATIO_STANDARD),
        (ElementKind::Hex8, HexFormulation::Standard) => Some(LOCKING_RATIO_STANDARD),
        (ElementKind::Hex8, HexFormulation::Enhanced) => Some(LOCKING_RATIO_ENHANCED),
        _ => None,
    }
}

fn name(kind: ElementKind, formulation: HexFormulation) -> &'static str {
    if kind == ElementKind::Hex8 { formulation.name() } else { kind.name() }
}

pub(super) fn locking_warning(fe: &MeshedBodyPlan, key: &str) -> Option<Warning> {
    let mut placed = fe.regions.iter().flat_map(|(_, placement)| placement.materials());
    if !placed.any(|placed| placed.stiffness.volumetric_poisson_ratio() >= LOCKING_RATIO_STANDARD) {
        return None;
    }
    let inputs = fe.fem_spec(key);
    let regions = ElementMaterials::new(&inputs).ok()?;
    let found = Locking::new(&fe.mesh, &regions, inputs.formulation)?;
    Some(Warning::uncertain(&found.message(key)))
}

struct Locking {
    elements: usize,
    kinds: BTreeSet<&'static str>,
    only_hexahedra: bool,
    only_enhanced: bool,
    /// Largest volumetric Poisson's ratio of the locking elements, and the name of the material with this ratio.
    worst: (f64, String),
}

impl Locking {
    fn new(mesh: &Mesh, regions: &ElementMaterials, formulation: HexFormulation) -> Option<Self> {
        // Ratio of the last material, because neighbouring elements usually have the same material.
        let mut last: Option<(&Stiffness, f64)> = None;
        let mut found = Self {
            elements: 0,
            kinds: BTreeSet::new(),
            only_hexahedra: true,
            only_enhanced: formulation == HexFormulation::Enhanced,
            worst: (f64::NEG_INFINITY, String::new()),
        };
        for (i, &cell) in regions.cells().iter().enumerate() {
            let kind = mesh.kind(cell);
            let Some(limit) = limit(kind, formulation) else { continue };
            let placed = regions.material(i);
            let known = last.filter(|(stiffness, _)| std::ptr::eq(*stiffness, &placed.stiffness));
            let ratio = known.map_or_else(|| placed.stiffness.volumetric_poisson_ratio(), |(_, ratio)| ratio);
            last = Some((&placed.stiffness, ratio));
            if ratio < limit {
                continue;
            }
            found.elements += 1;
            found.kinds.insert(name(kind, formulation));
            found.only_hexahedra &= kind == ElementKind::Hex8;
            found.only_enhanced &= kind == ElementKind::Hex8;
            if ratio > found.worst.0 {
                found.worst = (ratio, placed.name.clone());
            }
        }
        (found.elements > 0).then_some(found)
    }

    fn message(&self, key: &str) -> String {
        let (ratio, material) = &self.worst;
        let kinds: Vec<&str> = self.kinds.iter().copied().collect();
        let mend = if self.only_hexahedra {
            format!("set {key}.element = \"hex8-bbar\", or use a mesh of second order")
        } else {
            "use a mesh of second order (gmsh: -order 2), or one of hexahedra with element = \"hex8-bbar\""
                .to_owned()
        };
        let excess = if self.only_enhanced {
            "loads of a block under a sphere were 5 % too large at nu = 0.499, 18 % at 0.4999"
        } else {
            "loads of a block under a sphere were 8 % too large at nu = 0.45, 31 % at 0.49, 154 % at 0.499"
        };
        format!(
            "{} elements ({}) of {key} lock, so that the body is too stiff: the material `{material}` is nearly incompressible (equivalent isotropic nu = {}; {excess}); {mend}",
            self.elements,
            kinds.join(", "),
            format_number(*ratio),
        )
    }
}
