//! Load histories, height maps and outlines from the scene to the results.

use std::fs;
use std::path::Path;

use serde_json::Value;

fn scene(outline: &str, gap: &str, steps: &str) -> String {
    format!(
        r#"[materials.steel]
model = "isotropic"
E = 210e3
nu = 0.3
[body1]
kind = "half-space"
material = "steel"
[body2]
kind = "rigid"
[frame]
kind = "grid"
half_width = [0.5, 0.5]
cells = [20, 20]
{outline}
[gap]
{gap}
[friction]
law = "coulomb"
mu = 0.3
[output]
fields = []
{steps}
"#
    )
}

const SPHERE: &str = "kind = \"sphere\"\nradius = 10.0";

fn run(folder: &Path, scene: &str) -> (Option<i32>, String, Value) {
    fs::write(folder.join("scene.toml"), scene).unwrap();
    let output = crate::tools::orthowear()
        .current_dir(folder)
        .args(["run", "scene.toml", "--out", "out"])
        .output()
        .unwrap();
    let text = String::from_utf8(output.stderr).unwrap();
    let summary = fs::read(folder.join("out/summary.json")).unwrap_or_default();
    (output.status.code(), text, serde_json::from_slice(&summary).unwrap_or(Value::Null))
}

fn steps(summary: &Value) -> Vec<Value> {
    summary["steps"].as_array().cloned().unwrap_or_default()
}

/// Truth: docs/scene.md: each row of a load history is a load point. The results equal, bit by bit, the results of a scene with
/// one step per row.
#[test]
fn a_history_is_its_steps() {
    let folder = tempfile::tempdir().unwrap();
    fs::write(
        folder.path().join("loads.csv"),
        "# measured\ntime,normal_force,shift_x,twist\n0,200,0,0\n1,200,0.0005,0.01\n2,150,-0.0002,0.0\n",
    )
    .unwrap();
    let columns = r#"columns = ["-", "normal_force", "shift_x", "twist"]"#;
    let history = format!(
        "[[steps]]\nname = \"loads\"\nincrements = 2\nhistory = {{ file = \"loads.csv\", {columns} }}"
    );
    let (code, text, by_file) = run(folder.path(), &scene("", SPHERE, &history));
    assert_eq!(code, Some(0), "{text}");
    let by_hand: String = [(200.0, 0.0, 0.0), (200.0, 0.0005, 0.01), (150.0, -0.0002, 0.0)]
        .into_iter()
        .map(|(force, shift, twist)| {
            format!(
                "[[steps]]\nnormal_force = {force}\nshift = {{ distance = {shift} }}\nrotation = [0.0, 0.0]\ntwist = {twist}\n\
                 increments = 2\n"
            )
        })
        .collect();
    let (code, text, by_hand) = run(folder.path(), &scene("", SPHERE, &by_hand));
    assert_eq!(code, Some(0), "{text}");
    let (found, wanted) = (steps(&by_file), steps(&by_hand));
    assert_eq!((found.len(), wanted.len()), (6, 6));
    for (i, (found, wanted)) in found.iter().zip(&wanted).enumerate() {
        assert_eq!((&found["name"], &found["increment"]), (&Value::from("loads"), &Value::from(i + 1)));
        for key in ["normal_force", "tangential_force", "moment", "shift", "twist", "approach", "dissipation"]
        {
            assert_eq!(found[key], wanted[key], "{i} {key}");
        }
    }
    assert!(found[5]["dissipation"].as_f64() > Some(0.0));
    // RFC 4180: quotes around a field do not belong to its value.
    fs::write(
        folder.path().join("loads.csv"),
        "\"time\",normal_force,\"shift_x\",\"twist\"\n\"0\",\"200\",0,0\n1,200,\"0.0005\",0.01\n2,\"150\",-0.0002,0.0\n",
    )
    .unwrap();
    let (code, text, quoted) = run(folder.path(), &scene("", SPHERE, &history));
    assert_eq!(code, Some(0), "{text}");
    for (quoted, plain) in steps(&quoted).iter().zip(&found) {
        ["approach", "tangential_force", "moment"].iter().for_each(|key| assert_eq!(quoted[key], plain[key]));
    }
    fs::write(folder.path().join("loads.csv"), "normal_force;moment_y\n200;0\n200;20\n").unwrap();
    let header = "[[steps]]\nhistory = { file = \"loads.csv\" }";
    let (code, text, summary) = run(folder.path(), &scene("", SPHERE, header));
    assert_eq!(code, Some(0), "{text}");
    let last = steps(&summary).last().cloned().unwrap();
    // Under the normal force P and the moment M, a sphere of radius R rolls by the angle M / (P R).
    let angle = last["rotation"][1].as_f64().unwrap().to_radians();
    assert!((angle / 0.01 - 1.0).abs() < 1e-2, "{angle}");
}

/// Truth: docs/scene.md: a column with the name of a load gives the amplitude of this load. The results equal, bit by bit, the
/// results of steps with the same amplitudes in `loads`.
#[test]
fn a_history_of_amplitudes() {
    let folder = tempfile::tempdir().unwrap();
    let scene = |steps: &str| {
        let stress = "material = \"steel\"\nbulk_stress = { name = \"bulk\", value = [200.0, 60.0, 0.0] }";
        scene("", SPHERE, steps).replacen("material = \"steel\"", stress, 1)
    };
    fs::write(
        folder.path().join("loads.csv"),
        "normal_force,tangential_x,bulk\n200,0,0\n200,20,1\n200,-10,-0.5\n",
    )
    .unwrap();
    let history = "[[steps]]\nname = \"spectrum\"\nincrements = 2\nhistory = { file = \"loads.csv\" }";
    let (code, text, by_file) = run(folder.path(), &scene(history));
    assert_eq!(code, Some(0), "{text}");
    let step = |(force, amplitude): (f64, f64)| {
        format!(
            "[[steps]]\nnormal_force = 200\ntangential_force = [{force:?}, 0.0]\nincrements = 2\nloads = {{ bulk = {amplitude:?} }}\n"
        )
    };
    let by_hand: String = [(0.0, 0.0), (20.0, 1.0), (-10.0, -0.5)].into_iter().map(step).collect();
    let (code, text, by_hand) = run(folder.path(), &scene(&by_hand));
    assert_eq!(code, Some(0), "{text}");
    let (found, wanted) = (steps(&by_file), steps(&by_hand));
    assert_eq!((found.len(), wanted.len()), (6, 6));
    for (found, wanted) in found.iter().zip(&wanted) {
        for key in ["tangential_force", "shift", "approach", "dissipation", "loads"] {
            assert_eq!(found[key], wanted[key], "{key}");
        }
    }
    assert_eq!(found[5]["loads"]["bulk"], -0.5);
    assert!(found[5]["dissipation"].as_f64() > Some(0.0));
    // The table of `check` has one row for the whole history.
    fs::write(folder.path().join("scene.toml"), scene(history)).unwrap();
    let output =
        crate::tools::orthowear().current_dir(folder.path()).args(["check", "scene.toml"]).output().unwrap();
    let text = String::from_utf8(output.stdout).unwrap();
    assert_eq!(
        text.lines().filter(|line| line.contains("spectrum") && line.contains("bulk")).count(),
        1,
        "{text}"
    );
    assert!(text.contains("bulk -0.5"), "{text}");
    // A load with the name of a force column is ambiguous.
    fs::write(folder.path().join("loads.csv"), "normal_force,tangential_x\n200,0\n").unwrap();
    let (code, text, _) = run(folder.path(), &scene(history).replace("\"bulk\"", "\"tangential_x\""));
    assert!(code == Some(2) && text.contains("also the name of a load"), "{text}");
    // An unknown column name is refused. The message lists the named loads.
    fs::write(folder.path().join("loads.csv"), "normal_force,bilk\n200,0\n").unwrap();
    let (code, text, _) = run(folder.path(), &scene(history));
    let flat = text.split_whitespace().collect::<Vec<_>>().join(" ");
    assert!(code == Some(2) && flat.contains("unknown name \"bilk\"") && flat.contains("bulk"), "{text}");
}

/// Truth: docs/scene.md: decimal commas are refused in files whose columns are separated by semicolons, blanks or tabs. Otherwise
/// a decimal comma could split a number in two columns, and an ignored column "-" would hide the mistake.
#[test]
fn decimal_commas_of_histories_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let history = "[[steps]]\nhistory = { file = \"loads.csv\" }";
    fs::write(folder.path().join("loads.csv"), "approach;twist\n0,001;0,1\n0,002;\n").unwrap();
    let (code, text, _) = run(folder.path(), &scene("", SPHERE, history));
    let flat = text.split_whitespace().collect::<Vec<_>>().join(" ");
    assert_eq!(code, Some(2), "{text}");
    for line in [2, 3] {
        let words =
            format!("line {line}: the row has commas as well as semicolons: decimal commas are not read");
        assert!(flat.contains(&words), "lacks \"{words}\": {text}");
    }
    for (table, columns) in [
        ("1\t100,5\n", r#"["-", "normal_force"]"#),
        ("0,001\t3\n", r#"["approach", "-"]"#),
        ("0.5 0,001\n", r#"["-", "approach"]"#),
        ("approach;time\n0,001\n", r#"["approach", "-"]"#),
        ("1 0.5\n0,001\n", r#"["-", "approach"]"#),
    ] {
        fs::write(folder.path().join("loads.csv"), table).unwrap();
        let history = format!("[[steps]]\nhistory = {{ file = \"loads.csv\", columns = {columns} }}");
        let (code, text, _) = run(folder.path(), &scene("", SPHERE, &history));
        assert!(code == Some(2) && text.contains("decimal commas are not read"), "{table:?}: {text}");
    }
    for (table, columns) in [
        ("force, N; depth, mm\n1;0.001\n", r#"["-", "approach"]"#),
        ("1,2026-01-02 12:00:00,0.001\n", r#"["-", "-", "approach"]"#),
        ("0.001,5 of 10\n", r#"["approach", "-"]"#),
    ] {
        fs::write(folder.path().join("loads.csv"), table).unwrap();
        let history = format!("[[steps]]\nhistory = {{ file = \"loads.csv\", columns = {columns} }}");
        let (code, text, summary) = run(folder.path(), &scene("", SPHERE, &history));
        assert_eq!(code, Some(0), "{table:?}: {text}");
        assert_eq!(steps(&summary)[0]["approach"], 0.001, "{table:?}");
    }
}

/// Truth: docs/scene.md: all mistakes in a load history are reported together, with file, line and column.
#[test]
fn mistakes_of_histories_are_placed() {
    let folder = tempfile::tempdir().unwrap();
    let check = |csv: &str, keys: &str, words: &[&str]| {
        fs::write(folder.path().join("loads.csv"), csv).unwrap();
        let steps = format!("[[steps]]\n{keys}");
        let (code, text, _) = run(folder.path(), &scene("", SPHERE, &steps));
        assert_eq!(code, Some(2), "{csv:?} {keys}\n{text}");
        let flat = text.split_whitespace().collect::<Vec<_>>().join(" ");
        words.iter().for_each(|word| assert!(flat.contains(word), "lacks \"{word}\": {text}"));
    };
    let plain = "history = { file = \"loads.csv\" }";
    check(
        "approach,twist\n0.01,nan\n,0.1\n0.01\n0.02,x\n",
        plain,
        &[
            "line 2, column `twist`: expected a finite number, found \"nan\"",
            "line 3, column `approach`: expected a finite number, found nothing",
            "line 4: 1 values, but there are 2 columns",
            "line 5, column `twist`: expected a finite number, found \"x\"",
            "4 errors",
        ],
    );
    check("approach,normal_force\n0.01,3\n", plain, &["`approach` or `normal_force`, not both"]);
    check("approach,approach\n0.01,3\n", plain, &["`approach` appears twice"]);
    check("approach,speed\n0.01,3\n", plain, &["column 2 has the unknown name \"speed\"", "shift_x"]);
    check("normal_force\n-3\n", plain, &["line 2, column `normal_force`: -3 is negative"]);
    check("", plain, &["is empty"]);
    check("approach\n", plain, &["no load points"]);
    check("0.01\n", "history = { file = \"loads.csv\", columns = [\"-\"] }", &["nothing is prescribed"]);
    check(
        "0.01\n",
        "history = { file = \"loads.csv\", columns = [\"depth\"] }",
        &["steps.0.history.columns.0"],
    );
    check(
        "0.01\n",
        "approach = 0.01\nhistory = { file = \"loads.csv\", columns = [\"approach\"] }",
        &["together with `history`"],
    );
    check("0.01\n", "history = { file = \"none.csv\" }", &["none.csv", "cannot be read"]);
    check(
        "normal_force,tangential_x\n100,0\n100,10\n",
        "friction = false\nhistory = { file = \"loads.csv\" }",
        &["line 3: a tangential force is prescribed", "remove the columns `tangential_x`, `tangential_y`"],
    );
    check(
        "normal_force\n1e300\n-1e-120\n0\n1e100\n",
        plain,
        &[
            "line 2, column `normal_force`: 1e300",
            "line 3, column `normal_force`: -1e-120",
            "between 1e-100 and 1e100",
        ],
    );
}

/// Truth: the same heights in a text file. Files of NumPy in C and Fortran order, and in format versions 1 and 2, give the same
/// results bit by bit. Heights in single precision give the same approach to 1e-6.
#[test]
fn heights_that_numpy_wrote() {
    let folder = tempfile::tempdir().unwrap();
    if !crate::tools::python("write_heights.py", folder.path()) {
        return;
    }
    let press = "[[steps]]\nnormal_force = 100.0";
    let heights = |file: &str| {
        format!(
            "kind = \"heights\"\nfile = \"{file}\"\nspacing = [0.05, 0.05]\nangle = 20.0\noffset = [0.01, 0.0]"
        )
    };
    // The rotated map does not cover the corners of the frame, but it covers this outline.
    let outline = "outline = { shape = \"circle\", radius = 0.4 }";
    let result = |file: &str| {
        let (code, text, summary) = run(folder.path(), &scene(outline, &heights(file), press));
        assert_eq!(code, Some(0), "{file}\n{text}");
        steps(&summary)[0].clone()
    };
    let text = result("heights.csv");
    for file in ["c.npy", "fortran.npy", "v2.npy"] {
        let found = result(file);
        ["approach", "peak_pressure", "moment"]
            .iter()
            .for_each(|key| assert_eq!(found[key], text[key], "{file}"));
    }
    let [single, double] = [result("single.npy"), text].map(|step| step["approach"].as_f64().unwrap());
    assert!((single / double - 1.0).abs() < 1e-6);
    for (file, word) in [("nan.npy", "row 4, column 6"), ("three.npy", "2 dimensions")] {
        let (code, text, _) = run(folder.path(), &scene(outline, &heights(file), press));
        let flat = text.split_whitespace().collect::<Vec<_>>().join(" ");
        assert!(code == Some(2) && flat.contains(word), "{text}");
    }
}

/// Truth: docs/scene.md: `check` counts the cells inside and outside the outline. Contact along the outline is not contact at the
/// edge of the frame.
#[test]
fn outlines() {
    let folder = tempfile::tempdir().unwrap();
    let flat = "kind = \"flat\"";
    let press =
        "[[steps]]\nname = \"press\"\nnormal_force = 100.0\n[[steps]]\nname = \"more\"\nnormal_force = 200.0";
    let circle = scene("outline = { shape = \"circle\", radius = 0.4 }", flat, press);
    let (code, text, summary) = run(folder.path(), &circle);
    assert_eq!(code, Some(0), "{text}");
    assert!(steps(&summary).iter().all(|step| step["contact_touches_edge"] == Value::Bool(false)));
    // `operator_defect` compares the operator with the integrals over the cells inside the outline.
    let defect = steps(&summary)[1]["certificate"]["operator_defect"].as_f64().unwrap();
    assert!(defect < 1e-11, "{defect}");
    let output =
        crate::tools::orthowear().current_dir(folder.path()).args(["check", "scene.toml"]).output().unwrap();
    let plan = String::from_utf8(output.stdout).unwrap();
    let inside = (0..400)
        .filter(|cell| {
            let [x, y] = [cell / 20, cell % 20].map(|i| (f64::from(i) - 9.5) * 0.05);
            x.hypot(y) <= 0.4
        })
        .count();
    let words = format!("= 400 cells, 1 x 1 mm; {inside} inside the outline, {} outside", 400 - inside);
    assert!(plan.contains(&words), "{plan}");

    let (code, text, summary) = run(folder.path(), &scene("", flat, press));
    assert_eq!(code, Some(0), "{text}");
    assert!(steps(&summary).iter().all(|step| step["contact_touches_edge"] == Value::Bool(true)));
    let warnings = summary["warnings"].to_string();
    assert_eq!(warnings.matches("reaches the edge of the frame").count(), 2, "{warnings}");

    let polygon =
        "outline = { shape = \"polygon\", vertices = [[-0.3, -0.3], [0.3, 0.3], [0.3, -0.3], [-0.3, 0.3]] }";
    for (outline, word) in [
        (polygon, "edges 1 and 3"),
        ("outline = { shape = \"circle\", radius = 0.001 }", "smaller than a cell"),
        ("outline = { shape = \"circle\" }", "lacks `radius`"),
        ("outline = { shape = \"star\", radius = 0.3 }", "\"polygon\""),
        ("outline = { shape = \"polygon\", vertices = [[0.0, 0.0], [0.3, 0.0]] }", "vertices"),
    ] {
        let (code, text, _) = run(folder.path(), &scene(outline, flat, press));
        let flat = text.split_whitespace().collect::<Vec<_>>().join(" ");
        assert!(code == Some(2) && flat.contains(word) && text.contains("frame.outline"), "{word}: {text}");
    }
    let (code, text, _) =
        run(folder.path(), &scene("", "kind = \"ellipsoid\"\nradii = [1.0, 2.0]\nexact = true", press));
    assert!(code == Some(2) && text.contains("semi_axes"), "{text}");
    let (code, text, _) = run(folder.path(), &scene("", "kind = \"ellipsoid\"", press));
    assert!(code == Some(2) && text.contains("lacks `radii`"), "{text}");
}

/// Truth: docs/scene.md: numbers in scenes and in files have a limited magnitude.
#[test]
fn heights_beyond_all_sizes() {
    let folder = tempfile::tempdir().unwrap();
    let rows: Vec<String> = (0..20)
        .map(|i| if i == 3 { "0,".repeat(4) + "-1e200" + &",0".repeat(15) } else { "0,".repeat(20) })
        .collect();
    fs::write(folder.path().join("heights.csv"), rows.join("\n")).unwrap();
    let press = "[[steps]]\nnormal_force = 100.0";
    let (code, text, _) = run(folder.path(), &scene("", "kind = \"heights\"\nfile = \"heights.csv\"", press));
    let flat = text.split_whitespace().collect::<Vec<_>>().join(" ");
    assert!(
        code == Some(2) && flat.contains("row 4, column 5 is -1e200") && flat.contains("1e100"),
        "{text}"
    );
}

/// Truth: invariance. An outline is given in the axes of the frame (docs/scene.md). If the frame with its outline is rotated on
/// an isotropic half-space, the results agree to 1e-9.
#[test]
fn outlines_turn_with_the_frame() {
    let folder = tempfile::tempdir().unwrap();
    let ellipse =
        "outline = { shape = \"ellipse\", semi_axes = [0.4, 0.1], angle = 20.0, center = [0.05, 0.0] }";
    let press = "[[steps]]\nnormal_force = 100.0";
    let results = ["", "azimuth = 30.0\n"].map(|azimuth| {
        let (code, text, summary) =
            run(folder.path(), &scene(&format!("{azimuth}{ellipse}"), "kind = \"flat\"", press));
        assert_eq!(code, Some(0), "{text}");
        let step = steps(&summary)[0].clone();
        ["approach", "contact_area", "peak_pressure"].map(|key| step[key].as_f64().unwrap())
    });
    for (plain, turned) in results[0].iter().zip(&results[1]) {
        assert!((plain / turned - 1.0).abs() < 1e-9, "{results:?}");
    }
    let (s, c) = 20f64.to_radians().sin_cos();
    let inside = (0..400)
        .filter(|cell| {
            let [x, y] = [cell / 20, cell % 20].map(|i| (f64::from(i) - 9.5) * 0.05);
            let dx = x - 0.05;
            ((c * dx + s * y) / 0.4).hypot((c * y - s * dx) / 0.1) <= 1.0
        })
        .count();
    let output =
        crate::tools::orthowear().current_dir(folder.path()).args(["check", "scene.toml"]).output().unwrap();
    let plan = String::from_utf8(output.stdout).unwrap();
    assert!(plan.contains(&format!("{inside} inside the outline")), "{inside}: {plan}");
}

/// Truth: statics. Pressures on a single row of cells cannot balance a moment about this row. Tractions on a single cell cannot
/// balance a spin moment.
#[test]
fn moments_without_lever() {
    let folder = tempfile::tempdir().unwrap();
    let check = |cells: &str, load: &str| {
        let scene =
            scene("", "kind = \"flat\"", &format!("[[steps]]\nnormal_force = 100.0\n[[steps]]\n{load}"));
        fs::write(folder.path().join("scene.toml"), scene.replace("cells = [20, 20]", cells)).unwrap();
        let output = crate::tools::orthowear()
            .current_dir(folder.path())
            .args(["check", "scene.toml"])
            .output()
            .unwrap();
        let text = String::from_utf8(output.stderr).unwrap();
        (output.status.code(), text.split_whitespace().collect::<Vec<_>>().join(" "))
    };
    for (cells, load, key) in [
        ("cells = [1, 1]", "spin_moment = 0.1", "steps.1.spin_moment"),
        ("cells = [1, 8]", "moment = [0.0, 0.1]", "steps.1.moment"),
        ("cells = [8, 1]", "moment = [0.1, 0.0]", "steps.1.moment"),
    ] {
        let (code, text) = check(cells, load);
        assert!(
            code == Some(2) && text.contains(key) && text.contains("nothing resists it"),
            "{cells} {load}: {text}"
        );
    }
    for (cells, load) in [
        ("cells = [1, 8]", "moment = [0.1, 0.0]"),
        ("cells = [1, 8]", "spin_moment = 0.1"),
        ("cells = [1, 1]", "moment = [0.0, 0.0]"),
    ] {
        let (code, text) = check(cells, load);
        assert_eq!(code, Some(0), "{cells} {load}: {text}");
    }
}

/// Truth: Coulomb's law. Without pressure there is no friction, so a tangential force or a spin moment has no equilibrium.
#[test]
fn a_pull_on_bodies_that_do_not_touch() {
    let folder = tempfile::tempdir().unwrap();
    for pull in ["tangential_force = [1.0, 0.0]", "spin_moment = 1.0"] {
        let steps = format!(
            "[[steps]]\nnormal_force = 100.0\n[[steps]]\nname = \"pull\"\nnormal_force = 0.0\n{pull}"
        );
        let (code, _, summary) = run(folder.path(), &scene("", SPHERE, &steps));
        assert_eq!((code, &summary["reason"]), (Some(3), &Value::from("contact-lost")), "{pull}");
        let warnings = summary["warnings"].to_string();
        assert!(warnings.contains("no pressure acts") && !warnings.contains("gross sliding"), "{warnings}");
    }
}

/// Truth: statics. In cycles with gross sliding, the friction tractions reverse their direction from stroke to stroke. They
/// cannot balance a constant spin moment.
#[test]
fn a_spin_moment_held_in_cycles() {
    let folder = tempfile::tempdir().unwrap();
    let steps = |moment: &str| {
        format!(
            "[[steps]]\nnormal_force = 100.0\nspin_moment = {moment}\n[[steps]]\n\
             cycles = {{ count = 10, amplitude = 0.05, jumps = 2 }}\n[solver]\nmax_iterations = 200"
        )
    };
    let (code, text, summary) = run(folder.path(), &scene("", SPHERE, &steps("0.5")));
    assert_eq!((code, &summary["reason"]), (Some(3), &Value::from("iterations")), "{text}");
    let warnings = summary["warnings"].to_string();
    assert!(warnings.contains("a spin moment of 0.5 acts during the cycles"), "{warnings}");
    let (code, text, summary) = run(folder.path(), &scene("", SPHERE, &steps("0.0")));
    assert_eq!(code, Some(0), "{text} {}", summary["warnings"]);
}
