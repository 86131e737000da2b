//! Scenes and meshes for the sweeps.

use orthowear::geometry::Side;

use super::writer::{VARIANTS, write};

use crate::structured::{BlockElements, GradedBlock};

/// Scene keys of the material CFRP IM7/8551-7, with nu23 = 0.369.
pub const CFRP: &str = "model = \"orthotropic\"\nE1 = 167230.0\nE2 = 9544.0\nE3 = 9544.0\nG12 = 5292.0\nG13 = 5292.0\nG23 = 3483.0\n\
                        nu12 = 0.272\nnu13 = 0.272\nnu23 = 0.369";

#[derive(Clone)]
pub struct SceneText {
    pub material: String,
    pub body1: String,
    pub half_width: [f64; 2],
    pub cells: [usize; 2],
    pub gap: String,
    pub friction: String,
    pub steps: String,
    pub solver: String,
}

impl SceneText {
    /// A rigid sphere of radius 10 on a half-space with Coulomb friction, mu = 0.3. The sphere is pressed, then displaced at 30
    /// degrees to x.
    pub fn half_space(material: &str) -> Self {
        Self {
            material: material.to_owned(),
            body1: half_space(""),
            half_width: [1.2; 2],
            cells: [16; 2],
            gap: sphere(10.0),
            friction: coulomb(0.3),
            steps: moved(0.02, 0.004, 30.0),
            solver: String::new(),
        }
    }

    pub fn block(material: &str, more: &str) -> Self {
        Self { body1: finite_elements(more), cells: [8; 2], ..Self::half_space(material) }
    }

    pub fn text(&self) -> String {
        let Self { material, body1, half_width: [x, y], cells, gap, friction, steps, solver } = self;
        format!(
            "[materials.m]\n{material}\n[body1]\nmaterial = \"m\"\n{body1}\n[body2]\nkind = \"rigid\"\n\
             [frame]\nkind = \"grid\"\nhalf_width = [{x:?}, {y:?}]\ncells = {cells:?}\n[gap]\n{gap}\n\
             [friction]\n{friction}\n{steps}[solver]\n{solver}\n[output]\nfields = []\n"
        )
    }
}

pub fn isotropic(nu: f64) -> String {
    format!("model = \"isotropic\"\nE = 210e3\nnu = {nu:?}")
}

/// Scene keys of the material of case `str-modulus-ratio`: E1 = `ratio` E2, E2 = 10 GPa.
pub fn with_ratio(ratio: f64) -> String {
    let e2 = 10e3;
    let (e1, g12, g23) = (e2 * ratio, e2 / 2.0, e2 / 2.6);
    format!(
        "model = \"orthotropic\"\nE1 = {e1:?}\nE2 = {e2:?}\nE3 = {e2:?}\nG12 = {g12:?}\nG13 = {g12:?}\nG23 = {g23:?}\nnu12 = 0.3\n\
         nu13 = 0.3\nnu23 = 0.3"
    )
}

pub fn half_space(more: &str) -> String {
    format!("kind = \"half-space\"\n{more}")
}

/// Scene key of the fibre direction. Angles are in degrees.
pub fn fibre(tilt: f64, azimuth: f64) -> String {
    format!("fibre = {{ tilt = {tilt:?}, azimuth = {azimuth:?} }}")
}

/// Scene keys of a finite-element body that is clamped at its base.
pub fn finite_elements(more: &str) -> String {
    format!(
        "kind = \"fe\"\nmesh = \"block.msh\"\ncontact = \"contact\"\nfixed = [{{ group = \"base\" }}]\nnear_field = \"mesh\"\n{more}"
    )
}

pub fn sphere(radius: f64) -> String {
    format!("kind = \"sphere\"\nradius = {radius:?}")
}

/// Scene keys of the gap under a cylinder along x.
pub fn cylinder(radius: f64) -> String {
    format!("kind = \"cylinder\"\nradius = {radius:?}\nangle = 0.0")
}

pub fn coulomb(mu: f64) -> String {
    format!("law = \"coulomb\"\nmu = {mu:?}")
}

pub fn elliptic(mu: [f64; 2], angle: f64) -> String {
    format!("law = \"elliptic\"\nmu1 = {:?}\nmu2 = {:?}\nangle = {angle:?}", mu[0], mu[1])
}

pub const FRP: &str = "law = \"frp\"\nmu_L = 0.4\nmu_T = 0.5\nmu_N = 0.55";

pub fn moved(approach: f64, distance: f64, angle: f64) -> String {
    format!(
        "[[steps]]\nname = \"indent\"\napproach = {approach:?}\n[[steps]]\nname = \"shift\"\n\
         shift = {{ distance = {distance:?}, angle = {angle:?} }}\n"
    )
}

pub fn forced(force: f64, pull: f64) -> String {
    format!(
        "[[steps]]\nname = \"press\"\nnormal_force = {force:?}\n[[steps]]\nname = \"pull\"\ntangential_force = [{pull:?}, 0.0]\n"
    )
}

/// Contents of a mesh file with a block 12 x 12 x 6 times `unit`. The contact patch of 2.4 x 2.4 times `unit` has 12 x 12
/// hexahedra. `slender` divides all lengths along y. `flat` divides the height of the uppermost elements.
pub fn block(unit: f64, slender: f64, flat: f64) -> Vec<u8> {
    block_of(BlockElements::Hex8, [unit, slender, flat])
}

pub fn block_of(solids: BlockElements, [unit, slender, flat]: [f64; 3]) -> Vec<u8> {
    let graded = GradedBlock {
        half_width: [6.0 * unit, 6.0 * unit / slender],
        depth: 6.0 * unit,
        patch_half_width: [1.2 * unit, 1.2 * unit / slender],
        patch_cells: [12; 2],
        outer_cells: 3,
        depth_cells: 5,
        first_depth: Some(0.2 * unit / flat),
        solids,
        side: Side::Lower,
        distortion: 0.0,
    };
    write(&graded.mesh().expect("an admissible block"), VARIANTS[0])
}
