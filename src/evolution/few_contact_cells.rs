//! Warning about contacts that too few cells resolve.

use super::records::IncrementRecord;
use crate::error::warning;
use crate::frame::ContactFrame;

/// Fewest cells in contact for an error of the peak pressure near 3 %, measured on Hertz contact of a sphere.
const MIN_CONTACT_CELLS: usize = 12;

/// Fewest cells across a line contact for errors of at most 3 %, measured on Hertz contact of a cylinder.
const MIN_CELLS_ACROSS_LINE: usize = 4;

/// Sorted coordinates of cells along an axis of the frame, without repeated values.
struct Coordinates {
    values: Vec<f64>,
    /// Largest difference of coordinates that count as equal.
    tolerance: f64,
}

impl Coordinates {
    fn of(frame: &ContactFrame, axis: usize, cells: &[usize]) -> Self {
        let tolerance = 1e-6 * frame.size();
        let mut values: Vec<f64> = cells.iter().map(|&cell| frame.plane_coordinates(cell)[axis]).collect();
        values.sort_by(f64::total_cmp);
        values.dedup_by(|a, b| *a - *b <= tolerance);
        Self { values, tolerance }
    }

    fn count(&self) -> usize {
        self.values.len()
    }

    fn span(&self, all: &Self) -> bool {
        let ends = |values: &[f64]| [values[0], values[values.len() - 1]];
        let pairs = ends(&self.values).into_iter().zip(ends(&all.values));
        pairs.into_iter().all(|(a, b)| (a - b).abs() <= self.tolerance)
    }
}

/// Warning about a step whose contact has too few cells at the end of the step. `None` without contact, if the contact
/// was larger earlier in the step, and if it spans the frame in both directions.
///
/// `pressures`, `[N]`, MPa, are the pressures at the end of the step.
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
    let all: Vec<usize> = (0..frame.n_cells()).collect();
    let whole =
        [0, 1].map(|axis| Coordinates::of(frame, axis, &contact).span(&Coordinates::of(frame, axis, &all)));
    // Each plane of symmetry that bounds the frame doubles the number of contact cells along its normal.
    let normals = frame.symmetry_normals();
    let images = |axis: usize| 1 + usize::from(normals.iter().any(|normal| normal[axis].abs() > 0.5));
    let across = |axis: usize| images(axis) * Coordinates::of(frame, axis, &contact).count();
    let (number, least, place) = match whole {
        [true, true] => return None,
        [true, false] => (across(1), MIN_CELLS_ACROSS_LINE, "across the line contact"),
        [false, true] => (across(0), MIN_CELLS_ACROSS_LINE, "across the line contact"),
        [false, false] => (images(0) * images(1) * contact.len(), MIN_CONTACT_CELLS, "in contact"),
    };
    let finer = match frame.grid {
        Some(_) => {
            "use smaller cells (frame.cells, frame.half_width) and, on meshed bodies, contact faces no larger than the cells"
        }
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

    /// Truth: the chosen pressures give the numbers of cells. The warning appears below 12 cells in contact, or below 4
    /// cells across a line contact. There is no warning if the contact was larger before, covers the frame, or is
    /// absent.
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
        // The warning also asks for small contact faces, because finer cells help only if the meshes resolve them.
        assert!(
            warned(4.0, 2.0, 0.0).is_some_and(|text| text.contains("contact faces no larger than the cells"))
        );
        assert!(warned(6.0, 2.0, 0.0).is_none() && warned(4.0, 2.0, 9.0).is_none());
        assert!(warned(2.0, 4.0, 0.0).is_some_and(|text| text.contains("only 2 cells lie across")));
        assert!(warned(4.0, 4.0, 0.0).is_none());
        assert!(warned(20.0, 4.0, 0.0).is_none() && warned(0.0, 0.0, 0.0).is_none());
    }

    /// Truth: the warning counts the cells across a strip whose cells are 40 times as wide as long. In a quarter of a
    /// contact, it also counts the mirror images of the cells.
    #[test]
    fn long_cells_and_planes_of_symmetry() {
        let record = [IncrementRecord { contact_area: 1.0, ..IncrementRecord::default() }];
        let strip = ContactFrame::grid([0.7, 1.0], [28, 1], [0.0; 2], 0.0).unwrap();
        let warned = |columns: f64| {
            let inside = |cell: usize| f64::from(strip.plane_coordinates(cell)[0].abs() < 0.025 * columns);
            few_contact_cells_warning(&strip, &record, &(0..28).map(inside).collect::<Vec<_>>())
        };
        assert!(warned(14.0).is_none() && warned(2.0).is_some_and(|text| text.contains("only 2 cells lie")));
        let mut quarter = ContactFrame::grid([1.0, 1.0], [10, 10], [1.0; 2], 0.0).unwrap();
        let pressures: Vec<f64> = (0..100).map(|cell| f64::from(cell / 10 < 2 && cell % 10 < 2)).collect();
        let text = few_contact_cells_warning(&quarter, &record, &pressures);
        assert!(text.is_some_and(|text| text.contains("only 4 cells lie in contact")));
        quarter.symmetry_bounds = [true, true, false];
        assert!(few_contact_cells_warning(&quarter, &record, &pressures).is_none());
    }
}
