//! Half and quarter models, cut at symmetry planes under the contact, against full models.
//!
//! Truth of all tests: the full model on the same mesh. Its solution is symmetric about the planes. Scenes that contradict the
//! symmetry must be refused.

use std::fs;
use std::path::Path;
use std::sync::atomic::AtomicBool;

use super::grids::{boxes, steps};
use crate::common::Silent;
use crate::mesh::writer::{VARIANTS, write};
use crate::stability::random::Random;
use orthowear::evolution::records::{IncrementRecord, Outcome};
use orthowear::geometry::Point;
use orthowear::mesh::Mesh;
use orthowear::simulation::build;

/// Scene of two blocks in contact: full blocks, halves (one symmetry plane) or quarters (two symmetry planes).
#[derive(Clone)]
struct Pair {
    /// Number of symmetry planes: 0 (full model), 1 (y = 0) or 2 (y = 0 and x = 0).
    planes: usize,
    /// Whether the top of body 1 is a paraboloid. Otherwise both bodies are flat, and the gap is the gap of a sphere.
    domed: bool,
    /// Numbers of elements of body 1 and of body 2: along half the width in x and in y, then along z.
    cells: [[usize; 2]; 2],
    /// Half the width of body 1 along x and y. Body 2 is 1.1 times as wide.
    half_width: f64,
    depth: f64,
    radius: f64,
    points: &'static str,
    element: &'static str,
    moduli: [f64; 3],
    friction: String,
    steps: String,
    solver: String,
}

impl Default for Pair {
    fn default() -> Self {
        Self {
            planes: 0,
            domed: false,
            cells: [[5, 3], [4, 3]],
            half_width: 1.5,
            depth: 1.5,
            radius: 40.0,
            points: "nodes",
            element: "hex8-bbar",
            moduli: [200e3, 120e3, 90e3],
            friction: "law = \"coulomb\"\nmu = 0.3".to_owned(),
            steps: PRESSED.to_owned(),
            solver: "tolerance = 1e-11".to_owned(),
        }
    }
}

const PRESSED: &str = "[[steps]]\nname = \"press\"\napproach = 0.02\n";
const SHIFTED: &str = "[[steps]]\nname = \"shift\"\nshift = { distance = 0.003 }\n";

struct Found {
    centers: Vec<Point>,
    tractions: Vec<f64>,
    records: Vec<IncrementRecord>,
    planes: Vec<[bool; 3]>,
}

impl Pair {
    fn with_planes(&self, planes: usize) -> Self {
        Self { planes, ..self.clone() }
    }

    /// Meshes of body 1 and body 2. Their contact groups are "high2" (body 1) and "low2" (body 2).
    fn meshes(&self) -> [Mesh; 2] {
        let block = |body: usize, width: f64, z: [f64; 2]| {
            let [n, layers] = self.cells[body];
            let across = |cut: bool| if cut { steps(0.0, width, n) } else { steps(-width, width, 2 * n) };
            [across(self.planes > 1), across(self.planes > 0), steps(z[0], z[1], layers)]
        };
        let (depth, radius) = (self.depth, self.radius);
        let lower = boxes(&block(0, self.half_width, [-depth, 0.0]), false, |[x, y, z]| {
            let drop = if self.domed { (x * x + y * y) / (2.0 * radius) } else { 0.0 };
            [x, y, z - drop * (1.0 + z / depth)]
        });
        [lower, boxes(&block(1, 1.1 * self.half_width, [0.0, depth]), false, |x| x)]
    }

    fn text(&self) -> String {
        let groups = ["", "\"low1\"", "\"low0\", \"low1\""][self.planes];
        let [e1, e2, e3] = self.moduli;
        let gap = if self.domed {
            "kind = \"mesh\"".to_owned()
        } else {
            format!("kind = \"sphere\"\nradius = {:?}", self.radius)
        };
        let (element, points) = (self.element, self.points);
        let body = |material: &str, mesh: &str, contact: &str, base: &str| {
            format!(
                "kind = \"fe\"\nmaterial = \"{material}\"\nmesh = \"{mesh}\"\ncontact = \"{contact}\"\nelement = \"{element}\"\n\
                 near_field = \"mesh\"\nsymmetry = [{groups}]\nfixed = [{{ group = \"{base}\" }}]\n"
            )
        };
        format!(
            "[materials.orthotropic]\nmodel = \"orthotropic\"\nE1 = {e1:?}\nE2 = {e2:?}\nE3 = {e3:?}\nG12 = 60e3\nG13 = 50e3\nG23 = 40e3\n\
             nu12 = 0.3\nnu13 = 0.25\nnu23 = 0.3\n[materials.steel]\nmodel = \"isotropic\"\nE = 200e3\nnu = 0.3\n\
             [body1]\n{}[body2]\n{}[frame]\nkind = \"mesh\"\nbody = 1\npoints = \"{points}\"\n[gap]\n{gap}\n[friction]\n{}\n{}\
             [solver]\n{}\n[output]\nfields = []\n",
            body("orthotropic", "lower.msh", "high2", "low2"),
            body("steel", "upper.msh", "low2", "high2"),
            self.friction,
            self.steps,
            self.solver
        )
    }

    fn write(&self, folder: &Path, name: &str, text: &str) {
        let [lower, upper] = self.meshes();
        fs::write(folder.join("lower.msh"), write(&lower, VARIANTS[0])).expect("a written mesh");
        fs::write(folder.join("upper.msh"), write(&upper, VARIANTS[0])).expect("a written mesh");
        fs::write(folder.join(name), text).expect("a written scene");
    }

    /// Results of the scene `text`, or the key and the message of its refusal.
    fn run_text(&self, text: &str) -> Result<Found, (String, String)> {
        let folder = tempfile::tempdir().expect("a folder");
        self.write(folder.path(), "scene.toml", text);
        let plan = orthowear::scene::read(&folder.path().join("scene.toml"), &[])
            .unwrap_or_else(|mistakes| panic!("{:?}", mistakes.to_error()));
        let study = build(&plan, &mut |_| {}, &AtomicBool::new(false))
            .map_err(|failure| (failure.key, failure.error.to_string()))?;
        let result = study.run(&mut Silent).expect("a run without errors");
        assert_eq!(result.outcome, Outcome::Converged, "{text}");
        let frame = &study.model().frame;
        Ok(Found {
            centers: frame.centers.clone(),
            tractions: result.state.tractions,
            records: result.records,
            planes: frame.symmetry_planes.clone().unwrap_or_else(|| vec![[false; 3]; frame.n_cells()]),
        })
    }

    fn run(&self) -> Found {
        self.run_text(&self.text()).unwrap_or_else(|(key, message)| panic!("{key}: {message}"))
    }
}

/// Largest relative difference of records and tractions between the model `part` and the model `full`. `full` consists of
/// `images` copies of `part`. Differences of tractions are divided by the peak pressure.
fn difference(part: &Found, full: &Found, images: f64) -> f64 {
    let mut worst = difference_of_records(part, full, images);
    let (n, all) = (part.centers.len(), full.centers.len());
    let peak = full.records.last().expect("a record").peak_pressure;
    for (cell, center) in part.centers.iter().enumerate() {
        let same = full.centers.iter().position(|other| (other - center).norm() < 1e-9);
        let other = same.unwrap_or_else(|| panic!("no cell at {center} in the full model"));
        for plane in 0..3 {
            let gap = part.tractions[plane * n + cell] - full.tractions[plane * all + other];
            worst = worst.max(gap.abs() / peak);
        }
    }
    worst
}

fn difference_of_records(part: &Found, full: &Found, images: f64) -> f64 {
    assert_eq!(part.records.len(), full.records.len());
    let mut worst = 0.0_f64;
    for (own, whole) in part.records.iter().zip(&full.records) {
        assert!(own.converged && whole.converged);
        worst = worst.max((images * own.normal_force / whole.normal_force - 1.0).abs());
        worst = worst.max((own.peak_pressure / whole.peak_pressure - 1.0).abs());
        worst = worst.max((images * own.stick_area - whole.stick_area).abs() / whole.contact_area);
        worst = worst.max((images * own.contact_area / whole.contact_area - 1.0).abs());
        worst = worst.max((own.approach / whole.approach - 1.0).abs());
        worst = worst.max((own.shift[0] - whole.shift[0]).abs() / whole.approach);
        if images == 2.0 {
            let pull = images * own.tangential_force[0] - whole.tangential_force[0];
            worst = worst.max(pull.abs() / whole.normal_force);
        }
    }
    worst
}

/// Asserts that the tangential traction across a symmetry plane is exactly zero in each cell at the plane. The axes of the frame
/// are parallel to the planes.
fn assert_nothing_across(found: &Found) {
    let n = found.centers.len();
    assert!(found.planes.iter().any(|planes| planes.contains(&true)));
    for (cell, planes) in found.planes.iter().enumerate() {
        for component in (0..2).filter(|&c| planes[c]) {
            assert_eq!(found.tractions[component * n + cell], 0.0, "cell {cell}");
        }
    }
}

/// Truth: the full model, to 1e-9 at a solver tolerance of 1e-11. If body 2 is rigid, only body 1 needs a symmetry plane.
#[test]
fn a_rigid_partner_needs_no_plane() {
    let pair = Pair { steps: [PRESSED, SHIFTED].concat(), ..Pair::default() };
    let found = |pair: &Pair| {
        let text = pair.text();
        let (before, rest) = text.split_once("[body2]").expect("a second body");
        let (_, after) = rest.split_once("[frame]").expect("a frame");
        let rigid = format!("{before}[body2]\nkind = \"rigid\"\n[frame]{after}");
        pair.run_text(&rigid).unwrap_or_else(|(key, message)| panic!("{key}: {message}"))
    };
    let half = found(&pair.with_planes(1));
    let difference = difference(&half, &found(&pair), 2.0);
    assert!(difference < 1e-9, "{difference:e}");
    assert_nothing_across(&half);
}

const METHODS: [&str; 5] = ["auto", "newton", "cg", "bb", "uzawa"];

/// Truth: the full model, to 1e-9 at a solver tolerance of 1e-11. The error of the tractions is larger than the residual by up to
/// the condition number of the operator.
#[test]
fn half_and_quarter_models_are_parts_of_the_full_one() {
    for domed in [false, true] {
        for points in ["nodes", "faces"] {
            let pair = Pair { domed, points, steps: [PRESSED, SHIFTED].concat(), ..Pair::default() };
            let full = pair.run();
            let slips = full.records[1].contact_area - full.records[1].stick_area;
            assert!(slips > 0.0 && full.records[1].stick_area > 0.0, "partial slip");
            let half = pair.with_planes(1).run();
            let pressed = Pair { steps: PRESSED.to_owned(), ..pair };
            let quarter = pressed.with_planes(2).run();
            let found = [difference(&half, &full, 2.0), difference(&quarter, &pressed.run(), 4.0)];
            println!("domed {domed}, {points}: half {:.1e}, quarter {:.1e}", found[0], found[1]);
            assert!(found.iter().all(|difference| *difference < 1e-9), "{found:?}");
            if points == "nodes" {
                assert_nothing_across(&half);
                assert_nothing_across(&quarter);
            }
        }
    }
}

/// Truth: the full model, to 1e-9.
#[test]
fn every_method_and_coupling_keeps_to_the_plane() {
    let pair =
        Pair { domed: true, cells: [[4, 2], [5, 2]], steps: [PRESSED, SHIFTED].concat(), ..Pair::default() };
    let full = pair.run();
    for coupling in ["schur", "block"] {
        for method in METHODS {
            let solver = format!("tolerance = 1e-11\nmethod = \"{method}\"\ncoupling = \"{coupling}\"");
            let half = Pair { solver, ..pair.with_planes(1) }.run();
            let found = difference(&half, &full, 2.0);
            println!("{coupling}, {method}: {found:.1e}");
            assert!(found < 1e-9, "{coupling} {method}: {found:e}");
            assert_nothing_across(&half);
        }
    }
}

/// Truth: the full model, under prescribed forces and under moments about y, the normal of the plane. The half model carries half
/// of these forces and moments. The tolerance is 1e-9 without cycles. In cycles, strokes are solved only to residuals of 1e-6.
/// Cycles therefore agree to 1e-5 with one cell per node, and to 1e-4 with one cell per face.
#[test]
fn prescribed_forces_keep_to_the_plane() {
    let loads = |part: f64| {
        format!(
            "[[steps]]\nname = \"press\"\nnormal_force = {:?}\n[[steps]]\nname = \"pull\"\ntangential_force = [{:?}, 0.0]\n\
             [[steps]]\nname = \"tilt\"\nmoment = [0.0, {:?}]\n",
            400.0 * part,
            60.0 * part,
            40.0 * part
        )
    };
    let fretting = |part: f64| {
        let amplitude = 30.0 * part;
        format!(
            "{}[[steps]]\nname = \"fret\"\ncycles = {{ count = 1, force_amplitude = {amplitude:?} }}\n",
            loads(part)
        )
    };
    for (domed, points) in [(false, "nodes"), (true, "nodes"), (false, "faces"), (true, "faces")] {
        let steps: [(&dyn Fn(f64) -> String, f64); 2] = [(&loads, 1e-9), (&fretting, 1e-5)];
        for (case, (steps, tolerance)) in steps.into_iter().enumerate() {
            let full = Pair { domed, points, steps: steps(1.0), ..Pair::default() };
            let half = Pair { steps: steps(0.5), ..full.with_planes(1) }.run();
            let full = full.run();
            // Tractions that alternate in sign from face to face hardly displace the bodies. Strokes with residuals of 1e-6 leave
            // these tractions inaccurate, so only the records are compared.
            let (found, tolerance) = if points == "faces" && case == 1 {
                (difference_of_records(&half, &full, 2.0), 1e-4)
            } else {
                (difference(&half, &full, 2.0), tolerance)
            };
            println!("domed {domed}, {points}: {found:.1e}");
            assert!(found < tolerance, "{found:e}");
            if points == "nodes" {
                assert_nothing_across(&half);
            }
        }
    }
}

/// A random scene. Its meshes, elements, materials, friction and loads are symmetric about y = 0.
fn drawn(random: &mut Random) -> Pair {
    let mut modulus = || random.power(4.6, 5.4);
    let moduli = [modulus(), modulus(), modulus()];
    // The mesh writer refuses meshes whose number of nodes is a multiple of seven. Three or six cells would give such meshes.
    let mut cells = || [[4, 5, 7, 8][random.below(4)], 2 + random.below(2)];
    let cells = [cells(), cells()];
    let domed = random.below(2) == 1;
    let element = ["hex8", "hex8-bbar", "hex8-eas"][random.below(3)];
    let radius = random.between(15.0, 60.0);
    let press = if random.below(2) == 0 {
        format!("approach = {:?}", random.between(0.01, 0.03))
    } else {
        format!("normal_force = {:?}", random.between(100.0, 800.0))
    };
    let shift = random.between(-0.006, 0.006);
    Pair {
        domed,
        cells,
        half_width: random.between(1.0, 2.0),
        depth: random.between(1.0, 2.0),
        radius,
        element,
        moduli,
        friction: format!("law = \"coulomb\"\nmu = {:?}", random.between(0.1, 0.8)),
        steps: format!(
            "[[steps]]\nname = \"press\"\n{press}\n[[steps]]\nname = \"shift\"\nshift = {{ distance = {:?}, angle = {:?} }}\n",
            shift.abs(),
            if shift < 0.0 { 180.0 } else { 0.0 }
        ),
        solver: "tolerance = 1e-10".to_owned(),
        ..Pair::default()
    }
}

/// Truth: the full model, to 1e-8 at a solver tolerance of 1e-10, for three of 30 random scenes. With
/// `ORTHOWEAR_SYMMETRY_SCENES=FOLDER` all 30 run, and their half and full models are written to this folder.
#[test]
fn random_half_models() {
    let folder = std::env::var_os("ORTHOWEAR_SYMMETRY_SCENES");
    let mut random = Random(1);
    let scenes: Vec<Pair> = (0..30).map(|_| drawn(&mut random)).collect();
    let mut worst = 0.0_f64;
    for (index, pair) in scenes.iter().enumerate() {
        let half = pair.with_planes(1);
        // The half model carries half of the normal force.
        let text = half.text().lines().map(halved).collect::<Vec<_>>().join("\n");
        if let Some(folder) = &folder {
            for (kind, pair, text) in [("half", &half, &text), ("full", pair, &pair.text())] {
                let place = Path::new(folder).join(format!("{index:02}-{kind}"));
                fs::create_dir_all(&place).expect("a folder");
                pair.write(&place, "scene.toml", text);
            }
        } else if !index.is_multiple_of(10) {
            continue;
        }
        let part = half.run_text(&text).unwrap_or_else(|(key, message)| panic!("{index} {key}: {message}"));
        let found = difference(&part, &pair.run(), 2.0);
        println!("{index}: {found:.1e}");
        assert_nothing_across(&part);
        worst = worst.max(found);
    }
    assert!(worst < 1e-8, "{worst:e}");
}

fn halved(line: &str) -> String {
    match line.strip_prefix("normal_force = ") {
        Some(force) => format!("normal_force = {:?}", 0.5 * force.parse::<f64>().expect("a number")),
        None => line.to_owned(),
    }
}

/// Contact frames that end at the symmetry plane of a half model: one cell per node, one cell per face, and a grid.
const FRAMES: [&str; 3] = [
    "kind = \"mesh\"\nbody = 1\npoints = \"nodes\"",
    "kind = \"mesh\"\nbody = 1\npoints = \"faces\"",
    "kind = \"grid\"\ncenter = [0.0, 0.6]\nhalf_width = [1.2, 0.6]\ncells = [8, 4]",
];

fn changed(frame: &str, changes: &[(&str, &str)]) -> Result<Found, (String, String)> {
    let half = Pair { steps: [PRESSED, SHIFTED].concat(), ..Pair::default() }.with_planes(1);
    let text = [&[(FRAMES[0], frame)], changes].concat().iter().fold(half.text(), |text, (from, to)| {
        assert!(text.contains(from), "{from}");
        text.replacen(from, to, 1)
    });
    half.run_text(&text)
}

fn refused(frame: &str, changes: &[(&str, &str)]) -> (String, String) {
    match changed(frame, changes) {
        Ok(_) => panic!("not refused on {frame}: {changes:?}"),
        Err(refusal) => refusal,
    }
}

const COULOMB: &str = "law = \"coulomb\"\nmu = 0.3";
const SHIFT: &str = "shift = { distance = 0.003 }";
const SYMMETRY: &str = "symmetry = [\"low1\"]";

/// Truth: symmetry excludes loads and motions across the plane, and a friction ellipse oblique to the plane. It also excludes a
/// plane of one body alone, and planes that move relative to each other.
#[test]
fn contradictions_are_refused() {
    let controls = [
        ("shift = { distance = 0.003, angle = 1.0 }", "steps.1.shift"),
        ("tangential_force = [10.0, 1.0]", "steps.1.tangential_force"),
        ("rotation = [0.01, 0.0]", "steps.1.rotation"),
        ("moment = [1.0, 0.0]", "steps.1.moment"),
        ("twist = 0.1", "steps.1.twist"),
        ("spin_moment = 1.0", "steps.1.spin_moment"),
        ("cycles = { count = 1, amplitude = 0.001, angle = 90.0 }", "steps.1.cycles"),
        ("cycles = { count = 1, force_amplitude = 1.0, angle = 45.0 }", "steps.1.cycles"),
        ("sliding = { distance = 1.0, angle = 90.0 }", "steps.1.sliding"),
    ];
    let oblique = "law = \"elliptic\"\nmu1 = 0.3\nmu2 = 0.4\nangle = 30.0";
    for frame in FRAMES {
        for (control, key) in controls {
            let (found, message) = refused(frame, &[(SHIFT, control)]);
            assert_eq!(found, key, "{frame}: {message}");
            assert!(message.contains("normal along y"), "{frame}: {message}");
        }
        let (key, message) = refused(frame, &[(COULOMB, oblique)]);
        assert!(key == "friction" && message.contains("oblique"), "{frame}, {key}: {message}");
    }
    let (key, message) =
        refused(FRAMES[0], &[("near_field = \"mesh\"\nsymmetry = [\"low1\"]", "near_field = \"mesh\"")]);
    assert!(key == "body2.symmetry.0" && message.contains("body1 has none"), "{key}: {message}");
    let moved = "displaced = [{ group = \"low1\", components = [\"y\"], value = [0.001] }]";
    let base = ("group = \"low2\" }", "group = \"low2\", components = [\"x\", \"z\"] }");
    let (key, message) = refused(FRAMES[0], &[(SYMMETRY, moved), base]);
    assert!(key == "body1.displaced.0" && message.contains("relative to each other"), "{key}: {message}");
}

/// Truth: loads, motions and friction laws that are symmetric about the plane are accepted.
#[test]
fn what_is_symmetric_is_accepted() {
    let along = "law = \"elliptic\"\nmu1 = 0.3\nmu2 = 0.4\nangle = 90.0";
    for frame in FRAMES {
        for change in
            [(SHIFT, "tangential_force = [10.0, 0.0]"), (SHIFT, "moment = [0.0, 1.0]"), (COULOMB, along)]
        {
            if let Err((key, message)) = changed(frame, &[change]) {
                panic!("{frame}, {change:?}: {key}: {message}");
            }
        }
    }
}

/// Truth: equivalent inputs give the same tractions, to 1e-9. The inputs are `fixed` supports instead of `symmetry`, explicit
/// zeros for motions across the plane, and equal displacements of both planes. An almost circular friction ellipse with an axis
/// along the plane agrees with Coulomb friction to 1e-6.
#[test]
fn planes_in_other_words() {
    let pair = Pair { steps: [PRESSED, SHIFTED].concat(), ..Pair::default() };
    let half = pair.with_planes(1);
    let (text, expected) = (half.text(), half.run());
    let fixed = "fixed = [{ group = \"low1\", components = [\"y\"] }, {";
    let moved = "displaced = [{ group = \"low1\", components = [\"y\"], value = [0.002] }]";
    let without = text.replace(SYMMETRY, "symmetry = []");
    let written = without.replace("fixed = [{", fixed);
    // The base must not fix the direction in which the plane moves.
    let free = |text: &str| text.replace("2\" }]", "2\", components = [\"x\", \"z\"] }]");
    let together = half.run_text(&free(&text.replace(SYMMETRY, moved))).expect("planes that move together");
    let at_rest = half.run_text(&free(&text)).expect("planes at rest");
    assert_nothing_across(&together);
    assert!(difference(&together, &at_rest, 1.0) < 1e-9);
    let zeros =
        text.replace(SHIFT, "shift = { distance = 0.003, angle = 0.0 }\ntwist = 0.0\nrotation = [0.0, 0.0]");
    let ellipse = text.replace(COULOMB, "law = \"elliptic\"\nmu1 = 0.3\nmu2 = 0.300000001\nangle = 0.0");
    for (text, tolerance) in [(written, 1e-9), (zeros, 1e-9), (ellipse, 1e-6)] {
        let found = half.run_text(&text).unwrap_or_else(|(key, message)| panic!("{key}: {message}"));
        assert_nothing_across(&found);
        let difference = difference(&found, &expected, 1.0);
        assert!(difference < tolerance, "{difference:e}: {text}");
    }
    // If a step prescribes a motion across fixed planes, these planes are rigid walls and not symmetry planes.
    let wall = text
        .replace(SYMMETRY, "symmetry = []")
        .replace("fixed = [{", fixed)
        .replace(SHIFT, "shift = { distance = 0.003, angle = 90.0 }");
    let found = half.run_text(&wall).unwrap_or_else(|(key, message)| panic!("{key}: {message}"));
    assert!(found.planes.iter().all(|planes| *planes == [false; 3]));
}
