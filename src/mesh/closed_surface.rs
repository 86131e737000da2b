//! Closed surfaces of bodies.

use std::collections::HashMap;

use super::faces::{group_faces, outer_faces};
use super::self_intersection::find_intersecting_faces;
use super::{CellBlock, CellRef, Mesh, PhysicalGroup};
use crate::error::{Error, Result};
use crate::geometry::{Point, fan_area_vectors, format_point};

const MAX_NAMED_EDGES: usize = 6;

/// Smallest cosine of the angle between the normals of neighbouring faces on a smooth surface.
const CREASE_COSINE: f64 = 0.95;

/// An element counts as without area if its area divided by the square of its longest edge is at most this number.
const MIN_RELATIVE_AREA: f64 = 1e-6;

/// Cells at an edge: index, and whether the cell traverses the edge from the smaller to the larger node number.
type EdgeCells = Vec<(usize, bool)>;

struct SurfaceTopology<'a> {
    mesh: &'a Mesh,
    cells: Vec<CellRef>,
    /// Edges, each with its two corner nodes (ascending) and its cells.
    edges: Vec<([usize; 2], EdgeCells)>,
}

/// Turns the surface cells so that their normals point out of the body; returns notes about the turned cells.
///
/// # Errors
/// If there are no surface cells, or an element has no area. If the surface is open or branches. If neighbours on a smooth part are
/// oriented against each other, or the surface has one side only. If the surface encloses no volume, intersects itself, or has a
/// part outside the largest part.
pub fn orient_outward(mesh: &Mesh) -> Result<(Mesh, Vec<String>)> {
    let surface = SurfaceTopology::new(mesh)?;
    surface.refuse_flat()?;
    surface.refuse_open()?;
    let (mut turned, part) = surface.orient_consistently()?;
    surface.orient_parts_outward(&mut turned, &part)?;
    let count = turned.iter().filter(|&&is| is).count();
    let mut mesh = mesh.clone();
    for (cell, _) in surface.cells.iter().zip(&turned).filter(|(_, turned)| **turned) {
        flip_cell(&mut mesh, *cell);
    }
    let notes = (count > 0).then(|| {
        let all = turned.len();
        format!(
            "the normals of {count} of the {all} surface elements pointed into the body and were reversed"
        )
    });
    let faces = outer_faces(&mesh);
    if let Some(pair) = find_intersecting_faces(&mesh, &faces) {
        let [a, b] = pair.map(|k| faces[k].tag);
        return Err(Error::input(format!(
            "the surface in {} intersects itself at its elements {a} and {b}; fix the mesh there",
            mesh.source
        )));
    }
    Ok((mesh, notes.into_iter().collect()))
}

/// Boundary surface of the solids of a mesh: outer faces with outward normals, their surface groups, and their points.
pub fn boundary_surface(mesh: &Mesh) -> Mesh {
    let faces = outer_faces(mesh);
    let mut number = vec![usize::MAX; mesh.n_points()];
    let mut points = Vec::new();
    let mut blocks: Vec<CellBlock> = Vec::new();
    let mut place = HashMap::new();
    for face in &faces {
        let block = match blocks.iter().position(|block| block.kind == face.kind) {
            Some(block) => block,
            None => {
                blocks.push(CellBlock { kind: face.kind, nodes: Vec::new(), tags: Vec::new() });
                blocks.len() - 1
            }
        };
        place.insert(face.id(), CellRef { block, cell: blocks[block].tags.len() });
        for &node in &face.nodes {
            if number[node] == usize::MAX {
                number[node] = points.len();
                points.push(mesh.points[node]);
            }
            blocks[block].nodes.push(number[node]);
        }
        blocks[block].tags.push(face.tag);
    }
    let mut groups = Vec::new();
    for group in mesh.groups.iter().filter(|group| group.dim == 2) {
        // Groups that `group_faces` refuses, for example groups with inner faces, are omitted.
        let Ok(own) = group_faces(mesh, &group.name) else { continue };
        for face in &own {
            let at: &CellRef = &place[&face.id()];
            blocks[at.block].tags[at.cell] = face.tag;
        }
        let cells = own.iter().map(|face| place[&face.id()]).collect();
        groups.push(PhysicalGroup { cells, ..group.clone() });
    }
    Mesh { source: mesh.source.clone(), points, blocks, groups, ..Mesh::default() }
}

fn flip_cell(mesh: &mut Mesh, cell: CellRef) {
    let block = &mut mesh.blocks[cell.block];
    let (n, corners) = (block.kind.n_nodes(), block.kind.n_corners());
    let nodes = &mut block.nodes[cell.cell * n..(cell.cell + 1) * n];
    nodes[1..corners].reverse();
    if n >= 2 * corners {
        nodes[corners..2 * corners].reverse();
    }
}

impl<'a> SurfaceTopology<'a> {
    fn new(mesh: &'a Mesh) -> Result<Self> {
        let cells: Vec<CellRef> = mesh.cells(2).collect();
        if cells.is_empty() {
            return Err(Error::input(format!(
                "{} has neither solid nor surface elements; mesh the surface of the body (gmsh -2) or its volume (gmsh -3)",
                mesh.source
            )));
        }
        let mut edges: HashMap<[usize; 2], EdgeCells> = HashMap::new();
        for (index, &cell) in cells.iter().enumerate() {
            let corners = &mesh.cell_nodes(cell)[..mesh.kind(cell).n_corners()];
            for (k, &a) in corners.iter().enumerate() {
                let b = corners[(k + 1) % corners.len()];
                edges.entry([a.min(b), a.max(b)]).or_default().push((index, a < b));
            }
        }
        let mut edges: Vec<([usize; 2], EdgeCells)> = edges.into_iter().collect();
        edges.sort_unstable();
        Ok(Self { mesh, cells, edges })
    }

    fn tag(&self, cell: usize) -> u64 {
        self.mesh.tag(self.cells[cell])
    }

    fn describe_edges(&self, edges: &[&([usize; 2], EdgeCells)]) -> String {
        let one = |(nodes, sides): &&([usize; 2], EdgeCells)| {
            let [a, b] = nodes.map(|node| format_point(&self.mesh.points[node]));
            let tags: Vec<String> = sides.iter().map(|(cell, _)| self.tag(*cell).to_string()).collect();
            format!("from {a} to {b} (element{} {})", if tags.len() > 1 { "s" } else { "" }, tags.join(", "))
        };
        let mut words: Vec<String> = edges.iter().take(MAX_NAMED_EDGES).map(one).collect();
        if edges.len() > MAX_NAMED_EDGES {
            words.push(format!("and {} more", edges.len() - MAX_NAMED_EDGES));
        }
        words.join("; ")
    }

    fn refuse_flat(&self) -> Result<()> {
        let flat = |&cell: &usize| {
            let corners =
                &self.mesh.cell_nodes(self.cells[cell])[..self.mesh.kind(self.cells[cell]).n_corners()];
            let at = |k: usize| Point::from(self.mesh.points[corners[k % corners.len()]]);
            let longest = (0..corners.len()).map(|k| (at(k + 1) - at(k)).norm_squared()).fold(0.0, f64::max);
            let area = self.area(cell).norm();
            // Also refuses coordinates that are NaN.
            area.is_nan() || area <= MIN_RELATIVE_AREA * longest
        };
        let Some(cell) = (0..self.cells.len()).find(flat) else { return Ok(()) };
        Err(Error::input(format!(
            "the surface element {} of {} has no area, because its corners lie on a line; fix the mesh there",
            self.tag(cell),
            self.mesh.source
        )))
    }

    fn refuse_open(&self) -> Result<()> {
        let with = |few: bool| {
            let other = |sides: &EdgeCells| if few { sides.len() < 2 } else { sides.len() > 2 };
            self.edges.iter().filter(|(_, sides)| other(sides)).collect::<Vec<_>>()
        };
        let source = &self.mesh.source;
        let open = with(true);
        if !open.is_empty() {
            return Err(Error::input(format!(
                "the surface in {source} is open at {} edges, which belong to only one element: {}. A boundary-element body needs a closed surface; add the missing faces to the groups that gmsh saves, or merge coincident nodes (Coherence Mesh)",
                open.len(),
                self.describe_edges(&open)
            )));
        }
        let branched = with(false);
        if !branched.is_empty() {
            return Err(Error::input(format!(
                "more than two surface elements in {source} meet at {} edges: {}. At most two elements may share an edge; remove inner surfaces",
                branched.len(),
                self.describe_edges(&branched)
            )));
        }
        Ok(())
    }

    fn area(&self, cell: usize) -> Point {
        let cell = self.cells[cell];
        let corners = &self.mesh.cell_nodes(cell)[..self.mesh.kind(cell).n_corners()];
        fan_area_vectors(corners.len(), |k| Point::from(self.mesh.points[corners[k]])).sum()
    }

    /// For each cell, whether it must be turned to be oriented like the first cell of its connected part, and the index of this
    /// part.
    fn orient_consistently(&self) -> Result<(Vec<bool>, Vec<usize>)> {
        let mut neighbours: Vec<Vec<(usize, bool)>> = vec![Vec::new(); self.cells.len()];
        for (_, sides) in &self.edges {
            let &[(a, forward), (b, other)] = &sides[..] else { continue };
            // Neighbours with the same orientation run along their edge in opposite directions.
            neighbours[a].push((b, forward == other));
            neighbours[b].push((a, forward == other));
        }
        let mut part = vec![usize::MAX; self.cells.len()];
        let mut turned = vec![false; self.cells.len()];
        let mut n_parts = 0;
        for first in 0..self.cells.len() {
            if part[first] != usize::MAX {
                continue;
            }
            let mut stack = vec![first];
            part[first] = n_parts;
            while let Some(cell) = stack.pop() {
                for &(other, against) in &neighbours[cell] {
                    if part[other] == usize::MAX {
                        (part[other], turned[other]) = (n_parts, turned[cell] ^ against);
                        stack.push(other);
                    }
                }
            }
            n_parts += 1;
        }
        let against = |(_, sides): &&([usize; 2], EdgeCells)| matches!(sides[..], [(_, a), (_, b)] if a == b);
        let wrong: Vec<_> = self.edges.iter().filter(against).collect();
        let one_sided = |(_, sides): &&&([usize; 2], EdgeCells)| turned[sides[0].0] == turned[sides[1].0];
        let smooth = |(_, sides): &&&([usize; 2], EdgeCells)| {
            let [a, b] = [sides[0].0, sides[1].0].map(|cell| self.area(cell).normalize());
            -a.dot(&b) > CREASE_COSINE
        };
        let source = &self.mesh.source;
        let twisted: Vec<_> = wrong.iter().copied().filter(|edge| one_sided(&edge)).collect();
        if !twisted.is_empty() {
            return Err(Error::input(format!(
                "the surface in {source} has only one side, like a Möbius strip: its elements cannot be oriented consistently at the edges {}",
                self.describe_edges(&twisted)
            )));
        }
        let inside: Vec<_> = wrong.iter().copied().filter(|edge| smooth(&edge)).collect();
        if !inside.is_empty() {
            return Err(Error::input(format!(
                "the surface in {source} is inconsistently oriented: neighbouring elements on a smooth part have opposite normals at {} edges: {}. Reverse them in the mesh, or also save the solids behind them, which define the outside",
                inside.len(),
                self.describe_edges(&inside)
            )));
        }
        Ok((turned, part))
    }

    /// Orients the parts of the surface. Normals of the largest part point away from the enclosed volume, normals of every other
    /// part into the enclosed volume.
    fn orient_parts_outward(&self, turned: &mut [bool], part: &[usize]) -> Result<()> {
        let n_parts = part.iter().max().map_or(0, |last| last + 1);
        let area = |cell: usize| if turned[cell] { -self.area(cell) } else { self.area(cell) };
        let first = |cell: usize| Point::from(self.mesh.points[self.mesh.cell_nodes(self.cells[cell])[0]]);
        let (mut volumes, mut surfaces) = (vec![0.0; n_parts], vec![0.0; n_parts]);
        let origin = first(0);
        for (cell, &part) in part.iter().enumerate() {
            volumes[part] += (first(cell) - origin).dot(&area(cell)) / 3.0;
            surfaces[part] += area(cell).norm();
        }
        let source = &self.mesh.source;
        let about = |part_of: usize| {
            let cell = part.iter().position(|&of| of == part_of).unwrap_or(0);
            format!("the part with element {}", self.tag(cell))
        };
        if let Some(flat) = (0..n_parts).find(|&k| volumes[k].abs() < 1e-9 * surfaces[k].powf(1.5)) {
            return Err(Error::input(format!(
                "the surface in {source} encloses no volume ({}): its faces coincide",
                about(flat)
            )));
        }
        let largest =
            (0..n_parts).max_by(|&a, &b| volumes[a].abs().total_cmp(&volumes[b].abs())).unwrap_or(0);
        for other in (0..n_parts).filter(|&k| k != largest) {
            let cell = part.iter().position(|&of| of == other).unwrap_or(0);
            let cells = (0..part.len()).filter(|&cell| part[cell] == largest);
            let angle: f64 = cells.map(|inner| self.solid_angle(inner, turned[inner], &first(cell))).sum();
            if angle.abs() < 2.0 * std::f64::consts::PI {
                return Err(Error::input(format!(
                    "the surface in {source} has {n_parts} parts, and {} lies outside {}, so the body is ambiguous. Give each body its own mesh (only parts inside another part are cavities)",
                    about(other),
                    about(largest)
                )));
            }
        }
        let inverted = |k: usize| (volumes[k] > 0.0) != (k == largest);
        for (turned, part) in turned.iter_mut().zip(part) {
            *turned ^= inverted(*part);
        }
        Ok(())
    }

    /// Solid angle of a cell seen from a point (van Oosterom and Strackee, 1983).
    fn solid_angle(&self, cell: usize, turned: bool, from: &Point) -> f64 {
        let cell = self.cells[cell];
        let corners = &self.mesh.cell_nodes(cell)[..self.mesh.kind(cell).n_corners()];
        let at = |k: usize| Point::from(self.mesh.points[corners[k]]) - from;
        let of_triangle = |k: usize| {
            let (a, b, c) = (at(0), at(k), at(k + 1));
            let [x, y, z] = [a.norm(), b.norm(), c.norm()];
            let below = x * y * z + a.dot(&b) * z + b.dot(&c) * x + c.dot(&a) * y;
            2.0 * a.dot(&b.cross(&c)).atan2(below)
        };
        let angle: f64 = (1..corners.len() - 1).map(of_triangle).sum();
        if turned { -angle } else { angle }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::element::ElementKind;
    use crate::mesh::faces::SurfaceFace;
    use crate::mesh::structured::GradedBlock;

    /// Corners and triangles of a cube, with outward normals. Node numbers start at `first`.
    fn cube(middle: f64, side: f64, first: usize) -> (Vec<[f64; 3]>, Vec<[usize; 3]>) {
        let corner = |k: usize| [k & 1, k >> 1 & 1, k >> 2].map(|s| middle + side * (s as f64 - 0.5));
        let quads = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
        let triangles = quads.iter().flat_map(|q| [[q[0], q[1], q[2]], [q[0], q[2], q[3]]]);
        ((0..8).map(corner).collect(), triangles.map(|t| t.map(|node| node + first)).collect())
    }

    fn mesh(points: Vec<[f64; 3]>, triangles: &[[usize; 3]]) -> Mesh {
        let tags = (1..=triangles.len() as u64).collect();
        let block = CellBlock { kind: ElementKind::Tri3, nodes: triangles.concat(), tags };
        Mesh { source: "box".into(), points, blocks: vec![block], ..Mesh::default() }
    }

    fn volume(mesh: &Mesh) -> f64 {
        let of_face =
            |face: &SurfaceFace| Point::from(mesh.points[face.nodes[0]]).dot(&face.area_vector(mesh)) / 3.0;
        outer_faces(mesh).iter().map(of_face).sum()
    }

    fn refusal(points: Vec<[f64; 3]>, triangles: &[[usize; 3]]) -> String {
        orient_outward(&mesh(points, triangles)).unwrap_err().to_string()
    }

    /// Truth: the divergence theorem gives the volume of the box, whether one side or all sides were turned.
    #[test]
    fn normals_point_out_of_the_body() {
        let (points, triangles) = cube(0.0, 2.0, 0);
        let (same, notes) = orient_outward(&mesh(points.clone(), &triangles)).unwrap();
        assert!((volume(&same) - 8.0).abs() < 1e-12 && notes.is_empty());
        let turn = |t: &[usize; 3]| [t[0], t[2], t[1]];
        let all: Vec<[usize; 3]> = triangles.iter().map(turn).collect();
        let (turned, notes) = orient_outward(&mesh(points.clone(), &all)).unwrap();
        assert!((volume(&turned) - 8.0).abs() < 1e-12 && notes[0].contains("12 of the 12"), "{notes:?}");
        let mut one_side = triangles.clone();
        one_side[..2].iter_mut().for_each(|t| *t = turn(t));
        let (turned, notes) = orient_outward(&mesh(points.clone(), &one_side)).unwrap();
        assert!((volume(&turned) - 8.0).abs() < 1e-12 && notes[0].contains("2 of the 12"), "{notes:?}");
        let (inner_points, inner) = cube(0.1, 1.0, 8);
        let hollow = mesh([points, inner_points].concat(), &[triangles, inner].concat());
        assert!((volume(&orient_outward(&hollow).unwrap().0) - 7.0).abs() < 1e-12);
    }

    #[test]
    fn surfaces_that_are_none() {
        let (points, triangles) = cube(0.0, 2.0, 0);
        let open = refusal(points.clone(), &triangles[1..]);
        assert!(open.contains("open at 3 edges") && open.contains("(element 9)"), "{open}");
        let mut one = triangles.clone();
        one[0] = [one[0][0], one[0][2], one[0][1]];
        let inconsistent = refusal(points.clone(), &one);
        assert!(
            inconsistent.contains("inconsistently oriented") && inconsistent.contains("elements 1, 2"),
            "{inconsistent}"
        );
        let (mut bent, same) = (points.clone(), triangles.clone());
        bent[7] = [0.2, 0.1, -3.0];
        let crossing = refusal(bent, &same);
        assert!(crossing.contains("intersects itself"), "{crossing}");
        let mut flat = points.clone();
        flat[3] = flat[1];
        assert!(refusal(flat, &triangles).contains("has no area"));
        let (others, beside) = cube(5.0, 1.0, 8);
        let apart = refusal([points.clone(), others].concat(), &[&triangles[..], &beside[..]].concat());
        assert!(apart.contains("ambiguous"), "{apart}");
        let mut wall = triangles.clone();
        wall.push([0, 3, 7]);
        let branched = refusal(points.clone(), &wall);
        assert!(branched.contains("open") || branched.contains("more than two"), "{branched}");
        assert!(refusal(points, &[]).contains("neither solid nor surface"));
    }

    /// Truth: a block of 4 x 3 x 2 elements has 2 (12 + 8 + 6) outer faces, which enclose its volume.
    #[test]
    fn skins() {
        let solids = GradedBlock::uniform([1.0, 1.5], 2.0, [4, 3, 2]).mesh().unwrap();
        let skin = boundary_surface(&solids);
        assert_eq!(skin.cells(2).count(), 52);
        let (same, notes) = orient_outward(&skin).unwrap();
        assert!(notes.is_empty() && (volume(&same) - 2.0 * 3.0 * 2.0).abs() < 1e-12, "{}", volume(&same));
        let group = solids.groups.iter().find(|group| group.dim == 2).unwrap();
        assert_eq!(skin.group_of_dim(&group.name, 2).unwrap().cells.len(), group.cells.len());
    }
}
