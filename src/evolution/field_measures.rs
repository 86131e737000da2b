//! Measures of fields on the frame: volumes and root mean squares.

/// Volume of the depth field `depth` (`[N]`, mm) on cells with the given areas, mm³.
pub(super) fn volume(depth: &[f64], areas: &[f64]) -> f64 {
    depth.iter().zip(areas).map(|(depth, area)| depth * area).sum()
}

/// Area-weighted root mean square of a field over the cells for which `counts` is true; 0 without such cells.
pub(super) fn root_mean_square(field: &[f64], areas: &[f64], counts: impl Fn(usize) -> bool) -> f64 {
    let (mut squares, mut sum) = (0.0, 0.0);
    for (_, (value, area)) in field.iter().zip(areas).enumerate().filter(|(i, _)| counts(*i)) {
        squares += area * value * value;
        sum += area;
    }
    if sum > 0.0 { (squares / sum).sqrt() } else { 0.0 }
}
