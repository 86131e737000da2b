//! Displacement and stress at points inside a body, as a table and, for a rectangle of points, as a grid.

use std::fmt::Write as _;

use nalgebra::Matrix3;

use crate::body::PointState;
use crate::error::{Error, Result};
use crate::geometry::{Point, Side};
use crate::material::strength::von_mises;
use crate::output::frame_fields::GLOBAL_COMPONENTS;
use crate::output::volume::stress_array;
use crate::output::vtu::{DataArray, UnstructuredGrid};

const QUADRILATERAL: u8 = 9;

/// Columns that follow the coordinates, `distance` and (for a rectangle) `distance_across`.
const FIELD_COLUMNS: &str = "displacement_x,displacement_y,displacement_z,stress_xx,stress_yy,stress_zz,stress_yz,stress_xz,stress_xy,von_mises,\
                     largest_shear,principal_1,principal_2,principal_3";

/// Measured memory per point while the table is written, bytes.
const TABLE_BYTES_PER_POINT: usize = 385;
/// Measured memory per point while the grid is written, bytes.
const GRID_BYTES_PER_POINT: usize = 420;

/// Requested points inside a body, evenly spaced on a line or over a rectangle.
#[derive(Debug, Clone, PartialEq)]
pub struct InteriorPointRequest {
    /// Name.
    pub name: String,
    /// Side of the body.
    pub side: Side,
    /// First point.
    pub from: Point,
    /// End of the line, or of the first side of a rectangle.
    pub to: Point,
    /// End of the second side of a rectangle.
    pub across: Option<Point>,
    /// Numbers of points along both sides; [n, 1] for a line.
    pub counts: [usize; 2],
}

impl InteriorPointRequest {
    /// Prefix of the output files: "inside-NAME".
    pub fn series(&self) -> String {
        format!("inside-{}", self.name)
    }

    /// Number of points.
    pub fn n_points(&self) -> usize {
        self.counts[0] * self.counts[1]
    }

    /// Memory while the files are written, bytes.
    pub fn writing_bytes(&self) -> usize {
        self.n_points()
            * if self.across.is_some() {
                TABLE_BYTES_PER_POINT.max(GRID_BYTES_PER_POINT)
            } else {
                TABLE_BYTES_PER_POINT
            }
    }

    /// Relative position of point `i` along both sides; consecutive points follow the first side.
    fn relative_position(&self, i: usize) -> [f64; 2] {
        let [n, m] = self.counts;
        [(i % n) as f64 / (n - 1) as f64, (i / n) as f64 / m.max(2).saturating_sub(1) as f64]
    }

    fn sides(&self) -> [Point; 2] {
        [self.to - self.from, self.across.map_or(Point::zeros(), |across| across - self.from)]
    }

    /// Positions of the points.
    pub fn points(&self) -> Vec<Point> {
        let [along, across] = self.sides();
        let at = |i: usize| {
            let [s, t] = self.relative_position(i);
            self.from + along * s + across * t
        };
        (0..self.n_points()).map(at).collect()
    }

    /// Ends of the line or corners of the rectangle, each with a key of the scene for messages. A convex body that contains these
    /// points contains all points.
    pub fn corners(&self) -> Vec<(&'static str, Point)> {
        let mut corners = vec![("from", self.from), ("to", self.to)];
        if let Some(across) = self.across {
            corners.extend([("across", across), ("across", across + self.to - self.from)]);
        }
        corners
    }

    /// Table with one row per point.
    ///
    /// # Errors
    /// If a number is not finite (kind `Numerical`).
    pub fn csv(&self, states: &[PointState]) -> Result<String> {
        let across = self.across.is_some();
        let distances = if across { "distance,distance_across" } else { "distance" };
        let mut text = format!("x,y,z,{distances},{FIELD_COLUMNS}\n");
        let lengths = self.sides().map(|side| side.norm());
        for (i, (x, state)) in self.points().iter().zip(states).enumerate() {
            let shares = self.relative_position(i);
            let distances = [0, 1].map(|k| shares[k] * lengths[k]);
            let stress = StressMeasures::of(state);
            let [p1, p2, p3] = stress.principal;
            let numbers: Vec<f64> = x
                .iter()
                .chain(&distances[..if across { 2 } else { 1 }])
                .chain(state.displacement.iter())
                .chain(&stress.voigt)
                .chain(&[stress.von_mises, stress.largest_shear, p1, p2, p3])
                .copied()
                .collect();
            if numbers.iter().any(|value| !value.is_finite()) {
                return Err(Error::numerical(format!(
                    "{} contains a number that is not finite in row {}",
                    self.name,
                    i + 1
                )));
            }
            let row: Vec<String> = numbers.iter().map(|value| format!("{value:?}")).collect();
            writeln!(text, "{}", row.join(",")).expect("writing to a string does not fail");
        }
        Ok(text)
    }

    /// Undeformed grid of quadrilaterals on the points of a rectangle, with displacement and stress.
    pub fn grid(&self, states: &[PointState]) -> UnstructuredGrid {
        let [n, m] = self.counts;
        let derived: Vec<StressMeasures> = states.iter().map(StressMeasures::of).collect();
        let points = self.points().into_iter().map(<[f64; 3]>::from).collect();
        let mut grid = UnstructuredGrid { points, ..Default::default() };
        for (i, j) in (0..m - 1).flat_map(|j| (0..n - 1).map(move |i| (i, j))) {
            let first = j * n + i;
            grid.push_cell(QUADRILATERAL, [first, first + 1, first + n + 1, first + n]);
        }
        let scalar = |name: &str, of: &dyn Fn(&StressMeasures) -> f64| {
            DataArray::scalar(name, derived.iter().map(of).collect())
        };
        let displacement = states.iter().flat_map(|state| <[f64; 3]>::from(state.displacement)).collect();
        grid.point_data = vec![
            DataArray::tuples("displacement", GLOBAL_COMPONENTS, displacement),
            stress_array(derived.iter().map(|derived| &derived.voigt)),
            scalar("von_mises", &|derived| derived.von_mises),
            scalar("largest_shear", &|derived| derived.largest_shear),
            DataArray::tuples(
                "principal_stress",
                &["1", "2", "3"],
                derived.iter().flat_map(|derived| derived.principal).collect(),
            ),
        ];
        grid
    }
}

struct StressMeasures {
    voigt: [f64; 6],
    von_mises: f64,
    /// Half the difference between the largest and the smallest principal stress.
    largest_shear: f64,
    /// Principal stresses, largest first.
    principal: [f64; 3],
}

impl StressMeasures {
    fn of(state: &PointState) -> Self {
        let voigt = state.voigt();
        let symmetric: Matrix3<f64> = 0.5 * (state.stress + state.stress.transpose());
        let mut principal: [f64; 3] = symmetric.symmetric_eigenvalues().into();
        principal.sort_by(|a, b| b.total_cmp(a));
        Self {
            voigt,
            von_mises: von_mises(&voigt),
            largest_shear: 0.5 * (principal[0] - principal[2]),
            principal,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn rectangle() -> InteriorPointRequest {
        InteriorPointRequest {
            name: "cut".into(),
            side: Side::Lower,
            from: Point::new(1.0, 0.0, 0.0),
            to: Point::new(3.0, 0.0, 0.0),
            across: Some(Point::new(1.0, 0.0, -4.0)),
            counts: [3, 2],
        }
    }

    /// Truth (docs/scene.md): points are evenly spaced along the first side, then the second; distances count from the first point.
    /// Tension p along x with pressure p along z has the largest shear p and the von Mises stress √3 p.
    #[test]
    fn points_and_rows() {
        let request = rectangle();
        let points = request.points();
        assert_eq!(points[1], Point::new(2.0, 0.0, 0.0));
        assert_eq!(points[5], Point::new(3.0, 0.0, -4.0));
        let stress = Matrix3::from_diagonal(&Point::new(2.0, 0.0, -2.0));
        let state = PointState { displacement: Point::new(0.5, 0.0, 0.0), stress };
        let text = request.csv(&[state; 6]).unwrap();
        let header: Vec<&str> = text.lines().next().unwrap().split(',').collect();
        let row: Vec<f64> = text.lines().last().unwrap().split(',').map(|x| x.parse().unwrap()).collect();
        let at = |name: &str| row[header.iter().position(|column| *column == name).unwrap()];
        assert_eq!((header.len(), text.lines().count()), (row.len(), 7));
        assert_eq!((at("distance"), at("distance_across")), (2.0, 4.0));
        assert!((at("largest_shear") - 2.0).abs() < 1e-12 && (at("von_mises") - 12f64.sqrt()).abs() < 1e-12);
        assert!((at("principal_1") - 2.0).abs() < 1e-12 && (at("principal_3") + 2.0).abs() < 1e-12);
        let grid = request.grid(&[state; 6]);
        assert_eq!(grid.connectivity, [0, 1, 4, 3, 1, 2, 5, 4]);
        let line = InteriorPointRequest { across: None, counts: [3, 1], ..request };
        assert_eq!(line.points().len(), 3);
        assert!(line.csv(&[state; 3]).unwrap().starts_with("x,y,z,distance,displacement_x"));
    }

    #[test]
    fn refuses_what_is_not_finite() {
        let state = PointState { displacement: Point::new(f64::NAN, 0.0, 0.0), stress: Matrix3::zeros() };
        assert!(rectangle().csv(&[state; 6]).is_err());
    }
}
