//! Bulk stress of half-spaces in scenes: refused keys, table of `check`, and fields.

use std::fs;

use crate::bad_input::{SOUND, check};
use crate::near_field::{call, run};

const STRESS: &str =
    "fibre = { tilt = 30.0, azimuth = 0.0 }\nbulk_stress = { name = \"bulk\", value = [100.0, 0.0, 0.0] }";

fn stressed() -> String {
    SOUND.replace("fibre = { tilt = 30.0, azimuth = 0.0 }", STRESS)
}

/// Output of `check` for a valid scene.
fn printed(scene: &str) -> String {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("scene.toml"), scene).unwrap();
    let (code, text) = call("check", folder.path(), &[]);
    assert_eq!(code, Some(0), "{text}");
    text
}

/// Truth: docs/scene.md: `check` refuses amplitudes of unknown loads, changes of amplitude in steps with cycles, and invalid bulk
/// stresses. The message gives the key.
#[test]
fn what_is_refused() {
    let (code, text) = check(&stressed(), &[]);
    assert_eq!(code, Some(0), "{text}");
    let cycles = "cycles = { count = 1000, amplitude = 0.05, jumps = 4 }";
    let rolling = "rolling = { creepage = [1e-3, 0.0] }";
    let step = "approach = 0.02\nloads = ";
    for (from, to, words) in [
        (
            "approach = 0.02",
            &format!("{step}{{ bilk = 1.0 }}")[..],
            ["steps.0.loads.bilk", "named loads: bulk"],
        ),
        (cycles, &format!("{cycles}\nloads = {{ bulk = 0.5 }}"), ["steps.1.loads", "step with `cycles`"]),
        (
            cycles,
            &cycles.replace("jumps = 4", "jumps = 4, loads = { b = 1.0 }"),
            ["steps.1.cycles.loads.b", "named loads: bulk"],
        ),
        (
            cycles,
            "cycles = { count = 1000, angle = 30.0, loads = { bulk = 0.5 } }",
            ["steps.1.cycles.angle", "only loads of the bodies vary"],
        ),
        (cycles, rolling, ["body1.bulk_stress", "combined with rolling"]),
        ("\"bulk\", value", "\"\", value", ["body1.bulk_stress.name", "empty name"]),
        ("[100.0, 0.0, 0.0]", "[100.0, 0.0]", ["body1.bulk_stress", "value"]),
        ("bulk_stress =", "truncated = 3.0\nbulk_stress =", ["body1.bulk_stress", "truncated"]),
        (
            "cells = [16, 16]",
            "cells = [16, 16]\nperiodic = [false, true]",
            ["body1.bulk_stress", "as with the stress [100, 10.41"],
        ),
    ] {
        assert!(stressed().contains(from), "{from}");
        let (code, text) = check(&stressed().replacen(from, to, 1), &[]);
        assert_eq!(code, Some(2), "{to}: {text}");
        assert!(words.iter().all(|word| text.contains(word)), "{to}: {words:?} in\n{text}");
    }
    let unnamed = stressed()
        .replace("name = \"bulk\", ", "")
        .replace("approach = 0.02", "approach = 0.02\nloads = { bulk = 1.0 }");
    let (code, text) = check(&unnamed, &[]);
    assert!(code == Some(2) && text.contains("no load has a name"), "{text}");
    // A mistake in the body gives one error, without a further error about the name of its load.
    let wrong = stressed()
        .replace("100.0", "nan")
        .replace("approach = 0.02", "approach = 0.02\nloads = { bulk = 1.0 }");
    let (code, text) = check(&wrong, &[]);
    assert!(code == Some(2) && text.contains("1 error in"), "{text}");
    // Without friction, the strain due to the bulk stress does not change the pressures. A note reports this.
    let smooth = stressed().split("[friction]").next().unwrap().to_owned() + "[[steps]]\napproach = 0.02\n";
    let text = printed(&smooth);
    assert!(text.contains("does not change the pressures"), "{text}");
}

/// Truth: docs/scene.md: loads of the bodies may be the only loads that vary in cycles. The tangential force of an earlier step
/// stays constant in these cycles.
#[test]
fn cycles_of_loads_alone() {
    let cycles = "cycles = { count = 1000, amplitude = 0.05, jumps = 4 }";
    let alone = "cycles = { count = 1000, jumps = 4, loads = { bulk = 0.5 } }";
    let text = printed(&stressed().replace(cycles, alone));
    let flat = text.split_whitespace().collect::<Vec<_>>().join(" ");
    assert!(
        flat.contains("1000 cycles of loads of the bodies") && flat.contains("bulk +-0.5 in phase"),
        "{text}"
    );
    let folder = tempfile::tempdir().unwrap();
    let held = stressed().replace(cycles, alone).replace(
        "[[steps]]\nname = \"fretting\"",
        "[[steps]]\ntangential_force = [10.0, 0.0]\n[[steps]]\nname = \"fretting\"",
    );
    fs::write(folder.path().join("scene.toml"), held).unwrap();
    let summary = run(folder.path(), &[]);
    let steps = summary["steps"].as_array().unwrap();
    let last = &steps[steps.len() - 1];
    assert!((last["tangential_force"][0].as_f64().unwrap() - 10.0).abs() < 1e-5, "{last}");
    assert!(last["worn_volume"].as_f64() > Some(0.0), "{last}");
    // The tangential force of the earlier step remains active, and therefore needs friction.
    let held = stressed().replace(
        "[[steps]]\nname = \"fretting\"",
        "[[steps]]\ntangential_force = [10.0, 0.0]\n[[steps]]\nname = \"fretting\"",
    );
    let frictionless = format!("friction = false\nwear = false\n{alone}");
    let (code, text) = check(&held.replace(cycles, &frictionless), &[]);
    assert!(code == Some(2) && text.contains("still active"), "{text}");
    // Cycles without an amplitude are refused, because nothing would move.
    for nothing in ["cycles = { count = 1000 }", "cycles = { count = 1000, loads = { bulk = 0.0 } }"] {
        let (code, text) = check(&stressed().replace(cycles, nothing), &[]);
        assert!(code == Some(2) && text.contains("lacks an amplitude"), "{text}");
    }
}

/// Truth: docs/scene.md: an amplitude grows from 0 to 1 over the first step, unless this step names the load. Later steps keep
/// the amplitude.
#[test]
fn table_of_amplitudes() {
    let text = printed(&stressed());
    assert!(text.contains("loads of the bodies at the end of each step"), "{text}");
    let rows = |text: &str| text.matches("bulk 1").count();
    assert_eq!(rows(&text), 2, "{text}");
    let named = stressed().replace("approach = 0.02", "approach = 0.02\nloads = { bulk = 0.25 }");
    let text = printed(&named);
    assert_eq!((rows(&text), text.matches("bulk 0.25").count()), (0, 2), "{text}");
}

/// Truth: superposition. Without friction, the bulk stress does not change the tractions. The stress at every point then
/// increases by the amplitude times the bulk stress, 0.5 x 100 MPa along x.
#[test]
fn stress_inside() {
    let line = "\n[[output.inside]]\nname = \"axis\"\nbody = 1\nfrom = [0.0, 0.0, -0.1]\nto = [0.0, 0.0, -5.0]\npoints = 3\n";
    let column = |scene: &str, name: &str| -> Vec<f64> {
        let folder = tempfile::tempdir().unwrap();
        let first = scene.split("[[steps]]\nname = \"fretting\"").next().unwrap();
        let scene = format!("{first}friction = false\nwear = false\n[output]\nfields = [\"vtu\"]\n{line}");
        fs::write(folder.path().join("scene.toml"), scene).unwrap();
        let summary = run(folder.path(), &[]);
        let out = folder.path().join("scene.out");
        assert!(summary["files"].to_string().contains("body1_0001.vtu"), "{summary}");
        let text = fs::read_to_string(out.join("inside-axis_0001.csv")).unwrap();
        let header: Vec<&str> = text.lines().next().unwrap().split(',').collect();
        let at = header.iter().position(|column| *column == name).unwrap();
        text.lines().skip(1).map(|row| row.split(',').nth(at).unwrap().parse().unwrap()).collect()
    };
    let half = stressed().replace("approach = 0.02", "approach = 0.02\nloads = { bulk = 0.5 }");
    for (name, added) in [("stress_xx", 50.0), ("stress_zz", 0.0)] {
        let (with, without) = (column(&half, name), column(SOUND, name));
        for (with, without) in with.iter().zip(&without) {
            assert!((with - without - added).abs() < 1e-6, "{name}: {with} {without}");
        }
    }
}
