//! `$ElementData` in files of gmsh and meshio, and in damaged files.

use std::fs;

use orthowear::mesh::gmsh;

use super::tools;

const BOX: &str = r#"
Point(1) = {0, 0, 0};
line[] = Extrude{1, 0, 0}{Point{1}; Layers{2};};
face[] = Extrude{0, 1, 0}{Line{line[1]}; Layers{2}; Recombine;};
body[] = Extrude{0, 0, 1}{Surface{face[1]}; Layers{2}; Recombine;};
Physical Volume("block") = {body[1]};
Physical Surface("top") = {body[0]};
Mesh 3;
Plugin(NewView).NumComp = 3;
Plugin(NewView).Value = 0.75;
Plugin(NewView).Type = "ElementData";
Plugin(NewView).Run;
View[0].Name = "fibre";
Mesh.SaveAll = 1;
Mesh.MshFileVersion = VERSION;
Mesh.Binary = BINARY;
PostProcessing.SaveMesh = MESH;
Save View[0] "view.msh";
"#;

/// Truth: the script gives (0.75, 0.75, 0.75) to each of the 64 elements of a cube of 2 x 2 x 2 solids. The elements are 8
/// solids, 24 outer faces, 24 edges and 8 points.
#[test]
fn what_gmsh_writes_of_a_view_is_read() {
    for (version, binary, with_mesh) in
        [("2.2", "0", "1"), ("2.2", "1", "1"), ("4.1", "0", "1"), ("4.1", "1", "1"), ("4.1", "1", "0")]
    {
        let dir = tempfile::tempdir().expect("a temporary folder");
        let script = BOX
            .replace("VERSION", version)
            .replace("BINARY", binary)
            .replace("MESH;", &format!("{with_mesh};"));
        fs::write(dir.path().join("box.geo"), script).expect("a written file");
        if !tools::gmsh(&["box.geo", "-"], dir.path()) {
            return;
        }
        let path = dir.path().join("view.msh");
        let (fields, warnings) =
            gmsh::read_fields(&path).unwrap_or_else(|e| panic!("{version} {binary}: {e}"));
        assert_eq!(warnings, [""; 0]);
        let [field] = fields.as_slice() else { panic!("{} fields", fields.len()) };
        assert_eq!((field.name.as_str(), field.n_components, field.elements.len()), ("fibre", 3, 64));
        assert!(field.values.len() == 3 * 64 && field.values.iter().all(|v| *v == 0.75));
        if with_mesh == "1" {
            let mesh = gmsh::read(&path).unwrap_or_else(|e| panic!("{version} {binary}: {e}"));
            assert_eq!(mesh.fields, fields);
            assert!(mesh.volume_cells().all(|cell| field.elements.contains(&mesh.tag(cell))));
        }
    }
}

const MESHIO: &str = r#"
import meshio, numpy
points = [[x, y, z] for z in (0, 1, 2) for y in (0, 1) for x in (0, 1)]
cells = [[0, 1, 3, 2, 4, 5, 7, 6], [4, 5, 7, 6, 8, 9, 11, 10]]
fibre = numpy.array([[0.1, -0.2, 0.3], [1e-3, 2.0, 3.0]])
mesh = meshio.Mesh(points, [("hexahedron", cells)], cell_data={"fibre": [fibre]})
# Binary, because in text files meshio 5.3 with NumPy 2 writes "np.float64(0.1)".
for name, kind in (("a", "gmsh22"), ("b", "gmsh")):
    meshio.write(name + ".msh", mesh, file_format=kind, binary=True)
"#;

/// Truth: the array given to meshio. The field that is read is equal to the last bit, in both file versions.
#[test]
fn cell_data_that_meshio_writes_is_read() {
    let dir = tempfile::tempdir().expect("a temporary folder");
    if !tools::python(&["-c", MESHIO], dir.path()) {
        return;
    }
    for name in ["a.msh", "b.msh"] {
        let mesh = gmsh::read(&dir.path().join(name)).unwrap_or_else(|e| panic!("{name}: {e}"));
        let tags: Vec<u64> = mesh.volume_cells().map(|cell| mesh.tag(cell)).collect();
        assert_eq!(mesh.fields.len(), 1, "{name}");
        assert_eq!(mesh.fields[0].elements, tags, "{name}");
        assert_eq!(mesh.fields[0].values, [0.1, -0.2, 0.3, 1e-3, 2.0, 3.0], "{name}");
    }
}

/// Truth: the message names the damage and its line.
#[test]
fn damaged_fields_are_refused() {
    let head = "$MeshFormat\n4.1 0 8\n$EndMeshFormat\n";
    let sound = "$ElementData\n1\n\"f\"\n1\n0.0\n3\n0\n3\n2\n7 1 0 0\n8 0 1 0\n$EndElementData\n";
    let read = |text: &str| {
        let dir = tempfile::tempdir().expect("a temporary folder");
        let path = dir.path().join("f.msh");
        fs::write(&path, text).expect("a written file");
        gmsh::read_fields(&path).map_err(|error| error.to_string())
    };
    let whole = format!("{head}{sound}{}", sound.replace("7 1 0 0", "7 5 5 5"));
    // Of several time steps, only the first is read. One warning covers all others.
    let (fields, warnings) = read(&format!("{whole}{}", &whole[head.len()..])).expect("sound");
    assert_eq!((fields.len(), &fields[0].values[..]), (1, &[1.0, 0.0, 0.0, 0.0, 1.0, 0.0][..]));
    assert!(warnings.len() == 1 && warnings[0].contains("\"f\" has several time steps"), "{warnings:?}");
    assert_eq!(read(&format!("{head}{sound}")).expect("sound").1, [""; 0]);
    let refused = |from: &str, to: &str, words: &[&str]| {
        let text = format!("{head}{sound}");
        assert!(text.contains(from), "{from}");
        let message = read(&text.replacen(from, to, 1)).expect_err("a refusal");
        words.iter().for_each(|word| assert!(message.contains(word), "lacks {word}: {message}"));
    };
    refused("3\n0\n3\n2\n7", "3\n0\n3\n900\n7", &["line 12", "900 values are announced"]);
    refused("3\n0\n3\n2\n7", "3\n0\n3\n1\n7", &["line 14", "expected $EndElementData"]);
    refused("3\n0\n3\n2\n7", "3\n0\n12\n2\n7", &["line 12", "12 components"]);
    refused("3\n0\n3\n2\n7", "2\n0\n3\n", &["line 9", "at least 3"]);
    refused("\"f\"", "f", &["line 6", "quotation marks"]);
    refused("8 0 1 0", "8 0 one 0", &["line 14", "\"one\""]);
    let early = read(&format!("{sound}{head}")).expect_err("a refusal");
    assert!(early.contains("$MeshFormat must come before"), "{early}");
}
