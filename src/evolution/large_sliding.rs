//! Warning about tangential displacements that exceed the assumption of small sliding.

use super::records::{FrameState, IncrementRecord};
use crate::error::warning;
use crate::frame::ContactFrame;
use crate::geometry::{Point, bounds};

/// Largest reliable ratio of the tangential displacement of body 2 to the half-width of the contact. The model neglects
/// that the surfaces move past each other, and the error of the gap grows with the square of this ratio.
const MAX_SLIDING_OVER_HALF_WIDTH: f64 = 0.2;

/// Warning if the tangential displacement of body 2 exceeds a share of the half-width of the contact. `None` for steady
/// rolling and without contact. `None` also if neither tangential force nor wear occurs, or if the contact covers the
/// whole frame along the displacement.
pub(super) fn large_sliding_warning(
    frame: &ContactFrame,
    record: &IncrementRecord,
    fields: &FrameState,
) -> Option<String> {
    if record.rolling.is_some() || record.tangential_force == [0.0; 2] && record.worn_volume == 0.0 {
        return None;
    }
    let shifts = record.stroke_ends.map_or([record.shift; 2], |ends| ends.map(|end| end.shift));
    let [dx, dy] = shifts.into_iter().max_by(|a, b| a[0].hypot(a[1]).total_cmp(&b[0].hypot(b[1])))?;
    let distance = dx.hypot(dy);
    if distance == 0.0 {
        return None;
    }
    let direction: Point = (frame.axes.0.column(0) * dx + frame.axes.0.column(1) * dy) / distance;
    let along = |cells: &mut dyn Iterator<Item = usize>| {
        bounds(cells.map(|cell| frame.centers[cell].dot(&direction)))
    };
    let n = frame.n_cells();
    let whole = along(&mut (0..n));
    let contact = along(&mut (0..n).filter(|&cell| fields.status[cell] > 0));
    if contact[0] > contact[1] || contact == whole {
        return None;
    }
    let cell = frame.mean_cell_side();
    let half_width = 0.5 * (contact[1] - contact[0] + cell);
    let (effect, remedy) = if record.worn_volume > 0.0 {
        ("the wear scar of the longer body becomes too deep and too short", ", or use wear volumes only")
    } else {
        ("the contact does not move with body 2", "")
    };
    (distance > MAX_SLIDING_OVER_HALF_WIDTH * half_width).then(|| {
        warning(&format!(
            "step \"{}\" ({}): body 2 is displaced tangentially by {distance:.4}, {:.0} % of the half-width of the contact in this direction ({half_width:.4}). The model neglects that the surfaces move past each other: {effect}. Keep the displacement below {:.0} %{remedy}",
            record.name,
            record.increment,
            100.0 * distance / half_width,
            100.0 * MAX_SLIDING_OVER_HALF_WIDTH
        ))
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::evolution::records::Resultants;

    /// Truth: a warning appears if the displacement exceeds 0.2 times the half-width of the contact. Along x, 6 of 20
    /// cells of side 0.1 are in contact, so the half-width is 0.3. Along y the contact covers the frame, so no
    /// displacement is too large. In a fretting cycle the displacements at the reversal points are compared.
    #[test]
    fn displacements_against_the_half_width() {
        let frame = ContactFrame::grid([1.0, 0.2], [20, 4], [0.0; 2], 0.0).unwrap();
        let touching = |cell: usize| u8::from(frame.centers[cell].x.abs() < 0.26);
        let status: Vec<u8> = (0..80).map(touching).collect();
        let half_width = 0.3;
        let fields = FrameState { status, ..FrameState::default() };
        let record = |shift: [f64; 2]| IncrementRecord {
            name: "press".to_owned(),
            shift,
            tangential_force: [1.0, 0.0],
            ..IncrementRecord::default()
        };
        let warned = |record: &IncrementRecord| large_sliding_warning(&frame, record, &fields);
        assert!(warned(&record([0.19 * half_width, 0.0])).is_none());
        let text = warned(&record([-0.21 * half_width, 0.0])).expect("a warning");
        assert!(text.starts_with("WARNING: step \"press\"") && text.contains("21 % of"), "{text}");
        assert!(warned(&record([0.0, 5.0])).is_none());
        let end = |x: f64| Resultants { shift: [x, 0.0], ..Resultants::default() };
        let cycle = |x: f64| IncrementRecord { stroke_ends: Some([end(x), end(-x)]), ..record([0.0; 2]) };
        assert!(warned(&cycle(0.19 * half_width)).is_none() && warned(&cycle(0.21 * half_width)).is_some());
        assert!(warned(&record([0.0; 2])).is_none());
    }
}
