//! Warning about contacts that too few cells resolve.

use super::records::IncrementRecord;
use crate::error::warning;
use crate::frame::ContactFrame;

/// Fewest cells in contact for an error of the peak pressure near 3 %. Measured on Hertz contact of a sphere: the error is 45 % or
/// more with 4 cells, 3 % with 12 to 24 cells, and 1 % with 40 cells.
const MIN_CONTACT_CELLS: usize = 12;

/// Fewest cells across a line contact. Measured on Hertz contact of a cylinder: the error is 26 % with 2 cells, and 3 % or less
/// with 4.
const MIN_CELLS_ACROSS_LINE: usize = 4;

/// Warning about a step whose contact has too few cells at its end and was not larger before. `None` without contact, and for a
/// contact of the whole frame, whose boundary is given.
///
/// `records` are the records of the step. `pressures` are the pressures at its end, `[N]`, MPa.
pub(super) fn few_contact_cells_warning(
    frame: &ContactFrame,
    records: &[IncrementRecord],
    pressures: &[f64],
) -> Option<String> {
    let last = records.last()?;
    let contact: Vec<usize> = (0..frame.n_cells()).filter(|&cell| pressures[cell] > 0.0).collect();
    if contact.is_empty() || records.iter().any(|record| record.contact_area > last.contact_area) {
        return None;
    }
    let side = frame.mean_cell_side();
    let cells_along = |axis: usize, cells: &mut dyn Iterator<Item = usize>| {
        let [low, high] = cells
            .map(|cell| frame.plane_coordinates(cell)[axis])
            .fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], x| [low.min(x), high.max(x)]);
        let side = frame.grid.as_ref().map_or(side, |grid| grid.spacing[axis]);
        ((high - low) / side).round() as usize + 1
    };
    let along = [0, 1].map(|axis| cells_along(axis, &mut contact.iter().copied()));
    let whole = [0, 1].map(|axis| along[axis] == cells_along(axis, &mut (0..frame.n_cells())));
    let (number, least, place) = match whole {
        [true, true] => return None,
        [true, false] => (along[1], MIN_CELLS_ACROSS_LINE, "across the line contact"),
        [false, true] => (along[0], MIN_CELLS_ACROSS_LINE, "across the line contact"),
        [false, false] => (contact.len(), MIN_CONTACT_CELLS, "in contact"),
    };
    let finer = match frame.grid {
        Some(_) => "increase frame.cells or reduce frame.half_width",
        None => "refine the meshes of the contact surfaces",
    };
    (number < least).then(|| {
        let cells = if number == 1 { "1 cell lies" } else { &format!("{number} cells lie") };
        warning(&format!(
            "step \"{}\" ({}): only {cells} {place}: load, contact area and peak pressure are inaccurate. Use at least {least}, and three times as many for an error near 1 %: {finer}",
            last.name, last.increment
        ))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Truth: the pressures are chosen, so the numbers of cells in contact and across a line contact are known. The warning appears
    /// below 12 or 4 cells. It does not appear if the contact was larger before, covers the frame, or is absent.
    #[test]
    fn contacts_of_few_cells() {
        let frame = ContactFrame::grid([1.0, 0.5], [20, 4], [0.0; 2], 0.0).unwrap();
        let warned = |columns: f64, rows: f64, earlier: f64| {
            let inside = |cell: usize| {
                let [x, y] = frame.plane_coordinates(cell);
                f64::from(x.abs() < 0.05 * columns && y.abs() < 0.125 * rows)
            };
            let pressures: Vec<f64> = (0..80).map(inside).collect();
            let record = |contact_area| IncrementRecord {
                name: "press".to_owned(),
                contact_area,
                ..IncrementRecord::default()
            };
            few_contact_cells_warning(&frame, &[record(earlier), record(columns * rows)], &pressures)
        };
        assert!(warned(4.0, 2.0, 0.0).is_some_and(|text| text.contains("only 8 cells lie in contact")));
        assert!(warned(6.0, 2.0, 0.0).is_none() && warned(4.0, 2.0, 9.0).is_none());
        assert!(warned(2.0, 4.0, 0.0).is_some_and(|text| text.contains("only 2 cells lie across")));
        assert!(warned(4.0, 4.0, 0.0).is_none());
        assert!(warned(20.0, 4.0, 0.0).is_none() && warned(0.0, 0.0, 0.0).is_none());
    }
}
