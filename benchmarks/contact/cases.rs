//! Scenes of the benchmark, and the quantity whose error is reported.

use std::fmt::Write;
use std::path::Path;

use super::Outcome;
use super::rough::Rough;

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Case {
    /// (a) Frictionless Hertz contact under a prescribed force.
    Hertz,
    /// (b) Equal spheres, pressed and then pulled with 0.875 of the friction limit (Cattaneo and Mindlin).
    PartialSlip,
    /// (c) Steel sphere on CFRP with fibres at 30 degrees. One increment contains the approach and the shift at 45
    /// degrees.
    Fibres,
    /// (d) Frictionless contact of a self-affine rough surface. About 1 % of the frame is in contact.
    Roughness,
    /// (e) The load of (b), then two cycles of the force with 40 increments each.
    Cycles,
    /// (f) The spheres of (b) in steady rolling, with longitudinal and lateral creepage. About half of the contact
    /// slips.
    Rolling,
}

impl Case {
    pub const ALL: [Self; 6] =
        [Self::Hertz, Self::PartialSlip, Self::Fibres, Self::Roughness, Self::Cycles, Self::Rolling];

    /// Letter of the case on the command line and in the tables.
    pub fn letter(self) -> char {
        match self {
            Self::Hertz => 'a',
            Self::PartialSlip => 'b',
            Self::Fibres => 'c',
            Self::Roughness => 'd',
            Self::Cycles => 'e',
            Self::Rolling => 'f',
        }
    }

    /// Default numbers of cells along the frame.
    pub fn cells(self) -> &'static [usize] {
        if self == Self::Rolling { &[64, 128, 256] } else { &[64, 128, 256, 512, 1024] }
    }

    /// Number of increments by which the seconds are divided: the increments of both cycles in (e), 1 in all other
    /// cases.
    pub fn increments(self) -> usize {
        if self == Self::Cycles { 2 * 40 } else { 1 }
    }

    /// Number of transforms per application of the operator: forward and inverse for each component.
    pub fn transforms(self) -> f64 {
        if matches!(self, Self::Hertz | Self::Roughness) { 2.0 } else { 6.0 }
    }

    /// Value whose error is reported, from `last`, the last entry of `summary.steps`.
    pub fn quantity(self, last: &serde_json::Value) -> f64 {
        let number = |value: &serde_json::Value| value.as_f64().unwrap_or(f64::NAN);
        match self {
            Self::Hertz | Self::Roughness => number(&last["approach"]),
            Self::PartialSlip => number(&last["shift"][0]),
            Self::Fibres => number(&last["normal_force"]),
            Self::Rolling => number(&last["tangential_force"][0]),
            Self::Cycles => number(&last["dissipation"]),
        }
    }

    pub fn exact(self) -> Option<f64> {
        (self == Self::Hertz).then(|| hertz_radius(STEEL / (1.0 - NU * NU)).powi(2) / RADIUS)
    }

    /// Writes the scene and the files that it reads, with `n` x `n` cells. `method` is the value of `solver.method` in
    /// the scene. `width` is the contact diameter of spheres divided by the side of the frame.
    ///
    /// # Errors
    /// If a file cannot be written.
    pub fn write(self, folder: &Path, n: usize, (method, width): (&str, f64)) -> Outcome<()> {
        let mut scene = match self {
            Self::Hertz => bodies("rigid", hertz_radius(STEEL / (1.0 - NU * NU)) / width, n),
            Self::PartialSlip | Self::Cycles | Self::Rolling => {
                bodies("steel", hertz_radius(STEEL / (1.0 - NU * NU) / 2.0) / width, n)
            }
            Self::Fibres => fibres(n),
            Self::Roughness => {
                Rough::default().write(&folder.join("heights.csv"), n)?;
                bodies("rigid", 0.5, n)
            }
        };
        scene += match self {
            Self::Roughness => "[gap]\nkind = \"heights\"\nfile = \"heights.csv\"\n",
            Self::Fibres => "[gap]\nkind = \"sphere\"\nradius = 50.0\n",
            _ => "[gap]\nkind = \"sphere\"\nradius = 10.0\n",
        };
        scene += &self.steps();
        write!(scene, "[solver]\ntolerance = 1e-8\nmethod = \"{method}\"\n[output]\nfields = []\n")?;
        Ok(std::fs::write(folder.join("scene.toml"), scene)?)
    }

    fn steps(self) -> String {
        let press = format!("[[steps]]\nname = \"press\"\nnormal_force = {FORCE:?}\n");
        let coulomb = format!("[friction]\nlaw = \"coulomb\"\nmu = {MU:?}\n");
        let pull = |name: &str, share: f64, increments: usize| {
            let force = share * MU * FORCE;
            format!(
                "[[steps]]\nname = \"{name}\"\ntangential_force = [{force:?}, 0.0]\nincrements = {increments}\n"
            )
        };
        match self {
            Self::Hertz => format!("[friction]\nlaw = \"none\"\n{press}"),
            Self::Roughness => format!(
                "[friction]\nlaw = \"none\"\n[[steps]]\nname = \"press\"\nnormal_force = {:?}\n",
                Rough::default().force(STEEL / (1.0 - NU * NU))
            ),
            Self::PartialSlip => coulomb + &press + &pull("pull", 0.875, 1),
            Self::Cycles => {
                let mut text = coulomb + &press + &pull("first", 0.875, 10);
                for cycle in 1..=2 {
                    text += &pull(&format!("back {cycle}"), -0.875, 20);
                    text += &pull(&format!("forth {cycle}"), 0.875, 20);
                }
                text
            }
            Self::Rolling => {
                let full = MU * hertz_radius(STEEL / (1.0 - NU * NU) / 2.0) / RADIUS;
                let (along, across) = (0.4 * full, 0.2 * full);
                format!(
                    "{coulomb}{press}[[steps]]\nname = \"roll\"\nrolling = {{ creepage = [{along:?}, {across:?}], \
                     distance = 1.0 }}\n"
                )
            }
            Self::Fibres => {
                "[friction]\nlaw = \"frp\"\nmu_L = 0.4\nmu_T = 0.5\nmu_N = 0.55\n[[steps]]\nname = \"both\"\n\
                             approach = 0.02\nshift = { distance = 0.008, angle = 45.0 }\n"
                    .to_owned()
            }
        }
    }
}

const STEEL: f64 = 210e3;
const NU: f64 = 0.3;
const RADIUS: f64 = 10.0;
const FORCE: f64 = 1000.0;
const MU: f64 = 0.3;

fn hertz_radius(reduced: f64) -> f64 {
    (3.0 * FORCE * RADIUS / (4.0 * reduced)).cbrt()
}

/// Text of the bodies and the frame: a steel half-space below `upper` (rigid or steel).
fn bodies(upper: &str, half_width: f64, n: usize) -> String {
    let above =
        if upper == "rigid" { "kind = \"rigid\"" } else { "kind = \"half-space\"\nmaterial = \"steel\"" };
    format!(
        "[materials.steel]\nmodel = \"isotropic\"\nE = {STEEL:?}\nnu = {NU:?}\n[body1]\nkind = \"half-space\"\n\
         material = \"steel\"\n[body2]\n{above}\n[frame]\nkind = \"grid\"\nhalf_width = [{half_width:?}, {half_width:?}]\n\
         cells = [{n}, {n}]\n"
    )
}

fn fibres(n: usize) -> String {
    format!(
        "[materials.steel]\nmodel = \"isotropic\"\nE = 210e3\nnu = 0.3\n[materials.im7]\nmodel = \"orthotropic\"\n\
         E1 = 167230.0\nE2 = 9544.0\nE3 = 9544.0\nG12 = 5292.0\nG13 = 5292.0\nG23 = 3483.0\nnu12 = 0.272\nnu13 = 0.272\n\
         nu23 = 0.369\n[body1]\nkind = \"half-space\"\nmaterial = \"im7\"\nfibre = {{ tilt = 30.0, azimuth = 0.0 }}\n\
         [body2]\nkind = \"half-space\"\nmaterial = \"steel\"\n[frame]\nkind = \"grid\"\nhalf_width = [1.2, 1.2]\n\
         cells = [{n}, {n}]\n"
    )
}
