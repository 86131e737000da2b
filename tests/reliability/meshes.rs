//! Mutated mesh files of gmsh's formats 2.2 and 4.1, as text and binary. Names after "Truth" are cases of
//! docs/verification.md.

use std::fmt::Write as _;
use std::fs;
use std::path::Path;

use orthowear::mesh::{CellRef, ElementField, Mesh, PhysicalGroup, closed_surface, faces, gmsh, quality};

use crate::harness::Reader;
use crate::structured::{BlockElements, GradedBlock};

#[derive(Clone, Copy)]
enum Form {
    Text,
    /// Binary file; `true` means that its numbers are big-endian.
    Binary(bool),
}

struct File {
    form: Form,
    bytes: Vec<u8>,
}

impl File {
    fn new(form: Form, version: &str) -> Self {
        let mut file = Self { form, bytes: Vec::new() };
        let binary = u8::from(matches!(form, Form::Binary(_)));
        file.line(&format!("$MeshFormat\n{version} {binary} 8"));
        if binary == 1 {
            file.ints(&[1]);
            file.bytes.push(b'\n');
        }
        file.line("$EndMeshFormat");
        file
    }

    fn line(&mut self, text: &str) {
        self.bytes.extend_from_slice(text.as_bytes());
        self.bytes.push(b'\n');
    }

    fn put<const N: usize>(&mut self, mut piece: [u8; N], text: &str) {
        match self.form {
            Form::Text => {
                self.bytes.extend_from_slice(text.as_bytes());
                self.bytes.push(b' ');
            }
            Form::Binary(swapped) => {
                if swapped {
                    piece.reverse();
                }
                self.bytes.extend_from_slice(&piece);
            }
        }
    }

    fn ints(&mut self, list: &[i64]) {
        list.iter().for_each(|&i| self.put((i as i32).to_le_bytes(), &i.to_string()));
    }

    fn sizes(&mut self, list: &[u64]) {
        list.iter().for_each(|&i| self.put(i.to_le_bytes(), &i.to_string()));
    }

    fn reals(&mut self, list: &[f64]) {
        list.iter().for_each(|&x| self.put(x.to_le_bytes(), &format!("{x:?}")));
    }

    /// Ends a record. Binary records have no separator.
    fn end(&mut self) {
        if matches!(self.form, Form::Text) {
            self.bytes.push(b'\n');
        }
    }

    fn names(&mut self, mesh: &Mesh) {
        let is_named = |group: &&PhysicalGroup| group.name != group.tag.to_string() || group.cells.is_empty();
        let named: Vec<&PhysicalGroup> = mesh.groups.iter().filter(is_named).collect();
        self.line(&format!("$PhysicalNames\n{}", named.len()));
        for group in named {
            self.line(&format!("{} {} \"{}\"", group.dim, group.tag, group.name));
        }
        self.line("$EndPhysicalNames");
    }

    fn fields(&mut self, fields: &[ElementField]) {
        for field in fields {
            let (k, n) = (field.n_components, field.elements.len());
            self.line(&format!("$ElementData\n1\n\"{}\"\n1\n0.0\n3\n0\n{k}\n{n}", field.name));
            for (element, values) in field.elements.iter().zip(field.values.chunks_exact(k)) {
                self.ints(&[*element as i64]);
                self.reals(values);
                self.end();
            }
            self.line("\n$EndElementData");
        }
    }
}

fn groups_of(mesh: &Mesh, cell: CellRef) -> Vec<i64> {
    let of_cell = mesh.groups.iter().filter(|group| group.cells.contains(&cell));
    of_cell.map(|group| group.tag).collect()
}

/// Writes a mesh in gmsh's format 4.1. Consecutive cells of a block with the same groups form one entity.
fn version_4(mesh: &Mesh, form: Form) -> Vec<u8> {
    let mut file = File::new(form, "4.1");
    file.names(mesh);
    let mut runs: Vec<(usize, Vec<i64>, Vec<CellRef>)> = Vec::new();
    for (i, block) in mesh.blocks.iter().enumerate() {
        for cell in (0..block.n_cells()).map(|cell| CellRef { block: i, cell }) {
            let groups = groups_of(mesh, cell);
            match runs.last_mut() {
                Some((_, known, cells)) if cells[0].block == i && *known == groups => cells.push(cell),
                _ => runs.push((block.kind.dim(), groups, vec![cell])),
            }
        }
    }
    file.line("$Entities");
    file.sizes(&std::array::from_fn::<u64, 4, _>(|dim| {
        runs.iter().filter(|run| run.0 == dim).count() as u64
    }));
    file.end();
    for dim in 0..4 {
        for (tag, (_, groups, _)) in runs.iter().enumerate().filter(|(_, run)| run.0 == dim) {
            file.ints(&[tag as i64 + 1]);
            file.reals(&vec![0.0; if dim == 0 { 3 } else { 6 }]);
            file.sizes(&[groups.len() as u64]);
            file.ints(groups);
            if dim > 0 {
                file.sizes(&[0]);
            }
            file.end();
        }
    }
    let n = mesh.n_points() as u64;
    file.line("\n$EndEntities\n$Nodes");
    file.sizes(&[1, n, 1, n]);
    file.end();
    file.ints(&[0, 1, 0]);
    file.sizes(&[n]);
    file.end();
    for node in 1..=n {
        file.sizes(&[node]);
        file.end();
    }
    for point in &mesh.points {
        file.reals(point);
        file.end();
    }
    let tags = || mesh.blocks.iter().flat_map(|block| &block.tags);
    let n_cells = tags().count() as u64;
    file.line("\n$EndNodes\n$Elements");
    file.sizes(&[
        runs.len() as u64,
        n_cells,
        tags().min().copied().unwrap_or(0),
        tags().max().copied().unwrap_or(0),
    ]);
    file.end();
    for (tag, (dim, _, cells)) in runs.iter().enumerate() {
        let block = &mesh.blocks[cells[0].block];
        file.ints(&[*dim as i64, tag as i64 + 1, i64::from(block.kind.gmsh_code())]);
        file.sizes(&[cells.len() as u64]);
        file.end();
        for cell in cells {
            file.sizes(&[block.tags[cell.cell]]);
            let nodes: Vec<u64> = block.cell_nodes(cell.cell).iter().map(|&node| node as u64 + 1).collect();
            file.sizes(&nodes);
            file.end();
        }
    }
    file.line("\n$EndElements");
    file.fields(&mesh.fields);
    file.bytes
}

/// Writes a mesh in gmsh's format 2.2. Each cell is written as one element for each of its groups.
fn version_2(mesh: &Mesh, form: Form) -> Vec<u8> {
    let mut file = File::new(form, "2.2");
    file.names(mesh);
    file.line(&format!("$Nodes\n{}", mesh.n_points()));
    for (node, point) in mesh.points.iter().enumerate() {
        file.ints(&[node as i64 + 1]);
        file.reals(point);
        file.end();
    }
    let mut elements: Vec<(CellRef, i64)> = Vec::new();
    for dim in 0..4 {
        for cell in mesh.cells(dim) {
            let groups = groups_of(mesh, cell);
            elements.extend(groups.iter().map(|&group| (cell, group)));
            elements.extend(groups.is_empty().then_some((cell, 0)));
        }
    }
    file.line(&format!("\n$EndNodes\n$Elements\n{}", elements.len()));
    for (number, (cell, group)) in elements.into_iter().enumerate() {
        let (number, code) = (number as i64 + 1, i64::from(mesh.kind(cell).gmsh_code()));
        match form {
            Form::Text => file.ints(&[number, code, 2, group, 1]),
            Form::Binary(_) => file.ints(&[code, 1, 2, number, group, 1]),
        }
        let nodes: Vec<i64> = mesh.cell_nodes(cell).iter().map(|&node| node as i64 + 1).collect();
        file.ints(&nodes);
        file.end();
    }
    file.line("\n$EndElements");
    file.fields(&mesh.fields);
    file.bytes
}

pub fn block(solids: BlockElements, cells: [usize; 3]) -> Mesh {
    let block = GradedBlock { solids, ..GradedBlock::uniform([1.0, 1.0], 1.0, cells) };
    let mut mesh = block.mesh().expect("a mesh");
    let elements: Vec<u64> = mesh.volume_cells().map(|cell| mesh.tag(cell)).collect();
    let values = elements.iter().flat_map(|&tag| [1.0, 0.1 * (tag % 7) as f64, 0.2]).collect();
    mesh.fields = vec![ElementField { name: "fibre".to_owned(), n_components: 3, elements, values }];
    mesh
}

pub fn block_text(cells: [usize; 3]) -> Vec<u8> {
    version_4(&block(BlockElements::Hex8, cells), Form::Text)
}

/// Content of a mesh that writing and reading preserve. Source and order of the cells within groups are excluded.
fn essence(mesh: &Mesh) -> impl PartialEq + std::fmt::Debug {
    let mut groups = mesh.groups.clone();
    groups.iter_mut().for_each(|group| group.cells.sort());
    let bits = |values: &[f64]| values.iter().map(|value| value.to_bits()).collect::<Vec<u64>>();
    let points: Vec<u64> = mesh.points.iter().flat_map(|point| bits(point)).collect();
    let fields = mesh
        .fields
        .iter()
        .map(|field| (field.name.clone(), field.n_components, field.elements.clone(), bits(&field.values)));
    (points, mesh.blocks.clone(), groups, fields.collect::<Vec<_>>())
}

/// Reads a mesh file. Returns the results of all checks of the mesh, or the message of the error.
fn examine(bytes: &[u8]) -> String {
    let mesh = match gmsh::parse(bytes, "file") {
        Ok(mesh) => mesh,
        Err(error) => {
            assert_eq!(error.exit_code(), 2);
            assert!(error.message().starts_with("file") && error.message().len() < 2000, "{error}");
            return error.to_string();
        }
    };
    assert!(mesh.points.iter().flatten().all(|x| x.is_finite()), "coordinates");
    for block in &mesh.blocks {
        assert_eq!(block.nodes.len(), block.n_cells() * block.kind.n_nodes());
        assert!(block.nodes.iter().all(|&node| node < mesh.n_points()), "nodes");
    }
    for group in &mesh.groups {
        let is_there = |cell: &CellRef| mesh.blocks.get(cell.block).is_some_and(|b| cell.cell < b.n_cells());
        assert!(group.cells.iter().all(is_there), "cells of groups");
    }
    // Only meshes with finite field values are written and read again, because NaN has no unique text.
    if mesh.fields.iter().flat_map(|field| &field.values).all(|value| value.is_finite()) {
        let again = gmsh::parse(&version_4(&mesh, Form::Text), "again");
        let again = again.unwrap_or_else(|error| panic!("what was read cannot be read again: {error}"));
        assert!(essence(&again) == essence(&mesh), "{:?}\n{:?}", essence(&again), essence(&mesh));
    }
    let mut text = String::from("a mesh");
    let outcome = |ended: Result<String, orthowear::error::Error>| ended.unwrap_or_else(|e| e.to_string());
    let checked = quality::check(&mesh).map(|found| format!("{:?}", found.warnings()));
    write!(text, " {}", outcome(checked)).expect("a text");
    write!(
        text,
        " {}",
        outcome(closed_surface::orient_outward(&mesh).map(|(_, notes)| format!("{notes:?}")))
    )
    .expect("a text");
    let _outer = faces::outer_faces(&mesh);
    for group in &mesh.groups {
        let faces = faces::group_faces(&mesh, &group.name).map(|faces| format!("{} faces", faces.len()));
        write!(text, " {}", outcome(faces)).expect("a text");
    }
    text
}

/// Truth (rel-no-panics): an invalid file is refused with a message. A file that is accepted gives a valid mesh with
/// finite points, and writing and reading do not change the mesh.
#[test]
fn mesh_files() {
    let small = [block(BlockElements::Hex8, [2, 1, 1]), block(BlockElements::Tet4, [1, 1, 1])];
    let forms = [Form::Text, Form::Binary(false), Form::Binary(true)];
    let mut seeds: Vec<Vec<u8>> = small
        .iter()
        .flat_map(|mesh| forms.iter().flat_map(move |&form| [version_2(mesh, form), version_4(mesh, form)]))
        .collect();
    for seed in &seeds {
        let read = gmsh::parse(seed, "a seed").expect("a mesh");
        assert!(small.iter().any(|mesh| mesh.points == read.points && mesh.fields == read.fields));
    }
    for name in ["pin-plate.msh", "roller.msh"] {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("meshes").join(name);
        seeds.push(fs::read(path).expect("a mesh"));
    }
    let words = [
        "$MeshFormat",
        "$EndMeshFormat",
        "$Nodes",
        "$EndNodes",
        "$Elements",
        "$EndElements",
        "$Entities",
        "$EndEntities",
        "$PhysicalNames",
        "$EndPhysicalNames",
        "$ParametricNodes",
        "$PartitionedEntities",
        "$ElementData",
        "$EndElementData",
        "$Comments\nx\n$EndComments\n",
        "2.2 0 8",
        "4.1 1 8",
        "4.1 1 4",
        "\"",
        "\n",
    ];
    let reader = Reader {
        name: "mesh",
        read: "a mesh",
        seeds,
        words: words.map(str::to_owned).to_vec(),
        cases: 100_000,
    };
    reader.check(examine);
}
