//! Refused scenes: exit code 2, with the key, the line, the value found and the fix. Several mistakes are reported together.

use std::fs;
use std::path::Path;
use std::process::Output;

/// A valid scene that needs no mesh.
pub const SOUND: &str = r#"title = "sound"
[materials.steel]
model = "isotropic"
E = 210e3
nu = 0.3
[materials.cfrp]
model = "transversely-isotropic"
E1 = 167230.0
E2 = 9544.0
G12 = 5292.0
nu12 = 0.272
nu23 = 0.37
[body1]
kind = "half-space"
material = "cfrp"
fibre = { tilt = 30.0, azimuth = 0.0 }
[body2]
kind = "half-space"
material = "steel"
[frame]
kind = "grid"
half_width = [1.2, 1.2]
cells = [16, 16]
[gap]
kind = "sphere"
radius = 50.0
[friction]
law = "frp"
mu_L = 0.4
mu_T = 0.5
mu_N = 0.55
[wear]
law = "energy"
k = 1.25e-9
[[steps]]
name = "indent"
approach = 0.02
[[steps]]
name = "fretting"
cycles = { count = 1000, amplitude = 0.05, jumps = 4 }
[solver]
tolerance = 1e-8
[output]
fields = []
"#;

fn check_bytes(folder: &Path, scene: &[u8], options: &[&str]) -> (Option<i32>, String) {
    let path = folder.join("scene.toml");
    fs::write(&path, scene).unwrap();
    let Output { status, stderr, .. } = crate::tools::orthowear()
        .current_dir(folder)
        .args(["check", "scene.toml"])
        .args(options)
        .output()
        .unwrap();
    (status.code(), String::from_utf8(stderr).unwrap())
}

pub fn check(scene: &str, options: &[&str]) -> (Option<i32>, String) {
    let folder = tempfile::tempdir().unwrap();
    check_bytes(folder.path(), scene.as_bytes(), options)
}

/// `SOUND` with `from` replaced by `to`, and the line (from 1) of the first changed byte.
fn changed(from: &str, to: &str) -> (String, usize) {
    assert!(SOUND.contains(from), "`{from}` is not in the sound scene");
    let line = 1 + SOUND[..SOUND.find(from).unwrap()].matches('\n').count();
    (SOUND.replacen(from, to, 1), line)
}

/// Truth: docs/scene.md: the unchanged scene is valid.
#[test]
fn the_sound_scene_is_accepted() {
    let (code, text) = check(SOUND, &[]);
    assert_eq!(code, Some(0), "{text}");
}

/// Text to replace, its replacement, number of lines from the change down to the reported line, and words of the message.
type Row = (&'static str, &'static str, usize, &'static [&'static str]);

const TABLE: &[Row] = &[
    // Invalid TOML, and a frame too far from the origin.
    ("radius = 50.0", "radius = 50,0", 0, &["not valid TOML", "decimals with a point"]),
    ("radius = 50.0", "radius = ", 0, &["not valid TOML"]),
    ("radius = 50.0", "radius = 50.0\nradius = 40.0", 1, &["duplicate key", "keep one"]),
    ("[gap]", "[gap", 0, &["not valid TOML"]),
    ("title = \"sound\"", "title = \"sound", 0, &["not valid TOML"]),
    ("[body2]", "[body1]", 0, &["duplicate key"]),
    ("E = 210e3", "E = 210.e3", 0, &["not valid TOML"]),
    (
        "[frame]",
        "[frame]\ncenter = [1e13, 0.0]",
        1,
        &["the frame lies 1e13 mm from the global origin, where coordinates are rounded to 0.00222 mm"],
    ),
    // Unknown keys and words.
    ("radius = 50.0", "raduis = 50.0", 0, &["gap.raduis", "did you mean `radius`"]),
    ("[solver]", "[slover]", 0, &["no key `slover`", "did you mean `solver`"]),
    ("tolerance = 1e-8", "tolerence = 1e-8", 0, &["solver.tolerence", "did you mean `tolerance`"]),
    ("kind = \"sphere\"", "kind = \"spere\"", 0, &["gap.kind", "did you mean \"sphere\""]),
    ("law = \"frp\"", "law = \"columb\"", 0, &["friction.law", "\"coulomb\"", "\"elliptic\""]),
    ("model = \"isotropic\"", "model = \"iso\"", 0, &["materials.steel.model", "\"orthotropic\""]),
    ("material = \"steel\"", "material = \"steel\"\nmesh = \"a.msh\"", 1, &["it belongs to kind = \"fe\""]),
    ("tilt = 30.0", "titl = 30.0", 0, &["body1.fibre.titl", "did you mean `tilt`"]),
    ("k = 1.25e-9", "k = 1.25e-9\ni_L = 5.0e-10", 1, &["wear.i_L", "it belongs to law = \"frp\""]),
    (
        "k = 1.25e-9",
        "k = 1.25e-9\nbeyond_critical = true",
        1,
        &["wear.beyond_critical", "no key `beyond_critical` any more", "sdirk2"],
    ),
    ("fields = []", "fields = [\"vtk\"]", 0, &["output.fields.0", "\"vtu\""]),
    // Missing keys.
    ("radius = 50.0\n", "", 0, &["`gap` lacks `radius`"]),
    ("kind = \"grid\"\n", "", 0, &["`frame` lacks `kind`", "\"grid\", \"mesh\""]),
    ("mu_T = 0.5\n", "", 0, &["`friction` lacks `mu_T`"]),
    ("nu = 0.3\n", "", 0, &["`materials.steel` lacks `nu`"]),
    ("material = \"cfrp\"\n", "", 0, &["`body1` lacks `material`"]),
    ("count = 1000, ", "", 0, &["lacks `count`"]),
    ("amplitude = 0.05, ", "", 0, &["steps.1.cycles", "lacks an amplitude"]),
    // Wrong types.
    ("radius = 50.0", "radius = \"50.0\"", 0, &["the text \"50.0\"", "remove the quotes"]),
    ("radius = 50.0", "radius = \"50,0\"", 0, &["with a point and without quotes: 50.0"]),
    ("radius = 50.0", "radius = true", 0, &["gap.radius", "must be a number"]),
    ("radius = 50.0", "radius = 1979-05-27", 0, &["gap.radius", "the date"]),
    ("radius = 50.0", "radius = [50.0]", 0, &["gap.radius", "a list of 1"]),
    ("cells = [16, 16]", "cells = 16", 0, &["frame.cells", "a list of 2 values"]),
    ("cells = [16, 16]", "cells = [16]", 0, &["frame.cells", "has 1 value", "a list of 2 values"]),
    ("half_width = [1.2, 1.2]", "half_width = [1,2, 1,2]", 0, &["has 4 values", "with a point"]),
    ("cells = [16, 16]", "cells = [16.5, 16]", 0, &["frame.cells.0", "not a whole number"]),
    ("cells = [16, 16]", "cells = [99999999999999999999, 16]", 0, &["frame.cells.0"]),
    ("title = \"sound\"", "title = 7", 0, &["title", "a text in double quotes"]),
    ("name = \"indent\"", "friction = \"no\"", 0, &["steps.0.friction", "true or false"]),
    ("fibre = { tilt = 30.0, azimuth = 0.0 }", "fibre = 30.0", 0, &["body1.fibre", "a table"]),
    // Numbers out of bounds.
    ("radius = 50.0", "radius = -50.0", 0, &["gap.radius", "-50", "above 0"]),
    ("radius = 50.0", "radius = 0.0", 0, &["gap.radius", "above 0"]),
    ("radius = 50.0", "radius = nan", 0, &["gap.radius", "not a finite number"]),
    ("radius = 50.0", "radius = inf", 0, &["gap.radius", "not a finite number"]),
    ("radius = 50.0", "radius = 1e999", 0, &["gap.radius", "not a finite number"]),
    ("approach = 0.02", "approach = -inf", 0, &["steps.0.approach", "not a finite number"]),
    ("half_width = [1.2, 1.2]", "half_width = [1.2, nan]", 0, &["frame.half_width.1", "not a finite number"]),
    ("cells = [16, 16]", "cells = [0, 16]", 0, &["frame.cells.0", "at least 1"]),
    ("cells = [16, 16]", "cells = [-4, 16]", 0, &["frame.cells.0", "at least 1"]),
    ("tilt = 30.0", "tilt = 100.0", 0, &["body1.fibre.tilt", "at least -90 and at most 90"]),
    ("mu_L = 0.4", "mu_L = -0.4", 0, &["friction.mu_L", "at least 0"]),
    ("k = 1.25e-9", "k = -1.0", 0, &["wear.k", "at least 0"]),
    ("count = 1000", "count = 0", 0, &["steps.1.cycles.count", "at least 1"]),
    ("amplitude = 0.05", "amplitude = 0.0", 0, &["steps.1.cycles.amplitude", "above 0"]),
    ("tolerance = 1e-8", "tolerance = 0.0", 0, &["solver.tolerance", "above 0 and below 1"]),
    ("E = 210e3", "E = 0", 0, &["materials.steel.E", "above 0"]),
    // Contradictions and values without meaning.
    ("nu = 0.3", "nu = 0.5", 0, &["materials.steel", "not admissible", "between -1 and 0.5"]),
    ("nu12 = 0.272", "nu12 = 9.0", 0, &["materials.cfrp", "not admissible"]),
    ("material = \"steel\"", "material = \"stel\"", 0, &["body2.material", "did you mean `steel`", "`cfrp`"]),
    ("approach = 0.02", "approach = 0.02\nnormal_force = 3.0", 1, &["steps.0.normal_force", "not both"]),
    (
        "approach = 0.02",
        "shift = { distance = 0.1 }\ntangential_force = [1.0, 0.0]",
        1,
        &["steps.0.tangential_force", "not both"],
    ),
    (
        "approach = 0.02",
        "approach = 0.02\nfriction = false\ntangential_force = [1.0, 0.0]",
        2,
        &["steps.0.tangential_force", "no friction"],
    ),
    (
        "approach = 0.02",
        "rotation = [0.1, 0.0]\nmoment = [1.0, 0.0]",
        1,
        &["steps.0.moment", "`rotation` or `moment`, not both"],
    ),
    (
        "approach = 0.02",
        "twist = 0.1\nspin_moment = 1.0",
        1,
        &["steps.0.spin_moment", "`twist` or `spin_moment`, not both"],
    ),
    (
        "approach = 0.02",
        "friction = false\nspin_moment = 1.0",
        1,
        &[
            "steps.0.spin_moment",
            "a spin moment is prescribed, but this step has no friction",
            "prescribe the displacement `twist`",
        ],
    ),
    (
        "approach = 0.02\n",
        "approach = 0.02\nspin_moment = 1.0\n[[steps]]\nname = \"after\"\nfriction = false\n",
        4,
        &["steps.1.friction", "the spin moment of step \"indent\" is still active"],
    ),
    ("name = \"fretting\"", "moment = [1.0, 0.0]", 0, &["steps.1.moment", "together with `cycles`"]),
    ("jumps = 4", "jumps = 4000", 0, &["steps.1.cycles.jumps", "4000 jumps for 1000 cycles"]),
    ("name = \"fretting\"", "twist = 0.03", 0, &["steps.1.twist", "together with `cycles`"]),
    ("name = \"fretting\"", "increments = 3", 0, &["steps.1.increments", "cycles.increments"]),
    (
        "name = \"fretting\"",
        "sliding = { distance = 1.0 }",
        0,
        &["steps.1.sliding", "together with `cycles`"],
    ),
    (
        "cycles = { count = 1000, amplitude = 0.05, jumps = 4 }",
        "sliding = { distance = 1.0 }\nshift = { distance = 0.1 }",
        1,
        &["steps.1.shift", "together with `sliding`"],
    ),
    (
        "jumps = 4",
        "force_amplitude = 1.0",
        0,
        &["steps.1.cycles.force_amplitude", "together with `amplitude`"],
    ),
    ("jumps = 4", "amplitude2 = 1.0", 0, &["steps.1.cycles.amplitude2", "path = \"ellipse\""]),
    ("jumps = 4", "path = \"ellipse\"", 0, &["steps.1.cycles.path", "lacks `amplitude2`"]),
    ("jumps = 4", "increments = true", 0, &["steps.1.cycles.increments", "a whole number or \"auto\""]),
    (
        "jumps = 4",
        "increments = \"automatic\"",
        0,
        &["steps.1.cycles.increments", "allowed: a whole number or \"auto\""],
    ),
    (
        "jumps = 4",
        "path = \"ellipse\", amplitude2 = 0.01, increments = 1",
        0,
        &["steps.1.cycles.increments", "too few"],
    ),
    (
        "cycles = { count = 1000, amplitude = 0.05, jumps = 4 }",
        "cycles = { count = 1000, force_amplitude = 0.05 }\nfriction = false",
        0,
        &["steps.1.cycles.force_amplitude", "needs friction"],
    ),
    (
        "cycles = { count = 1000, amplitude = 0.05, jumps = 4 }",
        "cycles = { count = 1000, amplitude = 0.05, jumps = 4 }\nfriction = false",
        1,
        &["steps.1.friction", "wear law \"energy\"", "`wear = false`"],
    ),
    ("k = 1.25e-9", "k = 1.25e-9\ntolerance = 0.0", 1, &["wear.tolerance"]),
    ("fibre = { tilt = 30.0, azimuth = 0.0 }\n", "", 0, &["friction.law", "neither body has"]),
    (
        "material = \"steel\"",
        "material = \"steel\"\nfibre = { tilt = 0.0 }",
        0,
        &["friction.law", "both bodies have a fibre", "`body = 1`"],
    ),
    ("mu_N = 0.55", "mu_N = 0.55\nbody = 2", 1, &["friction.body", "has no `fibre`"]),
    ("kind = \"sphere\"\nradius = 50.0", "kind = \"mesh\"", 0, &["gap.kind", "neither body has one"]),
    (
        "kind = \"grid\"\nhalf_width = [1.2, 1.2]\ncells = [16, 16]",
        "kind = \"mesh\"",
        0,
        &["frame.kind", "neither body has a mesh"],
    ),
    (
        "kind = \"half-space\"\nmaterial = \"steel\"",
        "kind = \"fe\"\nmaterial = \"steel\"\nmesh = \"no.msh\"\ncontact = \"c\"\nfixed = [{ group = \"b\" }]",
        2,
        &["body2.mesh", "no mesh file", "no.msh"],
    ),
    (
        "kind = \"sphere\"\nradius = 50.0",
        "kind = \"heights\"\nfile = \"no.csv\"",
        1,
        &["gap.file", "no.csv", "cannot be used"],
    ),
    // Misspelt kinds, growing and periodic frames, rolling.
    ("kind = \"half-space\"", "kind = \"bee\"", 0, &["body1.kind", "did you mean \"be\""]),
    ("cells = [16, 16]", "cells = [16, 16]\ngrow = 2", 1, &["frame.grow", "true or false"]),
    (
        "cells = [16, 16]",
        "cells = [1, 1]\nperiodic = [true, true]",
        0,
        &["frame.cells", "one cell", "more cells"],
    ),
    (
        "approach = 0.02",
        "approach = 0.02\nrolling = { direction = 45.0, creepage = [1e-3, 0.0] }",
        1,
        &["steps.0.rolling.direction", "frame.azimuth"],
    ),
    (
        "cycles = { count = 1000, amplitude = 0.05, jumps = 4 }",
        "rolling = { spin = 1e-3 }\nfriction = false",
        0,
        &["steps.1.rolling", "needs friction"],
    ),
];

/// Truth: docs/scene.md, exit code 2 of docs/command-line.md: each row contains one mistake, reported with key and line.
#[test]
fn each_mistake_is_refused_with_its_key_and_line() {
    for (from, to, below, words) in TABLE {
        let (scene, line) = changed(from, to);
        let (code, text) = check(&scene, &[]);
        assert_eq!(code, Some(2), "`{from}` -> `{to}`:\n{text}");
        for word in *words {
            assert!(text.contains(word), "`{from}` -> `{to}` lacks \"{word}\":\n{text}");
        }
        // Missing keys, unusable materials and laws are reported at their table. The line is then not the changed line.
        let exact = !to.is_empty() && !words[0].contains("law") && !words[0].contains("lacks");
        let place = format!("scene.toml:{}:", line + below);
        let at_table = words[0].starts_with("materials");
        assert!(!exact || at_table || text.contains(&place), "`{from}` -> `{to}` lacks {place}\n{text}");
        assert!(text.contains("--> scene.toml:"), "no place in the file:\n{text}");
    }
}

/// Truth: docs/scene.md: one mistake is reported once.
#[test]
fn a_mistake_is_told_once() {
    let roll = "rolling = { creepage = [1e-3, 0.0], distance = -1.0 }";
    let (scene, _) = changed("cycles = { count = 1000, amplitude = 0.05, jumps = 4 }", roll);
    let (code, text) = check(&scene, &[]);
    assert_eq!((code, text.matches("rolling.distance").count()), (Some(2), 1), "{text}");
    let (scene, _) = changed("mu_N = 0.55", "mu_N = -1.0");
    let (code, text) = check(&scene, &[]);
    assert!(code == Some(2) && !text.contains("along one axis"), "{text}");
    let (scene, _) = changed("kind = \"half-space\"\nmaterial = \"cfrp\"", "kind = \"rigid\"");
    let (code, text) = check(&scene, &[]);
    let advice = "friction.law = \"frp\" needs the fibre of a body that is not rigid";
    assert!(code == Some(2) && text.contains(advice) && !text.contains("neither body has"), "{text}");
    let (scene, _) = changed("fibre = { tilt = 30.0, azimuth = 0.0 }", "");
    let (code, text) = check(&scene, &["--set", "steps.0.incremens=2"]);
    assert!(code == Some(2) && text.contains("neither body has") && text.contains("incremens"), "{text}");
    let (scene, _) = changed("material = \"steel\"", "material = \"stel\"");
    let (code, text) = check(&scene, &[]);
    assert!(code == Some(2) && text.contains("did you mean `steel`") && !text.contains("not used"), "{text}");
}

/// Truth: the scene and its override contain seven independent mistakes. `check` reports all of them.
#[test]
fn mistakes_are_reported_together() {
    let mut scene = SOUND.to_owned();
    for (from, to) in [
        ("radius = 50.0", "raduis = -50.0"),
        ("nu = 0.3", "nu = 0.7"),
        ("material = \"cfrp\"", "material = \"cfrpp\""),
        ("cells = [16, 16]", "cells = [0, 16]"),
        ("approach = 0.02", "approach = \"deep\""),
        ("jumps = 4", "jumps = 4000"),
    ] {
        scene = scene.replacen(from, to, 1);
    }
    let (code, text) = check(&scene, &["--set", "solver.tolerance=-1"]);
    assert_eq!(code, Some(2));
    for word in [
        "gap.raduis",
        "materials.steel",
        "body1.material",
        "frame.cells.0",
        "steps.0.approach",
        "steps.1.cycles.jumps",
        "--set solver.tolerance=-1",
        "7 errors in scene.toml",
    ] {
        assert!(text.contains(word), "lacks \"{word}\":\n{text}");
    }
}

/// Truth: docs/command-line.md: a mistake in an override is reported with the option.
#[test]
fn overrides_are_checked_like_the_file() {
    for (option, words) in [
        ("gap.raduis=3", &["gap.raduis", "did you mean `radius`"][..]),
        ("gap.radius=-3", &["gap.radius", "above 0"]),
        ("gap.radius", &["has no `=`"]),
        ("=3", &["is not a valid key"]),
        ("gap..radius=3", &["is not a valid key"]),
        ("gap.radius=", &["the value after `=` is missing"]),
        ("gap.radius=3,5", &["has a decimal comma", "write a decimal point: 3.5"]),
        ("steps.7.approach=0.1", &["no element `7`"]),
        (
            "steps.indnt.approach=0.1",
            &["no element `indnt`", "Did you mean \"indent\"?", "named \"indent\", \"fretting\""],
        ),
        ("gap.radius.x=1", &["not a table"]),
        ("solver.method=newtn", &["\"newtn\"", "\"bb\""]),
    ] {
        let (code, text) = check(SOUND, &["--set", option]);
        assert_eq!(code, Some(2), "{option}\n{text}");
        assert!(text.contains(&format!("--set {option}")), "{option}\n{text}");
        for word in words {
            assert!(text.contains(word), "{option} lacks \"{word}\"\n{text}");
        }
    }
    let named = SOUND.replace("name = \"fretting\"", "name = \"0\"");
    let (code, text) = check(&named, &["--set", "steps.0.approach=0.01"]);
    assert!(code == Some(2) && text.contains("`0` is the name of element 1"), "{text}");
    let (code, text) = check(&named.replace("indent", "1"), &["--set", "steps.1.cycles.jumps=3"]);
    assert!(code == Some(2) && text.contains("`1` is the name of element 0"), "{text}");
    let (code, text) = check(SOUND, &["--set", "steps=[]"]);
    assert!(code == Some(2) && text.contains("`steps` has 0 values"), "{text}");
    for option in [
        "gap.radius=25",
        "steps.indent.approach=0.01",
        "steps.0.approach=0.01",
        "solver.method=bb",
        "title=../fine.msh",
        "title=/data/fine.msh",
    ] {
        let (code, text) = check(SOUND, &["--set", option]);
        assert_eq!(code, Some(0), "{option}\n{text}");
    }
}

/// Truth: TOML 1.1: a byte order mark, LF and CRLF are allowed, and text is UTF-8.
#[test]
fn encodings() {
    let folder = tempfile::tempdir().unwrap();
    let crlf = SOUND.replace('\n', "\r\n");
    let bom = format!("\u{feff}{SOUND}");
    for sound in [crlf.as_bytes(), bom.as_bytes()] {
        let (code, text) = check_bytes(folder.path(), sound, &[]);
        assert_eq!(code, Some(0), "{text}");
    }
    for wrong in [crlf.replace("raduis", "").replace("radius", "raduis"), bom.replace("radius", "raduis")] {
        let (code, text) = check_bytes(folder.path(), wrong.as_bytes(), &[]);
        assert_eq!(code, Some(2), "{text}");
        assert!(text.contains("--> scene.toml:26:1\n") && text.contains("raduis = 50.0"), "{text}");
    }
    let latin1 = SOUND.replace("sound", "S\u{1}").into_bytes();
    let latin1: Vec<u8> = latin1.into_iter().map(|byte| if byte == 1 { 0xE9 } else { byte }).collect();
    let utf16: Vec<u8> = SOUND.encode_utf16().flat_map(u16::to_le_bytes).collect();
    for (bytes, word) in [
        (latin1, "not UTF-8"),
        (Vec::new(), "the scene lacks `body1`"),
        (b"# only a comment\n".to_vec(), "the scene lacks `steps`"),
        (vec![0xff, 0xfe, 0x00], "not UTF-8"),
        (utf16, "not valid TOML"),
        ("[".repeat(100_000).into_bytes(), "not valid TOML"),
        (format!("a = {}", "[".repeat(50_000)).into_bytes(), "not valid TOML"),
    ] {
        let (code, text) = check_bytes(folder.path(), &bytes, &[]);
        assert_eq!(code, Some(2), "{}", &text[..text.len().min(2000)]);
        assert!(text.contains(word), "lacks \"{word}\": {}", &text[..text.len().min(2000)]);
    }
}

/// Truth: TOML continues an array or inline table without closing bracket on the next line. The only error is therefore at the
/// changed line or at the next line.
#[test]
fn a_missing_bracket_is_one_mistake() {
    for (from, to) in [("cells = [16, 16]", "cells = [16, 16"), ("jumps = 4 }", "jumps = 4")] {
        let (text, line) = changed(from, to);
        let (code, said) = check(&text, &[]);
        assert_eq!(code, Some(2), "{said}");
        assert_eq!(said.matches("not valid TOML").count(), 1, "{said}");
        let at = said.split("scene.toml:").nth(1).and_then(|rest| rest.split(':').next()).unwrap();
        assert!((line..=line + 1).contains(&at.parse().unwrap()), "line {at}, not {line}: {said}");
    }
    let (text, _) = changed("cells = [16, 16]", "cells = [16,16]]");
    assert!(!check(&text, &[]).1.contains("write decimals with a point"));
    let (text, _) = changed("radius = 50.0", "radius = 50,0");
    assert!(check(&text, &[]).1.contains("write decimals with a point"));
}

/// Truth: docs/command-line.md: scenes that cannot be read and wrong arguments give the exit code 2.
#[test]
fn scenes_that_cannot_be_read() {
    let folder = tempfile::tempdir().unwrap();
    for arguments in [
        &["check", "missing.toml"][..],
        &["check", "."],
        &["run", "missing.toml"],
        &["run"],
        &["run", "a.toml", "--threads", "0"],
        &["run", "a.toml", "--threads", "many"],
        &["run", "a.toml", "--resume"],
        &["walk", "a.toml"],
        &["check", "a.toml", "--sett", "x=1"],
    ] {
        let output = crate::tools::orthowear().current_dir(folder.path()).args(arguments).output().unwrap();
        let text = String::from_utf8(output.stderr).unwrap();
        assert_eq!(output.status.code(), Some(2), "{arguments:?}\n{text}");
        assert!(!text.is_empty(), "{arguments:?}");
    }
    assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 0, "a refused run leaves nothing behind");
}
