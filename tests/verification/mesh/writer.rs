//! A small writer of .msh files in every variant, for round trips. It is independent of the library's reader.

use std::collections::{BTreeMap, BTreeSet};

use orthowear::mesh::{CellRef, Mesh};

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Variant {
    /// Version 4.1, otherwise 2.2.
    pub v4: bool,
    /// Binary, otherwise text.
    pub binary: bool,
    /// Opposite byte order (binary files only).
    pub swapped: bool,
    /// Bytes of a `size_t` in 4.1.
    pub size: usize,
    /// Lines of text end in CR LF (text files only).
    pub crlf: bool,
}

pub const VARIANTS: [Variant; 9] = [
    Variant { v4: false, binary: false, swapped: false, size: 8, crlf: false },
    Variant { v4: false, binary: false, swapped: false, size: 8, crlf: true },
    Variant { v4: false, binary: true, swapped: false, size: 8, crlf: false },
    Variant { v4: false, binary: true, swapped: true, size: 8, crlf: false },
    Variant { v4: true, binary: false, swapped: false, size: 8, crlf: false },
    Variant { v4: true, binary: false, swapped: false, size: 8, crlf: true },
    Variant { v4: true, binary: true, swapped: false, size: 8, crlf: false },
    Variant { v4: true, binary: true, swapped: true, size: 8, crlf: false },
    Variant { v4: true, binary: true, swapped: false, size: 4, crlf: false },
];

struct Out {
    bytes: Vec<u8>,
    variant: Variant,
}

impl Out {
    fn text(&mut self, text: &str) {
        let text = if self.variant.crlf { text.replace('\n', "\r\n") } else { text.to_string() };
        self.bytes.extend(text.as_bytes());
    }

    fn put(&mut self, little: &[u8], text: String) {
        if !self.variant.binary {
            self.text(&format!("{text} "));
        } else if self.variant.swapped {
            self.bytes.extend(little.iter().rev());
        } else {
            self.bytes.extend(little);
        }
    }

    fn int(&mut self, value: i64) {
        self.put(&(value as i32).to_le_bytes(), value.to_string());
    }

    fn size(&mut self, value: u64) {
        let bytes = value.to_le_bytes();
        self.put(&bytes[..self.variant.size], value.to_string());
    }

    fn real(&mut self, value: f64) {
        self.put(&value.to_le_bytes(), format!("{value:e}"));
    }

    fn end(&mut self) {
        if !self.variant.binary {
            self.text("\n");
        }
    }
}

/// Number of node `i` in a file with `n` nodes: not consecutive, as after merging and deleting in gmsh.
fn node_tag(i: usize, n: usize) -> u64 {
    1 + 1009 * ((i * 7 + 3) % n) as u64
}

pub fn groups_of_cells(mesh: &Mesh) -> BTreeMap<CellRef, BTreeSet<i64>> {
    let mut of = BTreeMap::<_, BTreeSet<i64>>::new();
    for group in &mesh.groups {
        for &cell in &group.cells {
            of.entry(cell).or_default().insert(group.tag);
        }
    }
    of
}

/// Bytes of a .msh file of `mesh`, whose number of points must not be a multiple of 7.
pub fn write(mesh: &Mesh, variant: Variant) -> Vec<u8> {
    assert!(!mesh.n_points().is_multiple_of(7));
    let mut out = Out { bytes: vec![], variant };
    out.text("$Comments\nanything at all\n$EndComments\n");
    let version = if variant.v4 { "4.1" } else { "2.2" };
    let size = if variant.v4 { variant.size } else { 8 };
    out.text(&format!("$MeshFormat\n{version} {} {size}\n", u8::from(variant.binary)));
    if variant.binary {
        out.int(1);
        out.text("\n");
    }
    out.text(&format!("$EndMeshFormat\n$PhysicalNames\n{}\n", mesh.groups.len()));
    for group in &mesh.groups {
        out.text(&format!("{} {} \"{}\"\n", group.dim, group.tag, group.name));
    }
    out.text("$EndPhysicalNames\n");
    if variant.v4 {
        write_v4(mesh, &mut out)
    } else {
        write_v2(mesh, &mut out)
    }
    out.text("$Periodic\n0\n$EndPeriodic\n$NodeData\n1\n\"x\"\n0\n0\n$EndNodeData\n");
    out.bytes
}

fn write_v2(mesh: &Mesh, out: &mut Out) {
    let n = mesh.n_points();
    out.text(&format!("$Nodes\n{n}\n"));
    for (i, x) in mesh.points.iter().enumerate() {
        out.int(node_tag(i, n) as i64);
        x.iter().for_each(|&v| out.real(v));
        out.end();
    }
    let groups = groups_of_cells(mesh);
    let mut records = vec![];
    let mut extra = 1_000_000;
    for (i, block) in mesh.blocks.iter().enumerate() {
        for (cell, &tag) in block.tags.iter().enumerate() {
            let cell = CellRef { block: i, cell };
            let none = BTreeSet::from([0]);
            for (repeat, &group) in groups.get(&cell).unwrap_or(&none).iter().enumerate() {
                extra += 1;
                records.push((cell, if repeat == 0 { tag } else { extra }, group));
            }
        }
    }
    out.text(&format!("\n$EndNodes\n$Elements\n{}\n", records.len()));
    for (cell, tag, group) in records {
        let code = i64::from(mesh.kind(cell).gmsh_code());
        // In a text file, an element has its number, type, number of tags, and tags. In a binary file, it is a block of one
        // element: type, number of elements (1), number of tags, then the number and tags of the element.
        let head = if out.variant.binary { [code, 1, 2, tag as i64] } else { [tag as i64, code, 2, group] };
        head.into_iter().for_each(|value| out.int(value));
        if out.variant.binary {
            out.int(group);
        }
        out.int(31);
        mesh.cell_nodes(cell).iter().for_each(|&node| out.int(node_tag(node, n) as i64));
        out.end();
    }
    out.text("\n$EndElements\n");
}

fn write_v4(mesh: &Mesh, out: &mut Out) {
    // An entity contains the cells of one block that belong to the same groups.
    let groups = groups_of_cells(mesh);
    let mut entities = BTreeMap::<(usize, usize, BTreeSet<i64>), Vec<CellRef>>::new();
    for cell in (0..=3).flat_map(|dim| mesh.cells(dim)) {
        let set = groups.get(&cell).cloned().unwrap_or_default();
        entities.entry((mesh.kind(cell).dim(), cell.block, set)).or_default().push(cell);
    }
    out.text("$Entities\n");
    (0..4).for_each(|dim| out.size(entities.keys().filter(|key| key.0 == dim).count() as u64));
    out.end();
    for (i, (dim, _, set)) in entities.keys().enumerate() {
        out.int(i as i64 + 10);
        (0..if *dim == 0 { 3 } else { 6 }).for_each(|_| out.real(0.5));
        out.size(set.len() as u64);
        // A negative tag reverses the orientation of the entity in the group.
        set.iter().for_each(|&tag| out.int(-tag));
        if *dim > 0 {
            out.size(2);
            out.int(1);
            out.int(-2);
        }
        out.end();
    }
    let n = mesh.n_points();
    out.text("\n$EndEntities\n$Nodes\n");
    // The nodes form two blocks. The first block has parametric coordinates.
    [2, n as u64, 1, 1009 * n as u64].into_iter().for_each(|value| out.size(value));
    out.end();
    let (first, second) = (0..n / 2, n / 2..n);
    for (range, parametric) in [(first, 1), (second, 0)] {
        [2, 11, parametric].into_iter().for_each(|value| out.int(value));
        out.size(range.len() as u64);
        out.end();
        for i in range.clone() {
            out.size(node_tag(i, n));
            out.end();
        }
        for i in range {
            mesh.points[i].iter().for_each(|&v| out.real(v));
            (0..2 * parametric).for_each(|_| out.real(0.25));
            out.end();
        }
    }
    let total: usize = entities.values().map(Vec::len).sum();
    out.text("\n$EndNodes\n$Elements\n");
    [entities.len() as u64, total as u64, 1, total as u64].into_iter().for_each(|value| out.size(value));
    out.end();
    for (i, ((dim, block, _), cells)) in entities.iter().enumerate() {
        let code = i64::from(mesh.blocks[*block].kind.gmsh_code());
        [*dim as i64, i as i64 + 10, code].into_iter().for_each(|value| out.int(value));
        out.size(cells.len() as u64);
        out.end();
        for &cell in cells {
            out.size(mesh.tag(cell));
            mesh.cell_nodes(cell).iter().for_each(|&node| out.size(node_tag(node, n)));
            out.end();
        }
    }
    out.text("\n$EndElements\n");
}
