//! Reader of the .vtu files that this program writes ([`crate::output::vtu`]): raw appended data, little-endian, 64-bit headers.

use std::fs::File;
use std::io::Read;
use std::path::Path;

use crate::error::{Error, Result};

/// Largest size of a file, bytes. Larger files are refused.
const MAX_FILE_BYTES: u64 = 1 << 30;

/// Named array of tuples.
#[derive(Debug, Clone, PartialEq)]
pub struct FieldArray {
    /// Name.
    pub name: String,
    /// Number of components of a tuple.
    pub components: usize,
    /// Values, tuple by tuple.
    pub values: Vec<f64>,
}

/// Points, cells and fields of a .vtu file.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct VtuGrid {
    /// Coordinates.
    pub points: Vec<[f64; 3]>,
    /// Point indices of all cells, one cell after the other.
    pub connectivity: Vec<usize>,
    /// End of each cell in `connectivity`.
    pub offsets: Vec<usize>,
    /// VTK type of each cell.
    pub types: Vec<u8>,
    /// Fields at the points.
    pub point_data: Vec<FieldArray>,
    /// Fields on the cells.
    pub cell_data: Vec<FieldArray>,
}

impl VtuGrid {
    /// Reads the grid of a .vtu file.
    ///
    /// # Errors
    /// If the file cannot be read, is too large, or is not a .vtu file as this program writes it (kind `Input`).
    pub fn read(path: &Path) -> Result<Self> {
        let of_file = |error: std::io::Error| Error::input(error.to_string());
        let mut file = File::open(path).map_err(of_file)?;
        let length = file.metadata().map_err(of_file)?.len();
        if length > MAX_FILE_BYTES {
            return Err(Error::input(format!("it has {length} bytes; at most {MAX_FILE_BYTES} are read")));
        }
        let mut bytes = Vec::new();
        file.read_to_end(&mut bytes).map_err(of_file)?;
        Self::parse(&bytes)
    }

    /// Parses the bytes of a .vtu file.
    ///
    /// # Errors
    /// If the bytes do not form a .vtu file as this program writes it (kind `Input`).
    pub fn parse(bytes: &[u8]) -> Result<Self> {
        const MARK: &[u8] = b"<AppendedData encoding=\"raw\">\n_";
        let at = bytes.windows(MARK.len()).position(|window| window == MARK);
        let at = at.ok_or_else(|| {
            Error::input(
                "it has no raw appended data: it is not a .vtu file of this program, or it is truncated",
            )
        })?;
        let head = std::str::from_utf8(&bytes[..at]).map_err(|_| Error::input("its header is not text"))?;
        let data = &bytes[at + MARK.len()..];
        let mut grid = Self::default();
        let (mut n_points, mut n_cells, mut section) = (0, 0, "");
        for tag in head.split('<').skip(1) {
            match tag.split(|c: char| !c.is_alphanumeric()).next().unwrap_or("") {
                "Piece" => {
                    (n_points, n_cells) = (count(tag, "NumberOfPoints")?, count(tag, "NumberOfCells")?);
                }
                name @ ("Points" | "Cells" | "PointData" | "CellData") => section = name,
                "DataArray" => grid.store_array(section, array(tag, data)?, n_points, n_cells)?,
                _ => {}
            }
        }
        grid.check(n_points, n_cells)?;
        Ok(grid)
    }

    fn store_array(
        &mut self,
        section: &str,
        field: FieldArray,
        n_points: usize,
        n_cells: usize,
    ) -> Result<()> {
        let tuples = match section {
            "PointData" | "Points" => n_points,
            "CellData" => n_cells,
            _ if field.name == "connectivity" => field.values.len(),
            _ => n_cells,
        };
        if tuples.checked_mul(field.components) != Some(field.values.len()) {
            return Err(Error::input(format!(
                "`{}` has {} numbers for {tuples} tuples of {}",
                field.name,
                field.values.len(),
                field.components
            )));
        }
        let whole = || field.values.iter().map(|value| *value as usize).collect();
        match (section, field.name.as_str()) {
            ("Points", _) => {
                self.points = field.values.chunks_exact(3).map(|p| [p[0], p[1], p[2]]).collect();
            }
            ("Cells", "connectivity") => self.connectivity = whole(),
            ("Cells", "offsets") => self.offsets = whole(),
            ("Cells", "types") => self.types = field.values.iter().map(|value| *value as u8).collect(),
            ("PointData", _) => self.point_data.push(field),
            ("CellData", _) => self.cell_data.push(field),
            _ => {}
        }
        Ok(())
    }

    fn check(&self, n_points: usize, n_cells: usize) -> Result<()> {
        let counted =
            self.points.len() == n_points && self.offsets.len() == n_cells && self.types.len() == n_cells;
        let rising = self.offsets.windows(2).all(|pair| pair[0] <= pair[1])
            && self.offsets.last().copied().unwrap_or(0) == self.connectivity.len();
        if !counted || !rising || self.connectivity.iter().any(|&point| point >= n_points) {
            return Err(Error::input("its cells do not match its points"));
        }
        Ok(())
    }

    /// Number of cells.
    pub fn n_cells(&self) -> usize {
        self.offsets.len()
    }

    /// Point indices of a cell.
    pub fn cell(&self, cell: usize) -> &[usize] {
        let start = if cell == 0 { 0 } else { self.offsets[cell - 1] };
        &self.connectivity[start..self.offsets[cell]]
    }

    /// Finds a cell field by name.
    pub fn cell_field(&self, name: &str) -> Option<&FieldArray> {
        self.cell_data.iter().find(|field| field.name == name)
    }

    /// Finds a point field by name.
    pub fn point_field(&self, name: &str) -> Option<&FieldArray> {
        self.point_data.iter().find(|field| field.name == name)
    }
}

impl FieldArray {
    /// Values of one component. An index beyond the last component gives the last component.
    pub fn component(&self, index: usize) -> Vec<f64> {
        self.values.chunks_exact(self.components).map(|tuple| tuple[index.min(self.components - 1)]).collect()
    }
}

fn attribute<'a>(tag: &'a str, name: &str) -> Option<&'a str> {
    let start = tag.find(&format!(" {name}=\""))? + name.len() + 3;
    tag[start..].split('"').next()
}

fn count(tag: &str, name: &str) -> Result<usize> {
    let text = attribute(tag, name).unwrap_or("");
    text.parse().map_err(|_| Error::input(format!("{name} is \"{text}\", but a number is expected")))
}

fn array(tag: &str, data: &[u8]) -> Result<FieldArray> {
    let name = attribute(tag, "Name").unwrap_or("").to_owned();
    let cut = || Error::input(format!("the data of `{name}` are truncated or damaged"));
    let offset = count(tag, "offset")?;
    let start = offset.checked_add(8).filter(|&start| start <= data.len()).ok_or_else(cut)?;
    let length = u64::from_le_bytes(data[offset..start].try_into().map_err(|_| cut())?);
    let end = usize::try_from(length).ok().and_then(|length| start.checked_add(length));
    let raw = data.get(start..end.ok_or_else(cut)?).ok_or_else(cut)?;
    let eights = || raw.chunks_exact(8).map(|b| b.try_into().expect("eight bytes"));
    let values: Vec<f64> = match attribute(tag, "type").unwrap_or("") {
        "Float64" => eights().map(f64::from_le_bytes).collect(),
        "Int64" => eights().map(|b| i64::from_le_bytes(b) as f64).collect(),
        "UInt8" => raw.iter().map(|&b| f64::from(b)).collect(),
        other => {
            return Err(Error::input(format!(
                "`{name}` has the type {other}, which this program does not write"
            )));
        }
    };
    if values.iter().any(|value| !value.is_finite()) {
        return Err(Error::input(format!("`{name}` has a number that is not finite")));
    }
    let components =
        attribute(tag, "NumberOfComponents").map_or(Ok(1), |_| count(tag, "NumberOfComponents"))?;
    Ok(FieldArray { name, components: components.max(1), values })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::output::vtu::{DataArray, UnstructuredGrid};

    fn written() -> Vec<u8> {
        let mut grid = UnstructuredGrid {
            points: vec![[0.0; 3], [1.0, 0.5, -2.0], [0.1, 0.2, 0.3]],
            ..Default::default()
        };
        grid.push_cell(5, [0, 1, 2]);
        grid.point_data.push(DataArray::scalar("height", vec![1.5, -0.1, 3e-7]));
        grid.cell_data.push(DataArray::tuples("gap", &["x", "y", "n"], vec![0.1, 0.2, 0.3]));
        grid.cell_data.push(DataArray::u8_scalar("status", vec![2]));
        let mut bytes = Vec::new();
        grid.write(&mut bytes).unwrap();
        bytes
    }

    /// Truth: the read values equal the written ones bit by bit.
    #[test]
    fn reads_back_what_is_written() {
        let grid = VtuGrid::parse(&written()).unwrap();
        assert_eq!(grid.points[1], [1.0, 0.5, -2.0]);
        assert_eq!((grid.n_cells(), grid.cell(0), grid.types[0]), (1, &[0, 1, 2][..], 5));
        assert_eq!(grid.point_field("height").unwrap().values, [1.5, -0.1, 3e-7]);
        assert_eq!(grid.cell_field("gap").unwrap().component(2), [0.3]);
        assert_eq!(grid.cell_field("status").unwrap().values, [2.0]);
    }

    /// Truth: a truncated file is refused; a changed byte causes no panic.
    #[test]
    fn damaged_files_are_refused() {
        let bytes = written();
        // A file that lacks only XML tags after the last array may be read.
        let needed = bytes.windows(18).rposition(|w| w == b"\n  </AppendedData>").unwrap();
        for length in 0..needed {
            assert!(VtuGrid::parse(&bytes[..length]).is_err(), "{length} of {} bytes", bytes.len());
        }
        for place in 0..bytes.len() {
            let mut damaged = bytes.clone();
            damaged[place] ^= 0x15;
            let _ = VtuGrid::parse(&damaged);
        }
    }
}
