//! Scenes of the memory measurement: the scenes in scenes/, and larger scenes for every kind of body.

use std::path::{Path, PathBuf};

use orthowear::geometry::Side;

use super::Outcome;
use super::writer::{VARIANTS, write};

use crate::structured::{BlockElements, GradedBlock};

/// A scene with overrides, for which memory is measured.
pub struct Case {
    /// Heading in the table.
    pub group: &'static str,
    pub name: String,
    base: Base,
    pub sets: Vec<String>,
    /// Whether to set the smallest memory limit that `check` accepts. The body is then condensed by conjugate gradients.
    pub least: bool,
}

enum Base {
    /// Name of a file in scenes/.
    File(String),
    /// Text of a scene, and the block that becomes its mesh file block.msh.
    Block(String, Box<GradedBlock>),
}

const SPHERE: &str = "[materials.steel]\nmodel = \"isotropic\"\nE = 210e3\nnu = 0.3\n[gap]\nkind = \"sphere\"\nradius = 50.0\n\
                      [friction]\nlaw = \"coulomb\"\nmu = 0.4\n[[steps]]\nname = \"press\"\napproach = 0.01\n\
                      [[steps]]\nname = \"pull\"\nshift = { distance = 0.002, angle = 20.0 }\n";

const INSIDE: [&str; 2] = [
    "output.inside=[{ name = \"cut\", body = 1, from = [-0.4, 0.0, -0.01], to = [0.4, 0.0, -0.01], across = [-0.4, 0.0, -0.6], \
     points = [300, 300] }]",
    "output.inside=[{ name = \"cut\", body = 1, from = [-0.4, 0.0, -0.01], to = [0.4, 0.0, -0.01], across = [-0.4, 0.0, -0.6], \
     points = [60, 60] }]",
];

const BARE: &str = "output.fields=[]";

/// Half side length of the plates whose faces are the cells of mesh frames, mm.
const PLATE: f64 = 1.5;

impl Case {
    fn file(group: &'static str, name: impl Into<String>, scene: &str, sets: &[&str]) -> Self {
        let sets = sets.iter().map(|set| (*set).to_owned()).collect();
        Self { group, name: name.into(), base: Base::File(format!("{scene}.toml")), sets, least: false }
    }

    fn block(
        group: &'static str,
        name: impl Into<String>,
        scene: String,
        block: GradedBlock,
        sets: &[&str],
    ) -> Self {
        let sets = sets.iter().map(|set| (*set).to_owned()).collect();
        Self { group, name: name.into(), base: Base::Block(scene, Box::new(block)), sets, least: false }
    }

    /// Path of the scene file. If the scene is not in scenes/, writes the scene and its mesh into `folder` first.
    pub fn place(&self, folder: &Path) -> Outcome<PathBuf> {
        match &self.base {
            Base::File(name) => Ok(Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes").join(name)),
            Base::Block(text, block) => {
                let path = folder.join("scene.toml");
                std::fs::write(&path, text)?;
                std::fs::write(folder.join("block.msh"), write(&block.mesh()?, VARIANTS[2]))?;
                Ok(path)
            }
        }
    }
}

/// All cases. With `quick`, only smaller cases, which take seconds each.
pub fn all(quick: bool) -> Vec<Case> {
    let mut cases = scenes();
    cases.extend(grids(quick));
    cases.extend(mesh_frames(quick));
    cases.extend(finite_elements(quick));
    cases.extend(far_fields(quick));
    cases.extend(boundary_elements(quick));
    cases.extend(truncated(quick));
    cases.extend(inside());
    cases
}

fn scenes() -> Vec<Case> {
    const NAMES: [&str; 15] = [
        "cattaneo-mindlin",
        "compare-bushing",
        "compare-finite-pin",
        "compare-sphere-on-block",
        "cylinder-on-flat",
        "hertz-line",
        "hertz",
        "pin-in-hole",
        "rolling-cylinders",
        "sphere-on-block-fe",
        "sphere-on-cfrp-block",
        "sphere-on-cfrp-halfspaces",
        "sphere-wear",
        "steel-cap-on-cfrp-block",
        "tilting-punch",
    ];
    NAMES.iter().map(|name| Case::file("Scenes of scenes/", *name, name, &[])).collect()
}

fn grids(quick: bool) -> Vec<Case> {
    const GROUP: &str = "Half-spaces on grids";
    let mut cases = Vec::new();
    let sizes: &[usize] = if quick { &[64, 256] } else { &[16, 64, 128, 256, 512, 1024] };
    for &n in sizes {
        let cells = format!("frame.cells=[{n}, {n}]");
        for (fields, set) in [("with fields", None), ("no fields", Some(BARE))] {
            let mut add = |what: &str, scene: &str, more: &[&str]| {
                let sets: Vec<&str> =
                    [cells.as_str()].iter().chain(set.as_ref()).chain(more).copied().collect();
                cases.push(Case::file(GROUP, format!("{what}, {n} x {n}, {fields}"), scene, &sets));
            };
            add("no friction", "hertz", &[]);
            add("friction", "cattaneo-mindlin", &["solver.tolerance=1e-6"]);
            if n <= 512 {
                add("CFRP, friction", "sphere-on-cfrp-halfspaces", &["solver.tolerance=1e-6"]);
            }
            if n <= 256 {
                add("CFRP, wear", "sphere-wear", &[]);
                add("nothing skipped", "cattaneo-mindlin", &["solver.skip=false"]);
            }
        }
    }
    if !quick {
        let wide = ["frame.cells=[1024, 1024]", "frame.half_width=[3.2, 3.2]", BARE];
        cases.push(Case::file(GROUP, "no friction, window of 1024 x 1024, no fields", "hertz", &wide));
    }
    cases
}

fn on_plate(n: usize) -> GradedBlock {
    GradedBlock::uniform([PLATE; 2], 1.0, [n, n, 2])
}

fn mesh_frames(quick: bool) -> Vec<Case> {
    let scene = "[body1]\nkind = \"fe\"\nmaterial = \"steel\"\nmesh = \"block.msh\"\ncontact = \"contact\"\n\
                 fixed = [{ group = \"base\" }]\n[body2]\nkind = \"half-space\"\nmaterial = \"steel\"\n[frame]\nkind = \"mesh\"\n";
    let sizes: &[usize] = if quick { &[16, 40] } else { &[16, 24, 31, 40] };
    let case = |&n: &usize| {
        let how = if n * n > 1000 { "compressed" } else { "dense" };
        let name = format!("half-space on {} faces of a plate, {how}", n * n);
        Case::block("Mesh frames", name, format!("{SPHERE}{scene}"), on_plate(n), &[])
    };
    sizes.iter().map(case).collect()
}

fn cube(n: usize, solids: BlockElements) -> GradedBlock {
    GradedBlock {
        half_width: [6.0; 2],
        depth: 6.0,
        patch_half_width: [1.2; 2],
        patch_cells: [n; 2],
        outer_cells: n / 2,
        depth_cells: n,
        first_depth: None,
        solids,
        side: Side::Lower,
        distortion: 0.0,
    }
}

fn on_block(kind: &str, cells: usize) -> String {
    format!(
        "{SPHERE}[body1]\nkind = {kind}\nmaterial = \"steel\"\nmesh = \"block.msh\"\ncontact = \"contact\"\n\
         fixed = [{{ group = \"base\" }}]\n[body2]\nkind = \"rigid\"\n[frame]\nkind = \"grid\"\nhalf_width = [1.2, 1.2]\n\
         cells = [{cells}, {cells}]\n"
    )
}

fn finite_elements(quick: bool) -> Vec<Case> {
    const GROUP: &str = "Finite-element bodies";
    let mut cases = Vec::new();
    let sizes: &[usize] = if quick { &[8, 16] } else { &[4, 8, 12, 16, 22] };
    for &n in sizes {
        for least in [false, true] {
            for (fields, sets) in [("no fields", &[BARE][..]), ("with fields", &[])] {
                // Conjugate gradients are slow, so they are measured on small blocks without fields only.
                if least && (n > 12 || fields == "with fields") {
                    continue;
                }
                let how = if least { "conjugate gradients" } else { "factorisation" };
                let name = format!("block of {0} x {0} x {n} hexahedra, {how}, {fields}", 2 * n);
                let scene = on_block("\"fe\"\nnear_field = \"mesh\"", n);
                let case = Case::block(GROUP, name, scene, cube(n, BlockElements::Hex8), sets);
                cases.push(Case { least, ..case });
            }
        }
    }
    let stress = ["output.fields=[\"vtu\", \"volume\", \"stress\", \"error\"]"];
    for (solids, name) in [(BlockElements::Hex8, "hexahedra"), (BlockElements::Tet4, "tetrahedra")] {
        let name = format!("block of 16 x 16 x 8 {name}, stress");
        let scene = on_block("\"fe\"\nnear_field = \"mesh\"", 8);
        cases.push(Case::block(GROUP, name, scene, cube(8, solids), &stress));
    }
    cases
}

fn far_fields(quick: bool) -> Vec<Case> {
    let sizes: &[usize] = if quick { &[64] } else { &[64, 256, 512] };
    let of = |&n: &usize| {
        let cells = format!("frame.cells=[{n}, {n}]");
        let sets = [cells.as_str(), "steps.2.cycles.jumps=2"];
        [("with fields", &sets[..]), ("no fields", &[sets[0], sets[1], BARE])].map(|(fields, sets)| {
            let name = format!("CFRP block on {n} x {n} cells, {fields}");
            Case::file("Half-spaces with far-field correction", name, "sphere-on-cfrp-block", sets)
        })
    };
    sizes.iter().flat_map(of).collect()
}

fn boundary_elements(quick: bool) -> Vec<Case> {
    let sizes: &[(usize, &str)] = if quick {
        &[(8, "constant"), (8, "linear")]
    } else {
        &[(5, "linear"), (8, "constant"), (8, "linear"), (5, "quadratic")]
    };
    let case = |&(n, element): &(usize, &str)| {
        let scene = on_block(&format!("\"be\"\nelement = \"{element}\""), n / 2);
        let name = format!("boundary of {0} x {0} x {n} hexahedra, {element}", 2 * n);
        Case::block("Boundary-element bodies", name, scene, cube(n, BlockElements::Hex8), &[BARE])
    };
    sizes.iter().map(case).collect()
}

fn truncated(quick: bool) -> Vec<Case> {
    let sizes: &[usize] = if quick { &[16] } else { &[16, 24, 32] };
    let case = |&n: &usize| {
        let cells = format!("frame.cells=[{n}, {n}]");
        let sets = [cells.as_str(), "body1.truncated=3.0"];
        Case::file("Half-spaces with a meshed surface", format!("{n} x {n} cells"), "hertz", &sets)
    };
    sizes.iter().map(case).collect()
}

fn inside() -> Vec<Case> {
    const GROUP: &str = "Interior points";
    let be = on_block("\"be\"\nelement = \"constant\"", 4);
    vec![
        Case::file(GROUP, "90 000 points in a half-space, 64 x 64 cells", "hertz", &[INSIDE[0]]),
        Case::file(
            GROUP,
            "90 000 points in a half-space, 512 x 512 cells",
            "hertz",
            &[INSIDE[0], "frame.cells=[512, 512]"],
        ),
        Case::file(GROUP, "3600 points in CFRP, 64 x 64 cells", "sphere-on-cfrp-halfspaces", &[INSIDE[1]]),
        Case::block(
            GROUP,
            "3600 points in boundary elements",
            be,
            cube(5, BlockElements::Hex8),
            &[INSIDE[1], BARE],
        ),
    ]
}
