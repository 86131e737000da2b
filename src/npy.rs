//! NumPy files (numpy.lib.format). Reads two-dimensional arrays from .npy files of versions 1 and 2, and writes .npz
//! archives.

use std::io::{Cursor, Write};

use zip::write::SimpleFileOptions;
use zip::{CompressionMethod, ZipWriter};

use crate::error::{Error, Result};

/// Signature of .npy files.
const MAGIC: &[u8; 6] = b"\x93NUMPY";

/// Alignment of the data in a .npy file, bytes.
const ALIGNMENT: usize = 64;

/// Value type: code in the header, size in bytes, and conversion of these bytes to f64.
type ValueType = (&'static str, usize, fn(&[u8]) -> f64);

/// Supported value types. In the header of a file, "<" or "=" precedes the code; both mean little-endian here.
const VALUE_TYPES: [ValueType; 4] = [
    ("f4", 4, |b| f64::from(f32::from_le_bytes([b[0], b[1], b[2], b[3]]))),
    ("f8", 8, |b| f64::from_le_bytes([b[0], b[1], b[2], b[3], b[4], b[5], b[6], b[7]])),
    ("i4", 4, |b| f64::from(i32::from_le_bytes([b[0], b[1], b[2], b[3]]))),
    ("i8", 8, |b| i64::from_le_bytes([b[0], b[1], b[2], b[3], b[4], b[5], b[6], b[7]]) as f64),
];

/// Two-dimensional array in C order: `values[i * shape[1] + j]`.
#[derive(Debug, Clone, PartialEq)]
pub struct Array2 {
    /// Values, `[shape[0], shape[1]]`.
    pub values: Vec<f64>,
    /// Lengths of both dimensions.
    pub shape: [usize; 2],
}

/// Reads an array from the bytes of a .npy file. The values are little-endian f4, f8, i4 or i8, in C or Fortran order.
///
/// # Errors
/// If the bytes are not a .npy file, are damaged, or contain no values. If the format version, the value type or the
/// number of dimensions is not supported.
pub fn read(bytes: &[u8]) -> Result<Array2> {
    let (header, data) = split(bytes)?;
    let descr = field(header, "descr")?;
    let descr = descr.trim_matches(['\'', '"']);
    let kind = VALUE_TYPES.iter().find(|(name, ..)| descr.strip_prefix(['<', '=']) == Some(name)).ok_or_else(|| {
        let order = if descr.starts_with('>') { ", whose bytes are big-endian" } else { "" };
        wrong(format!("it has values of type \"{descr}\"{order}; save it as float64, e.g. numpy.save(file, z.astype(\"<f8\"))"))
    })?;
    let fortran = match field(header, "fortran_order")? {
        "True" => true,
        "False" => false,
        other => return Err(wrong(format!("its header says fortran_order = {other}"))),
    };
    let shape = shape(field(header, "shape")?)?;
    let (_, size, number) = *kind;
    let count = shape[0].checked_mul(shape[1]);
    let wanted = count.and_then(|count| count.checked_mul(size));
    if wanted != Some(data.len()) {
        return Err(wrong(format!(
            "it is damaged: its header announces {} x {} values of {size} bytes, but {} bytes follow",
            shape[0],
            shape[1],
            data.len()
        )));
    }
    let mut values: Vec<f64> = data.chunks_exact(size).map(number).collect();
    if fortran {
        let [rows, columns] = shape;
        values = (0..rows * columns).map(|k| values[k % columns * rows + k / columns]).collect();
    }
    Ok(Array2 { values, shape })
}

fn wrong(what: String) -> Error {
    Error::input(what)
}

/// Splits a file into header and data.
fn split(bytes: &[u8]) -> Result<(&str, &[u8])> {
    let rest =
        bytes.strip_prefix(MAGIC).ok_or_else(|| wrong("it does not begin like a .npy file".to_owned()))?;
    let ended = || wrong("it is damaged: it ends within its header".to_owned());
    let (length, rest) = match rest {
        [1, _, a, b, rest @ ..] => (usize::from(u16::from_le_bytes([*a, *b])), rest),
        [2, _, a, b, c, d, rest @ ..] => {
            (usize::try_from(u32::from_le_bytes([*a, *b, *c, *d])).map_err(|_| ended())?, rest)
        }
        [1 | 2, ..] | [] => return Err(ended()),
        [version, ..] => {
            return Err(wrong(format!("it has format version {version}; versions 1 and 2 are supported")));
        }
    };
    if rest.len() < length {
        return Err(ended());
    }
    let (header, data) = rest.split_at(length);
    let header =
        std::str::from_utf8(header).map_err(|_| wrong("it is damaged: its header is not text".to_owned()))?;
    Ok((header, data))
}

/// Text of the value of `name` in the header. The header is a Python dictionary such as
///
/// `{'descr': '<f8', 'fortran_order': False, 'shape': (3, 4), }`.
fn field<'a>(header: &'a str, name: &str) -> Result<&'a str> {
    let missing = || wrong(format!("it is damaged: its header has no \"{name}\""));
    let start = [format!("'{name}':"), format!("\"{name}\":")]
        .iter()
        .find_map(|key| header.find(key.as_str()).map(|at| at + key.len()))
        .ok_or_else(missing)?;
    let value = header[start..].trim_start();
    let closes = if value.starts_with('(') {
        value.find(')').map(|at| at + 1)
    } else if value.starts_with('[') {
        return Err(wrong("it contains records of several fields; save one array of numbers".to_owned()));
    } else {
        value.find([',', '}'])
    };
    Ok(value[..closes.ok_or_else(missing)?].trim_end())
}

/// Parses a tuple of two lengths.
fn shape(text: &str) -> Result<[usize; 2]> {
    let inner = text.trim_start_matches('(').trim_end_matches(')');
    let lengths: Option<Vec<usize>> = inner
        .split(',')
        .map(str::trim)
        .filter(|part| !part.is_empty())
        .map(|part| part.parse().ok())
        .collect();
    let lengths = lengths.ok_or_else(|| wrong(format!("its header says shape = {text}")))?;
    match lengths[..] {
        [_, _] if lengths.contains(&0) => Err(wrong(format!("it is empty: its shape is {text}"))),
        [rows, columns] => Ok([rows, columns]),
        _ => Err(wrong(format!("its shape is {text}, but heights need 2 dimensions, along x and y"))),
    }
}

/// Archive of arrays (.npz) in memory: a ZIP file with an uncompressed .npy file for each array.
pub struct NpzWriter {
    zip: ZipWriter<Cursor<Vec<u8>>>,
}

impl NpzWriter {
    /// Creates an empty archive.
    #[allow(clippy::new_without_default)]
    pub fn new() -> Self {
        Self { zip: ZipWriter::new(Cursor::new(Vec::new())) }
    }

    /// Appends the array `name` with the given `shape`. `values` are in C order.
    ///
    /// # Errors
    /// If the archive already has an array of this name, or `shape` does not fit the number of values.
    pub fn add(&mut self, name: &str, shape: &[usize], values: &[f64]) -> Result<()> {
        if shape.iter().product::<usize>() != values.len() {
            let message =
                format!("the array {name}: {} values do not fill the shape {shape:?}", values.len());
            return Err(Error::numerical(message));
        }
        // Files of 4 GiB and more need ZIP64. It is used from 2 GiB, which leaves a margin for the header.
        let options = SimpleFileOptions::default()
            .compression_method(CompressionMethod::Stored)
            .large_file(size_of_val(values) >= 1 << 31);
        let data: Vec<u8> = values.iter().flat_map(|value| value.to_le_bytes()).collect();
        let mut write = || -> zip::result::ZipResult<()> {
            self.zip.start_file(format!("{name}.npy"), options)?;
            self.zip.write_all(&head(shape))?;
            Ok(self.zip.write_all(&data)?)
        };
        write().map_err(|error| Error::numerical(format!("the array {name} cannot be written: {error}")))
    }

    /// Completes the archive and returns its bytes.
    ///
    /// # Errors
    /// If the central directory cannot be written.
    pub fn finish(self) -> Result<Vec<u8>> {
        let bytes = self
            .zip
            .finish()
            .map_err(|error| Error::numerical(format!("the archive cannot be written: {error}")))?;
        Ok(bytes.into_inner())
    }
}

/// Header of an array of f8 in C order, format version 1.
fn head(shape: &[usize]) -> Vec<u8> {
    // A Python tuple with a single length needs a trailing comma.
    let lengths: String = shape.iter().map(|length| format!("{length}, ")).collect();
    let lengths = if shape.len() == 1 { lengths.trim_end() } else { lengths.trim_end_matches(", ") };
    let dictionary = format!("{{'descr': '<f8', 'fortran_order': False, 'shape': ({lengths}), }}");
    let mut bytes = MAGIC.to_vec();
    let before = bytes.len() + 4;
    let length = (before + dictionary.len() + 1).next_multiple_of(ALIGNMENT) - before;
    bytes.extend([1, 0]);
    // The length fits into u16, because the dictionary is short.
    bytes.extend((length as u16).to_le_bytes());
    bytes.extend(format!("{dictionary:width$}\n", width = length - 1).into_bytes());
    bytes
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Conversion of a value to the bytes of a value type.
    type Bytes = fn(f64) -> Vec<u8>;

    fn file(version: u8, header: &str, data: &[u8]) -> Vec<u8> {
        let mut bytes = MAGIC.to_vec();
        bytes.extend([version, 0]);
        let length = header.len();
        if version == 1 {
            bytes.extend(u16::try_from(length).unwrap().to_le_bytes());
        } else {
            bytes.extend(u32::try_from(length).unwrap().to_le_bytes());
        }
        bytes.extend(header.as_bytes());
        bytes.extend(data);
        bytes
    }

    fn header(descr: &str, fortran: &str, shape: &str) -> String {
        format!("{{'descr': '{descr}', 'fortran_order': {fortran}, 'shape': {shape}, }}   \n")
    }

    /// Truth: `read` returns the values of files in the layout of numpy.lib.format. In C order the rows follow each
    /// other, in Fortran order the columns.
    #[test]
    fn types_versions_and_orders() {
        let wanted = [1.0, -2.0, 3.0, 4.0, 5.0, 6.0];
        let columns = [1.0, 4.0, -2.0, 5.0, 3.0, 6.0];
        let check = |bytes: Vec<u8>| {
            let array = read(&bytes).unwrap();
            assert_eq!((array.values.as_slice(), array.shape), (&wanted[..], [2, 3]));
        };
        for version in [1, 2] {
            for (order, values) in [("False", wanted), ("True", columns)] {
                let bytes = |to: Bytes| values.iter().copied().flat_map(to).collect::<Vec<u8>>();
                let all: [(&str, Bytes); 5] = [
                    ("<f8", |x| x.to_le_bytes().to_vec()),
                    ("=f8", |x| x.to_le_bytes().to_vec()),
                    ("<f4", |x| (x as f32).to_le_bytes().to_vec()),
                    ("<i4", |x| (x as i32).to_le_bytes().to_vec()),
                    ("<i8", |x| (x as i64).to_le_bytes().to_vec()),
                ];
                for (descr, to) in all {
                    check(file(version, &header(descr, order, "(2, 3)"), &bytes(to)));
                }
            }
        }
    }

    /// Truth: unsupported types, versions and shapes are refused, and the message names the reason. Damaged files give
    /// errors.
    #[test]
    fn other_files_are_refused() {
        let refused = |bytes: &[u8], word: &str| {
            let error = read(bytes).expect_err("refused");
            assert!(error.message().contains(word), "{error}");
        };
        refused(b"1.0,2.0", "begin");
        refused(b"", "begin");
        refused(MAGIC, "ends within");
        refused(&file(3, "", b""), "version 3");
        let plain = |descr: &str, shape: &str| file(1, &header(descr, "False", shape), &[0; 32]);
        refused(&plain(">f8", "(2, 2)"), "big-endian");
        refused(&plain("<c16", "(1, 2)"), "<c16");
        refused(&plain("|u1", "(4, 8)"), "|u1");
        refused(&plain("<f2", "(4, 4)"), "<f2");
        refused(&plain("<f8", "(4,)"), "2 dimensions");
        refused(&plain("<f8", "(2, 2, 1)"), "2 dimensions");
        refused(&plain("<f8", "()"), "2 dimensions");
        refused(&plain("<f8", "(0, 4)"), "empty");
        refused(&plain("<f8", "(2, 3)"), "32 bytes follow");
        refused(&plain("<f8", "(99999999999, 99999999999)"), "damaged");
        refused(&plain("<f8", "(-2, 2)"), "shape");
        refused(&file(1, "{'descr': [('a', '<f8')], }", &[]), "several fields");
        refused(&file(1, "{'descr': '<f8'}", &[]), "fortran_order");
        let sound = plain("<f8", "(2, 2)");
        for end in 0..sound.len() {
            assert!(read(&sound[..end]).is_err(), "cut at {end}");
        }
    }

    /// Truth: written files follow numpy.lib.format. The header is a dictionary whose shape is a tuple. The data start
    /// at a multiple of 64 bytes. A second array of the same name is refused.
    #[test]
    fn archives_hold_npy_files() {
        let values = [1.5, -2.0, f64::MIN_POSITIVE, 4.0, 5.0, 6.0];
        let mut archive = NpzWriter::new();
        archive.add("of one", &[6], &values).unwrap();
        archive.add("a/of two", &[2, 3], &values).unwrap();
        archive.add("of three", &[1, 3, 2], &values).unwrap();
        archive.add("empty", &[4, 0, 2], &[]).unwrap();
        assert!(archive.add("empty", &[0], &[]).unwrap_err().message().contains("empty"));
        let mut zip = zip::ZipArchive::new(Cursor::new(archive.finish().unwrap())).unwrap();
        let mut file = |name: &str| {
            let mut bytes = Vec::new();
            std::io::copy(&mut zip.by_name(&format!("{name}.npy")).unwrap(), &mut bytes).unwrap();
            bytes
        };
        assert_eq!(read(&file("a/of two")).unwrap(), Array2 { values: values.to_vec(), shape: [2, 3] });
        for (name, shape, count) in
            [("of one", "(6,)", 6), ("of three", "(1, 3, 2)", 6), ("empty", "(4, 0, 2)", 0)]
        {
            let bytes = file(name);
            let (text, data) = split(&bytes).unwrap();
            assert_eq!(text.trim_end(), header("<f8", "False", shape).trim_end());
            assert!(text.ends_with('\n'));
            assert_eq!((bytes.len() - data.len()) % 64, 0);
            assert_eq!(data.len(), 8 * count);
        }
    }
}
