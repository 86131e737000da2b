//! Work that a scene does not need is omitted without changing the results.

use serde_json::Value;

use crate::scenes::{COARSE, MESH, command, run, same, scene};

/// Kind of omitted work, scene, and settings of the scene.
const NAMED: [(&str, &str, &[&str]); 8] = [
    ("tangential-unknowns", "hertz.toml", &["frame.cells=[20, 20]"]),
    ("normal-components", "cattaneo-mindlin.toml", &["frame.cells=[20, 20]"]),
    ("tangential-gap", "hertz.toml", &["frame.cells=[20, 20]"]),
    ("second-half-space", "cattaneo-mindlin.toml", &["frame.cells=[20, 20]"]),
    ("vanishing-blocks", "cattaneo-mindlin.toml", &["frame.cells=[20, 20]"]),
    ("distant-cells", "sphere-on-cfrp-halfspaces.toml", &["frame.cells=[64, 64]"]),
    ("open-cells", OVERSIZED[1].0, OVERSIZED[1].1),
    ("cold-starts", "sphere-on-cfrp-halfspaces.toml", &["frame.cells=[20, 20]"]),
];

/// Kinds of omitted work (names of `solver.skip`) that the summary of a run lists.
fn names(summary: &Value) -> Vec<&str> {
    summary["skipped"].as_array().unwrap().iter().filter_map(|entry| entry["skip"].as_str()).collect()
}

fn all_names() -> Vec<String> {
    let output = crate::tools::orthowear().arg("schema").output().unwrap();
    let schema: Value = serde_json::from_slice(&output.stdout).unwrap();
    let words = schema.pointer("/$defs/OmittableWork/oneOf").unwrap().as_array().unwrap();
    words.iter().map(|word| word["const"].as_str().unwrap().to_owned()).collect()
}

/// Truth: docs/scene.md: results with and without one kind of omitted work are the same. They agree to 1e-7 at residuals of
/// 1e-10. The kind `distant-entries` is tested in compressed.rs.
#[test]
fn each_skip_changes_nothing() {
    let all = all_names();
    let tested: Vec<&str> = NAMED.iter().map(|named| named.0).chain(["distant-entries"]).collect();
    assert!(all.len() == tested.len() && all.iter().all(|name| tested.contains(&name.as_str())), "{all:?}");
    for (name, file, settings) in NAMED {
        let settings = [settings, &["solver.tolerance=1e-10"]].concat();
        let others: Vec<String> =
            all.iter().filter(|other| *other != name).map(|other| format!("{other:?}")).collect();
        let others = format!("solver.skip=[{}]", others.join(", "));
        let (with, without) =
            (run(&scene(file), &settings), run(&scene(file), &[&settings[..], &[&others]].concat()));
        assert!(
            names(&with).contains(&name) && !names(&without).contains(&name),
            "{name}: {}",
            with["skipped"]
        );
        same(&with, &without, 1e-7);
    }
}

/// Truth: docs/keys.md: `solver.skip` refuses other names and lists the valid ones.
#[test]
fn skips_are_named() {
    let wrong = command("check", &scene("hertz.toml"), &["solver.skip=[\"cold-start\"]"]).output().unwrap();
    let text = String::from_utf8(wrong.stderr).unwrap();
    assert_eq!(wrong.status.code(), Some(2), "{text}");
    assert!(text.contains("solver.skip") && text.contains("cold-starts"), "{text}");
}

/// Truth: solutions that start from the previous tractions need at most 1.2 times as many iterations as solutions that start from
/// zero. They may need more, because the cells of a growing contact with friction may change their states in another order.
#[test]
fn warm_starts_are_no_longer_than_cold_ones() {
    let settings = [
        "frame.cells=[96, 96]",
        "steps.indent.increments=4",
        "steps.shift.increments=2",
        "solver.skip=[\"distant-cells\", \"second-half-space\"]",
    ];
    let cold = run(&scene("sphere-on-cfrp-halfspaces.toml"), &settings);
    let all = ["solver.skip=[\"distant-cells\", \"second-half-space\", \"cold-starts\"]"];
    let warm = run(&scene("sphere-on-cfrp-halfspaces.toml"), &[&settings[..3], &all].concat());
    let iterations = |summary: &Value| -> u64 {
        let steps = summary["steps"].as_array().unwrap();
        steps.iter().map(|step| step["iterations"].as_u64().unwrap()).sum()
    };
    let (warm, cold) = (iterations(&warm), iterations(&cold));
    assert!(5 * warm <= 6 * cold, "{warm} {cold}");
}

/// Truth: omitted work does not change the results, in scenes with friction, wear and cycles.
#[test]
fn skips_with_friction_and_cycles() {
    let scene = scene("sphere-on-cfrp-halfspaces.toml");
    let with = [
        "frame.cells=[16, 16]",
        "solver.tolerance=1e-10",
        "wear={law=\"energy\", k=1.25e-9}",
        "steps.1={name=\"fretting\", cycles={count=1000, amplitude=0.05, jumps=2}}",
    ];
    let without = [&with[..], &["solver.skip=false"]].concat();
    let (with, without) = (run(&scene, &with), run(&scene, &without));
    assert!(with["skipped"].as_array().unwrap().len() > without["skipped"].as_array().unwrap().len());
    same(&with, &without, 1e-7);
}

/// Scenes with settings. Their frames are larger than the contact, so the flexibility of bodies is computed only on the cells
/// that may touch.
const OVERSIZED: [(&str, &[&str]); 2] = [
    (
        "sphere-on-cfrp-block.toml",
        &[
            COARSE,
            MESH,
            "frame.cells=[10, 10]",
            "steps.indent.approach=0.005",
            "steps.fretting.cycles.jumps=1",
        ],
    ),
    (
        "steel-cap-on-cfrp-block.toml",
        &[COARSE, MESH, "frame.cells=[8, 8]", "frame.half_width=[1.4, 1.4]", "steps.indent.approach=0.004"],
    ),
];

/// Truth: omitted work does not change the results. The summary reports the omitted work.
#[test]
fn skips_of_cells_that_cannot_touch() {
    for (name, settings) in OVERSIZED {
        let with = [settings, &["solver.tolerance=1e-10"]].concat();
        let without = [&with[..], &["solver.skip=false"]].concat();
        let (with, without) = (run(&scene(name), &with), run(&scene(name), &without));
        let skips =
            |summary: &Value| summary["skipped"].to_string().contains("flexibility of meshed bodies on");
        assert!(skips(&with) && !skips(&without), "{name}: {}", with["skipped"]);
        same(&with, &without, 1e-7);
    }
}

/// Truth: docs/command-line.md: `check` lists the work that a run will omit. The correction of wear by resolved cycles is an
/// exception: whether a run omits it is known only after the run (docs/skips.md).
#[test]
fn check_and_run_skip_the_same() {
    let coarse = "frame.cells=[12, 12]";
    for (name, settings) in [
        ("hertz.toml", &[coarse][..]),
        ("hertz.toml", &[coarse, "solver.skip=false"]),
        ("cattaneo-mindlin.toml", &[coarse]),
        ("sphere-on-cfrp-halfspaces.toml", &[coarse]),
        OVERSIZED[0],
        OVERSIZED[1],
    ] {
        let scene = scene(name);
        let checked = command("check", &scene, settings).output().unwrap();
        let text = String::from_utf8(checked.stdout).unwrap();
        let list = text.split("\nskipped\n").nth(1).unwrap().split("\n\n").next().unwrap();
        let list: Vec<&str> = list.lines().map(str::trim).filter(|line| *line != "nothing").collect();
        let summary = run(&scene, settings);
        let ran: Vec<String> = summary["skipped"]
            .as_array()
            .unwrap()
            .iter()
            .map(|skip| format!("{}: {}", skip["what"].as_str().unwrap(), skip["why"].as_str().unwrap()))
            .collect();
        let (found, expected): (Vec<String>, Vec<String>) =
            ran.into_iter().partition(|skip| skip.starts_with("correction of the wear by resolved cycles"));
        assert!(found.len() <= summary["steps"].as_array().unwrap().len(), "{found:?}");
        assert_eq!(list, expected, "{name} {settings:?}");
    }
}
