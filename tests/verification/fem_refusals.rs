//! Bodies that must be refused, and the contents of the error messages.

use orthowear::element::ElementKind::{Hex8, Tet4};
use orthowear::error::ErrorKind;
use orthowear::fem::{
    CondensationResources, FeModel, FeSpec, HexFormulation, Support, find_rigid_body_modes,
};
use orthowear::linalg::memory::MemoryLimit;

use super::fem_bodies::{ALL, clamp, isotropic, spec};
use super::fem_meshes::{add_cells, block, prescribe};

fn refusal(spec: FeSpec) -> String {
    let error = FeModel::new(spec).err().expect("a refusal");
    assert_eq!(error.kind(), ErrorKind::Input);
    error.to_string()
}

fn cube(supports: Vec<Support>) -> FeSpec {
    spec(block(Hex8, [2, 2, 2], [1.0; 3], |x| x), isotropic(), HexFormulation::Enhanced, supports)
}

fn assert_says(message: &str, words: &[&str]) {
    for word in words {
        assert!(message.contains(word), "{message:?} does not say {word:?}");
    }
}

/// Truth: docs/scene.md, which refuses runs that exceed the memory limit. The limit of this test suffices for the matrix entries
/// alone: 16 bytes for the row and value of each entry of the lower triangle.
#[test]
fn refuses_to_assemble_beyond_the_memory() {
    let entries = FeModel::new(cube(vec![clamp("z0")])).unwrap().stiffness().n_stored();
    let limit = MemoryLimit::of_scene(16 * entries as u64);
    let error = FeModel::with_memory_limit(cube(vec![clamp("z0")]), &limit).err().expect("a refusal");
    assert_eq!(error.kind(), ErrorKind::Resources);
    assert_says(error.message(), &["assembling 54 unknowns", "coarser mesh", "solver.memory_limit"]);
}

/// Truth: names in a specification must exist, values must be finite, regions must be unique and cover the body. Supports must not
/// contradict each other or fix all nodes.
#[test]
fn refuses_wrong_specs() {
    assert_says(&refusal(cube(vec![clamp("bottom")])), &["bottom", "z0"]);
    let mut without = cube(vec![clamp("z0")]);
    without.regions = vec![(Some("fibre".into()), isotropic().into())];
    assert_says(&refusal(without), &["fibre"]);
    let mut uncovered = cube(vec![clamp("z0")]);
    uncovered.regions.clear();
    assert_says(&refusal(uncovered), &["element 1", "region", "material"]);
    let mut twice = cube(vec![clamp("z0")]);
    twice.regions =
        vec![(Some("body".into()), isotropic().into()), (Some("body".into()), isotropic().into())];
    assert_says(&refusal(twice), &["two regions"]);
    let pull =
        Support { group: "x0".into(), components: ALL, value: [1.0, 0.0, 0.0], gradient: [[0.0; 3]; 3] };
    assert_says(&refusal(cube(vec![clamp("z0"), pull])), &["z0", "x0", "different displacements along x"]);
    let nan =
        Support { group: "z0".into(), components: ALL, value: [f64::NAN, 0.0, 0.0], gradient: [[0.0; 3]; 3] };
    assert_says(&refusal(cube(vec![nan])), &["z0", "NaN"]);
    assert_says(&refusal(cube(vec![clamp("body")])), &["all nodes are fixed"]);
    let mut infinite = cube(vec![clamp("z0")]);
    infinite.pressures = vec![("z1".into(), f64::INFINITY)];
    assert_says(&refusal(infinite), &["z1", "inf"]);
    let mut surface = cube(vec![clamp("z0")]);
    surface.tractions = vec![("body".into(), [1.0; 3])];
    assert_says(&refusal(surface), &["body", "surfaces"]);
}

/// Truth: the message names an inverted element by its number. A degenerate element is refused, too.
#[test]
fn refuses_inverted_elements() {
    for kind in [Hex8, Tet4] {
        let mut mesh = block(kind, [2, 2, 2], [1.0; 3], |x| x);
        let n = kind.n_nodes();
        mesh.blocks[0].nodes.swap(3 * n, 3 * n + 1);
        mesh.blocks[0].tags[3] = 77;
        let message = refusal(spec(mesh, isotropic(), HexFormulation::Enhanced, vec![clamp("z0")]));
        assert_says(&message, &["element 77", kind.name(), "inverted"]);
    }
    let flat = block(Hex8, [2, 2, 2], [1.0, 1.0, 1e-14], |x| x);
    let message = refusal(spec(flat, isotropic(), HexFormulation::Enhanced, vec![clamp("z0")]));
    assert_says(&message, &["degenerate"]);
}

fn free_names(spec: FeSpec) -> String {
    find_rigid_body_modes(&spec).expect("sound supports").map_or(String::new(), |free| free.names.join(", "))
}

/// Truth: the free rigid-body modes, derived by hand.
#[test]
fn names_free_rigid_motions() {
    assert_eq!(free_names(cube(vec![clamp("z0")])), "");
    let free = |components: [bool; 3]| {
        free_names(cube(vec![Support {
            group: "z0".into(),
            components,
            value: [0.0; 3],
            gradient: [[0.0; 3]; 3],
        }]))
    };
    assert_eq!(free([false, false, true]), "translation x, translation y, rotation about z");
    assert_eq!(
        free([true, false, false]),
        "translation y, translation z, rotation about x, rotation about y"
    );
    assert_eq!(free([true, true, false]), "translation z, rotation about x, rotation about y");
    let all = free_names(cube(vec![]));
    assert_says(
        &all,
        &[
            "translation x, translation y, translation z",
            "rotation about x, rotation about y, rotation about z",
        ],
    );

    let mut mesh = block(Hex8, [2, 2, 2], [1.0; 3], |x| x);
    let corner = mesh.points.iter().position(|x| *x == [0.0; 3]).unwrap();
    let opposite = mesh.points.iter().position(|x| *x == [1.0, 1.0, 0.0]).unwrap();
    let supports = prescribe(&mut mesh, &[corner, opposite], ALL, |_| [0.0; 3]);
    let one_point =
        free_names(spec(mesh.clone(), isotropic(), HexFormulation::Enhanced, supports[..1].to_vec()));
    assert_says(&one_point, &["rotation about x, rotation about y, rotation about z"]);
    let hinge = free_names(spec(mesh, isotropic(), HexFormulation::Enhanced, supports));
    assert_says(&hinge, &["rotation about the direction (0.707, 0.707, 0.000)"]);
}

/// Two unit cubes of n³ cells each. The second cube is moved by `offset`, and coincident nodes are merged.
fn two_cubes(offset: [f64; 3], n: usize) -> FeSpec {
    let mut mesh = block(Hex8, [n; 3], [1.0; 3], |x| x);
    let first: Vec<usize> = mesh.volume_cells().flat_map(|cell| mesh.cell_nodes(cell).to_vec()).collect();
    let moved: Vec<usize> = first
        .iter()
        .map(|&node| {
            let x = std::array::from_fn(|c| mesh.points[node][c] + offset[c]);
            mesh.points.iter().position(|p| *p == x).unwrap_or_else(|| {
                mesh.points.push(x);
                mesh.points.len() - 1
            })
        })
        .collect();
    add_cells(&mut mesh, Hex8, "second", moved);
    spec(mesh, isotropic(), HexFormulation::Enhanced, vec![clamp("z0")])
}

/// Truth: the second cube shares only an edge with the first cube, so it can rotate about this edge. The rigid-body modes of the
/// whole body do not contain this rotation. The factorisation finds the singular matrix. A separate cube is refused, too.
#[test]
fn refuses_loose_and_hinged_parts() {
    let loose = refusal(two_cubes([5.0, 0.0, 0.0], 1));
    assert_says(&loose, &["part with 8 nodes", "2 parts", "translation x"]);
    let hinged = FeModel::new(two_cubes([1.0, 0.0, 1.0], 1)).unwrap().condense(&[]).err().expect("singular");
    assert_eq!(hinged.kind(), ErrorKind::Input);
    assert_says(&hinged.to_string(), &["body1", "singular at the node at (", "direction"]);
}

/// Truth: two cubes that share only an edge, a piece of an edge or a node can rotate against each other. Conjugate gradients,
/// which need no factorisation, must report this.
#[test]
fn refuses_hinged_parts_without_a_factor() {
    for offset in [[1.0, 0.0, 1.0], [1.0, 0.5, 1.0], [1.0, 1.0, 1.0]] {
        let spec = two_cubes(offset, 12);
        let corner = offset.map(|x| x + 1.0);
        let top = spec.mesh.points.iter().position(|x| *x == corner).expect("the far corner");
        let model = FeModel::new(spec).unwrap();
        let memory = model.analyse(&[top]).unwrap().factorisation_peak_bytes() as u64 - 1;
        let memory = MemoryLimit::of_scene(memory);
        let resources = CondensationResources { memory, ..CondensationResources::default() };
        let hinged = model.condense_with(&[top], &resources).err().expect("singular");
        assert_eq!(hinged.kind(), ErrorKind::NotConverged, "{hinged}");
        assert_says(&hinged.to_string(), &["body1", "joined only by a single node or edge"]);
    }
}

/// Truth: a contact node must belong to a solid element, and must not appear twice.
#[test]
fn refuses_wrong_contact_nodes() {
    let model = || FeModel::new(cube(vec![clamp("z0")])).unwrap();
    assert_says(&model().condense(&[3, 4, 3]).err().unwrap().to_string(), &["contact node 3", "twice"]);
    assert_says(&model().condense(&[999]).err().unwrap().to_string(), &["999", "no solid"]);
}
