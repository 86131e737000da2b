//! Volumes of solid elements of every kind, written as VTU and read back by VTK and meshio.

use std::fmt::Write as _;
use std::fs;

use orthowear::body::BodyField;
use orthowear::element::ElementKind;
use orthowear::mesh::Mesh;
use orthowear::output::volume::volume_grid;
use orthowear::quadrature::{hexahedron, pyramid, tetrahedron, wedge};

use super::tools;
use crate::fem_meshes::{block, rough};

fn cell_volume(kind: ElementKind, nodes: &[[f64; 3]]) -> f64 {
    let rule = match kind.n_corners() {
        4 => tetrahedron(5),
        5 => pyramid(5),
        6 => wedge(5, 4),
        _ => hexahedron(4),
    };
    let volume = |(xi, weight): ([f64; 3], f64)| {
        let mut j = nalgebra::Matrix3::zeros();
        for (x, g) in nodes.iter().zip(kind.shape_gradients(xi)) {
            j += nalgebra::Vector3::from(*x) * nalgebra::Vector3::from(g).transpose();
        }
        weight * j.determinant()
    };
    rule.into_iter().map(volume).sum()
}

/// Text with a line for each cell: its VTK type and its volume.
fn described(mesh: &Mesh) -> String {
    let mut lines = String::new();
    for cell in mesh.volume_cells() {
        // VTK has no pyramid of 14 nodes. Such a pyramid is written without its last node.
        let kind = match mesh.kind(cell) {
            ElementKind::Pyramid14 => ElementKind::Pyramid13,
            kind => kind,
        };
        let nodes: Vec<[f64; 3]> =
            mesh.cell_nodes(cell)[..kind.n_nodes()].iter().map(|&node| mesh.points[node]).collect();
        writeln!(lines, "{} {:e}", kind.vtk_code(), cell_volume(kind, &nodes)).expect("a string");
    }
    lines
}

/// Truth: on curved cells of every kind, VTK's shape functions give the same volume as the shape functions of this program. A
/// misplaced node would change the volume. The tolerance 1e-9 covers rounding of central differences. VTK's filter of cell sizes
/// divides curved cells into a few straight cells and agrees to 20 %.
#[test]
fn volumes_read_back_by_vtk_and_meshio() {
    let dir = tempfile::tempdir().expect("a temporary folder");
    for kind in ElementKind::ALL.into_iter().filter(|kind| kind.dim() == 3) {
        let mesh = block(kind, [2, 2, 1], [1.0; 3], rough);
        let field = BodyField { displacement: mesh.points.clone(), stress: None };
        let grid = volume_grid(&mesh, &field).expect("a grid");
        let mut file = fs::File::create(dir.path().join(format!("{}.vtu", kind.name()))).expect("a file");
        grid.write(&mut file).expect("written");
        fs::write(dir.path().join(format!("{}.txt", kind.name())), described(&mesh)).expect("written");
    }
    let script = tools::root().join("tests/python/cells.py");
    tools::python(&[&script.to_string_lossy(), &dir.path().to_string_lossy()], dir.path());
}
