//! Checks of mesh quality and the built-in mesher, against elementary geometry.

use approx::assert_relative_eq;
use nalgebra::Vector3;
use orthowear::element::ElementKind;
use orthowear::geometry::Side;
use orthowear::mesh::faces::{group_faces, outer_faces};
use orthowear::mesh::quality::check;
use orthowear::mesh::{CellBlock, CellRef, Mesh};

use crate::structured::{BlockElements, GradedBlock};

fn graded(solids: BlockElements, side: Side, distortion: f64) -> Mesh {
    GradedBlock {
        half_width: [3.0, 4.0],
        depth: 2.5,
        patch_half_width: [1.0, 1.5],
        patch_cells: [4, 3],
        outer_cells: 2,
        depth_cells: 3,
        first_depth: Some(0.3),
        solids,
        side,
        distortion,
    }
    .mesh()
    .expect("a valid block")
}

/// Area vector of a face with straight edges.
fn area_vector(mesh: &Mesh, nodes: &[usize]) -> Vector3<f64> {
    let x: Vec<Vector3<f64>> = nodes.iter().map(|&n| mesh.points[n].into()).collect();
    match x.len() {
        3 => (x[1] - x[0]).cross(&(x[2] - x[0])) / 2.0,
        _ => (x[2] - x[0]).cross(&(x[3] - x[1])) / 2.0,
    }
}

/// Truth: geometry of a 6 x 8 x 2.5 box. The areas are 6 for the patch 2 x 3, 42 for the rest, 48 for the base, 70 for the sides.
/// Normals point outward. The tolerance 1e-12 covers rounding of sums of about 100 terms.
#[test]
fn structured_blocks_fill_their_box() {
    for solids in [BlockElements::Hex8, BlockElements::Tet4] {
        for side in [Side::Lower, Side::Upper] {
            for distortion in [0.0, 0.1] {
                let mesh = graded(solids, side, distortion);
                let quality = check(&mesh).expect("a sound mesh");
                assert_relative_eq!(quality.volume, 120.0, max_relative = 1e-12);
                assert!(quality.coincident_points.is_empty());
                let up = if side == Side::Lower { 1.0 } else { -1.0 };
                let rest = if side == Side::Lower { "top" } else { "bottom" };
                let mut n_faces = 0;
                for (name, area, normal) in
                    [("contact", 6.0, up), (rest, 42.0, up), ("base", 48.0, -up), ("sides", 70.0, 0.0)]
                {
                    let faces = group_faces(&mesh, name).expect("outer faces");
                    let areas: Vec<_> = faces.iter().map(|f| area_vector(&mesh, &f.nodes)).collect();
                    assert_relative_eq!(
                        areas.iter().map(|a| a.norm()).sum::<f64>(),
                        area,
                        max_relative = 1e-12
                    );
                    let total: Vector3<f64> = areas.iter().sum();
                    assert_relative_eq!(total, Vector3::z() * normal * area, epsilon = 1e-12);
                    n_faces += faces.len();
                }
                assert_eq!(n_faces, outer_faces(&mesh).len());
                let z = group_faces(&mesh, "contact").expect("faces").into_iter().flat_map(|f| f.nodes);
                assert!(
                    z.map(|n| mesh.points[n]).all(|x| x[2] == 0.0 && x[0].abs() <= 1.0 && x[1].abs() <= 1.5)
                );
            }
        }
    }
}

/// Truth: the heights of cells grow by a constant ratio.
#[test]
fn gradings_are_geometric_from_the_wanted_first_cell() {
    let mesh = graded(BlockElements::Hex8, Side::Lower, 0.0);
    let mut z: Vec<f64> = mesh.points.iter().map(|x| -x[2]).collect();
    z.sort_by(f64::total_cmp);
    z.dedup();
    assert_eq!(z.len(), 4);
    assert_relative_eq!(z[1], 0.3, max_relative = 1e-12);
    assert_relative_eq!((z[2] - z[1]) / (z[1] - z[0]), (z[3] - z[2]) / (z[2] - z[1]), max_relative = 1e-12);
    let mut x: Vec<f64> = mesh.points.iter().map(|x| x[0]).collect();
    x.sort_by(f64::total_cmp);
    assert!(x.iter().zip(x.iter().rev()).all(|(a, b)| a == &-b), "symmetric to the last bit");
}

/// Truth: geometry. A corner moved through the opposite face folds a hexahedron. Swapping the lower and the upper face turns a
/// hexahedron inside out. A corner on the line between two other corners collapses a tetrahedron.
#[test]
fn inverted_and_collapsed_elements_are_named() {
    let cube = GradedBlock::uniform([1.0, 1.0], 2.0, [2, 2, 2]).mesh().expect("a block");
    let named = |mesh: &Mesh, words: &[&str]| {
        let message = check(mesh).expect_err("refused").to_string();
        assert!(words.iter().all(|word| message.contains(word)), "{message}");
    };
    let first = |mesh: &Mesh| mesh.volume_cells().next().expect("a solid");
    let tag = format!("hex8 {}; ", cube.tag(first(&cube)));

    let mut folded = cube.clone();
    folded.points[0] = [0.5, 0.5, 0.5];
    named(&folded, &[&tag, "1 inverted or folded", "1 of 8 solid"]);

    let mut inverted = cube.clone();
    inverted.blocks[1].nodes[..8].rotate_left(4);
    named(&inverted, &[&tag, "inverted", "ReverseMesh"]);

    let mut flat =
        GradedBlock { solids: BlockElements::Tet4, ..GradedBlock::uniform([1.0, 1.0], 2.0, [1, 1, 1]) }
            .mesh()
            .expect("a block");
    let nodes = flat.cell_nodes(first(&flat)).to_vec();
    let middle =
        (0..3).map(|k| 0.5 * (flat.points[nodes[0]][k] + flat.points[nodes[3]][k])).collect::<Vec<_>>();
    flat.points[nodes[1]] = [middle[0], middle[1], middle[2]];
    named(&flat, &["tet4", " collapsed)"]);

    let surfaces = Mesh { blocks: vec![cube.blocks[0].clone()], ..cube.clone() };
    named(&surfaces, &["no solid elements", "gmsh -3"]);
}

/// Truth: two unit cubes side by side without merging have four coincident points.
#[test]
fn unmerged_nodes_are_counted() {
    let cube = GradedBlock::uniform([0.5, 0.5], 1.0, [1, 1, 1]).mesh().expect("a block");
    let two = |shift: f64| {
        let mut mesh = cube.clone();
        let n = mesh.n_points();
        mesh.points.extend(cube.points.iter().map(|x| [x[0] + shift, x[1], x[2]]));
        let solids = &mut mesh.blocks[1];
        solids.nodes.extend(cube.blocks[1].nodes.iter().map(|node| node + n));
        solids.tags.push(99);
        mesh
    };
    let apart = check(&two(3.0)).expect("measured");
    assert!(apart.coincident_points.is_empty());
    let touching = check(&two(1.0)).expect("measured");
    assert_eq!(touching.coincident_points.len(), 4);
    assert_relative_eq!(touching.volume, 2.0, max_relative = 1e-14);
    assert!(touching.warnings()[0].text.contains("4 nodes"));

    let mut thrice = cube.clone();
    for tag in [98, 99] {
        let nodes = thrice.blocks[1].nodes[..8].to_vec();
        thrice.blocks[1].nodes.extend(nodes);
        thrice.blocks[1].tags.push(tag);
    }
    assert!(check(&thrice).expect_err("overlap").to_string().contains("share one face"));
}

/// Truth: volumes V = 1/3 ∮ x·n dS, computed by hand. If a top corner of a unit cube is raised by 1, the volume increases by 1/4,
/// the mean of the bilinear height.
#[test]
fn volumes_of_all_shapes() {
    let one = |kind: ElementKind, points: Vec<[f64; 3]>| {
        let nodes = (0..points.len()).collect();
        let mesh = Mesh { points, blocks: vec![CellBlock { kind, nodes, tags: vec![1] }], ..Mesh::default() };
        check(&mesh).expect("a sound cell").volume
    };
    let tet = vec![[0., 0., 0.], [1., 0., 0.], [0., 1., 0.], [0., 0., 1.]];
    assert_relative_eq!(one(ElementKind::Tet4, tet), 1.0 / 6.0, max_relative = 1e-14);
    let wedge = vec![[0., 0., -1.], [1., 0., -1.], [0., 1., -1.], [0., 0., 1.], [1., 0., 1.], [0., 1., 1.]];
    assert_relative_eq!(one(ElementKind::Wedge6, wedge), 1.0, max_relative = 1e-14);
    let pyramid = vec![[-1., -1., 0.], [1., -1., 0.], [1., 1., 0.], [-1., 1., 0.], [0., 0., 1.]];
    assert_relative_eq!(one(ElementKind::Pyramid5, pyramid), 4.0 / 3.0, max_relative = 1e-14);
    let square = [[0., 0.], [1., 0.], [1., 1.], [0., 1.]];
    let mut hex: Vec<_> = [0.0, 1.0].iter().flat_map(|&z| square.map(|[x, y]| [x, y, z])).collect();
    hex[6][2] = 2.0;
    assert_relative_eq!(one(ElementKind::Hex8, hex), 1.25, max_relative = 1e-14);
}

/// Truth: each element of a surface group must be a face of the outer surface, and no face may occur twice. A reversed face gets
/// an outward normal.
#[test]
fn faces_that_are_not_on_the_outside_are_refused() {
    let mesh = GradedBlock::uniform([1.0, 1.0], 2.0, [1, 1, 2]).mesh().expect("a block");
    let refused = |mesh: &Mesh, name: &str, words: &[&str]| {
        let message = group_faces(mesh, name).expect_err("refused").to_string();
        assert!(words.iter().all(|word| message.contains(word)), "{words:?} not in: {message}");
    };
    refused(
        &mesh,
        "contakt",
        &["contakt", "Did you mean \"contact\"", "\"base\" (surfaces)", "\"block\" (volumes)"],
    );
    refused(&mesh, "block", &["group of volumes", "surfaces are needed", "\"contact\""]);
    refused(&mesh, "top", &["has no elements"]);

    let with_quad = |nodes: [usize; 4]| {
        let mut mesh = mesh.clone();
        mesh.blocks[0].nodes.extend(nodes);
        mesh.blocks[0].tags.push(777);
        let cell = mesh.blocks[0].n_cells() - 1;
        mesh.groups[0].cells.push(CellRef { block: 0, cell });
        mesh
    };
    refused(&with_quad([4, 5, 7, 6]), "contact", &["element 777 (quad4)", "inner face", "outside"]);
    refused(&with_quad([0, 1, 7, 6]), "contact", &["element 777 (quad4)", "belongs to no solid element"]);
    refused(&with_quad([8, 10, 11, 9]), "contact", &["element 777 (quad4)", "same face as element 1"]);

    let mut turned = mesh.clone();
    turned.blocks[0].nodes[..4].reverse();
    let normal = |mesh: &Mesh| area_vector(mesh, &group_faces(mesh, "contact").expect("faces")[0].nodes);
    assert_eq!(normal(&turned), normal(&mesh));
    assert_eq!(normal(&turned), Vector3::z() * 4.0);
}

/// Truth: the message names each wrong parameter.
#[test]
fn structured_blocks_refuse_what_cannot_be_meshed() {
    let block = GradedBlock::uniform([1.0, 1.0], 1.0, [2, 2, 2]);
    let refused = |block: &GradedBlock, word: &str| {
        let message = block.mesh().expect_err("refused").to_string();
        assert!(message.contains(word), "{message}");
    };
    refused(&GradedBlock { depth: f64::NAN, ..block.clone() }, "NaN");
    refused(&GradedBlock { depth: -1.0, ..block.clone() }, "-1");
    refused(&GradedBlock { patch_cells: [0, 1], ..block.clone() }, "at least 1");
    refused(&GradedBlock { patch_half_width: [0.5, 0.5], ..block.clone() }, "half-width 0.5");
    refused(&GradedBlock { outer_cells: 2, ..block.clone() }, "smaller than the block's 1");
    refused(&GradedBlock { first_depth: Some(2.0), ..block.clone() }, "first cell");
    refused(&GradedBlock { distortion: 0.5, ..block.clone() }, "distortion 0.5");
    refused(&GradedBlock { patch_cells: [1 << 19, 1 << 19], ..block }, "2^32");
}

/// Truth: displacements are bilinear on a quadrilateral face, but piecewise linear on two triangles. The two fields differ in the
/// middle of the face. A pyramid fits a quadrilateral face of a hexahedron. Elements of order 2 do not fit elements of order 1.
#[test]
fn faces_of_neighbours_that_do_not_fit_are_counted() {
    let mut points: Vec<[f64; 3]> = [0.0, 1.0]
        .iter()
        .flat_map(|&z| [[0.0, 0.0, z], [1.0, 0.0, z], [1.0, 1.0, z], [0.0, 1.0, z]])
        .collect();
    points.push([0.5, 0.5, 2.0]);
    let block = |kind: ElementKind, nodes: Vec<usize>, tags: Vec<u64>| CellBlock { kind, nodes, tags };
    let hex = || block(ElementKind::Hex8, (0..8).collect(), vec![1]);
    let mesh =
        |other: CellBlock| Mesh { points: points.clone(), blocks: vec![hex(), other], ..Mesh::default() };
    let tets = block(ElementKind::Tet4, vec![4, 5, 6, 8, 4, 6, 7, 8], vec![2, 3]);
    let quality = check(&mesh(tets)).expect("measured");
    assert_eq!(
        (quality.nonconforming_faces.split_quadrangles, quality.nonconforming_faces.mixed_orders.0),
        ((1, 1), 0)
    );
    assert!(
        quality.warnings()[0].text.contains("WARNING: 1 quadrilateral faces")
            && quality.warnings()[0].text.contains("pyramids")
    );
    let pyramid = block(ElementKind::Pyramid5, vec![4, 5, 6, 7, 8], vec![2]);
    assert!(check(&mesh(pyramid)).expect("measured").warnings().is_empty());

    let mut all = points[..8].to_vec();
    all.extend(
        ElementKind::Hex20
            .reference_nodes()
            .iter()
            .map(|x| [0.5 * (x[0] + 1.0), 0.5 * (x[1] + 1.0), 0.5 * (x[2] + 1.0) + 1.0]),
    );
    // The lower corners of the hex20 are the upper corners of the hex8 below.
    let nodes: Vec<usize> = (4..8).chain(8 + 4..8 + 20).collect();
    let mixed = Mesh {
        points: all,
        blocks: vec![hex(), block(ElementKind::Hex20, nodes, vec![2])],
        ..Mesh::default()
    };
    let quality = check(&mixed).expect("measured");
    assert_eq!(
        (quality.nonconforming_faces.mixed_orders, quality.nonconforming_faces.split_quadrangles.0),
        ((1, 2), 0)
    );
}
