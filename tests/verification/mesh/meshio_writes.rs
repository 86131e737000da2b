//! Files that meshio writes: .msh files read directly, .vtu and other files read through scripts/import-mesh.

use std::collections::BTreeSet;
use std::fs;
use std::path::Path;

use orthowear::mesh::faces::group_faces;
use orthowear::mesh::{Mesh, gmsh};

use super::gmsh_writes::{assert_same_group_points, counts};
use super::tools;
use super::writer::{VARIANTS, write};

use crate::structured::{BlockElements, GradedBlock};

const WRITE_ALL: &str = r#"
import meshio, sys
mesh = meshio.read(sys.argv[1])
# Without entities meshio writes 4.1 of one kind of cells only.
solids = [cells for cells in mesh.cells if cells.dim == 3]
whole = mesh if "gmsh:dim_tags" in mesh.point_data else meshio.Mesh(mesh.points, solids)
for binary in (False, True):
    meshio.write(f"22{binary}.msh", mesh, file_format="gmsh22", binary=binary)
    meshio.write(f"41{binary}.msh", whole, file_format="gmsh", binary=binary)
mesh.cell_sets = {}
meshio.write("mesh.vtu", mesh)
"#;

fn points(mesh: &Mesh) -> BTreeSet<[u64; 3]> {
    mesh.points.iter().map(|x| x.map(f64::to_bits)).collect()
}

fn import(dir: &Path, arguments: &[&str]) -> Mesh {
    let script = tools::root().join("scripts/import-mesh");
    let all = [&[script.to_str().expect("a path in UTF-8")], arguments].concat();
    assert!(tools::python(&all, dir));
    gmsh::read(&dir.join(arguments[1])).expect("an imported mesh")
}

/// Truth: the mesh given to meshio. Points are equal to the last bit, because meshio's text has 17 digits. Groups are equal
/// except in version 4.1.
#[test]
fn what_meshio_writes_comes_back_equal() {
    for solids in [BlockElements::Hex8, BlockElements::Tet4] {
        let block =
            GradedBlock { solids, distortion: 0.1, ..GradedBlock::uniform([1.0, 2.0], 1.5, [3, 2, 2]) };
        let mut mesh = block.mesh().expect("a block");
        mesh.groups.retain(|group| !group.cells.is_empty());
        let dir = tempfile::tempdir().expect("a temporary folder");
        // meshio requires $MeshFormat as the first section, and no empty data section at the end.
        let bytes = write(&mesh, VARIANTS[0]);
        let at = |section: &[u8]| {
            bytes.windows(section.len()).position(|word| word == section).expect("a section")
        };
        fs::write(dir.path().join("given.msh"), &bytes[at(b"$MeshFormat")..at(b"$Periodic")])
            .expect("a written file");
        if !tools::python(&["-c", WRITE_ALL, "given.msh"], dir.path()) {
            return;
        }
        let mut read: Vec<(String, Mesh)> = ["22False.msh", "22True.msh", "41False.msh", "41True.msh"]
            .map(|name| {
                (name.to_string(), gmsh::read(&dir.path().join(name)).unwrap_or_else(|e| panic!("{e}")))
            })
            .to_vec();
        let names = mesh
            .groups
            .iter()
            .flat_map(|g| ["--name".to_string(), format!("{}:{}={}", g.dim, g.tag, g.name)]);
        let arguments: Vec<String> =
            ["mesh.vtu", "vtu.msh"].map(String::from).into_iter().chain(names).collect();
        let arguments: Vec<&str> = arguments.iter().map(String::as_str).collect();
        read.push(("mesh.vtu".to_string(), import(dir.path(), &arguments)));
        for (name, read) in read {
            // The given file of version 2.2 has no entities. Without entities, meshio's files of version 4.1 have neither groups
            // nor surfaces.
            if !name.starts_with("41") {
                assert_eq!(counts(&read), counts(&mesh), "{name}");
                assert_same_group_points(&read, &mesh);
            }
            assert_eq!(points(&read), points(&mesh), "{name}");
            assert_eq!(read.volume_cells().count(), mesh.volume_cells().count(), "{name}");
        }
    }
}

const TWO_GROUPS: &str = r#"
Point(1) = {0, 0, 0}; 
line[] = Extrude{1, 0, 0}{Point{1}; Layers{3};};
face[] = Extrude{0, 1, 0}{Curve{line[1]}; Layers{2}; Recombine;};
body[] = Extrude{0, 0, -1}{Surface{face[1]}; Layers{2}; Recombine;};
Physical Surface("contact") = {face[1]};
Physical Surface("base face") = {body[0]};
Physical Volume("block") = {body[1]};
"#;

/// Truth: gmsh's mesh in version 4.1, read directly. The files that meshio writes have equal counts and the same points in each
/// group.
#[test]
fn meshio_keeps_the_groups_of_a_gmsh_file() {
    let dir = tempfile::tempdir().expect("a temporary folder");
    fs::write(dir.path().join("two.geo"), TWO_GROUPS).expect("a written file");
    for order in ["1", "2"] {
        let arguments = ["-3", "two.geo", "-order", order, "-format", "msh41", "-o", "given.msh"];
        if !tools::gmsh(&arguments, dir.path()) || !tools::python(&["-c", WRITE_ALL, "given.msh"], dir.path())
        {
            return;
        }
        let given = gmsh::read(&dir.path().join("given.msh")).expect("gmsh's mesh");
        for name in ["22False.msh", "22True.msh", "41False.msh", "41True.msh"] {
            let read = gmsh::read(&dir.path().join(name)).unwrap_or_else(|e| panic!("{e}"));
            assert_eq!(counts(&read), counts(&given), "{name}");
            assert_same_group_points(&read, &given);
            // Each face of order 2 matches its solid only if the mid-edge nodes are in gmsh's order.
            assert_eq!(group_faces(&read, "contact").expect("outer faces").len(), 6, "{name}");
        }
    }
}

const INP: &str = "*NODE\n1, 0, 0, 0\n2, 1, 0, 0\n3, 1, 1, 0\n4, 0, 1, 0\n5, 0, 0, 1\n6, 1, 0, 1\n7, 1, 1, 1\n8, 0, 1, 1\n\
                   *ELEMENT, TYPE=C3D8, ELSET=BODY\n1, 1, 2, 3, 4, 5, 6, 7, 8\n*NSET, NSET=TOP\n5, 6, 7, 8\n";

/// Truth: the text of the Abaqus file, which describes a unit cube with a node set on its top.
#[test]
fn node_sets_become_groups_of_faces() {
    let dir = tempfile::tempdir().expect("a temporary folder");
    fs::write(dir.path().join("cube.inp"), INP).expect("a written file");
    if !tools::python(&["-c", ""], dir.path()) {
        return;
    }
    let mesh = import(dir.path(), &["cube.inp", "cube.msh"]);
    let top = group_faces(&mesh, "TOP").expect("the faces of the node set");
    assert_eq!(top.len(), 1);
    assert!(top[0].nodes.iter().all(|&node| mesh.points[node][2] == 1.0));
    assert_eq!(mesh.group("BODY").expect("the element set").dim, 3);
}

/// Truth: a cube of side 2 with mid-edge nodes, made by hand. The input deck includes a file with a node set, which becomes the
/// top face. The import omits the *SURFACE of the deck.
#[test]
fn decks_of_order_2_that_include_others() {
    let corners = [[0, 0, 0], [2, 0, 0], [2, 2, 0], [0, 2, 0], [0, 0, 2], [2, 0, 2], [2, 2, 2], [0, 2, 2]];
    let edges =
        [[0, 1], [1, 2], [2, 3], [3, 0], [4, 5], [5, 6], [6, 7], [7, 4], [0, 4], [1, 5], [2, 6], [3, 7]];
    let middles = edges.map(|[a, b]: [usize; 2]| [0, 1, 2].map(|k| (corners[a][k] + corners[b][k]) / 2));
    let nodes: String = corners
        .iter()
        .chain(&middles)
        .enumerate()
        .map(|(i, [x, y, z])| format!("{}, {x}, {y}, {z}\n", i + 1))
        .collect();
    let numbers: Vec<String> = (1..=20).map(|i| i.to_string()).collect();
    let deck = format!(
        "*NODE\n{nodes}*ELEMENT, TYPE=C3D20, ELSET=BODY\n1, {},\n{}\n*INCLUDE, INPUT=sets.txt\n*SURFACE, TYPE=ELEMENT, NAME=UPPER\n1, S2\n",
        numbers[..15].join(", "),
        numbers[15..].join(", ")
    );
    let dir = tempfile::tempdir().expect("a temporary folder");
    fs::write(dir.path().join("cube.deck"), deck).expect("a written file");
    fs::write(dir.path().join("sets.txt"), "*NSET, NSET=TOP\n5, 6, 7, 8, 13, 14, 15, 16\n")
        .expect("a written file");
    if !tools::python(&["-c", ""], dir.path()) {
        return;
    }
    let mesh = import(dir.path(), &["cube.deck", "cube.msh", "--format", "abaqus"]);
    let top = group_faces(&mesh, "TOP").expect("the faces of the node set");
    assert_eq!(top.iter().map(|face| face.nodes.len()).collect::<Vec<_>>(), [8]);
    assert!(top[0].nodes.iter().all(|&node| mesh.points[node][2] == 2.0));
}
