//! Bodies meshed by gmsh, of first and second order, with all kinds of solid elements that gmsh writes.

use std::f64::consts::{FRAC_PI_2, PI};
use std::fs;

use orthowear::element::ElementKind::{
    self, Hex8, Hex20, Hex27, Pyramid5, Pyramid13, Pyramid14, Tet4, Tet10, Wedge6, Wedge15, Wedge18,
};
use orthowear::fem::{FeModel, HexFormulation, StressRecovery};
use orthowear::mesh::faces::outer_faces;
use orthowear::mesh::quality::check;
use orthowear::mesh::{Mesh, gmsh};

use crate::fem::patch_test;
use crate::fem_bodies::{ALL, largest_difference, rotated_orthotropic, spec};
use crate::fem_meshes::{add_cells, prescribe};
use crate::mesh::tools;

/// A quarter of a cylinder of radius 2 and height 2: hexahedra and wedges below, pyramids and tetrahedra above.
const QUARTER: &str = r#"
Point(1) = {0, 0, 0, 0.7}; Point(2) = {2, 0, 0, 0.7}; Point(3) = {0, 2, 0, 0.7};
Line(1) = {1, 2}; Circle(2) = {2, 1, 3}; Line(3) = {3, 1};
Curve Loop(1) = {1, 2, 3}; Plane Surface(1) = {1};
Recombine Surface{1};
lower[] = Extrude {0, 0, 1} { Surface{1}; Layers{2}; Recombine; };
upper[] = Extrude {0, 0, 1} { Surface{lower[0]}; };
Physical Curve("arc") = {2};
Physical Volume("body") = Volume{:};
"#;

/// Mesh of the quarter cylinder, with the element kinds `kinds`. `None` if gmsh is missing.
fn quarter(order: &str, incomplete: &str, kinds: &[ElementKind]) -> Option<Mesh> {
    let dir = tempfile::tempdir().expect("a temporary folder");
    fs::write(dir.path().join("quarter.geo"), QUARTER).expect("a written file");
    let numbers = ["-order", order, "-setnumber", "Mesh.SecondOrderIncomplete", incomplete];
    let files = ["-3", "quarter.geo", "-o", "quarter.msh"];
    if !tools::gmsh(&[&files[..], &numbers].concat(), dir.path()) {
        return None;
    }
    let mesh = gmsh::read(&dir.path().join("quarter.msh")).expect("a mesh");
    let mut found: Vec<ElementKind> =
        mesh.blocks.iter().map(|block| block.kind).filter(|kind| kind.dim() == 3).collect();
    found.sort_unstable();
    assert_eq!(found, kinds);
    Some(mesh)
}

/// Solves the quarter cylinder under the pressure 7 on its whole surface. Asserts that the normal stresses are -7 everywhere and
/// the reactions vanish.
fn assert_hydrostatic(mut mesh: Mesh) {
    for face in outer_faces(&mesh) {
        let name = format!("skin {}", face.kind.name());
        match mesh.groups.iter().position(|group| group.name == name) {
            None => add_cells(&mut mesh, face.kind, &name, face.nodes),
            Some(group) => {
                let block = mesh.groups[group].cells[0].block;
                let cell = mesh.blocks[block].n_cells();
                mesh.blocks[block].nodes.extend(face.nodes);
                mesh.blocks[block].tags.push(cell as u64 + 1);
                mesh.groups[group].cells.push(orthowear::mesh::CellRef { block, cell });
            }
        }
    }
    let at = |x: [f64; 3]| {
        let near = |p: &[f64; 3]| (0..3).all(|k| (p[k] - x[k]).abs() < 1e-9);
        mesh.points.iter().position(near).expect("a node")
    };
    let (origin, along_x, along_y) = (at([0.0; 3]), at([2.0, 0.0, 0.0]), at([0.0, 2.0, 0.0]));
    let mut supports = prescribe(&mut mesh, &[origin], ALL, |_| [0.0; 3]);
    supports.extend(prescribe(&mut mesh, &[along_x], [false, true, true], |_| [0.0; 3]));
    supports.extend(prescribe(&mut mesh, &[along_y], [false, false, true], |_| [0.0; 3]));
    let skins = mesh.groups.iter().filter(|group| group.name.starts_with("skin"));
    let pressures = skins.map(|group| (group.name.clone(), 7.0)).collect();
    let mut spec = spec(mesh, rotated_orthotropic(), HexFormulation::Enhanced, supports);
    spec.pressures = pressures;
    let body = FeModel::new(spec).unwrap().condense(&[]).unwrap();
    let (model, u) = (body.model(), body.contact_free_displacement());
    let stress = StressRecovery::new(model).unwrap().stress(model, u).unwrap();
    let wanted = vec![[-7.0, -7.0, -7.0, 0.0, 0.0, 0.0]; stress.len()];
    assert!(largest_difference(&stress, &wanted) < 1e-9 * 7.0, "{:e}", largest_difference(&stress, &wanted));
    let reactions = model.reactions(u).unwrap();
    assert!(largest_difference(&reactions, &vec![[0.0; 3]; reactions.len()]) < 1e-9);
}

/// Truth: elements of this library use gmsh's node order. The volume of the quarter cylinder is 2 pi, and constant strain passes
/// the patch test on the curved mixed mesh. Chords or parabolas replace the arcs of the outline. The tolerance of the volume is
/// twice the volume that this replacement loses. Other tolerances cover rounding, for some thousand unknowns.
#[test]
fn every_solid_that_gmsh_writes_is_solved() {
    let strain = [0.001, 0.0005, -0.0003, 0.0004, -0.0002, 0.0005];
    for (order, incomplete, kinds) in [
        ("1", "0", [Tet4, Hex8, Wedge6, Pyramid5]),
        ("2", "0", [Tet10, Hex27, Wedge18, Pyramid14]),
        ("2", "1", [Tet10, Hex20, Wedge15, Pyramid13]),
    ] {
        let Some(mesh) = quarter(order, incomplete, &kinds) else { return };
        let pieces = mesh.group("arc").expect("the arc").cells.len();
        let quality = check(&mesh).expect("a sound mesh");
        // A chord loses the fraction angle²/6 of the sector of its arc. A parabola through the middle of the arc loses
        // angle⁴/480.
        let angle = FRAC_PI_2 / pieces as f64;
        let lost = if order == "2" { angle.powi(4) / 480.0 } else { angle.powi(2) / 6.0 };
        let error = quality.volume / (2.0 * PI) - 1.0;
        println!("order {order}: volume {}, error {error:.2e}, arcs {lost:.2e}", quality.volume);
        assert!(error.abs() < 2.0 * lost);
        patch_test(
            mesh.clone(),
            rotated_orthotropic(),
            HexFormulation::Enhanced,
            strain,
            quality.volume,
            1e-11,
        );
        assert_hydrostatic(mesh);
    }
}
