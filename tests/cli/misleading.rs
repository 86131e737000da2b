//! Situations in which a result would mislead: refused, or warned of.

use std::fs;
use std::path::Path;

use super::materials::{folder, orthowear};

/// `check` of a scene of `scenes/` with overrides: code, and what it says on one line.
fn check(scene: &str, overrides: &[&str]) -> (Option<i32>, String) {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let mut arguments = vec!["check", scene];
    overrides.iter().for_each(|line| arguments.extend(["--set", line]));
    let (code, text, errors) = orthowear(&root.join("scenes"), &arguments);
    (code, (text + &errors).split_whitespace().collect::<Vec<_>>().join(" "))
}

const FRP: &str = "friction={ law = \"frp\", mu_L = 0.4, mu_T = 0.5, mu_N = 0.55 }";
const PLY: &str = "materials.peek={ model = \"orthotropic\", E1 = 167230.0, E2 = 9544.0, E3 = 9544.0, G12 = 5292.0, \
                   G13 = 5292.0, G23 = 3483.0, nu12 = 0.272, nu13 = 0.272, nu23 = 0.369 }";

/// Truth: the bore of the plate is a half cylinder: its normals are up to 90 degrees from their mean, so that fibres along x lie in the
/// surface at the bottom and stand normal to it at the sides. With angles to the surface the law holds.
#[test]
fn frp_laws_in_a_bore() {
    let fibre = "body1.fibre={ tilt = 0.0, azimuth = 0.0 }";
    let (code, text) = check("pin-in-hole.toml", &[PLY, fibre, FRP]);
    assert_eq!(code, Some(2), "{text}");
    for word in ["friction.law", "deviate by up to 8", "limit: 5", "friction.fibre = { tilt"] {
        assert!(text.contains(word), "lacks \"{word}\": {text}");
    }
    let wear = "wear={ law = \"frp\", i_L = 1e-9, i_T = 1e-9, i_N = 1e-9 }";
    let coulomb = "friction={ law = \"coulomb\", mu = 0.3 }";
    let (code, text) = check("pin-in-hole.toml", &[PLY, fibre, coulomb, wear]);
    assert!(code == Some(2) && text.contains("wear.law") && text.contains("wear.fibre = {"), "{text}");
    let given = "friction.fibre={ tilt = 0.0, azimuth = 0.0 }";
    let (code, text) = check("pin-in-hole.toml", &[PLY, fibre, FRP, given]);
    assert_eq!(code, Some(0), "{text}");
}

/// Truth: a block sheared so that its top rises by 0.05 x is plane, but inclined by atan(0.05) = 2.862 degrees, so that a tilt from z = 0 is not that to
/// the surface.
#[test]
fn frp_laws_on_an_inclined_plane() {
    let folder = folder("fibre = { tilt = 0.0 }", "", &[]);
    let path = folder.path().join("box.msh");
    let mesh = fs::read_to_string(&path).unwrap();
    let (before, rest) = mesh.split_once("$Nodes\n125\n").unwrap();
    let (nodes, after) = rest.split_once("$EndNodes").unwrap();
    let sheared: String = nodes
        .lines()
        .map(|line| {
            let [number, x, y, z]: [f64; 4] =
                line.split_whitespace().map(|n| n.parse().unwrap()).collect::<Vec<_>>().try_into().unwrap();
            format!("{number} {x} {y} {}\n", z + 0.05 * x)
        })
        .collect();
    fs::write(&path, format!("{before}$Nodes\n125\n{sheared}$EndNodes{after}")).unwrap();
    let check = |overrides: &[&str]| {
        let mut arguments = vec!["check", "scene.toml", "--set", "frame={ kind = \"mesh\" }"];
        overrides.iter().for_each(|line| arguments.extend(["--set", line]));
        let (code, text, errors) = orthowear(folder.path(), &arguments);
        (code, (text + &errors).split_whitespace().collect::<Vec<_>>().join(" "))
    };
    let (code, text) = check(&[]);
    assert!(code == Some(2) && text.contains("mean normal is 2.9 degrees away from z"), "{code:?} {text}");
    let (code, text) = check(&["friction.fibre={ tilt = 2.862 }"]);
    assert_eq!(code, Some(0), "{text}");
}

/// Truth: a mesh frame that is plane, or the cap of a sphere of 50 mm over 1.2 mm (1.4 degrees), has one angle to the fibre.
#[test]
fn frp_laws_on_nearly_plane_mesh_frames() {
    for scene in ["steel-cap-on-cfrp-block.toml", "compare-finite-pin.toml"] {
        let (code, text) = check(scene, &[]);
        assert_eq!(code, Some(0), "{text}");
    }
}

/// Truth: the loads are in the displacements before the first increment, so that friction cannot respond to them: a block under a pressure of its
/// own is warned of as long as a step has friction, one without loads is not.
#[test]
fn own_loads_with_friction() {
    let load = "pressure = [{ group = \"base\", value = 50.0 }]";
    let none = ["friction={ law = \"none\" }", "steps=[{ approach = 0.005 }]"];
    let body = |keys: &str| folder(&format!("fibre = {{ tilt = 0.0 }}\n{keys}"), "", &[]);
    let said = |keys: &str, overrides: &[&str]| {
        let folder = body(keys);
        let mut arguments = vec!["check", "scene.toml"];
        overrides.iter().for_each(|line| arguments.extend(["--set", line]));
        let (code, text, errors) = orthowear(folder.path(), &arguments);
        assert_eq!(code, Some(0), "{errors}");
        text
    };
    let warned = "act in full before contact";
    let text = said(load, &[]);
    assert!(
        text.contains("WARNING: body1 has loads of its own (`pressure`)") && text.contains("no slip"),
        "{text}"
    );
    let text =
        said("", &["body1.fixed=[]", "body1.displaced=[{ group = \"base\", value = [0.0, 0.0, 0.001] }]"]);
    assert!(
        text.contains("WARNING: body1 has loads of its own (`displaced`)") && text.contains(warned),
        "{text}"
    );
    assert!(!said(load, &none).contains(warned));
    assert!(!said("", &[]).contains(warned));
}

/// Truth: Hertz: a rigid sphere of 20 mm pressed by 0.005 mm touches within sqrt(20 * 0.005) = 0.32 mm at most; 0.2 mm is more than a fifth
/// of it, 0.002 mm is not.
#[test]
fn sliding_farther_than_the_contact_allows() {
    let folder = folder("fibre = { tilt = 0.0 }", "", &[]);
    let said = |distance: &str| {
        let set = format!("steps.shift.shift.distance={distance}");
        let (code, text, errors) = orthowear(folder.path(), &["run", "scene.toml", "--set", &set]);
        assert_eq!(code, Some(0), "{text} {errors}");
        text
    };
    let text = said("0.2");
    assert!(
        text.contains("WARNING: step \"shift\"") && text.contains("displaced tangentially by 0.2000"),
        "{text}"
    );
    assert!(!said("0.002").contains("displaced tangentially"));
}
