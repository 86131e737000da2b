//! Profiles of cell values along a straight line in the frame.

use nalgebra::Vector2;

use crate::frame::{ContactFrame, Grid};

/// Straight line in the plane of the frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ProfileLine {
    /// Point at distance 0: coordinates along x and y of the frame, from its origin, mm.
    pub through: [f64; 2],
    /// Angle from x of the frame, radians.
    pub angle: f64,
}

impl ProfileLine {
    fn direction(&self) -> Vector2<f64> {
        let (sin, cos) = self.angle.sin_cos();
        // Exact directions along an axis align the samples with the cell centres.
        let clean = |c: f64| if c.abs() < 1e-9 { 0.0 } else { c };
        Vector2::new(clean(cos), clean(sin)).normalize()
    }
}

/// Samples (distance along the line, value) of the cell `values`, in order of distance.
///
/// On a grid, values are interpolated bilinearly between the cell centres; grid cells outside the frame count as 0.
/// Along an axis, the samples lie at the coordinates of the cell centres. On other lines, the distance between samples
/// is the smaller cell spacing.
///
/// On frames without a grid, each cell gives its value at the middle of its intersection with the line. Cells with a
/// common middle give the mean of their values, for example two cells whose common edge lies on the line.
pub fn profile_along(frame: &ContactFrame, values: &[f64], line: &ProfileLine) -> Vec<[f64; 2]> {
    match frame.grid {
        Some(grid) if frame.polygons.is_none() && frame.n_cells() > 0 => {
            sample_grid(frame, grid, values, line)
        }
        _ => cut_polygons(frame, values, line),
    }
}

fn sample_grid(frame: &ContactFrame, grid: Grid, values: &[f64], line: &ProfileLine) -> Vec<[f64; 2]> {
    let [nx, ny] = grid.cells;
    let place = frame.grid_index(0);
    let first = frame.plane_coordinates(0);
    let index = [place / ny, place % ny];
    let corner = [0, 1].map(|axis| first[axis] - index[axis] as f64 * grid.spacing[axis]);
    let mut whole = vec![0.0; nx * ny];
    values.iter().enumerate().for_each(|(cell, value)| whole[frame.grid_index(cell)] = *value);
    // Position relative to the centre of the grid cell (0, 0), in cell spacings.
    let cells_at = |p: Vector2<f64>| [0, 1].map(|axis| (p[axis] - corner[axis]) / grid.spacing[axis]);
    let value_at = |p: Vector2<f64>| {
        let at = cells_at(p);
        let within = |axis: usize| {
            let last = grid.cells[axis] as f64 - 1.0;
            (-0.500_001..=last + 0.500_001).contains(&at[axis]).then(|| at[axis].clamp(0.0, last))
        };
        let (x, y) = (within(0)?, within(1)?);
        let (ix, iy) = ((x as usize).min(nx.max(2) - 2), (y as usize).min(ny.max(2) - 2));
        let (fx, fy) = (x - ix as f64, y - iy as f64);
        let cell = |dx: usize, dy: usize| whole[(ix + dx).min(nx - 1) * ny + (iy + dy).min(ny - 1)];
        let low = cell(0, 0) * (1.0 - fy) + cell(0, 1) * fy;
        let high = cell(1, 0) * (1.0 - fy) + cell(1, 1) * fy;
        Some(low * (1.0 - fx) + high * fx)
    };
    let (direction, through) = (line.direction(), Vector2::from(line.through));
    let distances: Vec<f64> = match [0, 1].into_iter().find(|&axis| direction[axis].abs() == 1.0) {
        Some(axis) => {
            let along =
                |i: usize| direction[axis] * (corner[axis] + i as f64 * grid.spacing[axis] - through[axis]);
            let mut found: Vec<f64> = (0..grid.cells[axis]).map(along).collect();
            found.sort_by(f64::total_cmp);
            found
        }
        None => {
            let step = grid.spacing[0].min(grid.spacing[1]);
            let reach = (nx as f64 * grid.spacing[0]).hypot(ny as f64 * grid.spacing[1]);
            let most = ((reach + through.norm()) / step).ceil() as i64;
            (-most..=most).map(|k| k as f64 * step).collect()
        }
    };
    distances.into_iter().filter_map(|s| Some([s, value_at(through + direction * s)?])).collect()
}

fn cut_polygons(frame: &ContactFrame, values: &[f64], line: &ProfileLine) -> Vec<[f64; 2]> {
    let (direction, through) = (line.direction(), Vector2::from(line.through));
    let mut found = Vec::new();
    for (corners, value) in frame.all_corners().zip(values) {
        let flat: Vec<Vector2<f64>> = corners
            .iter()
            .map(|p| frame.axes.to_local(&(p - frame.origin)).xy() - through)
            .map(|p| Vector2::new(p.dot(&direction), direction.perp(&p)))
            .collect();
        let (mut low, mut high) = (f64::INFINITY, f64::NEG_INFINITY);
        for (a, b) in flat.iter().zip(flat.iter().cycle().skip(1)) {
            let mut take = |s: f64| (low, high) = (low.min(s), high.max(s));
            if a.y == b.y {
                if a.y == 0.0 {
                    take(a.x);
                    take(b.x);
                }
            } else if a.y.min(b.y) <= 0.0 && a.y.max(b.y) >= 0.0 {
                take(a.x + (b.x - a.x) * a.y / (a.y - b.y));
            }
        }
        if high - low > 1e-9 * frame.size() {
            found.push([0.5 * (low + high), *value]);
        }
    }
    found.sort_by(|a, b| a[0].total_cmp(&b[0]));
    let tolerance = 1e-9 * frame.size();
    let mean = |group: &[[f64; 2]]| group.iter().map(|p| p[1]).sum::<f64>() / group.len() as f64;
    found.chunk_by(|a, b| b[0] - a[0] <= tolerance).map(|group| [group[0][0], mean(group)]).collect()
}

#[cfg(test)]
mod tests {
    use std::f64::consts::FRAC_PI_2;

    use super::*;

    /// Truth: bilinear interpolation reproduces a linear field, except in the outermost half cells. Distances count from the given
    /// point.
    #[test]
    fn linear_fields_are_exact_on_grids() {
        let frame = ContactFrame::grid([2.0, 1.0], [16, 12], [5.0, -3.0], 0.4).unwrap();
        let field = |x: f64, y: f64| 3.0 + 2.0 * x - 5.0 * y;
        let values: Vec<f64> =
            (0..192).map(|cell| frame.plane_coordinates(cell)).map(|[x, y]| field(x, y)).collect();
        for angle in [0.0, 0.3, FRAC_PI_2, 2.0, -FRAC_PI_2] {
            let line = ProfileLine { through: [0.2, -0.1], angle };
            let points = profile_along(&frame, &values, &line);
            assert!(points.len() >= 12, "{angle}: {}", points.len());
            for [s, value] in points {
                let (x, y) = (0.2 + s * angle.cos(), -0.1 + s * angle.sin());
                if x.abs() < 1.87 && y.abs() < 0.91 {
                    assert!((value - field(x, y)).abs() < 1e-12, "{angle}: {s} {value} {}", field(x, y));
                }
            }
        }
    }

    /// Truth: samples along an axis lie at the cell centres. With two rows of cells, the axis lies between them, and each sample is
    /// the mean of both rows.
    #[test]
    fn rows_are_met_on_their_centres() {
        let frame = ContactFrame::grid([2.0, 1.0], [4, 2], [5.0, 5.0], 0.0).unwrap();
        let values: Vec<f64> = (0..8).map(f64::from).collect();
        let at = |angle| profile_along(&frame, &values, &ProfileLine { through: [0.0; 2], angle });
        assert_eq!(at(0.0), [[-1.5, 0.5], [-0.5, 2.5], [0.5, 4.5], [1.5, 6.5]]);
        assert_eq!(at(FRAC_PI_2), [[-0.5, 3.0], [0.5, 4.0]]);
    }

    /// Truth: the cells as polygons give the same samples as the grid. An oblique line gives the values of the cells that it cuts.
    #[test]
    fn polygons_are_cut() {
        let grid = ContactFrame::grid([2.0, 1.0], [4, 2], [0.0, 0.0], 0.0).unwrap();
        let polygons = grid.all_corners().map(|corners| corners.to_vec()).collect();
        let frame = ContactFrame { polygons: Some(polygons), grid: None, ..grid.clone() };
        let values: Vec<f64> = (0..8).map(f64::from).collect();
        for angle in [0.0, FRAC_PI_2] {
            let line = ProfileLine { through: [0.0; 2], angle };
            assert_eq!(profile_along(&frame, &values, &line), profile_along(&grid, &values, &line));
        }
        let oblique =
            profile_along(&frame, &values, &ProfileLine { through: [0.0; 2], angle: 0.5_f64.atan() });
        let [far, near] = [1.25_f64.sqrt() * 1.5, 1.25_f64.sqrt() * 0.5];
        let expected = [[-far, 0.0], [-near, 2.0], [near, 5.0], [far, 7.0]];
        assert_eq!(oblique.len(), 4, "{oblique:?}");
        for (found, expected) in oblique.iter().zip(expected) {
            assert!((found[0] - expected[0]).abs() < 1e-12 && found[1] == expected[1], "{oblique:?}");
        }
    }
}
