//! Faces of the solids: the boundary surface, and the faces of a physical surface, with outward normals.

use rustc_hash::FxHashMap;

use super::{CellRef, Mesh};
use crate::element::ElementKind;
use crate::error::{Error, Result};
use crate::geometry::{Point, fan_area_vectors};

/// Face of one solid cell on the boundary of the mesh, or a surface cell of a mesh without solids.
#[derive(Debug, Clone, PartialEq)]
pub struct SurfaceFace {
    /// Element kind of the face.
    pub kind: ElementKind,
    /// Nodes in gmsh's order. The normal points out of the solid; a mesh without solids keeps the normal of the surface cell.
    pub nodes: Vec<usize>,
    /// Solid of the face; without solids, the surface cell itself.
    pub owner: CellRef,
    /// Index among the solid's [`ElementKind::local_faces`]; 0 without solids.
    pub local_face: usize,
    /// Number in the mesh file of the surface element on the face. Without a surface element: number of the owner.
    pub tag: u64,
}

impl SurfaceFace {
    /// Solid of the face, and index among the faces of the solid.
    pub fn id(&self) -> (CellRef, usize) {
        (self.owner, self.local_face)
    }

    /// Sum of the areas of the triangles between the corners, in the scene's length unit squared.
    pub fn area(&self, mesh: &Mesh) -> f64 {
        self.triangle_area_vectors(mesh).map(|triangle| triangle.norm()).sum()
    }

    /// Outward area vector of the polygon of the corners, in the scene's length unit squared.
    pub fn area_vector(&self, mesh: &Mesh) -> Point {
        self.triangle_area_vectors(mesh).sum()
    }

    /// Area vectors of the triangles of the first corner and two successive other corners.
    fn triangle_area_vectors(&self, mesh: &Mesh) -> impl Iterator<Item = Point> {
        fan_area_vectors(self.kind.n_corners(), |i| Point::from(mesh.points[self.nodes[i]]))
    }
}

/// Corner nodes of a face in ascending order; the last entry of a triangle is `usize::MAX`.
pub(super) type FaceKey = [usize; 4];

fn face_key(corners: &[usize]) -> FaceKey {
    let mut key = [usize::MAX; 4];
    key[..corners.len()].copy_from_slice(corners);
    key.sort_unstable();
    key
}

pub(super) fn each_solid_face(mesh: &Mesh, mut visit: impl FnMut(FaceKey, CellRef, usize)) {
    for owner in mesh.volume_cells() {
        let nodes = mesh.cell_nodes(owner);
        for (local_face, (kind, local)) in mesh.kind(owner).local_faces().iter().enumerate() {
            let mut corners = [0; 4];
            let n = kind.n_corners();
            for (corner, &i) in corners.iter_mut().zip(&local[..n]) {
                *corner = nodes[i];
            }
            visit(face_key(&corners[..n]), owner, local_face);
        }
    }
}

fn surface_face(mesh: &Mesh, owner: CellRef, local_face: usize, tag: u64) -> SurfaceFace {
    let (kind, local) = mesh.kind(owner).local_faces()[local_face];
    let nodes = mesh.cell_nodes(owner);
    SurfaceFace { kind, nodes: local.iter().map(|&i| nodes[i]).collect(), owner, local_face, tag }
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct SolidFace {
    /// Index in [`Mesh::volume_cells`].
    pub solid: usize,
    /// Index among the solid's [`ElementKind::local_faces`].
    pub local_face: usize,
    /// Solid on the other side; `None` on the boundary.
    pub neighbour: Option<usize>,
}

pub(crate) fn solid_faces(mesh: &Mesh) -> Vec<SolidFace> {
    let mut owners: FxHashMap<FaceKey, [usize; 2]> = FxHashMap::default();
    let (mut faces, mut keys) = (Vec::new(), Vec::new());
    let (mut solid, mut last) = (0, None);
    each_solid_face(mesh, |key, owner, local_face| {
        solid += usize::from(last.is_some_and(|last| last != owner));
        last = Some(owner);
        owners.entry(key).and_modify(|pair| pair[1] = solid).or_insert([solid, usize::MAX]);
        faces.push(SolidFace { solid, local_face, neighbour: None });
        keys.push(key);
    });
    for (face, key) in faces.iter_mut().zip(keys) {
        let [first, second] = owners[&key];
        let other = if first == face.solid { second } else { first };
        face.neighbour = Some(other).filter(|&other| other != usize::MAX);
    }
    faces
}

fn surface_cell(mesh: &Mesh, cell: CellRef) -> SurfaceFace {
    let nodes = mesh.cell_nodes(cell).to_vec();
    SurfaceFace { kind: mesh.kind(cell), nodes, owner: cell, local_face: 0, tag: mesh.tag(cell) }
}

/// Faces that belong to exactly one solid, in the order of the solids. For a mesh without solids, the surface cells.
pub fn outer_faces(mesh: &Mesh) -> Vec<SurfaceFace> {
    if mesh.volume_cells().next().is_none() {
        return mesh.cells(2).map(|cell| surface_cell(mesh, cell)).collect();
    }
    let mut count: FxHashMap<FaceKey, u32> = FxHashMap::default();
    each_solid_face(mesh, |key, _, _| *count.entry(key).or_insert(0) += 1);
    let mut faces = Vec::new();
    each_solid_face(mesh, |key, owner, local_face| {
        if count[&key] == 1 {
            faces.push(surface_face(mesh, owner, local_face, mesh.tag(owner)));
        }
    });
    faces
}

/// Outer faces on which the surface elements of the physical group `name` lie, in the group's order. In a mesh with
/// solids, the faces are oriented outward, whatever the orientation of the surface elements. Without solids, the faces
/// are the surface elements themselves.
///
/// # Errors
/// If the group does not exist, is not a group of surfaces, or is empty. If a surface element is an inner face or belongs to no
/// solid. If a surface element has other nodes than the face of its solid, or repeats the face of another surface element.
pub fn group_faces(mesh: &Mesh, name: &str) -> Result<Vec<SurfaceFace>> {
    let group = mesh.group_of_dim(name, 2)?;
    if group.cells.is_empty() {
        return Err(Error::input(format!("the group \"{name}\" of {} has no elements", mesh.source)));
    }
    if mesh.volume_cells().next().is_none() {
        return Ok(group.cells.iter().map(|&cell| surface_cell(mesh, cell)).collect());
    }
    let mut owners: FxHashMap<FaceKey, Vec<(CellRef, usize)>> = FxHashMap::default();
    let key_of = |cell| face_key(&mesh.cell_nodes(cell)[..mesh.kind(cell).n_corners()]);
    for &cell in &group.cells {
        owners.insert(key_of(cell), Vec::new());
    }
    each_solid_face(mesh, |key, owner, local_face| {
        if let Some(found) = owners.get_mut(&key) {
            found.push((owner, local_face));
        }
    });
    let mut taken: FxHashMap<FaceKey, u64> = FxHashMap::default();
    group
        .cells
        .iter()
        .map(|&cell| {
            let tag = mesh.tag(cell);
            if let Some(other) = taken.insert(key_of(cell), tag) {
                return Err(group_element_error(
                    mesh,
                    name,
                    cell,
                    &format!("lies on the same face as element {other}"),
                ));
            }
            let face = sole_outer_face(mesh, name, cell, &owners[&key_of(cell)])?;
            same_nodes(mesh, name, cell, &face)?;
            Ok(face)
        })
        .collect()
}

fn group_element_error(mesh: &Mesh, name: &str, cell: CellRef, what: &str) -> Error {
    Error::input(format!(
        "element {} ({}) of the group \"{name}\" of {} {what}",
        mesh.tag(cell),
        mesh.kind(cell).name(),
        mesh.source
    ))
}

fn sole_outer_face(
    mesh: &Mesh,
    name: &str,
    cell: CellRef,
    owners: &[(CellRef, usize)],
) -> Result<SurfaceFace> {
    match *owners {
        [(owner, local_face)] => Ok(surface_face(mesh, owner, local_face, mesh.tag(cell))),
        [] => {
            let why = "belongs to no solid element; mesh the volume behind it with the same nodes, and put the volume into a physical group so that gmsh saves it";
            Err(group_element_error(mesh, name, cell, why))
        }
        [(a, _), (b, _), ..] => Err(group_element_error(
            mesh,
            name,
            cell,
            &format!(
                "is an inner face, between the solid elements {} and {}; a contact or load surface must lie on the \
                 outside of the body",
                mesh.tag(a),
                mesh.tag(b)
            ),
        )),
    }
}

fn same_nodes(mesh: &Mesh, name: &str, cell: CellRef, face: &SurfaceFace) -> Result<()> {
    let sorted = |nodes: &[usize]| {
        let mut nodes = nodes.to_vec();
        nodes.sort_unstable();
        nodes
    };
    if sorted(mesh.cell_nodes(cell)) == sorted(&face.nodes) {
        return Ok(());
    }
    let solid = format!("{} {}", mesh.kind(face.owner).name(), mesh.tag(face.owner));
    let what = format!(
        "does not have the same mid-side nodes as the {} face of {solid} on which it lies",
        face.kind.name()
    );
    Err(group_element_error(mesh, name, cell, &what))
}

/// Three solids that share one face; `None` if no face belongs to three solids.
pub(super) fn face_of_three_solids(mesh: &Mesh) -> Option<[CellRef; 3]> {
    let mut owners: FxHashMap<FaceKey, [Option<CellRef>; 2]> = FxHashMap::default();
    let mut three = None;
    each_solid_face(mesh, |key, owner, _| match owners.entry(key).or_default() {
        [Some(a), Some(b)] => three = three.or(Some([*a, *b, owner])),
        [Some(_), second] => *second = Some(owner),
        [first, _] => *first = Some(owner),
    });
    three
}
