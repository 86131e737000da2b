//! Resolves the material axes of elements: by angles, by fields of mesh files, by tables, or by windings.

use std::collections::HashSet;
use std::path::Path;
use std::sync::Arc;

use super::resolver::Resolver;
use crate::csv::{Separators, data_lines};
use crate::error::Error;
use crate::geometry::fibre_axes;
use crate::material::{ElementAxes, Orientation, Winding, WoundLayer};
use crate::mesh::{ElementField, Mesh, gmsh};
use crate::scene::plan::FibreAngles;
use crate::scene::spec::direction::{CylindricalWinding, FibreDirection};
use crate::scene::suggest::{closest, quoted_list};

const MAX_LISTED_LINES: usize = 5;

/// Angles of a fibre direction, if it is uniform.
pub(super) fn uniform_angles(direction: &FibreDirection) -> Option<FibreAngles> {
    let varies = direction.field.is_some() || direction.file.is_some() || direction.cylindrical.is_some();
    let radians = |degrees: Option<f64>| degrees.unwrap_or(0.0).to_radians();
    (!varies).then(|| FibreAngles { tilt: radians(direction.tilt), azimuth: radians(direction.azimuth) })
}

pub(super) fn resolve(
    r: &mut Resolver,
    key: &str,
    direction: &FibreDirection,
    mesh: &Mesh,
) -> Option<Orientation> {
    let by_angles = direction.tilt.is_some() || direction.azimuth.is_some();
    let by_table = direction.field.is_some() || direction.file.is_some();
    let ways = [by_angles, by_table, direction.cylindrical.is_some()];
    if ways.iter().filter(|given| **given).count() > 1 {
        let message = "the fibre direction is defined in more than one way";
        let mend = "give `tilt` and `azimuth`, or `field` and `file`, or `cylindrical`";
        return r.refuse(key, message, "more than one way", mend);
    }
    if let Some(cylindrical) = &direction.cylindrical {
        return winding(r, &format!("{key}.cylindrical"), cylindrical);
    }
    match (&direction.file, &direction.field) {
        (None, None) => {
            uniform_angles(direction).map(|fibre| Orientation::Uniform(fibre_axes(fibre.tilt, fibre.azimuth)))
        }
        (None, Some(field)) => from_fields(r, key, field, &mesh.fields, &mesh.source, mesh),
        (Some(file), field) => from_file(r, key, file, field.as_deref(), mesh),
    }
}

fn winding(r: &mut Resolver, key: &str, winding: &CylindricalWinding) -> Option<Orientation> {
    let layers = match (winding.angle, winding.layers.as_slice()) {
        (Some(angle), []) => vec![WoundLayer { radii: [0.0, f64::INFINITY], angle: angle.to_radians() }],
        (None, [_, ..]) => {
            let layer = |layer: &crate::scene::spec::direction::WindingLayer| WoundLayer {
                radii: layer.r,
                angle: layer.angle.to_radians(),
            };
            winding.layers.iter().map(layer).collect()
        }
        (angle, _) => {
            let found =
                if angle.is_some() { "both `angle` and `layers`" } else { "neither `angle` nor `layers`" };
            let mend = "give one `angle` from the axis, or `layers = [{ r = [.., ..], angle = .. }]`";
            return r.refuse(key, format!("the winding has {found}"), "one of the two", mend);
        }
    };
    let winding = Winding::new(winding.axis.vector(), winding.origin, layers);
    r.accept(winding, key, ["this winding", "see docs/scene.md"]).map(Orientation::Winding)
}

/// Numbers (tags) of all elements of a mesh, and numbers of its volume elements.
fn numbers(mesh: &Mesh) -> [HashSet<u64>; 2] {
    let all = mesh.blocks.iter().flat_map(|block| block.tags.iter().copied()).collect();
    [all, mesh.volume_cells().map(|cell| mesh.tag(cell)).collect()]
}

fn from_fields(
    r: &mut Resolver,
    key: &str,
    name: &str,
    fields: &[ElementField],
    source: &str,
    mesh: &Mesh,
) -> Option<Orientation> {
    let key = &format!("{key}.field");
    let Some(field) = fields.iter().find(|field| field.name == name) else {
        let names: Vec<&str> = fields.iter().map(|field| field.name.as_str()).collect();
        let mut mend = format!("element fields ($ElementData) in that file: {}", quoted_list(&names, "\""));
        if let Some(word) = closest(name, &names) {
            mend = format!("did you mean \"{word}\"? {mend}");
        }
        return r.refuse(key, format!("{source} has no field \"{name}\""), "no such field", mend);
    };
    match field_axes(field, source, mesh) {
        Ok((axes, unknown)) => {
            if let [first, ..] = unknown.as_slice() {
                r.note(format!(
                    "{key}: the field \"{name}\" of {source} has values for {} elements that are not in {} (first: \
                     element {first}); these values are ignored",
                    unknown.len(),
                    mesh.source
                ));
            }
            Some(Orientation::PerElement(Arc::new(axes)))
        }
        Err(error) => {
            let message = format!("the field \"{name}\" of {source}: {}", error.message());
            r.refuse(
                key,
                message,
                "this field",
                "the field needs 3 components (direction of axis 1) or 9 (directions of axes 1, 2 and 3)",
            )
        }
    }
}

/// Material axes of the volume elements from a field. Also returns the element numbers in the field that the mesh
/// lacks.
fn field_axes(field: &ElementField, source: &str, mesh: &Mesh) -> Result<(ElementAxes, Vec<u64>), Error> {
    if ![3, 9].contains(&field.n_components) {
        return Err(Error::input(format!("it has {} components, not 3 or 9", field.n_components)));
    }
    let [all, solids] = numbers(mesh);
    let mut axes = ElementAxes::new(&format!("the field \"{}\" of {source}", field.name));
    let mut unknown = Vec::new();
    for (&element, value) in field.elements.iter().zip(field.values.chunks_exact(field.n_components)) {
        if !solids.contains(&element) {
            if !all.contains(&element) {
                unknown.push(element);
            }
            continue;
        }
        let second = (value.len() == 9).then(|| [value[3], value[4], value[5]]);
        axes.add(element, [value[0], value[1], value[2]], second.filter(|v| *v != [0.0; 3]))?;
    }
    Ok((axes, unknown))
}

fn from_file(
    r: &mut Resolver,
    key: &str,
    file: &str,
    field: Option<&str>,
    mesh: &Mesh,
) -> Option<Orientation> {
    let path = r.file(&format!("{key}.file"), file);
    if path.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("msh")) {
        let (fields, warnings) = match gmsh::read_fields(&path) {
            Ok(found) => found,
            Err(error) => {
                return r.refuse(
                    &format!("{key}.file"),
                    error.to_string(),
                    "this file",
                    "paths are relative to the folder of the scene file",
                );
            }
        };
        warnings.iter().for_each(|warning| r.note(format!("{key}.file: {warning}")));
        let name = match (field, fields.as_slice()) {
            (Some(name), _) => name.to_owned(),
            (None, [only]) => only.name.clone(),
            (None, _) => {
                let names: Vec<&str> = fields.iter().map(|field| field.name.as_str()).collect();
                let mend = format!("add `field`, one of {}", quoted_list(&names, "\""));
                return r.refuse(
                    &format!("{key}.file"),
                    format!("{file} has {} fields", names.len()),
                    "which field?",
                    mend,
                );
            }
        };
        return from_fields(r, key, &name, &fields, &path.display().to_string(), mesh);
    }
    if field.is_some() {
        let message = format!("`field` applies to .msh files only; {file} is not one");
        let mend = "remove `field`, or name a .msh file";
        return r.refuse(&format!("{key}.field"), message, "not applicable", mend);
    }
    from_table(r, &format!("{key}.file"), &path, mesh)
}

fn from_table(r: &mut Resolver, key: &str, path: &Path, mesh: &Mesh) -> Option<Orientation> {
    let mend = "each line: element number, fx, fy, fz (direction of axis 1) and optionally gx, gy, gz (direction of \
                axis 2); # starts a comment";
    let text = match std::fs::read_to_string(path) {
        Ok(text) => text,
        Err(error) => {
            return r.refuse(
                key,
                format!("the file {} cannot be read: {error}", path.display()),
                "this file",
                mend,
            );
        }
    };
    let [all, solids] = numbers(mesh);
    let mut axes = ElementAxes::new(&path.display().to_string());
    let mut wrong = Vec::new();
    let mut before = false;
    let mut separators = Separators::default();
    for (number, line) in data_lines(&text) {
        let line = line.split('#').next().unwrap_or("").trim();
        // A first line that starts with a letter or a quote is a header.
        let heading = !before && line.starts_with(|c: char| c.is_alphabetic() || c == '"');
        before = true;
        if heading {
            continue;
        }
        let checked = separators.check(line).map_err(|problem| format!("the line {problem}"));
        if let Err(why) = checked.and_then(|()| add_line(&mut axes, line, &all, &solids)) {
            wrong.push(format!("{}:{}: {why}", path.display(), number));
        }
    }
    let more = wrong.len().saturating_sub(MAX_LISTED_LINES);
    for (i, message) in wrong.iter().take(MAX_LISTED_LINES).enumerate() {
        let more = if i + 1 == MAX_LISTED_LINES && more > 0 {
            format!(" (and {more} more lines with errors)")
        } else {
            String::new()
        };
        r.report(key, format!("{message}{more}"), "this file", mend);
    }
    wrong.is_empty().then(|| Orientation::PerElement(Arc::new(axes)))
}

/// Adds the material axes from one line of a table. A line for an element that is not a volume element is ignored.
fn add_line(
    axes: &mut ElementAxes,
    line: &str,
    all: &HashSet<u64>,
    solids: &HashSet<u64>,
) -> Result<(), String> {
    let words: Vec<&str> =
        line.split(|c: char| ",;".contains(c) || c.is_whitespace()).filter(|word| !word.is_empty()).collect();
    if ![4, 7].contains(&words.len()) {
        return Err(format!("{} values, not 4 or 7", words.len()));
    }
    let element: u64 = words[0].parse().map_err(|_| format!("\"{}\" is not an element number", words[0]))?;
    let mut values = [0.0; 6];
    for (value, word) in values.iter_mut().zip(&words[1..]) {
        *value = word.parse().map_err(|_| format!("\"{word}\" is not a number"))?;
    }
    if !all.contains(&element) {
        return Err(format!("the mesh has no element {element}"));
    }
    if !solids.contains(&element) {
        return Ok(());
    }
    let [x, y, z, second @ ..] = values;
    axes.add(element, [x, y, z], (words.len() == 7).then_some(second)).map_err(|e| e.message().to_owned())
}
