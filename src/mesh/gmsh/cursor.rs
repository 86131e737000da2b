//! Reading position in the bytes of a .msh file: words, numbers and sections.

use std::str::FromStr;

use crate::error::{Error, Result};

#[derive(Debug, Clone, Copy)]
struct Binary {
    swapped: bool,
    /// Size of a `size_t`, bytes.
    size: usize,
}

pub(super) struct Cursor<'a> {
    bytes: &'a [u8],
    source: &'a str,
    pos: usize,
    /// Start of the last word, number or section, for messages.
    last_read: usize,
    section: String,
    binary: Option<Binary>,
}

impl<'a> Cursor<'a> {
    pub(super) fn new(bytes: &'a [u8], source: &'a str) -> Self {
        let pos = if bytes.starts_with(b"\xef\xbb\xbf") { 3 } else { 0 };
        Self { bytes, source, pos, last_read: pos, section: String::new(), binary: None }
    }

    pub(super) fn is_binary(&self) -> bool {
        self.binary.is_some()
    }

    pub(super) fn fail(&self, what: &str) -> Error {
        let place = if self.binary.is_some() {
            format!("byte {}", self.last_read)
        } else {
            let upto = self.last_read.min(self.bytes.len());
            format!("line {}", 1 + self.bytes[..upto].iter().filter(|&&b| b == b'\n').count())
        };
        let section =
            if self.section.is_empty() { String::new() } else { format!(" (section ${})", self.section) };
        Error::input(format!("{}, {place}{section}: {what}", self.source))
    }

    fn fail_at(&mut self, pos: usize, what: &str) -> Error {
        self.last_read = pos;
        self.fail(what)
    }

    fn skip_space(&mut self) {
        while self.bytes.get(self.pos).is_some_and(u8::is_ascii_whitespace) {
            self.pos += 1;
        }
        self.last_read = self.pos;
    }

    fn rest(&self) -> &'a [u8] {
        &self.bytes[self.pos..]
    }

    pub(super) fn word(&mut self, wanted: &str) -> Result<&'a str> {
        self.skip_space();
        let rest = self.rest();
        let length = rest.iter().position(u8::is_ascii_whitespace).unwrap_or(rest.len());
        if length == 0 {
            return Err(
                self.fail(&format!("the file ends here, but {wanted} is missing; the file may be truncated"))
            );
        }
        let word =
            std::str::from_utf8(&rest[..length]).ok().filter(|word| !word.starts_with('$')).ok_or_else(
                || self.fail(&format!("found {}, expected {wanted}", quoted_excerpt(&rest[..length]))),
            )?;
        self.pos += length;
        Ok(word)
    }

    pub(super) fn number<T: FromStr>(&mut self, wanted: &str) -> Result<T> {
        let word = self.word(wanted)?;
        word.parse()
            .map_err(|_| self.fail(&format!("found {}, expected {wanted}", quoted_excerpt(word.as_bytes()))))
    }

    /// Text between the next and the last quotation mark of the line.
    pub(super) fn quoted(&mut self, wanted: &str) -> Result<String> {
        self.skip_space();
        let rest = self.rest();
        let line = &rest[..rest.iter().position(|&b| b == b'\n').unwrap_or(rest.len())];
        let inner = line
            .strip_prefix(b"\"")
            .and_then(|tail| tail.iter().rposition(|&b| b == b'"').map(|end| &tail[..end]))
            .ok_or_else(|| {
                self.fail(&format!("found {}, expected {wanted} in quotation marks", quoted_excerpt(line)))
            })?;
        self.pos += inner.len() + 2;
        Ok(String::from_utf8_lossy(inner).into_owned())
    }

    pub(super) fn end_line(&mut self) -> Result<()> {
        loop {
            match self.bytes.get(self.pos) {
                Some(b'\n') => {
                    self.pos += 1;
                    return Ok(());
                }
                Some(b' ' | b'\t' | b'\r') => self.pos += 1,
                None => return Ok(()),
                Some(_) => {
                    let rest = self.rest();
                    let end = rest.iter().position(|&b| b == b'\n').unwrap_or(rest.len());
                    let found = quoted_excerpt(rest[..end].trim_ascii_end());
                    let pos = self.pos;
                    return Err(self.fail_at(pos, &format!("found {found}, expected the end of the line")));
                }
            }
        }
    }

    /// Ends a record. In a text file, a record ends with its line. Binary records have no separator.
    pub(super) fn end_record(&mut self) -> Result<()> {
        if self.is_binary() { Ok(()) } else { self.end_line() }
    }

    /// Reads the number 1 that shows the byte order. From then on, integers, sizes and reals are read as binary; words stay text.
    pub(super) fn start_binary(&mut self, size: usize) -> Result<()> {
        self.binary = Some(Binary { swapped: false, size });
        let one: [u8; 4] = self.take("the number 1 that marks the byte order")?;
        let swapped = match (i32::from_le_bytes(one), i32::from_be_bytes(one)) {
            (1, _) => false,
            (_, 1) => true,
            (other, _) => {
                return Err(
                    self.fail(&format!("found {other}, expected the number 1 that marks the byte order"))
                );
            }
        };
        self.binary = Some(Binary { swapped, size });
        Ok(())
    }

    /// Next `N` bytes, in little-endian order.
    fn take<const N: usize>(&mut self, wanted: &str) -> Result<[u8; N]> {
        self.last_read = self.pos;
        let Some(found) = self.rest().first_chunk::<N>() else {
            return Err(
                self.fail(&format!("the file ends here, but {wanted} is missing; the file may be truncated"))
            );
        };
        self.pos += N;
        let mut bytes = *found;
        if self.binary.is_some_and(|b| b.swapped) {
            bytes.reverse();
        }
        Ok(bytes)
    }

    pub(super) fn int(&mut self, wanted: &str) -> Result<i64> {
        if self.binary.is_none() {
            return self.number(wanted);
        }
        Ok(i64::from(i32::from_le_bytes(self.take(wanted)?)))
    }

    pub(super) fn nonnegative_int(&mut self, wanted: &str) -> Result<u64> {
        let value = self.int(wanted)?;
        u64::try_from(value).map_err(|_| self.fail(&format!("found {value}, expected {wanted}, 0 or more")))
    }

    /// Reads a `size_t`: a number in a text file, 4 or 8 bytes in a binary file.
    pub(super) fn size(&mut self, wanted: &str) -> Result<u64> {
        match self.binary {
            None => self.number(wanted),
            Some(Binary { size: 4, .. }) => Ok(u64::from(u32::from_le_bytes(self.take(wanted)?))),
            Some(_) => Ok(u64::from_le_bytes(self.take(wanted)?)),
        }
    }

    pub(super) fn real(&mut self, wanted: &str) -> Result<f64> {
        if self.binary.is_none() {
            return self.number(wanted);
        }
        Ok(f64::from_le_bytes(self.take(wanted)?))
    }

    pub(super) fn coordinate(&mut self, node: u64) -> Result<f64> {
        let value = self.real("a coordinate")?;
        if value.is_finite() {
            return Ok(value);
        }
        Err(self.fail(&format!("node {node} has the coordinate {value}; coordinates must be finite numbers")))
    }

    /// Bytes of a `size_t` in a binary file. In a text file: the fewest bytes that a number and its separator take.
    pub(super) fn size_bytes(&self) -> u64 {
        self.binary.map_or(2, |b| b.size as u64)
    }

    /// Bytes of a number that has `stored` bytes in a binary file. In a text file: the fewest bytes that a number and
    /// its separator take.
    pub(super) fn bytes_of(&self, stored: u64) -> u64 {
        if self.is_binary() { stored } else { 2 }
    }

    /// Checks that `n` items of at least `bytes_each` bytes fit in the rest of the file, and returns `n` as a length.
    pub(super) fn check_count(&self, n: u64, bytes_each: u64, what: &str) -> Result<usize> {
        let remaining = (self.bytes.len() - self.pos) as u64;
        let possible = (remaining + 1) / bytes_each;
        if n > possible {
            return Err(self.fail(&format!(
                "{n} {what} are announced, but the remaining {remaining} bytes hold at most {possible}; the file may be truncated or damaged"
            )));
        }
        usize::try_from(n)
            .map_err(|_| self.fail(&format!("{n} {what} exceed the address range of this machine")))
    }

    pub(super) fn next_section(&mut self) -> Result<Option<String>> {
        self.section.clear();
        self.skip_space();
        let rest = self.rest();
        if rest.is_empty() {
            return Ok(None);
        }
        let end = rest.iter().position(|&b| b == b'\n').unwrap_or(rest.len());
        let line = rest[..end].trim_ascii_end();
        let name = line
            .strip_prefix(b"$")
            .filter(|name| !name.is_empty() && name.len() < 200 && !name.starts_with(b"End"))
            .and_then(|name| std::str::from_utf8(name).ok())
            .ok_or_else(|| {
                self.fail(&format!("found {}, expected a section such as $Nodes", quoted_excerpt(line)))
            })?;
        self.section = name.to_string();
        self.pos += (end + 1).min(rest.len());
        Ok(Some(self.section.clone()))
    }

    pub(super) fn end_section(&mut self, name: &str) -> Result<()> {
        self.skip_space();
        let rest = self.rest();
        let end = rest.iter().position(|&b| b == b'\n').unwrap_or(rest.len());
        let line = rest[..end].trim_ascii_end();
        if line.strip_prefix(b"$End") == Some(name.as_bytes()) {
            self.pos += end;
            return Ok(());
        }
        let found = if line.is_empty() { "the end of the file".to_string() } else { quoted_excerpt(line) };
        Err(self.fail(&format!(
            "found {found}, expected $End{name}; the section is longer than announced, or the file is truncated"
        )))
    }

    pub(super) fn skip_section(&mut self, name: &str) -> Result<()> {
        let end = format!("$End{name}").into_bytes();
        let found = self.rest().windows(end.len()).position(|window| window == end);
        let Some(at) = found else {
            return Err(
                self.fail(&format!("the section ${name} has no $End{name}; the file may be truncated"))
            );
        };
        self.pos += at;
        self.end_section(name)
    }
}

pub(super) fn quoted_excerpt(bytes: &[u8]) -> String {
    let short = &bytes[..bytes.len().min(40)];
    let dots = if short.len() < bytes.len() { ".." } else { "" };
    format!("\"{}{dots}\"", String::from_utf8_lossy(short).escape_debug())
}
