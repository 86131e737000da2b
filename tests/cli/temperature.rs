//! Changes of temperature in scenes: refused keys, warnings, half-spaces with the equivalent bulk stress, and a warm body that
//! closes its gap.

use crate::bad_input::{SOUND, check};
use crate::materials::{folder, orthowear};

const ALPHAS: [&str; 3] =
    ["materials.im7.alpha1=-0.5e-6", "materials.im7.alpha2=30e-6", "materials.im7.alpha3=30e-6"];

fn heated() -> String {
    SOUND.replace("nu23 = 0.37\n", "nu23 = 0.37\nalpha1 = -0.5e-6\nalpha2 = 30e-6\n").replace(
        "fibre = { tilt = 30.0, azimuth = 0.0 }",
        "fibre = { tilt = 30.0, azimuth = 0.0 }\ntemperature_change = { value = 80.0, name = \"warm\" }",
    )
}

fn flat(text: &str) -> String {
    text.split_whitespace().filter(|word| *word != "│").collect::<Vec<_>>().join(" ")
}

/// Truth: docs/scene.md: a change of temperature needs all coefficients of thermal expansion of the material. Truncated
/// half-spaces, rolling and periodic frames do not allow it. The message gives the key.
#[test]
fn what_is_refused() {
    let (code, text) = check(&heated(), &[]);
    assert_eq!(code, Some(0), "{text}");
    let cycles = "cycles = { count = 1000, amplitude = 0.05, jumps = 4 }";
    for (from, to, words) in [
        ("alpha1 = -0.5e-6\nalpha2 = 30e-6\n", "", ["body1.temperature_change", "materials.cfrp"]),
        ("alpha2 = 30e-6\n", "", ["materials.cfrp.alpha1", "no `alpha2`"]),
        ("alpha2 = 30e-6\n", "alpha2 = 30e-6\nalpha3 = 30e-6\n", ["materials.cfrp.alpha3", "unknown key"]),
        ("value = 80.0, ", "", ["body1.temperature_change", "lacks `value`"]),
        ("\"warm\"", "\"\"", ["body1.temperature_change.name", "empty name"]),
        (
            "temperature_change",
            "truncated = 3.0\ntemperature_change",
            ["body1.temperature_change", "truncated"],
        ),
        (
            cycles,
            "rolling = { creepage = [1e-3, 0.0] }",
            ["body1.temperature_change", "combined with rolling"],
        ),
        (
            "cells = [16, 16]",
            "cells = [16, 16]\nperiodic = [false, true]",
            ["body1.temperature_change", "periodic direction y"],
        ),
    ] {
        assert!(heated().contains(from), "{from}");
        let (code, text) = check(&heated().replacen(from, to, 1), &[]);
        assert_eq!(code, Some(2), "{to}: {text}");
        assert!(words.iter().all(|word| text.contains(word)), "{to}: {words:?} in\n{text}");
    }
}

/// Truth: a coefficient of 30 1/K and a change of 80 K give a thermal strain of 2400, which no solid reaches. The coefficient was
/// probably given in 1e-6/K.
#[test]
fn coefficients_without_their_power_of_ten() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("scene.toml"), heated().replace("30e-6", "30.0")).unwrap();
    let (code, text, errors) = orthowear(folder.path(), &["check", "scene.toml"]);
    let words = flat(&(text + &errors));
    assert!(code == Some(0) && words.contains("the thermal strain of body1 is 2400"), "{words}");
}

/// Truth: a block of height 1 mm that is fixed at its base and 100 K warmer rises towards the sphere above it. The normal force
/// at a given approach therefore increases. With the amplitude 0, the change has no effect. The near field of a half-space is
/// refused.
#[test]
fn warm_blocks_rise() {
    let force = |keys: &str, more: &[&str]| {
        let folder = folder(&format!("fibre = {{ tilt = 0.0 }}\n{keys}"), "", &[]);
        let mut arguments = vec!["run", "scene.toml", "--out", "out"];
        ALPHAS.iter().chain(more).for_each(|line| arguments.extend(["--set", line]));
        let (code, text, errors) = orthowear(folder.path(), &arguments);
        assert_eq!(code, Some(0), "{text} {errors}");
        let summary = std::fs::read_to_string(folder.path().join("out/summary.json")).unwrap();
        let summary: serde_json::Value = serde_json::from_str(&summary).unwrap();
        (summary["steps"][0]["normal_force"].as_f64().unwrap(), text + &errors)
    };
    let mesh = "near_field = \"mesh\"";
    let (cold, _) = force(mesh, &[]);
    let warm = |amplitude: &str| {
        let name = format!("steps.0.loads={{ warm = {amplitude} }}");
        let keys = format!("{mesh}\ntemperature_change = {{ value = 100.0, name = \"warm\" }}");
        force(&keys, &[&name]).0
    };
    assert!((warm("0.0") / cold - 1.0).abs() < 1e-9, "{cold}");
    assert!(warm("1.0") > 1.05 * warm("0.5") && warm("0.5") > 1.05 * cold, "{cold} {}", warm("1.0"));
    let refused =
        folder("fibre = { tilt = 0.0 }\nnear_field = \"half-space\"\ntemperature_change = 100.0", "", &[]);
    let mut arguments = vec!["run", "scene.toml", "--out", "out"];
    ALPHAS.iter().for_each(|line| arguments.extend(["--set", line]));
    let (code, text, errors) = orthowear(refused.path(), &arguments);
    let words = flat(&(text + &errors));
    assert!(code == Some(2) && words.contains("the temperature of the body changes"), "{words}");
}

/// Truth: the bulk stress σ_x = σ_y = E α ΔT / (1 - ν) and the change of temperature ΔT strain a steel half-space equally. They
/// give the same dissipation. By superposition, two further cases give this dissipation: half of each load, or half the change of
/// temperature in body 1 and its negative in body 2.
#[test]
fn half_spaces_as_by_bulk_stress() {
    let stress = 210e3 * 12e-6 * 40.0 / 0.7;
    let warm = |change: f64| format!("temperature_change = {{ value = {change:?}, name = \"load\" }}");
    let squeezed = |share: f64| {
        let stress = share * stress;
        format!("bulk_stress = {{ value = [{stress:?}, {stress:?}, 0.0], name = \"load\" }}")
    };
    let dissipation = |lower: &str, upper: &str| {
        let folder = tempfile::tempdir().unwrap();
        let steel = "nu = 0.3\nalpha = 12e-6\n";
        let scene = SOUND.replace("nu = 0.3\n", steel).replace(
            "material = \"cfrp\"\nfibre = { tilt = 30.0, azimuth = 0.0 }\n",
            &format!("material = \"steel\"\n{lower}\n"),
        );
        let steps = "[[steps]]\nnormal_force = 200.0\nloads = { load = 0.0 }\n[[steps]]\ntangential_force = [30.0, 0.0]\n";
        let scene = scene
            .replace(
                "kind = \"half-space\"\nmaterial = \"steel\"\n[frame]",
                &format!("kind = \"half-space\"\nmaterial = \"steel\"\n{upper}\n[frame]"),
            )
            .replace("law = \"frp\"\nmu_L = 0.4\nmu_T = 0.5\nmu_N = 0.55\n", "law = \"coulomb\"\nmu = 0.5\n");
        let scene = scene.split("[wear]").next().unwrap().to_owned() + steps + "loads = { load = 1.0 }\n";
        std::fs::write(folder.path().join("scene.toml"), scene).unwrap();
        let (code, text, errors) =
            orthowear(folder.path(), &["run", "scene.toml", "--out", "out", "--quiet"]);
        assert_eq!(code, Some(0), "{text} {errors}");
        let summary = std::fs::read_to_string(folder.path().join("out/summary.json")).unwrap();
        let summary: serde_json::Value = serde_json::from_str(&summary).unwrap();
        summary["steps"][1]["dissipation"].as_f64().unwrap()
    };
    let by_temperature = dissipation(&warm(40.0), "");
    for (lower, upper) in [
        (squeezed(1.0), String::new()),
        (format!("{}\n{}", warm(20.0), squeezed(0.5)), String::new()),
        (warm(20.0), warm(-20.0)),
    ] {
        let found = dissipation(&lower, &upper);
        assert!((found / by_temperature - 1.0).abs() < 1e-8, "{lower} {upper}: {found} {by_temperature}");
    }
    let nothing = dissipation(&format!("{}\n{}", warm(40.0), squeezed(-1.0)), "");
    assert!(nothing < 0.9 * by_temperature, "{nothing} {by_temperature}");
}
