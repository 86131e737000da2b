//! Faces of the solids: the boundary surface, and the faces of a physical surface, with outward normals. In a mesh without solids,
//! the surface cells with their own orientation are the boundary ([`super::closed_surface::orient_outward`]).

use super::{CellRef, Mesh};
use crate::element::ElementKind;
use crate::error::{Error, Result};
use crate::geometry::{Point, fan_area_vectors};

/// Face of one solid cell on the boundary of the mesh, or a surface cell of a mesh without solids.
#[derive(Debug, Clone, PartialEq)]
pub struct SurfaceFace {
    /// Element kind of the face.
    pub kind: ElementKind,
    /// Nodes in gmsh's order; the normal points out of the solid.
    pub nodes: Vec<usize>,
    /// Solid of the face; without solids, the surface cell itself.
    pub owner: CellRef,
    /// Index among the solid's [`ElementKind::local_faces`]; 0 without solids.
    pub local_face: usize,
    /// File number of the surface element, or of the owner if there is no surface element.
    pub tag: u64,
}

impl SurfaceFace {
    /// Solid of the face, and index among the faces of the solid.
    pub fn id(&self) -> (CellRef, usize) {
        (self.owner, self.local_face)
    }

    /// Area between the corners, mm2.
    pub fn area(&self, mesh: &Mesh) -> f64 {
        self.triangle_area_vectors(mesh).map(|triangle| triangle.norm()).sum()
    }

    /// Outward area vector between the corners, mm2.
    pub fn area_vector(&self, mesh: &Mesh) -> Point {
        self.triangle_area_vectors(mesh).sum()
    }

    /// Area vectors of the triangles between the first corner and the other corners.
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

/// Calls `visit` for each face of each solid with key, solid and local face.
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

/// Values by face key. The faces with the same smallest node form a linked list; unlike a hash table, this needs no hashing.
struct FaceTable<T> {
    /// Per mesh node the entry of the last face with this smallest node, or `usize::MAX`.
    last_of_node: Vec<usize>,
    /// Key, entry before of the same smallest node, and value.
    entries: Vec<(FaceKey, usize, T)>,
}

impl<T: Default> FaceTable<T> {
    fn new(mesh: &Mesh) -> Self {
        Self { last_of_node: vec![usize::MAX; mesh.n_points()], entries: Vec::new() }
    }

    fn find(&self, key: FaceKey) -> Option<usize> {
        let mut i = self.last_of_node[key[0]];
        while let Some((other, before, _)) = self.entries.get(i) {
            if *other == key {
                return Some(i);
            }
            i = *before;
        }
        None
    }

    fn get_or_default(&mut self, key: FaceKey) -> &mut T {
        let i = self.find(key).unwrap_or_else(|| {
            let before = std::mem::replace(&mut self.last_of_node[key[0]], self.entries.len());
            self.entries.push((key, before, T::default()));
            self.entries.len() - 1
        });
        &mut self.entries[i].2
    }
}

fn surface_face(mesh: &Mesh, owner: CellRef, local_face: usize, tag: u64) -> SurfaceFace {
    let (kind, local) = mesh.kind(owner).local_faces()[local_face];
    let nodes = mesh.cell_nodes(owner);
    SurfaceFace { kind, nodes: local.iter().map(|&i| nodes[i]).collect(), owner, local_face, tag }
}

/// Face of a solid, and the solid on its other side.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct SolidFace {
    /// Index of the solid in [`Mesh::volume_cells`].
    pub solid: usize,
    /// Index among the solid's [`ElementKind::local_faces`].
    pub local_face: usize,
    /// Solid on the other side; `None` on the boundary.
    pub neighbour: Option<usize>,
}

/// All faces of all solids, in the order of the solids.
pub(crate) fn solid_faces(mesh: &Mesh) -> Vec<SolidFace> {
    let mut owners: FaceTable<[Option<usize>; 2]> = FaceTable::new(mesh);
    let (mut faces, mut keys) = (Vec::new(), Vec::new());
    let (mut solid, mut last) = (0, None);
    each_solid_face(mesh, |key, owner, local_face| {
        solid += usize::from(last.is_some_and(|last| last != owner));
        last = Some(owner);
        let pair = owners.get_or_default(key);
        pair[usize::from(pair[0].is_some())] = Some(solid);
        faces.push(SolidFace { solid, local_face, neighbour: None });
        keys.push(key);
    });
    for (face, key) in faces.iter_mut().zip(keys) {
        let [first, second] = *owners.get_or_default(key);
        face.neighbour = if first == Some(face.solid) { second } else { first };
    }
    faces
}

/// Surface cell of a mesh without solids, as a face.
fn surface_cell(mesh: &Mesh, cell: CellRef) -> SurfaceFace {
    let nodes = mesh.cell_nodes(cell).to_vec();
    SurfaceFace { kind: mesh.kind(cell), nodes, owner: cell, local_face: 0, tag: mesh.tag(cell) }
}

/// Faces that belong to exactly one solid, in the order of the solids, each with the file number of its solid. For a mesh without
/// solids, the surface cells.
pub fn outer_faces(mesh: &Mesh) -> Vec<SurfaceFace> {
    if mesh.volume_cells().next().is_none() {
        return mesh.cells(2).map(|cell| surface_cell(mesh, cell)).collect();
    }
    let mut owners: FaceTable<(u32, Option<(CellRef, usize)>)> = FaceTable::new(mesh);
    each_solid_face(mesh, |key, owner, local_face| {
        let (count, last) = owners.get_or_default(key);
        (*count, *last) = (*count + 1, Some((owner, local_face)));
    });
    // Entries have the order in which the solids were visited.
    let faces = owners.entries.into_iter().filter_map(|(_, _, (count, face))| face.filter(|_| count == 1));
    faces.map(|(owner, local_face)| surface_face(mesh, owner, local_face, mesh.tag(owner))).collect()
}

/// Outer faces under the surface elements of the physical group `name`, in the group's order. They are oriented outward, whatever
/// the orientation of the surface elements.
///
/// # Errors
/// If there is no such group, it is not a group of surfaces, or it is empty. If one of its elements is an inner face or belongs to
/// no solid. If it has other nodes than its solid's face, or repeats the face of another element.
pub fn group_faces(mesh: &Mesh, name: &str) -> Result<Vec<SurfaceFace>> {
    let group = mesh.group_of_dim(name, 2)?;
    if group.cells.is_empty() {
        return Err(Error::input(format!("the group \"{name}\" of {} has no elements", mesh.source)));
    }
    if mesh.volume_cells().next().is_none() {
        return Ok(group.cells.iter().map(|&cell| surface_cell(mesh, cell)).collect());
    }
    let mut owners: FaceTable<Vec<(CellRef, usize)>> = FaceTable::new(mesh);
    let key_of = |cell| face_key(&mesh.cell_nodes(cell)[..mesh.kind(cell).n_corners()]);
    for &cell in &group.cells {
        owners.get_or_default(key_of(cell));
    }
    each_solid_face(mesh, |key, owner, local_face| {
        if let Some(i) = owners.find(key) {
            owners.entries[i].2.push((owner, local_face));
        }
    });
    let mut taken: FaceTable<Option<u64>> = FaceTable::new(mesh);
    group
        .cells
        .iter()
        .map(|&cell| {
            let tag = mesh.tag(cell);
            if let Some(other) = taken.get_or_default(key_of(cell)).replace(tag) {
                return Err(group_element_error(
                    mesh,
                    name,
                    cell,
                    &format!("lies on the same face as element {other}"),
                ));
            }
            let face = sole_outer_face(mesh, name, cell, owners.get_or_default(key_of(cell)))?;
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
            let why = "belongs to no solid element: mesh the volume behind it conformingly, and put the volume into a physical group \
                       so that gmsh saves it";
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
    let what =
        format!("does not share its middle nodes with the {} face of {solid} it lies on", face.kind.name());
    Err(group_element_error(mesh, name, cell, &what))
}

/// Three solids that share one face; `None` if there are none.
pub(super) fn face_of_three_solids(mesh: &Mesh) -> Option<[CellRef; 3]> {
    let mut owners: FaceTable<[Option<CellRef>; 2]> = FaceTable::new(mesh);
    let mut three = None;
    each_solid_face(mesh, |key, owner, _| match owners.get_or_default(key) {
        [Some(a), Some(b)] => three = three.or(Some([*a, *b, owner])),
        [Some(_), second] => *second = Some(owner),
        [first, _] => *first = Some(owner),
    });
    three
}
