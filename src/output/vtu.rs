//! Writer of VTK XML files: unstructured grids (.vtu, raw appended data) and collections over time (.pvd).
//!
//! Numbers are little-endian, with 64-bit headers and offsets. meshio requires the line end before `</AppendedData>`.
//!
//! Data blocks follow in the reverse order of the `DataArray` tags. meshio (5.3) identifies arrays by their offsets,
//! and overwrites the offsets while it reads. With data blocks in the order of the tags, meshio might silently swap two
//! fields.

use std::fmt::Write as _;
use std::io::{self, Write};

use crate::error::{Error, Result};
use crate::output::atomic_file::write_error;

/// Values of a data array.
#[derive(Debug, Clone, PartialEq)]
pub enum ArrayValues {
    /// 64-bit floats; all must be finite.
    Float64(Vec<f64>),
    /// 64-bit integers.
    Int64(Vec<i64>),
    /// Bytes.
    UInt8(Vec<u8>),
}

impl ArrayValues {
    fn len(&self) -> usize {
        match self {
            Self::Float64(values) => values.len(),
            Self::Int64(values) => values.len(),
            Self::UInt8(values) => values.len(),
        }
    }

    fn type_name(&self) -> &'static str {
        match self {
            Self::Float64(_) => "Float64",
            Self::Int64(_) => "Int64",
            Self::UInt8(_) => "UInt8",
        }
    }

    fn n_bytes(&self) -> u64 {
        let width = if matches!(self, Self::UInt8(_)) { 1 } else { 8 };
        width * self.len() as u64
    }

    fn write_raw(&self, out: &mut dyn Write) -> io::Result<()> {
        out.write_all(&self.n_bytes().to_le_bytes())?;
        match self {
            Self::Float64(values) => values.iter().try_for_each(|v| out.write_all(&v.to_le_bytes())),
            Self::Int64(values) => values.iter().try_for_each(|v| out.write_all(&v.to_le_bytes())),
            Self::UInt8(values) => out.write_all(values),
        }
    }
}

/// Named array of tuples, one per point or cell.
#[derive(Debug, Clone, PartialEq)]
pub struct DataArray {
    /// Name.
    pub name: String,
    /// Component names of a tuple; empty for scalars.
    pub components: &'static [&'static str],
    /// Values, tuple by tuple.
    pub values: ArrayValues,
}

impl DataArray {
    /// Array of one scalar per point or cell.
    pub fn scalar(name: &str, values: Vec<f64>) -> Self {
        Self { name: name.to_owned(), components: &[], values: ArrayValues::Float64(values) }
    }

    /// Array of one tuple per point or cell from flat `values`.
    pub fn tuples(name: &str, components: &'static [&'static str], values: Vec<f64>) -> Self {
        Self { name: name.to_owned(), components, values: ArrayValues::Float64(values) }
    }

    /// Array of one byte per point or cell.
    pub fn u8_scalar(name: &str, values: Vec<u8>) -> Self {
        Self { name: name.to_owned(), components: &[], values: ArrayValues::UInt8(values) }
    }

    fn check(&self, tuples: usize) -> Result<()> {
        let wanted = tuples * self.components.len().max(1);
        if self.values.len() != wanted {
            return Err(Error::numerical(format!(
                "the field `{}` has {} numbers instead of {wanted}",
                self.name,
                self.values.len()
            )));
        }
        if let ArrayValues::Float64(values) = &self.values
            && let Some(i) = values.iter().position(|v| !v.is_finite())
        {
            return Err(Error::numerical(format!(
                "the field `{}` is {} at entry {} of {tuples}: not a finite number",
                self.name,
                values[i],
                i / self.components.len().max(1) + 1
            )));
        }
        Ok(())
    }
}

/// Points, cells and fields of a .vtu file.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct UnstructuredGrid {
    /// Coordinates.
    pub points: Vec<[f64; 3]>,
    /// Point indices of all cells, one cell after the other, in VTK's node order.
    pub connectivity: Vec<i64>,
    /// End of each cell in `connectivity`.
    pub offsets: Vec<i64>,
    /// VTK type of each cell.
    pub types: Vec<u8>,
    /// Fields at the points.
    pub point_data: Vec<DataArray>,
    /// Fields on the cells.
    pub cell_data: Vec<DataArray>,
}

impl UnstructuredGrid {
    /// Adds a cell of the VTK type `code`.
    pub fn push_cell(&mut self, code: u8, nodes: impl IntoIterator<Item = usize>) {
        self.connectivity.extend(nodes.into_iter().map(|node| node as i64));
        self.offsets.push(self.connectivity.len() as i64);
        self.types.push(code);
    }

    /// Writes the grid as a .vtu file.
    ///
    /// # Errors
    /// If a field has the wrong length or a value that is not finite (kind `Numerical`). If `out` fails (kind `Resources`).
    pub fn write(&self, out: &mut dyn Write) -> Result<()> {
        let points = DataArray::tuples("Points", &["x", "y", "z"], self.points.concat());
        points.check(self.points.len())?;
        self.point_data.iter().try_for_each(|array| array.check(self.points.len()))?;
        self.cell_data.iter().try_for_each(|array| array.check(self.types.len()))?;
        let cells = [
            DataArray {
                name: "connectivity".into(),
                components: &[],
                values: ArrayValues::Int64(self.connectivity.clone()),
            },
            DataArray {
                name: "offsets".into(),
                components: &[],
                values: ArrayValues::Int64(self.offsets.clone()),
            },
            DataArray::u8_scalar("types", self.types.clone()),
        ];
        let sections: [(&str, &[DataArray]); 4] = [
            ("Points", std::slice::from_ref(&points)),
            ("Cells", &cells),
            ("PointData", &self.point_data),
            ("CellData", &self.cell_data),
        ];
        write_file(out, &head(&sections, self.points.len(), self.types.len()), &sections)
            .map_err(|reason| write_error(&reason))
    }
}

fn write_file(out: &mut dyn Write, head: &str, sections: &[(&str, &[DataArray])]) -> io::Result<()> {
    out.write_all(head.as_bytes())?;
    for array in sections.iter().rev().flat_map(|(_, arrays)| arrays.iter().rev()) {
        array.values.write_raw(out)?;
    }
    out.write_all(b"\n  </AppendedData>\n</VTKFile>\n")
}

fn head(sections: &[(&str, &[DataArray])], n_points: usize, n_cells: usize) -> String {
    let mut xml = String::from("<?xml version=\"1.0\"?>\n");
    xml += "<VTKFile type=\"UnstructuredGrid\" version=\"1.0\" byte_order=\"LittleEndian\" header_type=\"UInt64\">\n";
    xml += "  <UnstructuredGrid>\n";
    push_fmt(
        &mut xml,
        format_args!("    <Piece NumberOfPoints=\"{n_points}\" NumberOfCells=\"{n_cells}\">\n"),
    );
    let mut offset = sections.iter().flat_map(|(_, arrays)| arrays.iter()).map(array_bytes).sum();
    for (section, arrays) in sections {
        push_fmt(&mut xml, format_args!("      <{section}>\n"));
        for array in *arrays {
            offset -= array_bytes(array);
            push_fmt(&mut xml, format_args!("        {}\n", tag(array, offset)));
        }
        push_fmt(&mut xml, format_args!("      </{section}>\n"));
    }
    xml + "    </Piece>\n  </UnstructuredGrid>\n  <AppendedData encoding=\"raw\">\n_"
}

/// Bytes of an array, including the 8 bytes of its length.
fn array_bytes(array: &DataArray) -> u64 {
    8 + array.values.n_bytes()
}

fn tag(array: &DataArray, offset: u64) -> String {
    let mut tag =
        format!("<DataArray type=\"{}\" Name=\"{}\"", array.values.type_name(), escaped(&array.name));
    if !array.components.is_empty() {
        push_fmt(&mut tag, format_args!(" NumberOfComponents=\"{}\"", array.components.len()));
        for (i, name) in array.components.iter().enumerate() {
            push_fmt(&mut tag, format_args!(" ComponentName{i}=\"{name}\""));
        }
    }
    push_fmt(&mut tag, format_args!(" format=\"appended\" offset=\"{offset}\"/>"));
    tag
}

/// Text of a collection (.pvd), which lists files with their times for ParaView.
pub fn pvd_collection(files: &[(f64, String)]) -> String {
    let mut xml = String::from("<?xml version=\"1.0\"?>\n");
    xml += "<VTKFile type=\"Collection\" version=\"0.1\" byte_order=\"LittleEndian\">\n  <Collection>\n";
    for (time, file) in files {
        push_fmt(
            &mut xml,
            format_args!(
                "    <DataSet timestep=\"{time}\" group=\"\" part=\"0\" file=\"{}\"/>\n",
                escaped(file)
            ),
        );
    }
    xml + "  </Collection>\n</VTKFile>\n"
}

fn push_fmt(text: &mut String, more: std::fmt::Arguments<'_>) {
    text.write_fmt(more).expect("writing to a string does not fail");
}

pub(crate) fn escaped(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;")
}

#[cfg(test)]
mod tests {
    use super::*;

    fn triangle() -> UnstructuredGrid {
        let mut grid = UnstructuredGrid { points: vec![[0.0; 3]; 3], ..Default::default() };
        grid.push_cell(5, [0, 1, 2]);
        grid
    }

    fn refused(array: DataArray) -> String {
        let mut grid = triangle();
        grid.cell_data.push(array);
        grid.write(&mut Vec::new()).unwrap_err().to_string()
    }

    /// Truth: arrays with a wrong length or a NaN are refused by name.
    #[test]
    fn refuses_wrong_lengths_and_what_is_not_finite() {
        assert!(
            refused(DataArray::scalar("wear", vec![1.0, 2.0])).contains("`wear` has 2 numbers instead of 1")
        );
        let message = refused(DataArray::tuples("gap", &["x", "y"], vec![0.0, f64::NAN]));
        assert!(message.contains("`gap` is NaN at entry 1 of 1"), "{message}");
    }

    /// Truth (format): an 8-byte length precedes each array, offsets count from `_`, and the last array comes first.
    #[test]
    fn offsets_count_lengths_and_data() {
        let mut bytes = Vec::new();
        triangle().write(&mut bytes).unwrap();
        let text = String::from_utf8_lossy(&bytes);
        let (after_types, after_offsets) = (8 + 1, 8 + 1 + 16);
        for (name, offset) in [("types", 0), ("offsets", after_types), ("connectivity", after_offsets)] {
            let tag = format!("Name=\"{name}\" format=\"appended\" offset=\"{offset}\"");
            assert!(text.contains(&tag), "{tag}: {text}");
        }
    }
}
