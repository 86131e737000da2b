//! Sections of .msh version 2.2.

use super::cursor::Cursor;
use super::raw_mesh::{RawElement, RawMesh};
use crate::error::Result;

pub(super) fn read_nodes(cursor: &mut Cursor, raw: &mut RawMesh, parametric: bool) -> Result<()> {
    let n = cursor.number("the number of nodes")?;
    cursor.end_line()?;
    let n = cursor.check_count(n, cursor.bytes_of(4) + 3 * cursor.bytes_of(8), "nodes")?;
    raw.start_nodes(cursor, n)?;
    for _ in 0..n {
        let tag = cursor.nonnegative_int("a node number")?;
        let mut x = [0.0; 3];
        for value in &mut x {
            *value = cursor.coordinate(tag)?;
        }
        if parametric {
            let dim = cursor.int("the dimension of a parametric node's entity")?;
            cursor.int("the entity of a parametric node")?;
            for _ in 0..(if (1..=2).contains(&dim) { dim } else { 0 }) {
                cursor.real("a parameter of a node")?;
            }
        }
        cursor.end_record()?;
        raw.add_node(tag, x);
    }
    Ok(())
}

/// Reads the elements. In a text file, each element has its own type and tags. In a binary file, a run of elements
/// shares the type and the number of tags.
pub(super) fn read_elements(cursor: &mut Cursor, raw: &mut RawMesh) -> Result<()> {
    let n = cursor.number("the number of elements")?;
    cursor.end_line()?;
    let n = cursor.check_count(n, 3 * cursor.bytes_of(4), "elements")?;
    raw.start_elements(cursor)?;
    let mut nodes = Vec::with_capacity(27);
    let mut left = n as u64;
    while left > 0 {
        let (tag, code, run) = if cursor.is_binary() {
            let code = cursor.nonnegative_int("an element type")?;
            let run = cursor.nonnegative_int("the number of elements in a block")?;
            (None, code, run)
        } else {
            let tag = cursor.nonnegative_int("an element number")?;
            (Some(tag), cursor.nonnegative_int("an element type")?, 1)
        };
        if run == 0 || run > left {
            return Err(cursor.fail(&format!(
                "a block of {run} elements exceeds the {left} that remain of the {n} announced"
            )));
        }
        let n_tags = cursor.nonnegative_int("the number of tags")?;
        let kind = raw.kind(cursor, code)?;
        for _ in 0..run {
            let tag = match tag {
                Some(tag) => tag,
                None => cursor.nonnegative_int("an element number")?,
            };
            let physical = read_tags(cursor, n_tags)?;
            nodes.clear();
            for _ in 0..kind.n_nodes() {
                nodes.push(cursor.nonnegative_int("a node of an element")?);
            }
            cursor.end_record()?;
            let group_set = group_set_of_tag(raw, physical);
            raw.add_element(RawElement { kind, tag, nodes: &nodes, group_set });
        }
        left -= run;
    }
    Ok(())
}

/// Reads the tags of an element and returns the first tag, which is its physical group (0: none). The other tags are
/// not used.
fn read_tags(cursor: &mut Cursor, n_tags: u64) -> Result<i64> {
    let mut physical = 0;
    for i in 0..n_tags {
        let tag = cursor.int("a tag of an element")?;
        if i == 0 {
            physical = tag;
        }
    }
    Ok(physical)
}

/// Index of the group set with the tag `physical`. The sign of the tag is dropped, because it only marks a reversed
/// element.
fn group_set_of_tag(raw: &mut RawMesh, physical: i64) -> u32 {
    let tags: &[i64] = if physical == 0 { &[] } else { &[physical.saturating_abs()] };
    raw.group_set_index(tags)
}
