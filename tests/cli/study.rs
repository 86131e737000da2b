//! `orthowear study`: its table has the results of single runs, and all mistakes are reported together.

use std::fs;
use std::path::Path;

use serde_json::Value;

use super::bad_input::SOUND;

pub(super) fn folder(study: &str) -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("scene.toml"), SOUND).unwrap();
    fs::write(folder.path().join("study.toml"), study).unwrap();
    folder
}

pub(super) fn orthowear(folder: &Path, arguments: &[&str]) -> (Option<i32>, String, String) {
    let output = crate::tools::orthowear().current_dir(folder).args(arguments).output().unwrap();
    let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
    (output.status.code(), text(&output.stdout), text(&output.stderr))
}

pub(super) fn json(path: &Path) -> Value {
    serde_json::from_slice(&fs::read(path).unwrap_or_else(|e| panic!("{}: {e}", path.display()))).unwrap()
}

pub(super) fn csv(path: &Path) -> (Vec<String>, Vec<Vec<String>>) {
    let text = fs::read_to_string(path).unwrap();
    let mut rows = text.lines().map(|line| line.split(',').map(str::to_owned).collect::<Vec<_>>());
    (rows.next().unwrap(), rows.collect())
}

pub(super) const TWO_AXES: &str = r#"
[study]
scene = "scene.toml"
[[axes]]
keys = ["body1.fibre.tilt"]
values = [0, 30.0]
[[axes]]
name = "depth"
keys = ["steps.indent.approach", "gap.radius"]
values = [[0.02, 50.0], [0.01, 40.0]]
[output]
collect = ["indent.normal_force", "fretting.worn_volume", "fretting.stroke_ends.1.tangential_force.0"]
curves = ["fretting.worn_volume"]
"#;

/// Truth: docs/study.md: a study computes every run, and a note reports that `study.symmetry` has no effect.
#[test]
fn symmetric_runs_are_computed() {
    let axis = "[[axes]]\nkeys = [\"body1.fibre.azimuth\"]\nvalues = [30, -30]\n";
    for (given, notes) in [("", 0), ("symmetry = true\n", 1), ("symmetry = false\n", 1)] {
        let folder = folder(&format!("[study]\nscene = \"scene.toml\"\n{given}{axis}"));
        let (code, text, errors) = orthowear(folder.path(), &["study", "study.toml"]);
        assert!(code == Some(0) && text.contains("\n2 runs, "), "{text}{errors}");
        assert_eq!(errors.matches("note: study.symmetry has no effect").count(), notes, "{errors}");
        for run in ["azimuth-30", "azimuth--30"] {
            let summary = json(&folder.path().join("study.study").join(run).join("summary.json"));
            assert!(
                summary["steps"].as_array().unwrap().iter().all(|entry| entry["iterations"] != 0),
                "{summary}"
            );
        }
    }
}

/// Truth: each row of the table equals, bit by bit, the results of a single run with the values of the row.
#[test]
fn the_table_is_that_of_the_single_runs() {
    let folder = folder(TWO_AXES);
    let (code, text, errors) = orthowear(folder.path(), &["study", "study.toml"]);
    assert_eq!(code, Some(0), "{errors}");
    assert!(text.contains("4 runs"), "{text}");
    let out = folder.path().join("study.study");
    let (heads, rows) = csv(&out.join("study.csv"));
    let column = |name: &str| heads.iter().position(|head| head == name).unwrap();
    assert_eq!(rows.len(), 4);
    let result = json(&out.join("study.json"));
    for (number, row) in rows.iter().enumerate() {
        let mut arguments = vec!["run", "scene.toml", "--out", "alone", "--quiet"];
        let keys = ["body1.fibre.tilt", "steps.indent.approach", "gap.radius"];
        let sets: Vec<String> = keys.iter().map(|key| format!("{key}={}", row[column(key)])).collect();
        sets.iter().for_each(|set| arguments.extend(["--set", set]));
        assert_eq!(orthowear(folder.path(), &arguments).0, Some(0));
        let alone = json(&folder.path().join("alone/summary.json"));
        let own = json(&out.join(&row[column("folder")]).join("summary.json"));
        let entries = alone["steps"].as_array().unwrap();
        let last = |name: &str| entries.iter().rev().find(|entry| entry["name"] == name).unwrap();
        for (path, value) in [
            ("indent.normal_force", &last("indent")["normal_force"]),
            ("fretting.worn_volume", &last("fretting")["worn_volume"]),
            (
                "fretting.stroke_ends.1.tangential_force.0",
                &last("fretting")["stroke_ends"][1]["tangential_force"][0],
            ),
        ] {
            assert_eq!(row[column(path)].parse::<f64>().unwrap(), value.as_f64().unwrap(), "{row:?} {path}");
        }
        assert_eq!(own["steps"][4]["worn_volume"], alone["steps"][4]["worn_volume"]);
        let curve = result["runs"][number]["curves"]["fretting.worn_volume"].as_array().unwrap();
        assert_eq!(curve.len(), 1 + 4, "the entry before and four jumps");
        for (point, entry) in curve.iter().zip(entries) {
            assert_eq!(point[0].as_f64().unwrap(), entry["cycles_done"].as_f64().unwrap());
            assert_eq!(point[1].as_f64().unwrap(), entry["worn_volume"].as_f64().unwrap());
        }
    }
    let names = ["curves-fretting.worn_volume.svg", "fretting.worn_volume.svg", "indent.normal_force.svg"];
    for name in names {
        let picture = fs::read_to_string(out.join(name)).unwrap();
        assert!(picture.contains("tilt = 30") && picture.contains("0.01, 40"), "{name}: {picture}");
    }
}

/// Truth: the table does not depend on the number of threads, byte for byte. Another order of the values gives the same rows in
/// another order.
#[test]
fn neither_threads_nor_order_change_the_table() {
    let folder = folder(TWO_AXES);
    let reversed = TWO_AXES
        .replace("[0, 30.0]", "[30.0, 0]")
        .replace("[[0.02, 50.0], [0.01, 40.0]]", "[[0.01, 40.0], [0.02, 50.0]]");
    assert_ne!(reversed, TWO_AXES);
    fs::write(folder.path().join("reversed.toml"), reversed).unwrap();
    for (study, out, threads) in
        [("study.toml", "a", "1"), ("study.toml", "b", "3"), ("reversed.toml", "c", "2")]
    {
        let arguments = ["study", study, "--out", out, "--threads", threads, "--quiet"];
        let (code, text, errors) = orthowear(folder.path(), &arguments);
        assert_eq!((code, text.as_str()), (Some(0), ""), "{errors}");
    }
    let bytes = |out: &str| fs::read(folder.path().join(out).join("study.csv")).unwrap();
    assert_eq!(bytes("a"), bytes("b"));
    let sorted = |out: &str| {
        let (heads, mut rows) = csv(&folder.path().join(out).join("study.csv"));
        rows.sort();
        (heads, rows)
    };
    assert_eq!(sorted("a"), sorted("c"));
}

/// Truth: the combinations that the loops below write out. The wear volumes equal, bit by bit, the wear volumes of a study with a
/// list of these combinations.
#[test]
fn ranges_zips_and_requirements_make_the_runs_that_are_meant() {
    let study = r#"
[study]
scene = "scene.toml"
require = ["tilt + 'sliding angle' <= 75", "approach > 0.01"]
[[axes]]
keys = ["body1.fibre.tilt"]
range = { from = 0, to = 60, step = 30 }
[[axes]]
zip = "depth"
keys = ["steps.indent.approach"]
range = { from = 0.01, to = 0.02, count = 3 }
[[axes]]
name = "sliding angle"
keys = ["steps.fretting.cycles.angle"]
range = { from = 0, to = 45, count = 3 }
[[axes]]
zip = "depth"
keys = ["gap.radius"]
values = [60.0, 50, 40.0]
[output]
collect = ["fretting.worn_volume"]
"#;
    let folder = folder(study);
    let (code, text, errors) = orthowear(folder.path(), &["study", "study.toml"]);
    assert_eq!(code, Some(0), "{errors}");
    assert!(text.contains("14 runs, 13 combinations omitted"), "{text}");
    let (heads, rows) = csv(&folder.path().join("study.study/study.csv"));
    let keys = ["body1.fibre.tilt", "steps.indent.approach", "gap.radius", "steps.fretting.cycles.angle"];
    assert_eq!(heads[..4], keys);
    let mut wanted = Vec::new();
    for tilt in ["0", "30", "60"] {
        for (approach, radius) in [("0.015", "50"), ("0.02", "40")] {
            for angle in ["0", "22.5", "45"] {
                if !(tilt == "60" && angle != "0") {
                    wanted.push([tilt, approach, radius, angle]);
                }
            }
        }
    }
    let found: Vec<&[String]> = rows.iter().map(|row| &row[..4]).collect();
    assert_eq!(found, wanted);
    assert_eq!(json(&folder.path().join("study.study/study.json"))["left_out"], 13);
    let lists = format!(
        "[study]\nscene = \"scene.toml\"\n[[axes]]\nname = \"all\"\nkeys = {keys:?}\nvalues = {}\n[output]\n\
         collect = [\"fretting.worn_volume\"]\n",
        format!("{wanted:?}").replace('"', "")
    );
    fs::write(folder.path().join("lists.toml"), lists).unwrap();
    assert_eq!(orthowear(folder.path(), &["study", "lists.toml", "--quiet"]).0, Some(0));
    let (_, listed) = csv(&folder.path().join("lists.study/study.csv"));
    let worn = |rows: &[Vec<String>]| rows.iter().map(|row| row.last().unwrap().clone()).collect::<Vec<_>>();
    assert_eq!(worn(&rows), worn(&listed));
}

/// Truth: docs/study.md: axes with `sample` are sampled together at `count` points, which the seed determines. Each point is
/// combined with each value of the other axes.
#[test]
fn samples_are_studied() {
    let study = r#"
[study]
scene = "scene.toml"
require = ["gap.radius < 57.5"]
[sample]
count = 8
seed = 4
[[axes]]
keys = ["gap.radius"]
sample = { from = 40.0, to = 60.0 }
[[axes]]
keys = ["body1.fibre.tilt"]
values = [0, 30]
[[axes]]
keys = ["wear.k"]
sample = { from = 1e-10, to = 1e-8, spacing = "log" }
[output]
collect = ["fretting.worn_volume"]
"#;
    let folder = folder(study);
    let (code, text, errors) = orthowear(folder.path(), &["study", "study.toml", "--out", "a"]);
    assert_eq!(code, Some(0), "{errors}");
    let (heads, rows) = csv(&folder.path().join("a/study.csv"));
    assert_eq!(heads[..3], ["gap.radius", "wear.k", "body1.fibre.tilt"]);
    let number = |row: &[String], k: usize| row[k].parse::<f64>().unwrap();
    // One point lies in each eighth of the range of radii. `require` excludes the last eighth, so two combinations are omitted.
    assert!(text.contains("14 runs, 2 combinations omitted"), "{text}");
    assert_eq!(rows.len(), 14);
    for pair in rows.chunks(2) {
        assert_eq!(pair[0][..2], pair[1][..2]);
        assert_eq!([&pair[0][2], &pair[1][2]], ["0", "30"]);
        assert!((40.0..57.5).contains(&number(&pair[0], 0)) && (1e-10..=1e-8).contains(&number(&pair[0], 1)));
    }
    let row = &rows[3];
    let sets = [0, 1, 2].map(|k| format!("{}={}", heads[k], row[k]));
    let mut arguments = vec!["run", "scene.toml", "--out", "alone", "--quiet"];
    sets.iter().for_each(|set| arguments.extend(["--set", set]));
    assert_eq!(orthowear(folder.path(), &arguments).0, Some(0));
    let alone = json(&folder.path().join("alone/summary.json"));
    let worn = alone["steps"].as_array().unwrap().last().unwrap()["worn_volume"].as_f64().unwrap();
    assert_eq!(number(row, heads.len() - 1), worn);
    let picture = fs::read_to_string(folder.path().join("a/fretting.worn_volume.svg")).unwrap();
    assert!(
        picture.contains("gap.radius") && picture.contains("wear.k") && picture.contains("tilt = 30"),
        "{picture}"
    );
    for (seed, same) in [("seed = 4", true), ("seed = 5", false)] {
        fs::write(folder.path().join("b.toml"), study.replace("seed = 4", seed)).unwrap();
        assert_eq!(
            orthowear(folder.path(), &["study", "b.toml", "--quiet", "--set", "frame.cells=[8, 8]"]).0,
            Some(0)
        );
        let (_, other) = csv(&folder.path().join("b.study/study.csv"));
        let points = |rows: &[Vec<String>]| rows.iter().map(|row| row[..3].to_vec()).collect::<Vec<_>>();
        assert_eq!(points(&rows) == points(&other), same, "{seed}");
    }
}

/// Truth: docs/results.md: each run has its own folder, even if two names are equal after the replacement of special characters.
#[test]
fn each_run_has_a_folder() {
    let study = r#"
[study]
scene = "scene.toml"
[[axes]]
keys = ["body2.material"]
values = ["a-b-3", "a b", "a-b"]
[output]
collect = ["indent.normal_force"]
"#;
    let folder = folder(study);
    let steel =
        |name: &str, e: f64| format!("[materials.\"{name}\"]\nmodel = \"isotropic\"\nE = {e}\nnu = 0.3\n");
    let materials = [steel("a-b-3", 1e5), steel("a b", 2e5), steel("a-b", 3e5)].concat();
    fs::write(folder.path().join("scene.toml"), SOUND.to_owned() + &materials).unwrap();
    let (code, _, errors) = orthowear(folder.path(), &["study", "study.toml", "--quiet"]);
    assert_eq!(code, Some(0), "{errors}");
    let out = folder.path().join("study.study");
    let table = fs::read(out.join("study.csv")).unwrap();
    let (heads, rows) = csv(&out.join("study.csv"));
    let column = heads.iter().position(|head| head == "folder").unwrap();
    let folders: std::collections::BTreeSet<&String> = rows.iter().map(|row| &row[column]).collect();
    assert_eq!(folders.len(), 3, "{folders:?}");
    assert_eq!(orthowear(folder.path(), &["study", "study.toml", "--quiet", "--collect"]).0, Some(0));
    assert_eq!(fs::read(out.join("study.csv")).unwrap(), table);
}

/// Truth: docs/command-line.md: a failed run does not prevent the other runs. The exit code is the worst of all runs.
#[test]
fn runs_that_fail_do_not_stop_the_others() {
    let study = r#"
[study]
scene = "scene.toml"
[[axes]]
keys = ["solver.max_iterations"]
values = [1, 400]
[output]
collect = ["fretting.worn_volume"]
"#;
    let folder = folder(study);
    let (code, text, _) = orthowear(folder.path(), &["study", "study.toml", "--out", "o"]);
    assert_eq!(code, Some(3), "{text}");
    assert!(
        text.contains("max_iterations-1: not converged (reason \"iterations\"): the contact solver did not reach solver.tolerance"),
        "{text}"
    );
    let (heads, rows) = csv(&folder.path().join("o/study.csv"));
    assert_eq!(heads[..4], ["solver.max_iterations", "status", "reason", "folder"]);
    assert_eq!((rows[0][1].as_str(), rows[0][2].as_str()), ("not-converged", "iterations"));
    assert_eq!(rows[0].last().unwrap(), "", "a step that was not reached has no result");
    assert_eq!(rows[1][1], "converged");
    assert!(rows[1].last().unwrap().parse::<f64>().unwrap() > 0.0);
    let (code, text, errors) = orthowear(folder.path(), &["study", "study.toml", "--out", "o", "--quiet"]);
    assert_eq!((code, text.as_str()), (Some(3), ""));
    assert!(errors.contains("max_iterations-1"), "{errors}");
}

/// Truth: docs/study.md: all mistakes are reported together, with file, line, key and fix.
#[test]
fn mistakes_are_told_at_once() {
    let study = r#"
[study]
scene = "scene.toml"
[[axes]]
keys = ["body1.fibre.tilt"]
values = [0, 95, "steep"]
[[axes]]
keys = ["steps.push.approach"]
values = [0.01]
[[axes]]
keys = ["gap.radus"]
values = [40.0]
[output]
colect = []
"#;
    let folder = folder(study);
    let told = |study: &str, options: &[&str], wanted: &[&str]| {
        fs::write(folder.path().join("study.toml"), study).unwrap();
        let (code, text, errors) =
            orthowear(folder.path(), &[&["study", "study.toml", "--out", "o"][..], options].concat());
        assert_eq!((code, text.as_str()), (Some(2), ""), "{errors}");
        for words in wanted {
            assert!(errors.contains(words), "`{words}` is missing in:\n{errors}");
        }
        assert!(!folder.path().join("o").exists());
    };
    told(study, &[], &["study.toml:14", "did you mean `collect`"]);
    let study = study.replace(
        "colect = []",
        "collect = [\"fretting.worn_volum\", \"rub.worn_volume\"]\ncurves = [\"indent\"]",
    );
    told(
        &study,
        &[],
        &[
            "output.collect.0: `worn_volum` does not exist in the entries of steps",
            "output.curves.0: `indent` is not a number",
            "study.toml:6",
        ],
    );
    let study = study.replace("\"fretting.worn_volum\", ", "").replace("\"indent\"", "");
    told(
        &study,
        &[],
        &[
            "study.toml:6",
            "body1.fibre.tilt: `tilt` is 95",
            "must be a number",
            "study.toml:8",
            "the list has no element `push`",
            "study.toml:11",
            "did you mean `radius`",
        ],
    );
    let one = |axes: &str| format!("[study]\nscene = \"scene.toml\"\n{axes}");
    let axis = |keys: &str, values: &str| format!("[[axes]]\nkeys = {keys}\nvalues = {values}\n");
    let tilt = axis("[\"body1.fibre.tilt\"]", "[0, 30]");
    told(&one(&(tilt.clone() + &tilt)), &[], &["study.toml:7", "`body1.fibre.tilt` is varied twice"]);
    told(&one(&tilt), &["--set", "body1.fibre.tilt=10"], &["--set gives it a fixed value"]);
    told(&one(&axis("[\"gap.radius\", \"friction.mu_L\"]", "[[50.0, 0.4], 40.0]")), &[], &["for 2 keys"]);
    told(&one(&axis("[\"gap.radius\"]", "[50.0, 50.0]")), &[], &["appears twice"]);
    told(&one(&axis("[\"gap.radius\"]", "[]")), &[], &["`values` has 0 values"]);
    told(&one(&tilt).replace("scene.toml", "no.toml"), &[], &["study.scene: there is no scene file"]);
    let (code, _, errors) = orthowear(folder.path(), &["run", "study.toml"]);
    assert!(code == Some(2) && errors.contains("this is a study, not a scene"), "{errors}");
    told(SOUND, &[], &["this is a scene, not a study"]);
    told(&tilt, &[], &["the study file has no table [study]", "add [study] with scene"]);
    let range =
        |range: &str| one(&format!("[[axes]]\nkeys = [\"body1.fibre.tilt\"]\nrange = {{ {range} }}\n"));
    told(&range("from = 0, to = 90"), &[], &["study.toml:5", "`count` or `step`"]);
    told(&range("from = 0, to = 90, step = 20"), &[], &["axes.0.range.step", "end the range at 80 or 100"]);
    told(
        &range("from = 0, to = 90, count = 3, spacing = \"log\""),
        &[],
        &["cannot have logarithmic spacing"],
    );
    told(&range("from = 0, to = 90, cuont = 3"), &[], &["did you mean `count`"]);
    told(&range("from = 0, to = 180, step = 90"), &[], &["study.toml:5", "`tilt` is 180"]);
    told(&(range("from = 0, to = 90, count = 3") + "values = [0]\n"), &[], &["`values` and a `range`"]);
    told(&one("[[axes]]\nkeys = [\"gap.radius\"]\n"), &[], &["the axis has no values"]);
    let zip = tilt.clone() + "zip = \"both\"\n" + &axis("[\"gap.radius\"]", "[4, 5, 6]") + "zip = \"both\"\n";
    told(&one(&zip), &[], &["study.toml:10", "`radius` has 3 values, `tilt` has 2"]);
    let require = |text: &str| one(&tilt).replace("\n[[", &format!("\nrequire = [\"{text}\"]\n[["));
    told(&require("tlit <= 30"), &[], &["study.require.0: no axis is named `tlit`", "did you mean `tilt`"]);
    told(
        &require("3 <= 30"),
        &[],
        &["study.toml:3", "does not contain the name of an axis", "`tilt`, `body1.fibre.tilt`"],
    );
    told(&require("tilt + 30"), &[], &["has the end where a comparison"]);
    told(&require("tilt <= (30"), &[], &["has the end where `)` is expected"]);
    told(&require("tilt > 30"), &[], &["none of the 2 combinations meets"]);
    let sample = |more: &str| {
        one(&format!("{more}[[axes]]\nkeys = [\"body1.fibre.tilt\"]\nsample = {{ from = 0, to = 90 }}\n"))
    };
    told(
        &sample(""),
        &[],
        &["study.toml:5", "an axis has a `sample`, but the study has no table `[sample]`", "add `[sample]`"],
    );
    told(&sample("[sample]\ncount = 0\n"), &[], &["study.toml:4", "`count` is 0"]);
    told(&sample("[sample]\ncount = 2\nmethod = \"sobel\"\n"), &[], &["did you mean \"sobol\"?"]);
    told(
        &(sample("[sample]\ncount = 2\n") + "values = [1]\n"),
        &[],
        &["the axis has both `values` and a `sample`"],
    );
    told(
        &sample("[sample]\ncount = 2\n").replace("from = 0", "from = 90"),
        &[],
        &["the range goes from 90 to 90"],
    );
    told(
        &sample("[sample]\ncount = 2\n").replace("to = 90", "to = 9, spacing = \"log\""),
        &[],
        &["cannot have logarithmic spacing"],
    );
    told(&one(&format!("[sample]\ncount = 2\n{tilt}")), &[], &["study.toml:3", "no axis has a `sample`"]);
    let names =
        one(&(tilt.clone() + "name = \"x\"\n" + &axis("[\"gap.radius\"]", "[4, 5]") + "name = \"x\"\n"));
    told(&names, &[], &["study.toml:8", "two axes are named \"x\""]);
    let many = "count = 100000000000";
    told(
        &range(&format!("from = 0, to = 90, {many}")),
        &[],
        &["study.toml:5", "`count` is 100000000000", "at most 10000"],
    );
    told(
        &sample(&format!("[sample]\n{many}\n")),
        &[],
        &["study.toml:4", "`count` is 100000000000", "at most 10000"],
    );
    told(
        &sample("[sample]\ncount = 2\nseed = 5000000000\n"),
        &[],
        &["study.toml:5", "`seed` is 5000000000", "at most"],
    );
    let lost = one(&tilt) + "[output]\ncollect = [\"rub.worn_volume\"]\n";
    told(&lost, &[], &["the scene has no step \"rub\"", "its steps are \"fretting\", \"indent\""]);
    let bulk = |name: &str| format!("{}[output]\ncollect = [\"fretting.loads.{name}\"]\n", one(&tilt));
    told(&bulk("bulk"), &[], &["the scene has no load \"bulk\"", "it has no named loads"]);
    let fibre = "fibre = { tilt = 30.0, azimuth = 0.0 }";
    let stressed = format!("{fibre}\nbulk_stress = {{ name = \"bulk\", value = [50.0, 0.0, 0.0] }}");
    fs::write(folder.path().join("scene.toml"), SOUND.replace(fibre, &stressed)).unwrap();
    told(
        &bulk("bulkk"),
        &[],
        &["study.toml", "the scene has no load \"bulkk\"", "its named loads are \"bulk\""],
    );
    fs::write(folder.path().join("scene.toml"), SOUND.replace("radius = 50.0", "radius = -50.0")).unwrap();
    told(&one(&tilt), &["--set", "frame.cels=3"], &["gap.radius", "--> scene.toml:26", "--set frame.cels=3"]);
    // A value of an axis makes another key of the scene invalid.
    let pulled = SOUND.replace("approach = 0.02", "approach = 0.02\ntangential_force = [1.0, 0.0]");
    fs::write(folder.path().join("scene.toml"), pulled).unwrap();
    let laws = axis("[\"friction\"]", "[{ law = \"coulomb\", mu = 0.3 }, { law = \"none\" }]");
    let run = "(1 of 2 runs; the run with friction = { \"law\" = \"none\" })";
    told(&one(&laws), &[], &["steps.0.tangential_force", run]);
}

/// Truth: docs/results.md explains every field of study.json.
#[test]
fn the_documents_explain_the_study() {
    let folder =
        folder("[study]\nscene = \"scene.toml\"\n[[axes]]\nkeys = [\"gap.radius\"]\nvalues = [50.0]\n");
    let (code, text, errors) = orthowear(folder.path(), &["study", "study.toml"]);
    assert_eq!(code, Some(0), "{errors}");
    assert!(text.contains("fretting") && text.contains("sound"), "{text}");
    let documented = include_str!("../../docs/results.md");
    let study = json(&folder.path().join("study.study/study.json"));
    for table in [&study, &study["axes"][0], &study["runs"][0]] {
        for key in table.as_object().unwrap().keys() {
            assert!(documented.contains(&format!("`{key}`")), "docs/results.md does not explain `{key}`");
        }
    }
}
