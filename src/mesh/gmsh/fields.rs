//! `$ElementData`: values per element. The section has the same format in versions 2.2 and 4.1.

use super::cursor::Cursor;
use crate::error::Result;
use crate::mesh::ElementField;

/// Number of components of a tensor.
const MAX_COMPONENTS: u64 = 9;

/// Reads one `$ElementData` section. Further time steps of a known field are omitted, and `repeated` then contains the
/// name of the field.
///
/// The three lists of tags are text also in binary files: strings (name first), reals (time first), and integers (time
/// step, components, elements, partition).
pub(super) fn read_element_data(
    cursor: &mut Cursor,
    fields: &mut Vec<ElementField>,
    repeated: &mut Vec<String>,
) -> Result<()> {
    let (name, n_components, n) = read_header(cursor)?;
    let n = cursor.check_count(n, cursor.bytes_of(4) + n_components * cursor.bytes_of(8), "values")?;
    let n_components = n_components as usize;
    let (elements, values) = (Vec::with_capacity(n), Vec::with_capacity(n * n_components));
    let mut field = ElementField { name, n_components, elements, values };
    for _ in 0..n {
        field.elements.push(cursor.nonnegative_int("an element number")?);
        for _ in 0..n_components {
            field.values.push(cursor.real("a value of the field")?);
        }
        cursor.end_record()?;
    }
    if fields.iter().all(|known| known.name != field.name) {
        fields.push(field);
    } else if !repeated.contains(&field.name) {
        repeated.push(field.name);
    }
    Ok(())
}

pub(super) fn repeated_warning(name: &str) -> String {
    format!(
        "the field \"{name}\" has several time steps; only the first is used. Save only the time step to be used"
    )
}

fn read_header(cursor: &mut Cursor) -> Result<(String, u64, u64)> {
    let n_strings: u64 = cursor.number("the number of texts of a field")?;
    cursor.check_count(n_strings, 2, "texts")?;
    let mut name = String::new();
    for i in 0..n_strings {
        let text = cursor.quoted("a text")?;
        if i == 0 {
            name = text;
        }
    }
    let n_reals: u64 = cursor.number("the number of reals of a field")?;
    cursor.check_count(n_reals, 2, "reals")?;
    for _ in 0..n_reals {
        cursor.number::<f64>("a real of a field")?;
    }
    let n_integers: u64 = cursor.number("the number of integers of a field")?;
    if n_integers < 3 {
        return Err(cursor.fail(&format!(
            "the field has {n_integers} integers; at least 3 are needed: time step, components, elements"
        )));
    }
    cursor.check_count(n_integers, 2, "integers")?;
    let mut integers = [0; 3];
    for i in 0..n_integers {
        let value: u64 = cursor.number("an integer of a field")?;
        if let Some(place) = integers.get_mut(i as usize) {
            *place = value;
        }
    }
    cursor.end_line()?;
    let [_, n_components, n] = integers;
    if !(1..=MAX_COMPONENTS).contains(&n_components) {
        return Err(cursor
            .fail(&format!("the field has {n_components} components; 1 to {MAX_COMPONENTS} are allowed")));
    }
    Ok((name, n_components, n))
}
