//! Sections of .msh version 4.1.

use super::cursor::Cursor;
use super::raw_mesh::{RawElement, RawMesh};
use crate::error::Result;

/// Reads the physical groups of each point, curve, surface and volume.
pub(super) fn read_entities(cursor: &mut Cursor, raw: &mut RawMesh) -> Result<()> {
    let mut counts = [0; 4];
    for count in &mut counts {
        *count = cursor.size("a number of entities")?;
    }
    for (dim, &count) in counts.iter().enumerate() {
        let reals = if dim == 0 { 3 } else { 6 };
        let least = cursor.bytes_of(4) + reals * cursor.bytes_of(8) + cursor.size_bytes();
        cursor.check_count(count, least, "entities")?;
        for _ in 0..count {
            let tag = cursor.int("the tag of an entity")?;
            for _ in 0..reals {
                cursor.real("a coordinate of an entity")?;
            }
            let mut physical = read_ints(cursor, "physical tags")?;
            // A negative physical tag only marks a reversed entity.
            physical.iter_mut().for_each(|tag| *tag = tag.saturating_abs());
            if dim > 0 {
                read_ints(cursor, "bounding entities")?;
            }
            let set = raw.group_set_index(&physical);
            if raw.entities.insert((dim, tag), set).is_some() {
                return Err(cursor.fail(&format!("the entity {tag} of dimension {dim} appears twice")));
            }
        }
    }
    raw.has_entities = true;
    Ok(())
}

fn read_ints(cursor: &mut Cursor, what: &str) -> Result<Vec<i64>> {
    let n = cursor.size(&format!("the number of {what}"))?;
    let n = cursor.check_count(n, cursor.bytes_of(4), what)?;
    (0..n).map(|_| cursor.int(what)).collect()
}

/// Reads the nodes. Each entity has blocks of nodes, with the node numbers first and the coordinates after them.
pub(super) fn read_nodes(cursor: &mut Cursor, raw: &mut RawMesh) -> Result<()> {
    let [n_blocks, n, _, _] = read_header(cursor, "nodes")?;
    let per_node = cursor.size_bytes() + 3 * cursor.bytes_of(8);
    let n = cursor.check_count(n, per_node, "nodes")?;
    raw.start_nodes(cursor, n)?;
    let mut tags = Vec::new();
    let mut seen = 0;
    for _ in 0..n_blocks {
        let dim = cursor.int("the dimension of a node block")?;
        cursor.int("the entity of a node block")?;
        let parametric = cursor.int("0 or 1, whether nodes are parametric")?;
        let in_block = cursor.size("the number of nodes in a block")?;
        if !(0..=3).contains(&dim) || !(0..=1).contains(&parametric) {
            return Err(cursor.fail(&format!(
                "a node block has the dimension {dim} and the parametric flag {parametric}; allowed are 0 to 3, and 0 or 1"
            )));
        }
        let in_block = cursor.check_count(in_block, per_node, "nodes")?;
        cursor.end_record()?;
        seen += in_block;
        tags.clear();
        for _ in 0..in_block {
            tags.push(cursor.size("a node number")?);
            cursor.end_record()?;
        }
        for &tag in &tags {
            let x = [cursor.coordinate(tag)?, cursor.coordinate(tag)?, cursor.coordinate(tag)?];
            for _ in 0..parametric * dim {
                cursor.real("a parameter of a node")?;
            }
            cursor.end_record()?;
            raw.add_node(tag, x);
        }
    }
    same_count(cursor, seen, n, "nodes")
}

pub(super) fn read_elements(cursor: &mut Cursor, raw: &mut RawMesh) -> Result<()> {
    let [n_blocks, n, _, _] = read_header(cursor, "elements")?;
    let n = cursor.check_count(n, 2 * cursor.size_bytes(), "elements")?;
    raw.start_elements(cursor)?;
    let mut nodes = Vec::with_capacity(27);
    let mut seen = 0;
    for _ in 0..n_blocks {
        let dim = cursor.int("the dimension of an element block")?;
        let entity = cursor.int("the entity of an element block")?;
        let code = cursor.nonnegative_int("an element type")?;
        let kind = raw.kind(cursor, code)?;
        if dim != kind.dim() as i64 {
            return Err(
                cursor.fail(&format!("{} elements appear in a block of dimension {dim}", kind.name()))
            );
        }
        let in_block = cursor.size("the number of elements in a block")?;
        let bytes_each = (1 + kind.n_nodes() as u64) * cursor.size_bytes();
        let in_block = cursor.check_count(in_block, bytes_each, "elements")?;
        cursor.end_record()?;
        seen += in_block;
        let group_set = raw.entity_set(kind.dim(), entity);
        for _ in 0..in_block {
            let tag = cursor.size("an element number")?;
            nodes.clear();
            for _ in 0..kind.n_nodes() {
                nodes.push(cursor.size("a node of an element")?);
            }
            cursor.end_record()?;
            raw.add_element(RawElement { kind, tag, nodes: &nodes, group_set });
        }
    }
    same_count(cursor, seen, n, "elements")
}

fn read_header(cursor: &mut Cursor, what: &str) -> Result<[u64; 4]> {
    let header = [
        cursor.size(&format!("the number of blocks of {what}"))?,
        cursor.size(&format!("the number of {what}"))?,
        cursor.size(&format!("the smallest number of the {what}"))?,
        cursor.size(&format!("the largest number of the {what}"))?,
    ];
    cursor.end_record()?;
    Ok(header)
}

fn same_count(cursor: &Cursor, seen: usize, announced: usize, what: &str) -> Result<()> {
    if seen == announced {
        return Ok(());
    }
    Err(cursor.fail(&format!("the blocks hold {seen} {what}, but {announced} are announced")))
}
