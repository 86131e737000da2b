//! Tables of the element kinds (node counts, faces, VTK's node order) against the geometry of the elements.

use std::collections::HashMap;

use orthowear::element::ElementKind::{self, *};

/// Corners of gmsh's reference solids (reference manual, "Node ordering").
fn reference_corners(kind: ElementKind) -> Vec<[f64; 3]> {
    match kind {
        Tet4 | Tet10 => vec![[0., 0., 0.], [1., 0., 0.], [0., 1., 0.], [0., 0., 1.]],
        Hex8 | Hex20 | Hex27 => vec![
            [-1., -1., -1.],
            [1., -1., -1.],
            [1., 1., -1.],
            [-1., 1., -1.],
            [-1., -1., 1.],
            [1., -1., 1.],
            [1., 1., 1.],
            [-1., 1., 1.],
        ],
        Wedge6 | Wedge15 | Wedge18 => {
            vec![[0., 0., -1.], [1., 0., -1.], [0., 1., -1.], [0., 0., 1.], [1., 0., 1.], [0., 1., 1.]]
        }
        _ => vec![[-1., -1., 0.], [1., -1., 0.], [1., 1., 0.], [-1., 1., 0.], [0., 0., 1.]],
    }
}

/// Edges with a middle node, in gmsh's order of these nodes (reference manual, "Node ordering").
fn edges(kind: ElementKind) -> Vec<[usize; 2]> {
    match kind {
        Tet10 => vec![[0, 1], [1, 2], [2, 0], [3, 0], [2, 3], [1, 3]],
        Hex20 | Hex27 => vec![
            [0, 1],
            [0, 3],
            [0, 4],
            [1, 2],
            [1, 5],
            [2, 3],
            [2, 6],
            [3, 7],
            [4, 5],
            [4, 7],
            [5, 6],
            [6, 7],
        ],
        Wedge15 | Wedge18 => {
            vec![[0, 1], [0, 2], [0, 3], [1, 2], [1, 4], [2, 5], [3, 4], [3, 5], [4, 5]]
        }
        Pyramid13 | Pyramid14 => vec![[0, 1], [0, 3], [0, 4], [1, 2], [1, 4], [2, 3], [2, 4], [3, 4]],
        _ => vec![],
    }
}

fn mean(points: impl IntoIterator<Item = [f64; 3]>) -> [f64; 3] {
    let (mut sum, mut n) = ([0.0; 3], 0.0);
    for x in points {
        (0..3).for_each(|k| sum[k] += x[k]);
        n += 1.0;
    }
    sum.map(|s| s / n)
}

/// Corners and mid-edge nodes of the reference element, without nodes at the centres of faces and of the element.
fn corner_and_edge_nodes(kind: ElementKind) -> Vec<[f64; 3]> {
    let mut x = reference_corners(kind);
    for [a, b] in edges(kind) {
        x.push(mean([x[a], x[b]]));
    }
    x
}

fn solids() -> impl Iterator<Item = ElementKind> {
    ElementKind::ALL.into_iter().filter(|kind| kind.dim() == 3)
}

/// Truth: the number of nodes by type in gmsh's table of element types (reference manual, "MSH file format").
#[test]
fn type_numbers_have_the_node_counts_of_the_gmsh_manual() {
    let manual = [
        (1, 2),
        (2, 3),
        (3, 4),
        (4, 4),
        (5, 8),
        (6, 6),
        (7, 5),
        (8, 3),
        (9, 6),
        (10, 9),
        (11, 10),
        (12, 27),
        (13, 18),
        (14, 14),
        (15, 1),
        (16, 8),
        (17, 20),
        (18, 15),
        (19, 13),
    ];
    for (code, nodes) in manual {
        let kind = ElementKind::from_gmsh_code(code).expect("a known type");
        assert_eq!((kind.gmsh_code(), kind.n_nodes()), (code, nodes));
        assert!(kind.name().ends_with(&nodes.to_string()) || nodes == 1, "{}", kind.name());
    }
    assert_eq!(manual.len(), ElementKind::ALL.len());
    assert!((20..140).chain([0]).all(|code| ElementKind::from_gmsh_code(code).is_none()));
}

/// Truth: geometry. The normal of each face points away from the middle of the solid. The mid-edge nodes of a face follow the
/// order of its corners. In a closed, consistently oriented surface, the two faces at an edge run along the edge in opposite
/// directions.
#[test]
fn faces_close_the_solid_with_outward_normals() {
    for kind in solids() {
        let x = corner_and_edge_nodes(kind);
        let centre = mean(reference_corners(kind));
        let mut directed = HashMap::new();
        for (face, local) in kind.local_faces() {
            let m = face.n_corners();
            assert_eq!(local.len(), face.n_nodes(), "{kind:?}");
            let p: Vec<_> = local[..m].iter().map(|&i| nalgebra::Vector3::from(x[i])).collect();
            let normal = (p[1] - p[0]).cross(&(p[2] - p[0]));
            assert!(normal.dot(&(p[0] - nalgebra::Vector3::from(centre))) > 0.0, "{kind:?} {local:?}");
            for i in 0..m {
                *directed.entry((local[i], local[(i + 1) % m])).or_insert(0) += 1;
                if face.n_nodes() > m {
                    assert_eq!(x[local[m + i]], mean([x[local[i]], x[local[(i + 1) % m]]]), "{kind:?}");
                }
            }
        }
        assert!(directed.iter().all(|(&(a, b), &n)| n == 1 && directed.get(&(b, a)) == Some(&1)), "{kind:?}");
    }
}

/// Truth: VTK's order of mid-edge nodes (VTK user's guide, quadratic cells). The edges of the first face come first, then the
/// edges of an opposite face, then the other edges.
#[test]
fn vtk_order_puts_middle_nodes_on_vtk_s_edges() {
    let vtk_edges = |kind| match kind {
        Tet10 => vec![[0, 1], [1, 2], [2, 0], [0, 3], [1, 3], [2, 3]],
        Hex20 | Hex27 => vec![
            [0, 1],
            [1, 2],
            [2, 3],
            [3, 0],
            [4, 5],
            [5, 6],
            [6, 7],
            [7, 4],
            [0, 4],
            [1, 5],
            [2, 6],
            [3, 7],
        ],
        Wedge15 | Wedge18 => vec![[0, 1], [1, 2], [2, 0], [3, 4], [4, 5], [5, 3], [0, 3], [1, 4], [2, 5]],
        Pyramid13 | Pyramid14 => vec![[0, 1], [1, 2], [2, 3], [3, 0], [0, 4], [1, 4], [2, 4], [3, 4]],
        _ => vec![],
    };
    for kind in ElementKind::ALL {
        let order = kind.vtk_order();
        let mut sorted = order.to_vec();
        sorted.sort_unstable();
        assert!(sorted.iter().enumerate().all(|(i, &node)| i == node), "{kind:?} is no permutation");
        assert_eq!(order.len(), if kind == Pyramid14 { 13 } else { kind.n_nodes() });
        if kind.dim() < 3 {
            continue;
        }
        let x = corner_and_edge_nodes(kind);
        for (i, [a, b]) in vtk_edges(kind).into_iter().enumerate() {
            assert_eq!(x[order[kind.n_corners() + i]], mean([x[a], x[b]]), "{kind:?}");
        }
    }
}

/// All reference nodes in gmsh's order: corners, middle nodes of edges, centres of faces, centre of the solid (reference manual).
fn with_centres(kind: ElementKind) -> Vec<[f64; 3]> {
    let mut x = corner_and_edge_nodes(kind);
    let quads: &[[usize; 4]] = match kind {
        Hex27 => &[[0, 1, 2, 3], [0, 1, 4, 5], [0, 3, 4, 7], [1, 2, 5, 6], [2, 3, 6, 7], [4, 5, 6, 7]],
        Wedge18 => &[[0, 1, 3, 4], [0, 2, 3, 5], [1, 2, 4, 5]],
        _ => &[],
    };
    let corners = reference_corners(kind);
    x.extend(quads.iter().map(|quad| mean(quad.map(|i| corners[i]))));
    if kind == Hex27 {
        x.push([0.0; 3]);
    }
    x
}

const FIT: &str = r#"
import sys, numpy, vtk
for line in open(sys.argv[1]):
    code, *values = line.split()
    nodes = numpy.array(values, dtype=float).reshape(-1, 3)
    cell = vtk.vtkGenericCell()
    cell.SetCellType(int(code))
    cell = cell.GetRepresentativeCell() if hasattr(cell, "GetRepresentativeCell") else cell
    own = cell.GetParametricCoords()
    own = numpy.array([own[i] for i in range(nodes.size)]).reshape(-1, 3)
    affine = numpy.column_stack([own, numpy.ones(len(own))])
    fit = numpy.linalg.lstsq(affine, nodes, rcond=None)[0]
    assert abs(affine @ fit - nodes).max() < 1e-12, f"cell type {code}: nodes in another order"
    assert numpy.linalg.det(fit[:3]) > 0, f"cell type {code}: turned inside out"
"#;

/// Truth: in VTK's node order, the reference nodes of this program are an affine image of VTK's parametric coordinates. Pyramids
/// of order 2 are excluded, because VTK's coordinates of their upper edges are not affine.
#[test]
fn vtk_itself_finds_the_nodes_in_its_order() {
    let dir = tempfile::tempdir().expect("a temporary folder");
    let lines = solids().filter(|kind| !matches!(kind, Pyramid13 | Pyramid14)).map(|kind| {
        let x = with_centres(kind);
        assert_eq!(x.len(), kind.n_nodes());
        let values: Vec<String> =
            kind.vtk_order().iter().flat_map(|&i| x[i]).map(|v| v.to_string()).collect();
        format!("{} {}\n", kind.vtk_code(), values.join(" "))
    });
    std::fs::write(dir.path().join("cells"), lines.collect::<String>()).expect("a written file");
    super::tools::python(&["-c", FIT, "cells"], dir.path());
}
