//! Loads and motions that exclude each other, or that the bodies do not allow.

use std::fs;

use super::bad_input::{SOUND, check};

/// Truth: docs/scene.md: on a frame that is periodic along x, body 2 can rotate about x only. A rotation about y or the normal n
/// is refused, because the gap would grow from period to period. Every moment is refused, because its lever arm would differ from
/// period to period.
#[test]
fn repeated_bodies_do_not_turn() {
    let turned = |periodic: &str, control: &str| {
        let scene = SOUND
            .replace("cells = [16, 16]", &format!("cells = [16, 16]\nperiodic = {periodic}"))
            // With two periodic directions the approach must be less than the mean gap.
            .replace("approach = 0.02", &format!("approach = 0.005\n{control}"));
        check(&scene, &[])
    };
    for (periodic, control) in [
        ("[true, false]", "rotation = [0.0, 0.01]"),
        ("[false, true]", "rotation = [0.01, 0.0]"),
        ("[true, true]", "rotation = [0.01, 0.0]"),
        ("[true, false]", "moment = [0.0, 1.0]"),
        ("[false, true]", "twist = 0.01"),
        ("[true, false]", "spin_moment = 1.0"),
    ] {
        let (code, text) = turned(periodic, control);
        let key = format!("steps.0.{}", control.split(' ').next().unwrap());
        assert_eq!(code, Some(2), "{periodic} {control}:\n{text}");
        let reason = if key.ends_with("moment") {
            "lever arm would differ from period to period"
        } else {
            "grow from period to period"
        };
        for word in [&key[..], reason, "with frame.periodic"] {
            assert!(text.contains(word), "{periodic} {control} lacks {word}:\n{text}");
        }
    }
    for (periodic, control) in [
        ("[true, false]", "rotation = [0.01, 0.0]"),
        ("[false, true]", "rotation = [0.0, 0.01]"),
        ("[true, true]", "rotation = [0.0, 0.0]"),
        ("[true, true]", "twist = 0.0"),
        ("[false, false]", "rotation = [0.01, 0.01]"),
    ] {
        let (code, text) = turned(periodic, control);
        assert_eq!(code, Some(0), "{periodic} {control}:\n{text}");
    }
}

/// Truth: docs/scene.md: a step keeps the loads of earlier steps, but rolling excludes a tangential force and a spin moment.
/// `check` refuses this conflict. `run` would meet it only after the earlier steps.
#[test]
fn loads_held_into_rolling() {
    let scene = |load: &str, between: &str| {
        SOUND.replace("approach = 0.02", &format!("approach = 0.02\n{load}\n{between}")).replace(
            "cycles = { count = 1000, amplitude = 0.05, jumps = 4 }",
            "rolling = { creepage = [1e-3, 0.0], direction = 90.0 }",
        )
    };
    for (load, motion) in [("tangential_force = [1.0, 0.0]", "shift"), ("spin_moment = 0.1", "twist")] {
        let (code, text) = check(&scene(load, ""), &[]);
        let words = ["rolling", "of step \"indent\"", &format!("prescribe `{motion}`")[..]];
        assert!(code == Some(2) && words.iter().all(|word| text.contains(word)), "{load}: {text}");
        for between in
            ["shift = { distance = 0.0 }\ntwist = 0.0", "tangential_force = [0.0, 0.0]\nspin_moment = 0.0"]
        {
            let (code, text) = check(&scene(load, &format!("[[steps]]\nname = \"between\"\n{between}")), &[]);
            assert_eq!(code, Some(0), "{load} {between}: {text}");
        }
    }
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("scene.toml"), scene("", "")).unwrap();
    let output =
        crate::tools::orthowear().current_dir(folder.path()).args(["check", "scene.toml"]).output().unwrap();
    let plan = String::from_utf8(output.stdout).unwrap();
    assert!(plan.contains("rolling along 90 degrees with creepage (0.001"), "{plan}");
}
