//! Reader of .msh files, on small files: variants of the format, refusals, and damage.

use std::collections::{BTreeMap, BTreeSet};

use orthowear::element::ElementKind;
use orthowear::mesh::{CellBlock, CellRef, Mesh, PhysicalGroup, gmsh};

use super::writer::{VARIANTS, Variant, groups_of_cells, write};

use crate::structured::{BlockElements, GradedBlock};

/// Content of a mesh, independent of the order of cells and nodes in the file. For each cell number it has the kind, the
/// coordinates of the nodes as bits, and the tags of the groups of the cell.
type Content = BTreeMap<u64, (ElementKind, Vec<[u64; 3]>, BTreeSet<i64>)>;

fn content(mesh: &Mesh) -> Content {
    let groups = groups_of_cells(mesh);
    (0..=3)
        .flat_map(|dim| mesh.cells(dim))
        .map(|cell| {
            let nodes = mesh.cell_nodes(cell).iter().map(|&n| mesh.points[n].map(f64::to_bits)).collect();
            (mesh.tag(cell), (mesh.kind(cell), nodes, groups.get(&cell).cloned().unwrap_or_default()))
        })
        .collect()
}

fn names(mesh: &Mesh) -> BTreeSet<(String, usize, i64)> {
    mesh.groups.iter().map(|g| (g.name.clone(), g.dim, g.tag)).collect()
}

/// Mesh of a block with one cell in two groups and one cell in no group. It also has a point element and a line element, each in
/// a group.
fn rich_block(solids: BlockElements, cells: [usize; 3]) -> Mesh {
    let block = GradedBlock { solids, distortion: 0.05, ..GradedBlock::uniform([0.7, 1.0], 1.3, cells) };
    let mut mesh = block.mesh().expect("a block");
    mesh.groups.retain(|group| !group.cells.is_empty());
    let sides = mesh.groups.iter().position(|g| g.name == "sides").expect("sides");
    mesh.groups[sides].cells.pop();
    let shared = mesh.groups[0].cells[0];
    let group = |name: &str, dim, tag, cells| PhysicalGroup { name: name.to_string(), dim, tag, cells };
    mesh.groups.push(group("also this one", 2, 9, vec![shared]));
    mesh.blocks.push(CellBlock { kind: ElementKind::Line2, nodes: vec![0, 1], tags: vec![5000] });
    mesh.blocks.push(CellBlock { kind: ElementKind::Point1, nodes: vec![1], tags: vec![5001] });
    mesh.groups.push(group("a line", 1, 1, vec![CellRef { block: 2, cell: 0 }]));
    mesh.groups.push(group("a point", 0, 1, vec![CellRef { block: 3, cell: 0 }]));
    mesh
}

/// Truth: the mesh that was written, to the last bit. The writer is independent of the reader.
#[test]
fn every_variant_is_read_back_to_the_last_bit() {
    for (solids, cells) in [(BlockElements::Hex8, [3, 2, 2]), (BlockElements::Tet4, [2, 1, 1])] {
        let mesh = rich_block(solids, cells);
        for variant in VARIANTS {
            let read =
                gmsh::parse(&write(&mesh, variant), "file").unwrap_or_else(|e| panic!("{variant:?}: {e}"));
            assert_eq!(content(&read), content(&mesh), "{variant:?}");
            assert_eq!(names(&read), names(&mesh), "{variant:?}");
            assert_eq!(read.n_points(), mesh.n_points(), "{variant:?}");
            assert!(read.warnings.is_empty(), "{variant:?}");
        }
    }
}

/// Truth: a truncated file must be refused. If it only lacks the optional sections at its end, the whole mesh may be read.
#[test]
fn a_file_cut_off_anywhere_is_refused() {
    let mesh = rich_block(BlockElements::Hex8, [1, 1, 1]);
    for variant in VARIANTS {
        let bytes = write(&mesh, variant);
        let whole = gmsh::parse(&bytes, "file").expect("the whole file");
        for length in 0..bytes.len() {
            if let Ok(read) = gmsh::parse(&bytes[..length], "file") {
                assert_eq!(read, whole, "{variant:?} cut at {length}");
            }
        }
    }
}

/// Truth: damaged bytes never cause a panic or exhaust the memory, and every mesh that is still read is consistent.
#[test]
fn damaged_bytes_never_panic() {
    let mesh = rich_block(BlockElements::Hex8, [1, 1, 1]);
    let mut seed = 12345_u64;
    let mut random = move |below: usize| {
        seed = seed.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        (seed >> 33) as usize % below
    };
    let mut refused = 0;
    for variant in VARIANTS {
        let bytes = write(&mesh, variant);
        for _ in 0..4000 {
            let mut damaged = bytes.clone();
            for _ in 0..1 + random(3) {
                let at = random(damaged.len());
                match random(4) {
                    0 => damaged[at] ^= 1 << random(8),
                    1 => damaged[at] = random(256) as u8,
                    2 => damaged[at] = b"0123456789-.e $\n\xff"[random(17)],
                    _ => drop(damaged.splice(at..(at + random(9)).min(damaged.len()), [b'9'; 4])),
                }
            }
            match gmsh::parse(&damaged, "file") {
                Ok(read) => consistent(&read),
                Err(error) => {
                    refused += 1;
                    assert!(error.to_string().starts_with("file"), "{error}");
                    assert_eq!(error.exit_code(), 2);
                }
            }
        }
    }
    assert!(refused > 1000, "the damage is felt");
}

fn consistent(mesh: &Mesh) {
    assert!(mesh.points.iter().flatten().all(|x| x.is_finite()));
    for block in &mesh.blocks {
        assert_eq!(block.nodes.len(), block.tags.len() * block.kind.n_nodes());
        assert!(block.nodes.iter().all(|&node| node < mesh.n_points()));
    }
    for group in &mesh.groups {
        assert!(
            group
                .cells
                .iter()
                .all(|&c| mesh.kind(c).dim() == group.dim && c.cell < mesh.blocks[c.block].n_cells())
        );
    }
}

const V2: &str = "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$PhysicalNames\n1\n3 1 \"body\"\n$EndPhysicalNames\n$Nodes\n5\n\
                  1 0 0 0\n2 1 0 0\n3 0 1 0\n4 0 0 1\n9 5 5 5\n$EndNodes\n$Elements\n1\n7 4 2 1 1 1 2 3 4\n$EndElements\n";
const V4: &str = "$MeshFormat\n4.1 0 8\n$EndMeshFormat\n$PhysicalNames\n1\n3 1 \"body\"\n$EndPhysicalNames\n$Entities\n\
                  0 0 0 1\n1 0 0 0 1 1 1 1 1 0\n$EndEntities\n$Nodes\n1 4 1 4\n3 1 0 4\n1\n2\n3\n4\n0 0 0\n1 0 0\n0 1 0\n\
                  0 0 1\n$EndNodes\n$Elements\n1 1 7 7\n3 1 4 1\n7 1 2 3 4\n$EndElements\n";

/// Truth: the text of the file. Node 9, which no element uses, is omitted, and a byte-order mark is skipped.
#[test]
fn small_files_mean_what_they_say() {
    for text in [V2.to_string(), V4.to_string(), format!("\u{feff}{V2}"), format!("\n\n{V4}\n\n")] {
        let mesh = gmsh::parse(text.as_bytes(), "small.msh").expect("a mesh");
        assert_eq!(mesh.points, [[0., 0., 0.], [1., 0., 0.], [0., 1., 0.], [0., 0., 1.]]);
        assert_eq!(
            mesh.blocks,
            [CellBlock { kind: ElementKind::Tet4, nodes: vec![0, 1, 2, 3], tags: vec![7] }]
        );
        let cells = vec![CellRef { block: 0, cell: 0 }];
        assert_eq!(mesh.groups, [PhysicalGroup { name: "body".to_string(), dim: 3, tag: 1, cells }]);
        let warned = mesh.warnings.iter().any(|w| w.contains("1 nodes") && w.contains("node 9"));
        assert_eq!(warned, text.contains("2.2"));
    }
}

/// Truth: the message gives the place, what was found, and what is allowed.
#[test]
fn refusals_say_where_what_and_how_to_mend() {
    let cases: &[(&str, &str, &str, &[&str])] = &[
        // Version 2.2. Each case has the text of a file, the text to replace, its replacement, and words of the message.
        (V2, "2.2 0 8", "4 0 8", &["line 2", "version \"4\"", "4.1 or 2.2", "-format msh41"]),
        (V2, "2.2 0 8", "4.0 0 8", &["version \"4.0\""]),
        (V2, "2.2 0 8", "2.2 2 8", &["file type \"2\"", "0 (ASCII)"]),
        (V2, "2.2 0 8", "2.2 0 4", &["data size \"4\"", "8"]),
        (V2, "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n", "", &["$MeshFormat must come before"]),
        (V2, "$Nodes\n5", "$Nodes\n4", &["line 14", "$EndNodes", "the section is longer than announced"]),
        (V2, "$Nodes\n5", "$Nodes\n6", &["$EndNodes", "expected a node number"]),
        (V2, "$Nodes\n5", "$Nodes\n999999999999999", &["line 9", "999999999999999 nodes", "truncated"]),
        (V2, "$Nodes\n5", "$Nodes\n-5", &["\"-5\"", "number of nodes"]),
        (V2, "2 1 0 0\n", "2 1 nan 0\n", &["line 11", "node 2", "NaN", "finite"]),
        (V2, "2 1 0 0\n", "2 1 1e999 0\n", &["node 2", "inf"]),
        (V2, "2 1 0 0\n", "2 1 0\n", &["line 12", "expected the end of the line"]),
        (V2, "2 1 0 0\n", "2 1 0 0 0\n", &["line 11", "expected the end of the line"]),
        (V2, "2 1 0 0\n", "2 1,5 0 0\n", &["line 11", "\"1,5\"", "a coordinate"]),
        (V2, "2 1 0 0\n", "1 1 0 0\n", &["node number 1 appears twice"]),
        (V2, "$Elements\n1\n", "$Elements\n88888888888\n", &["88888888888 elements", "truncated"]),
        (V2, "7 4 2 1 1 1 2 3 4", "7 4 2 1 1 1 2 3 6", &["element 7 (tet4)", "node 6"]),
        (V2, "7 4 2 1 1 1 2 3 4", "7 4 2 1 1 1 2 3 3", &["element 7 (tet4)", "node 3 twice"]),
        (
            V2,
            "7 4 2 1 1 1 2 3 4",
            "7 29 2 1 1 1 2 3 4",
            &["line 18", "element type 29", "5 hex8", "ElementOrder"],
        ),
        (
            V2,
            "1\n7 4 2 1 1 1 2 3 4",
            "2\n7 4 2 1 1 1 2 3 4\n7 4 2 1 1 1 2 4 3",
            &["element number 7 appears twice"],
        ),
        (
            V2,
            "1\n7 4 2 1 1 1 2 3 4",
            "2\n7 4 2 1 1 1 2 3 4\n8 4 2 1 1 1 2 3 4",
            &["elements 7 and 8", "same nodes"],
        ),
        (V2, "3 1 \"body\"", "3 1 body", &["line 6", "quotation marks"]),
        (V2, "3 1 \"body\"", "4 1 \"body\"", &["dimension 4", "0 to 3"]),
        (V2, "1\n3 1 \"body\"", "2\n3 1 \"body\"\n3 2 \"body\"", &["repeats", "(3, 1)"]),
        (V2, "$Elements\n", "$Nodes\n0\n$EndNodes\n$Elements\n", &["the section of nodes appears twice"]),
        (
            V2,
            "$Elements\n1\n7 4 2 1 1 1 2 3 4\n$EndElements\n",
            "",
            &["no $Elements section", "mesh the geometry"],
        ),
        (V2, "$EndNodes\n", "$EndNodes\nrubbish\n", &["line 16", "\"rubbish\"", "expected a section"]),
        (V2, "$Elements\n1", "$Periodic\n1\n$Elements\n1", &["$Periodic has no $EndPeriodic"]),
        // Version 4.1.
        (V4, "1 4 1 4\n", "1 5 1 4\n", &["the blocks hold 4 nodes", "5 are announced"]),
        (V4, "3 1 0 4\n", "3 1 0 4444444444\n", &["4444444444 nodes", "truncated"]),
        (V4, "3 1 0 4\n", "3 1 2 4\n", &["parametric flag 2"]),
        (V4, "1 1 7 7\n", "1 2 7 7\n", &["the blocks hold 1 elements", "2 are announced"]),
        (V4, "3 1 4 1\n", "2 1 4 1\n", &["tet4 elements appear in a block of dimension 2"]),
        (V4, "3 1 4 1\n", "3 2 4 1\n", &["entity 2 of dimension 3", "$Entities does not contain"]),
        (V4, "3 1 4 1\n", "3 1 4 777777777\n", &["777777777 elements", "truncated"]),
        (V4, "0 0 0 1\n1 0", "0 0 0 99999999\n1 0", &["99999999 entities", "truncated"]),
        (V4, "1 1 1 1 1 0\n", "1 1 1 55555555 1 0\n", &["55555555 physical tags", "truncated"]),
        (V4, "$Entities\n", "$PartitionedEntities\n", &["partitioned", "Unpartition"]),
    ];
    for (text, from, to, words) in cases {
        assert!(text.contains(from), "{from:?} is in the file");
        let error = gmsh::parse(text.replacen(from, to, 1).as_bytes(), "bad.msh").expect_err(to).to_string();
        assert!(error.starts_with("bad.msh"), "{error}");
        words.iter().for_each(|word| assert!(error.contains(word), "{to:?}: {word:?} is not in: {error}"));
    }
    for (bytes, word) in [
        (&b""[..], "is empty"),
        (b" \r\n ", "is empty"),
        (b"<?xml version=\"1.0\"?>", "scripts/import-mesh"),
        (b"\x1f\x8b\x08\x00", "not with a $ section"),
        (b"$NOD\n1\n", "version 1"),
        (b"$MeshFormat\n2.2 1 8\n\x02\0\0\0\n", "marks the byte order"),
        (b"$MeshFormat\n2.2 0 8\n$EndMeshFormat\n", "no $Nodes section"),
    ] {
        let error = gmsh::parse(bytes, "bad.msh").expect_err(word).to_string();
        assert!(error.contains(word), "{word:?} is not in: {error}");
    }
    let error = gmsh::read(std::path::Path::new("no/such/file.msh")).expect_err("no file").to_string();
    assert!(error.contains("no/such/file.msh") && error.contains("cannot be read"), "{error}");
}

/// Truth: the position of the first coordinate of the second node, which the test replaces by NaN.
#[test]
fn binary_messages_give_the_byte() {
    let variant = Variant { v4: false, binary: true, swapped: false, size: 8, crlf: false };
    let mut bytes = write(&rich_block(BlockElements::Hex8, [1, 1, 1]), variant);
    let marker = b"$Nodes\n8\n";
    let start = bytes.windows(marker.len()).position(|w| w == marker).expect("nodes") + marker.len();
    bytes[start + 28 + 4..start + 28 + 12].copy_from_slice(&f64::NAN.to_le_bytes());
    let error = gmsh::parse(&bytes, "bad.msh").expect_err("not a number").to_string();
    assert!(error.contains(&format!("byte {} (section $Nodes)", start + 28 + 4)), "{error}");
}
