//! Sweeps over difficult values of a parameter, with a scene for each value. docs/verification.md lists the named cases. The
//! audit checks the contact and friction conditions of a state in each cell.

use super::random::Random;
use super::scenes::{
    CFRP, FRP, SceneText, block, block_of, coulomb, cylinder, elliptic, fibre, finite_elements, forced,
    half_space, isotropic, moved, sphere, with_ratio,
};

use crate::structured::BlockElements;

/// Required end of a run.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum End {
    /// The run converges, and its states pass the audit.
    Certified,
    /// As `Certified`, or the run reports a reason for no convergence.
    Honest,
    Refused,
}

pub struct Case {
    pub sweep: &'static str,
    pub value: String,
    pub scene: String,
    pub mesh: Option<Vec<u8>>,
    pub end: End,
}

impl Case {
    fn new(sweep: &'static str, value: impl ToString, scene: &SceneText) -> Self {
        Self { sweep, value: value.to_string(), scene: scene.text(), mesh: None, end: End::Certified }
    }

    fn on(self, mesh: &[u8]) -> Self {
        Self { mesh: Some(mesh.to_vec()), ..self }
    }

    fn ends(self, end: End) -> Self {
        Self { end, ..self }
    }

    pub fn name(&self) -> String {
        format!("{} {}", self.sweep, self.value)
    }
}

/// Case `str-modulus-ratio`: E1 / E2 from 1 to 1e4.
pub fn modulus_ratio() -> Vec<Case> {
    let mesh = block(1.0, 1.0, 1.0);
    let ratios = [1.0, 10.0, 100.0, 1e3, 1e4];
    let half_spaces = ratios
        .iter()
        .map(|&ratio| Case::new("E1 / E2, half-space", ratio, &SceneText::half_space(&with_ratio(ratio))));
    let blocks = ratios.iter().map(|&ratio| {
        Case::new("E1 / E2, finite elements", ratio, &SceneText::block(&with_ratio(ratio), "")).on(&mesh)
    });
    half_spaces.chain(blocks).collect()
}

pub const POISSON: [f64; 5] = [0.3, 0.45, 0.49, 0.499, 0.4999];

/// Case `str-near-incompressible`: Poisson's ratios up to 0.4999, on a half-space and for four kinds of elements.
pub fn poisson() -> Vec<Case> {
    let mesh = block(1.0, 1.0, 1.0);
    let half_spaces =
        POISSON.iter().map(|&nu| Case::new("nu, half-space", nu, &SceneText::half_space(&isotropic(nu))));
    let meshed = [("nu, hex8", "hex8"), ("nu, hex8-eas", "hex8-eas"), ("nu, hex8-bbar", "hex8-bbar")];
    let blocks = meshed.iter().flat_map(|&(sweep, element)| {
        let mesh = &mesh;
        POISSON.iter().map(move |&nu| {
            let scene = SceneText::block(&isotropic(nu), &format!("element = \"{element}\""));
            Case::new(sweep, nu, &scene).on(mesh)
        })
    });
    let tetrahedra = block_of(BlockElements::Tet4, [1.0; 3]);
    let tetrahedra = POISSON
        .iter()
        .map(|&nu| Case::new("nu, tet4", nu, &SceneText::block(&isotropic(nu), "")).on(&tetrahedra));
    let beyond = [0.5, -1.0]
        .map(|nu| Case::new("nu, half-space", nu, &SceneText::half_space(&isotropic(nu))).ends(End::Refused));
    half_spaces.chain(blocks).chain(tetrahedra).chain(beyond).collect()
}

/// Scene with a fibre at `tilt` and `azimuth` (degrees) and a friction law that depends on the fibre direction.
pub fn tilted(tilt: f64, azimuth: f64) -> SceneText {
    let scene = SceneText::half_space(CFRP);
    SceneText { body1: half_space(&fibre(tilt, azimuth)), friction: FRP.to_owned(), ..scene }
}

/// Case `str-near-degenerate-roots`: fibres at and near angles where Stroh's eigenvalues coincide, and at random angles.
pub fn tilts() -> Vec<Case> {
    let tilts =
        [0.0, 1e-12, -1e-12, 1e-6, 30.0, 45.0, 60.0, -30.0, -45.0, 89.999_999, 90.0 - 1e-12, 90.0, -90.0];
    let azimuths = [1e-12, 90.0, 90.0 + 1e-12, 180.0 - 1e-6, 180.0];
    let mut random = Random(11);
    let anywhere: Vec<[f64; 2]> =
        (0..10).map(|_| [random.between(-90.0, 90.0), random.between(-180.0, 180.0)]).collect();
    let turned = azimuths.iter().map(|&azimuth| [30.0, azimuth]);
    let all = tilts.iter().map(|&tilt| [tilt, 0.0]).chain(turned).chain(anywhere);
    let cases = all.map(|[tilt, azimuth]| {
        Case::new("fibre's tilt, azimuth", format!("{tilt:?}, {azimuth:?}"), &tilted(tilt, azimuth))
    });
    let beyond = [90.1, 180.0].map(|tilt| {
        Case::new("fibre's tilt, azimuth", format!("{tilt:?}, 0"), &tilted(tilt, 0.0)).ends(End::Refused)
    });
    cases.chain(beyond).collect()
}

/// Case `str-friction-large`: isotropic and elliptic friction with coefficients up to 2.
pub fn coefficients() -> Vec<Case> {
    let mesh = block(1.0, 1.0, 1.0);
    let scene = |friction: String| SceneText { friction, ..tilted(30.0, 0.0) };
    let circles = [0.0_f64, 1e-100, 1e-12, 0.1, 0.5, 1.0, 1.5, 2.0];
    let mut cases = Vec::new();
    for mu in circles {
        let end = if mu > 1.0 { End::Honest } else { End::Certified };
        cases.push(Case::new("mu, half-space", format!("{mu:?}"), &scene(coulomb(mu))).ends(end));
        let end = if mu > 0.5 { End::Honest } else { End::Certified };
        let meshed = SceneText { friction: coulomb(mu), ..SceneText::block(CFRP, &fibre(30.0, 0.0)) };
        cases.push(Case::new("mu, finite elements", format!("{mu:?}"), &meshed).on(&mesh).ends(end));
    }
    let ellipses = [[0.1_f64, 0.5], [0.5, 0.1], [0.1, 2.0], [2.0, 0.1], [1.0, 2.0], [1e-3, 1.0]];
    for mu in ellipses {
        let end = if mu[0].max(mu[1]) > 0.5 { End::Honest } else { End::Certified };
        let value = format!("{:?}, {:?}", mu[0], mu[1]);
        cases.push(Case::new("mu1, mu2", value, &scene(elliptic(mu, 20.0))).ends(end));
    }
    for mu in [[0.0, 0.5], [1e-12, 2.0]] {
        let value = format!("{:?}, {:?}", mu[0], mu[1]);
        cases.push(Case::new("mu1, mu2", value, &scene(elliptic(mu, 20.0))).ends(End::Refused));
    }
    cases
}

/// Case `str-aspect-ratio`: elements and grid cells with aspect ratios up to 1000.
pub fn aspect_ratios() -> Vec<Case> {
    let mut cases = Vec::new();
    for ratio in [1.0, 10.0, 100.0, 1000.0] {
        let scene = SceneText::block(CFRP, &fibre(30.0, 0.0));
        cases.push(Case::new("aspect ratio, flat elements", ratio, &scene).on(&block(1.0, 1.0, ratio)));
        // `ratio` divides the lengths of body, frame and cells along y. The upper body is a cylinder along y.
        let slender = SceneText {
            half_width: [1.2, 1.2 / ratio],
            gap: "kind = \"cylinder\"\nradius = 10.0\nangle = 90.0".to_owned(),
            ..SceneText::block(&isotropic(0.3), "")
        };
        let solver = "max_iterations = 3000".to_owned();
        let end = if ratio > 10.0 { End::Honest } else { End::Certified };
        let slender = SceneText { solver, ..slender };
        cases.push(
            Case::new("aspect ratio, slender elements", ratio, &slender)
                .on(&block(1.0, ratio, 1.0))
                .ends(end),
        );
        let grid = SceneText { half_width: [1.2, 1.2 / ratio], ..SceneText::half_space(&isotropic(0.3)) };
        cases.push(Case::new("aspect ratio, cells of a grid", ratio, &grid));
    }
    cases
}

pub fn frames() -> Vec<Case> {
    let cells = [[1, 1], [1, 2], [2, 1], [3, 3], [2048, 2], [2, 2048]];
    let on = |cells: [usize; 2], gap: String| SceneText { cells, gap, ..tilted(30.0, 0.0) };
    let name = |cells: [usize; 2]| format!("{} x {}", cells[0], cells[1]);
    let round =
        cells.iter().map(|&cells| Case::new("cells, roller", name(cells), &on(cells, cylinder(10.0))));
    let flat = cells[..4]
        .iter()
        .map(|&cells| Case::new("cells, flat", name(cells), &on(cells, "kind = \"flat\"".to_owned())));
    let none = Case::new("cells, flat", "0 x 1", &on([0, 1], "kind = \"flat\"".to_owned()));
    round.chain(flat).chain([none.ends(End::Refused)]).collect()
}

/// Case `str-zero-load`: zero loads and the smallest loads that a scene may prescribe.
pub fn nothing() -> Vec<Case> {
    let mut cases = Vec::new();
    let scene = |steps: String| SceneText { steps, ..tilted(30.0, 0.0) };
    for value in [0.0, 1e-99, 1e-30, 1e-12] {
        let text = format!("{value:?}");
        cases.push(Case::new("force, pull", &text, &scene(forced(value, 0.2 * value))));
        cases.push(Case::new("approach, shift", &text, &scene(moved(value, value, 0.0))));
        cases.push(Case::new("shift", &text, &scene(moved(0.02, value, 0.0))));
    }
    // The smallest double is below the smallest number that a scene may contain, 1e-100.
    let least = 5e-324;
    let value = format!("{least:?}");
    cases.push(Case::new("force, pull", &value, &scene(forced(least, least))).ends(End::Refused));
    cases.push(Case::new("shift", &value, &scene(moved(0.02, least, 0.0))).ends(End::Refused));
    let small = SceneText { friction: coulomb(least), ..tilted(30.0, 0.0) };
    cases.push(Case::new("mu, half-space", &value, &small).ends(End::Refused));
    cases
}

/// A scene with all lengths multiplied by `length` and all stresses by `stress`.
pub fn scaled(length: f64, stress: f64, meshed: bool) -> Case {
    let moduli = [167_230.0, 9544.0, 5292.0, 3483.0].map(|modulus| modulus * stress);
    let [e1, e2, g12, g23] = moduli;
    let material = format!(
        "model = \"orthotropic\"\nE1 = {e1:?}\nE2 = {e2:?}\nE3 = {e2:?}\nG12 = {g12:?}\nG13 = {g12:?}\nG23 = {g23:?}\nnu12 = 0.272\n\
         nu13 = 0.272\nnu23 = 0.369"
    );
    let fibre = fibre(30.0, 0.0);
    let unit = stress * length * length;
    let scene = SceneText {
        body1: if meshed { finite_elements(&fibre) } else { half_space(&fibre) },
        half_width: [1.2 * length; 2],
        cells: [if meshed { 8 } else { 16 }; 2],
        gap: sphere(10.0 * length),
        friction: FRP.to_owned(),
        steps: moved(0.02 * length, 0.004 * length, 30.0) + &forced(300.0 * unit, 60.0 * unit),
        // The solution must be more accurate than the comparison, whose tolerance is 1e-9.
        solver: "tolerance = 1e-11".to_owned(),
        ..SceneText::half_space(&material)
    };
    let sweep = if meshed {
        "units of length, stress, finite elements"
    } else {
        "units of length, stress, half-space"
    };
    let case = Case::new(sweep, format!("{length:e}, {stress:e}"), &scene);
    if meshed { case.on(&block(length, 1.0, 1.0)) } else { case }
}

pub const SCALES: [[f64; 2]; 8] =
    [[1.0, 1.0], [1e-3, 1e6], [1e3, 1.0], [1e6, 1e-3], [1e-9, 1.0], [1e9, 1e-9], [1.0, 1e9], [1e-9, 1e9]];

/// Case `str-units-scale`: one contact in several units of length and stress.
pub fn units() -> Vec<Case> {
    let half_spaces = SCALES.iter().map(|&[length, stress]| scaled(length, stress, false));
    half_spaces.chain(SCALES.iter().map(|&[length, stress]| scaled(length, stress, true))).collect()
}

pub fn drawn() -> Vec<Case> {
    let mut random = Random(2024);
    (0..60).map(|k| draw(&mut random, k)).collect()
}

/// Random scene number `k`. The ratio of the friction coefficients is at most 32. For a ratio of 1000, many runs do not converge
/// within the iteration limit.
fn draw(random: &mut Random, k: usize) -> Case {
    let length = random.power(-6.0, 6.0);
    let e2 = random.power(0.0, 6.0);
    let e1 = e2 * random.power(0.0, 4.0);
    let g12 = e2 * random.power(-1.0, 0.0);
    let (nu12, nu23) = (random.between(0.0, 0.45), random.between(0.0, 0.6));
    let material = format!(
        "model = \"transversely-isotropic\"\nE1 = {e1:?}\nE2 = {e2:?}\nG12 = {g12:?}\nnu12 = {nu12:?}\nnu23 = {nu23:?}"
    );
    let tilt = [0.0, 90.0, -90.0, random.between(-90.0, 90.0)][random.below(4)];
    let mu = random.power(-2.0, 0.3);
    let ellipse = [mu, mu * random.power(-1.5, 0.0)];
    let approach = length * random.between(0.001, 0.05);
    let mut steps = moved(approach, approach * random.power(-6.0, 1.0), random.between(-180.0, 180.0));
    if random.below(3) == 0 {
        let back = approach * [0.0, 0.5, -1.0][random.below(3)];
        steps += &format!("[[steps]]\nname = \"release\"\napproach = {back:?}\n");
    }
    if random.below(3) == 0 {
        let pull = e2 * length * length * random.power(-8.0, -2.0);
        steps += &format!("[[steps]]\nname = \"pull\"\ntangential_force = [{pull:?}, 0.0]\n");
    }
    let scene = SceneText {
        body1: half_space(&fibre(tilt, random.between(-180.0, 180.0))),
        half_width: [1.2 * length, 1.2 * length * random.power(-1.5, 0.0)],
        cells: [1 + random.below(20), 1 + random.below(20)],
        gap: sphere(10.0 * length),
        friction: elliptic(ellipse, random.between(-90.0, 90.0)),
        steps,
        solver: "max_iterations = 4000".to_owned(),
        ..SceneText::half_space(&material)
    };
    Case::new("drawn", k, &scene).ends(End::Honest)
}
