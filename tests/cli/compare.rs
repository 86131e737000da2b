//! `orthowear compare`: variants equal the corresponding runs, and the message names what makes a variant impossible.

use std::fs;
use std::path::Path;

use serde_json::Value;

use super::materials::{folder, orthowear};

fn json(path: &Path) -> Value {
    serde_json::from_slice(&fs::read(path).unwrap_or_else(|e| panic!("{}: {e}", path.display()))).unwrap()
}

/// Keys of body 1. The near field of the mesh takes a hundredth of the time of the default near field.
const FIBRE: &str = "fibre = { tilt = 30.0 }\nnear_field = \"mesh\"";

const STEEL: &str = "fibre = { tilt = 30.0 }\nnear_field = \"mesh\"\n[materials.steel]\nmodel = \"isotropic\"\nE = 210e3\nnu = 0.3";

fn pairs(names: &[&str]) -> Vec<orthowear::scene::variant::DiscretisationPair> {
    names.iter().map(|name| name.parse().unwrap()).collect()
}

/// Normal force, areas, peak pressure and wear volume of each entry.
fn results(summary: &Value) -> Vec<Vec<f64>> {
    let keys = ["normal_force", "contact_area", "stick_area", "peak_pressure", "worn_volume"];
    let numbers = |step: &Value| keys.iter().map(|key| step[key].as_f64().unwrap()).collect::<Vec<f64>>();
    summary["steps"].as_array().unwrap().iter().map(numbers).collect()
}

/// Truth: each variant equals, bit by bit, a run of the scene in which the variant's body replaces the original body.
#[test]
fn the_variants_are_the_runs_they_stand_for() {
    let folder = folder(STEEL, "", &[]);
    let set_body2 = ["--set", "body2.kind=half-space", "--set", "body2.material=steel"];
    let warm = ["1=-0.5e-6", "2=30e-6", "3=30e-6"].map(|alpha| format!("materials.im7.alpha{alpha}"));
    let warm = warm.iter().map(String::as_str).chain(["body1.temperature_change=20.0"]);
    let set_body2: Vec<&str> = set_body2.into_iter().chain(warm.flat_map(|set| ["--set", set])).collect();
    let (code, text, errors) = orthowear(
        folder.path(),
        &[&["compare", "scene.toml", "--out", "c", "--variants", "fe-hs,HS-HS"][..], &set_body2].concat(),
    );
    assert_eq!(code, Some(0), "{errors}");
    let comparison = json(&folder.path().join("c/compare.json"));
    let variants = comparison["variants"].as_array().unwrap();
    let names: Vec<&str> = variants.iter().map(|v| v["name"].as_str().unwrap()).collect();
    assert_eq!(names, ["FE-HS", "HS-HS"]);
    let replaced = "body1={ kind = \"half-space\", material = \"im7\", fibre = { tilt = 30.0 }, temperature_change = 20.0 }";
    for (i, more) in [(0, &[][..]), (1, &["--set", replaced][..])] {
        let arguments = [&["run", "scene.toml", "--out", "r", "--quiet"][..], &set_body2, more].concat();
        let (code, _, errors) = orthowear(folder.path(), &arguments);
        assert_eq!(code, Some(0), "{errors}");
        let alone = results(&json(&folder.path().join("r/summary.json")));
        assert_eq!(results(&variants[i]), alone, "{}", names[i]);
        let own = variants[i]["folder"].as_str().unwrap();
        assert_eq!(results(&json(&folder.path().join("c").join(own).join("summary.json"))), alone);
    }
    let load = |variant: usize| variants[variant]["steps"][0]["normal_force"].as_f64().unwrap();
    let percent = variants[1]["steps"][0]["difference"]["normal_force"].as_f64().unwrap();
    assert!((percent - 100.0 * (load(1) / load(0) - 1.0)).abs() < 1e-10);
    assert!(variants[0]["steps"][0]["difference"].is_null());
    assert!(text.contains(&format!("({percent:+.1} %)")), "{text}");
    let csv = fs::read_to_string(folder.path().join("c/compare.csv")).unwrap();
    let header = csv.lines().next().unwrap();
    assert_eq!(csv.lines().count(), 1 + 2 * 2);
    assert!(csv.lines().all(|line| line.split(',').count() == header.split(',').count()), "{csv}");
    let picture = fs::read_to_string(folder.path().join("c/compare.svg")).unwrap();
    for word in ["FE-HS", "HS-HS", "Pressure after shift, along y"] {
        assert!(picture.contains(word), "the picture lacks {word}");
    }
}

/// Truth: docs/results.md explains every field of compare.json and every column of compare.csv.
#[test]
fn the_documents_explain_the_comparison() {
    let folder = folder(FIBRE, "", &[]);
    let (code, text, _) = orthowear(folder.path(), &["compare", "scene.toml"]);
    assert_eq!(code, Some(0), "{text}");
    let documented = include_str!("../../docs/results.md");
    let comparison = json(&folder.path().join("scene.compare/compare.json"));
    let mut keys: Vec<String> = Vec::new();
    for table in [&comparison, &comparison["variants"][0], &comparison["variants"][1]["steps"][1]] {
        keys.extend(table.as_object().unwrap().keys().cloned());
    }
    let names: Vec<&str> =
        comparison["variants"].as_array().unwrap().iter().map(|v| v["name"].as_str().unwrap()).collect();
    assert_eq!(names, ["FE-rigid", "BE-rigid", "HS-rigid"]);
    for key in keys {
        assert!(documented.contains(&format!("`{key}`")), "docs/results.md does not explain `{key}`");
    }
}

/// Truth: docs/command-line.md: a half-space needs a plane frame and one material direction. Other variants are computed, and the
/// exit code is the worst of the computed variants.
#[test]
fn variants_that_cannot_be_do_not_stop_the_others() {
    let curved = folder(FIBRE, "", &[]);
    let mesh = fs::read_to_string(curved.path().join("box.msh")).unwrap();
    // The top is lowered by 0.1 mm at two corners.
    let bent = mesh.replace("-1 -1 0\n", "-1 -1 -0.1\n").replace("\n125 1 1 0\n", "\n125 1 1 -0.1\n");
    assert_ne!(bent, mesh);
    fs::write(curved.path().join("box.msh"), bent).unwrap();
    let to_surface = "friction.fibre={ tilt = 30.0 }";
    let arguments = ["compare", "scene.toml", "--set", "frame={ kind = \"mesh\" }", "--set", to_surface];
    let (code, text, errors) = orthowear(curved.path(), &arguments);
    assert_eq!(code, Some(0), "{errors}");
    assert!(text.contains("HS-rigid: the contact frame is curved"), "{text}");
    assert!(text.contains("not computed") && text.contains("converged"), "{text}");

    let wound = "fibre = { cylindrical = { axis = \"y\", origin = [0, 0, -2], angle = 90.0 } }";
    let varied = folder(wound, "", &[]);
    let arguments = ["compare", "scene.toml", "--set", "friction.fibre={ azimuth = 0.0 }"];
    let (code, text, errors) = orthowear(varied.path(), &arguments);
    assert_eq!(code, Some(0), "{errors}");
    assert!(
        ["BE-rigid", "HS-rigid"]
            .iter()
            .all(|name| text.contains(&format!("{name}: the material axes of body1 vary by "))),
        "{text}"
    );
}

/// Truth: docs/command-line.md: a half-space has no body force, foundations or prescribed displacements. A warning names them,
/// even a prescribed displacement that consists of a gradient alone.
#[test]
fn what_a_half_space_has_no_place_for_is_named() {
    let scene = folder(FIBRE, "", &[]);
    let path = scene.path().join("scene.toml");
    let notes = |settings: &[&str]| -> String {
        let settings: Vec<String> = settings.iter().map(|setting| setting.to_string()).collect();
        let plan = orthowear::scene::read(&path, &settings).unwrap_or_else(|mistakes| panic!("{mistakes}"));
        let (_, variants) =
            orthowear::compare::variants(&plan, &[]).unwrap_or_else(|f| panic!("{}", f.error));
        variants.into_iter().flat_map(|variant| variant.warnings).map(String::from).collect()
    };
    assert_eq!(notes(&[]), "");
    let sides = "body1.fixed=[{ group = \"base\", components = [\"x\", \"y\"] }]";
    let far = "body1.displaced=[{ group = \"base\", components = [\"z\"], gradient = [[1e-4, 0.0, 0.0]] }]";
    for (settings, named) in [
        (&["body1.body_force=[0.0, 0.0, -1e-3]"][..], "the body force of body1"),
        (&["body1.foundation=[{ group = \"base\", stiffness = 10.0 }]"], "the foundations of body1"),
        (&[sides, far], "the prescribed displacements of body1"),
    ] {
        let found = notes(settings);
        assert!(found.contains(named), "{settings:?}: {found}");
    }
}

/// Truth: docs/command-line.md: a scene without meshed bodies has one variant. The exit code is the worst of the variants.
#[test]
fn one_variant_and_the_worst_exit_code() {
    let folder = folder(FIBRE, "", &[]);
    let half_space = "body1={ kind = \"half-space\", material = \"im7\", fibre = { tilt = 30.0 } }";
    let (code, text, _) =
        orthowear(folder.path(), &["compare", "scene.toml", "--set", half_space, "--out", "one"]);
    assert_eq!(code, Some(0));
    assert!(text.contains("only one variant") && text.contains("1 variant in"), "{text}");
    let few = ["compare", "scene.toml", "--set", "solver.max_iterations=1", "--out", "few"];
    let (code, text, _) = orthowear(folder.path(), &few);
    assert_eq!(code, Some(3), "{text}");
    assert!(text.contains("NOT CONVERGED") && text.contains("increase solver.max_iterations"), "{text}");
    let (code, _, errors) = orthowear(folder.path(), &["compare", "scene.toml", "--set", "gap.radius=-1"]);
    assert_eq!(code, Some(2));
    assert!(errors.contains("gap.radius"), "{errors}");
}

/// Truth: geometry of a sphere of radius R = 50 mm. Plane faces with sides of 0.19 mm deviate from the sphere by up to 0.19^2/(4
/// R) = 2e-4 mm. The gap in the corners of the frame is 0.024 mm.
#[test]
fn half_spaces_keep_the_gap_of_the_meshes() {
    let scene = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes/steel-cap-on-cfrp-block.toml");
    let plan = orthowear::scene::read(&scene, &[]).unwrap_or_else(|mistakes| panic!("{mistakes}"));
    let (frame, variants) = orthowear::compare::variants(&plan, &pairs(&["FE-HS", "HS-FE", "HS-HS"]))
        .unwrap_or_else(|f| panic!("{}", f.error));
    for variant in &variants {
        let gap = variant.plan.as_ref().unwrap().gap.evaluate(&frame).unwrap();
        for (cell, found) in gap.iter().enumerate() {
            let [x, y] = frame.plane_coordinates(cell);
            let exact = 50.0 - (2500.0 - x * x - y * y).sqrt();
            assert!((found - exact).abs() < 3e-4, "{}: {found} instead of {exact}", variant.name);
        }
    }
}

/// Truth: each variant equals, bit by bit, a run of the scene in which the variant's body replaces the original body.
///
/// - FE to BE: the boundary elements are the surface of the solid elements, or a separate mesh.
/// - BE to FE: the finite elements are the solid elements of the mesh whose surface the boundary elements used.
#[test]
fn meshed_bodies_become_one_another() {
    let folder = folder(FIBRE, "", &[]);
    let path = |name: &str| folder.path().join(name);
    let box_mesh = fs::read_to_string(path("box.msh")).unwrap();
    fs::write(path("other.msh"), box_mesh).unwrap();
    let as_be = "body1={ kind = \"be\", material = \"im7\", fibre = { tilt = 30.0 }, mesh = \"box.msh\", contact = \"top\", \
                 fixed = [{ group = \"base\" }], element = \"constant\" }";
    let mesh = "body1.near_field=\"mesh\"";
    let run = |settings: &[&str]| {
        let sets = settings.iter().flat_map(|setting| ["--set", setting]);
        let arguments: Vec<&str> =
            ["run", "scene.toml", "--out", "r", "--quiet"].into_iter().chain(sets).collect();
        let (code, _, errors) = orthowear(folder.path(), &arguments);
        assert_eq!(code, Some(0), "{errors}");
        results(&json(&path("r/summary.json")))
    };
    let [fe, be] = [run(&[mesh]), run(&[as_be])];
    assert_ne!(fe, be);
    let constant = "compare.body1.be.element=\"constant\"";
    let solids = "compare.body1.fe.near_field=\"mesh\"";
    let own = "compare.body1.be={ mesh = \"other.msh\", element = \"constant\" }";
    for (settings, expected) in [(&[mesh, constant][..], &be), (&[mesh, own], &be), (&[as_be, solids], &fe)] {
        let sets = settings.iter().flat_map(|setting| ["--set", setting]);
        let both = if settings[0] == as_be { "be-rigid,fe-rigid" } else { "fe-rigid,be-rigid" };
        let arguments = ["compare", "scene.toml", "--out", "c", "--variants", both];
        let arguments: Vec<&str> = arguments.into_iter().chain(sets).collect();
        let (code, text, errors) = orthowear(folder.path(), &arguments);
        assert_eq!(code, Some(0), "{text}{errors}");
        let comparison = json(&path("c/compare.json"));
        assert_eq!(results(&comparison["variants"][1]), *expected, "{settings:?}");
    }
}

/// Truth: docs/command-line.md: the message names the reason why a variant is impossible, or the key of `compare` that does not
/// fit the scene.
#[test]
fn descriptions_that_do_not_fit_are_named() {
    let folder = folder(FIBRE, "", &[("flat.msh", FLAT)]);
    let of_be = "body1={ kind = \"be\", material = \"im7\", mesh = \"box.msh\", contact = \"top\", fixed = [{ group = \"base\" }] }";
    let given = "compare.body1.be.element=\"constant\"";
    for (settings, code, named) in [
        (&["compare.variants=[\"FE-rigid\", \"BEM-rigid\"]"][..], 2, "\"BEM\" is not a body model"),
        (&["compare.variants=[\"FE-rigid\", \"fe-rigid\"]"], 2, "the variant FE-rigid is named twice"),
        (&["compare.variants=[]"], 2, "compare.variants"),
        (&["compare.body1.be.mesh=\"none.msh\""], 2, "there is no mesh file"),
        (&["compare.body1.be.mesh=\"flat.msh\""], 2, "is open"),
        (&["compare.body1.fe.mesh=\"box.msh\""], 2, "applies only if body1.kind = \"be\""),
        (&[of_be, given], 2, "applies only if body1.kind = \"fe\""),
        (&["compare.variants=[\"FE-rigid\", \"FE-FE\"]"], 0, "FE-FE: body2 is rigid in the scene"),
        (
            &["compare.variants=[\"FE-rigid\", \"rigid-rigid\"]"],
            0,
            "rigid-rigid: body1 is elastic in the scene",
        ),
        (
            &["body1.foundation=[{ group = \"base\", stiffness = 10.0 }]"],
            0,
            "BE-rigid: body1 has foundations, which boundary elements do not support",
        ),
        (
            &["body1.fixed=[{ group = \"base\" }, { group = \"block\", components = [\"x\"] }]"],
            0,
            "BE-rigid: body1 as a boundary-element body can be fixed and loaded on surfaces only",
        ),
        (
            &["body1.near_field=\"auto\"", "frame.cells=[12, 12]"],
            0,
            "BE-rigid: the cells of the frame are too small for the meshes",
        ),
    ] {
        let sets = settings.iter().flat_map(|setting| ["--set", setting]);
        let arguments = ["compare", "scene.toml", "--out", "c", "--set", "body1.near_field=\"mesh\""];
        let usual =
            if settings[0].starts_with("compare") { &[][..] } else { &["--variants", "FE-rigid,BE-rigid"] };
        let arguments: Vec<&str> = arguments.into_iter().chain(sets).chain(usual.iter().copied()).collect();
        let (found, text, errors) = orthowear(folder.path(), &arguments);
        let text = format!("{text}{errors}").split_whitespace().collect::<Vec<_>>().join(" ");
        assert_eq!(found, Some(code), "{settings:?}: {text}");
        assert!(text.contains(named), "{settings:?}: {text}");
    }
}

/// Mesh of two triangles, which form no closed surface.
const FLAT: &str = "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$PhysicalNames\n1\n2 1 \"top\"\n$EndPhysicalNames\n$Nodes\n4\n\
                    1 0 0 0\n2 1 0 0\n3 1 1 0\n4 0 1 0\n$EndNodes\n$Elements\n2\n1 2 2 1 1 1 2 3\n2 2 2 1 1 1 3 4\n$EndElements\n";

/// Truth: the files contain the fields of each variant. The differences in the files equal the differences of these fields bit by
/// bit.
#[test]
fn differences_are_those_of_the_fields() {
    let folder = folder("fibre = { tilt = 30.0 }", "", &[]);
    let arguments = ["compare", "scene.toml", "--out", "c", "--variants", "HS-rigid,FE-rigid"];
    let settings = ["--set", "output.fields=[\"vtu\"]", "--set", "frame.cells=[4, 4]"];
    let (code, _, errors) = orthowear(folder.path(), &[&arguments[..], &settings].concat());
    assert_eq!(code, Some(0), "{errors}");
    let _checked = crate::tools::python("differences.py", &folder.path().join("c"));
}

/// Truth: expected results in the head of the scene file: forces and peak pressures of FE-FE and FE-BE agree to 0.5 %. A
/// half-space cannot represent the curved, wound tube.
#[test]
fn a_bushing_on_a_wound_tube() {
    let scene = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes/compare-bushing.toml");
    let out = tempfile::tempdir().unwrap();
    let [scene, place] = [scene.to_str().unwrap(), out.path().to_str().unwrap()];
    let (code, text, errors) =
        orthowear(out.path(), &["compare", scene, "--out", place, "--set", "output.fields=[]"]);
    assert_eq!(code, Some(0), "{text}{errors}");
    let comparison = json(&out.path().join("compare.json"));
    let difference = &comparison["variants"][1]["steps"][0]["difference"];
    for key in ["normal_force", "peak_pressure", "tangential_force"] {
        let percent = difference[key].as_f64().unwrap();
        assert!(percent.abs() < 0.5, "{key}: {percent}");
    }
    assert!(text.contains("HS-HS: the material axes of body1 vary by "), "{text}");
}

/// Truth: docs/command-line.md: differences are relative to the first computed variant. If no variant is computed, the exit code
/// is 2. A warning names its variant, unless all variants give this warning.
#[test]
fn what_is_compared_with_what_is_told() {
    let folder = folder(FIBRE, "", &[]);
    let run = |arguments: &[&str]| {
        let all = [&["compare", "scene.toml", "--set", "body1.near_field=\"mesh\""], arguments].concat();
        let (code, text, errors) = orthowear(folder.path(), &all);
        (code, format!("{text}{errors}").split_whitespace().collect::<Vec<_>>().join(" "))
    };
    let (code, text) = run(&["--variants", "FE-FE,HS-HS", "--out", "new/deep"]);
    assert_eq!(code, Some(2), "{text}");
    assert!(text.contains("FE-FE: body2 is rigid in the scene") && !text.contains("cannot write"), "{text}");
    let (code, text) = run(&["--variants", "FE-FE, fe-rigid,HS-rigid,FE-rigid", "--out", "c"]);
    assert_eq!(code, Some(0), "{text}");
    assert!(text.contains("FE-FE was not computed; the differences refer to FE-rigid"), "{text}");
    let comparison = json(&folder.path().join("c/compare.json"));
    let variants = comparison["variants"].as_array().unwrap();
    assert_eq!(variants.len(), 3);
    assert!(
        variants[1]["steps"][0]["difference"].is_null() && variants[2]["steps"][0]["difference"].is_object()
    );
    let grid = fs::read(folder.path().join("c/differences_0001.vtu")).unwrap();
    assert!(String::from_utf8_lossy(&grid).contains("pressure_HS-rigid_minus_FE-rigid"));
    let (code, text) =
        run(&["--variants", "BE-rigid,HS-rigid", "--out", "w", "--set", "frame.half_width=[0.375, 0.375]"]);
    assert_eq!(code, Some(0), "{text}");
    let edge = "WARNING: step \"press\" (1): the contact reaches the edge of the frame";
    assert!(
        text.contains("BE-rigid: WARNING: the area of a cell of the frame is") && text.contains(edge),
        "{text}"
    );
}

/// Truth: docs/scene.md: a warning reports a group of supports or loads whose area or position differs by more than 5 % between
/// the meshes.
#[test]
fn meshes_that_are_not_alike_are_told() {
    let folder = folder(FIBRE, "", &[]);
    let mesh = fs::read_to_string(folder.path().join("box.msh")).unwrap();
    let base = mesh.lines().filter(|line| line.contains(" 3 2 2 2 ")).take(2).collect::<Vec<_>>();
    let other = base
        .iter()
        .fold(mesh.clone(), |mesh, line| mesh.replace(line, &line.replace(" 3 2 2 2 ", " 3 2 1 1 ")));
    assert_ne!(other, mesh);
    for (name, text, told) in [("same.msh", &mesh, false), ("other.msh", &other, true)] {
        fs::write(folder.path().join(name), text).unwrap();
        let own = format!("compare.body1.be={{ mesh = \"{name}\", element = \"constant\" }}");
        let arguments = ["compare", "scene.toml", "--variants", "FE-rigid,BE-rigid", "--set", &own];
        let near = ["--set", "body1.near_field=\"mesh\"", "--out", "c"];
        let (code, text, errors) = orthowear(folder.path(), &[&arguments[..], &near].concat());
        assert_eq!(code, Some(0), "{text}{errors}");
        let warning = "the group \"base\" of body1 has an area of 4.0000";
        assert_eq!(text.contains(warning), told, "{name}: {text}");
    }
}
