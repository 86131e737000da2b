//! Reader of gmsh's .msh files, versions 2.2 and 4.1, ASCII and binary of either byte order.
//!
//! Every count is checked against the remaining bytes of the file before memory is allocated. A damaged file therefore
//! cannot request more memory than its size justifies.
//!
//! # Source
//! gmsh reference manual, "MSH file format" and "MSH file format version 2 (legacy)".

mod cursor;
mod fields;
mod pos;
mod raw_mesh;
mod v2;
mod v4;

use std::collections::HashMap;
use std::path::Path;

use super::{ElementField, Mesh};
use crate::error::{Error, Result};
use cursor::{Cursor, quoted_excerpt};
pub use pos::write_size_field;
use raw_mesh::RawMesh;

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Version {
    V2,
    V4,
}

/// Reads the mesh in the .msh file `path`.
///
/// # Errors
/// If the file cannot be read, is not a .msh file of version 2.2 or 4.1, is truncated, or contradicts itself. If it has partitions
/// or unsupported elements.
pub fn read(path: &Path) -> Result<Mesh> {
    parse(&read_bytes(path)?, &path.display().to_string())
}

/// Reads the mesh in the bytes of a .msh file; `source` names the file in messages.
///
/// # Errors
/// As [`read`], for the contents of the file.
pub fn parse(bytes: &[u8], source: &str) -> Result<Mesh> {
    let (raw, fields, warnings) = parse_sections(bytes, source)?;
    let mut mesh = raw.into_mesh(source)?;
    mesh.fields = fields;
    mesh.warnings.extend(warnings);
    Ok(mesh)
}

/// Reads the fields of elements in the .msh file `path`, with warnings about them. The file may have no mesh.
///
/// # Errors
/// As [`read`].
pub fn read_fields(path: &Path) -> Result<(Vec<ElementField>, Vec<String>)> {
    let (_, fields, warnings) = parse_sections(&read_bytes(path)?, &path.display().to_string())?;
    Ok((fields, warnings))
}

fn read_bytes(path: &Path) -> Result<Vec<u8>> {
    std::fs::read(path).map_err(|error| {
        Error::input(format!("the mesh file {} cannot be read: {error}; check the path", path.display()))
    })
}

fn parse_sections(bytes: &[u8], source: &str) -> Result<(RawMesh, Vec<ElementField>, Vec<String>)> {
    check_start(bytes, source)?;
    let mut cursor = Cursor::new(bytes, source);
    let (mut raw, mut fields, mut repeated) = (RawMesh::default(), Vec::new(), Vec::new());
    let mut version = None;
    while let Some(name) = cursor.next_section()? {
        match (name.as_str(), version) {
            ("MeshFormat", None) => version = Some(read_format(&mut cursor)?),
            ("MeshFormat", Some(_)) => {
                return Err(cursor.fail("the section $MeshFormat appears twice; a file must have one"));
            }
            ("PhysicalNames", _) => read_physical_names(&mut cursor, &mut raw)?,
            (
                "Nodes" | "ParametricNodes" | "Elements" | "Entities" | "PartitionedEntities" | "ElementData",
                None,
            ) => {
                return Err(cursor.fail("$MeshFormat must come before this section"));
            }
            ("Nodes", Some(Version::V2)) => v2::read_nodes(&mut cursor, &mut raw, false)?,
            ("ParametricNodes", Some(Version::V2)) => v2::read_nodes(&mut cursor, &mut raw, true)?,
            ("Elements", Some(Version::V2)) => v2::read_elements(&mut cursor, &mut raw)?,
            ("Nodes", Some(Version::V4)) => v4::read_nodes(&mut cursor, &mut raw)?,
            ("Elements", Some(Version::V4)) => v4::read_elements(&mut cursor, &mut raw)?,
            ("Entities", Some(Version::V4)) => v4::read_entities(&mut cursor, &mut raw)?,
            ("ElementData", Some(_)) => fields::read_element_data(&mut cursor, &mut fields, &mut repeated)?,
            ("PartitionedEntities", Some(Version::V4)) => {
                return Err(cursor.fail(
                    "partitioned meshes are not supported; save the mesh unpartitioned (in gmsh: Mesh > Unpartition)",
                ));
            }
            _ => {
                cursor.skip_section(&name)?;
                continue;
            }
        }
        cursor.end_section(&name)?;
    }
    if version.is_none() {
        return Err(Error::input(format!(
            "{source} has no $MeshFormat section; a gmsh .msh file begins with one"
        )));
    }
    Ok((raw, fields, repeated.iter().map(|name| fields::repeated_warning(name)).collect()))
}

fn check_start(bytes: &[u8], source: &str) -> Result<()> {
    let mend =
        "a .msh file of version 2.2 or 4.1 is expected; convert other formats with scripts/import-mesh";
    let text = bytes.trim_ascii_start();
    if text.is_empty() {
        return Err(Error::input(format!("{source} is empty; {mend}")));
    }
    let text = text.strip_prefix(b"\xef\xbb\xbf").unwrap_or(text);
    if text.starts_with(b"$NOD") {
        return Err(Error::input(format!(
            "{source} is a .msh file of version 1, but versions 2.2 and 4.1 are supported; save it again with `gmsh -save -format msh41`"
        )));
    }
    if !text.starts_with(b"$") {
        let shown = String::from_utf8_lossy(&text[..text.len().min(20)]).escape_debug().to_string();
        return Err(Error::input(format!("{source} begins with \"{shown}\", not with a $ section; {mend}")));
    }
    Ok(())
}

fn read_format(cursor: &mut Cursor) -> Result<Version> {
    let word = cursor.word("the version, 2.2 or 4.1")?;
    let version = match word {
        "2.2" => Version::V2,
        "4.1" => Version::V4,
        _ => {
            let found = quoted_excerpt(word.as_bytes());
            return Err(cursor.fail(&format!(
                "version {found} of the .msh format is not supported; save the mesh as 4.1 or 2.2 (`gmsh -format msh41` or `-format msh22`)"
            )));
        }
    };
    let binary = match cursor.word("the file type, 0 (ASCII) or 1 (binary)")? {
        "0" => false,
        "1" => true,
        other => {
            let found = quoted_excerpt(other.as_bytes());
            return Err(cursor
                .fail(&format!("file type {found} is not supported; 0 (ASCII) and 1 (binary) are allowed")));
        }
    };
    let size = match (cursor.word("the data size, 8")?, version) {
        ("8", _) => 8,
        ("4", Version::V4) => 4,
        (other, _) => {
            let found = quoted_excerpt(other.as_bytes());
            return Err(cursor.fail(&format!("data size {found} is not supported; it must be 8")));
        }
    };
    if binary {
        cursor.end_line()?;
        cursor.start_binary(size)?;
    }
    Ok(version)
}

/// Reads the physical names. The section is text also in binary files: `dimension tag "name"` line by line.
fn read_physical_names(cursor: &mut Cursor, raw: &mut RawMesh) -> Result<()> {
    let n: u64 = cursor.number("the number of physical names")?;
    cursor.check_count(n, 5, "physical names")?;
    let known = raw.names.iter().map(|((dim, tag), name)| ((*dim, name.clone()), *tag));
    let mut tags: HashMap<(usize, String), i64> = known.collect();
    for _ in 0..n {
        let dim: usize = cursor.number("the dimension of a physical group")?;
        if dim > 3 {
            return Err(cursor.fail(&format!("a physical group has the dimension {dim}; 0 to 3 are allowed")));
        }
        let tag: i64 = cursor.number("the tag of a physical group")?;
        let name = cursor.quoted("the group's name")?;
        if name.is_empty() {
            return Err(cursor.fail("the physical group's name is empty"));
        }
        let named = tags.insert((dim, name.clone()), tag).map(|tag| (dim, tag));
        if let Some(other) = named.or_else(|| raw.names.contains_key(&(dim, tag)).then_some((dim, tag))) {
            let found = format!(
                "the physical group ({dim}, {tag}) {} repeats the dimension and the tag or name of ({}, {})",
                quoted_excerpt(name.as_bytes()),
                other.0,
                other.1
            );
            return Err(cursor.fail(&format!("{found}; each group needs its own tag and name")));
        }
        raw.names.insert((dim, tag), name);
    }
    Ok(())
}
