//! Outlines of flat punches. Cells whose centre lies outside are no part of the frame.

use std::f64::consts::PI;

use rayon::prelude::*;

use super::ContactFrame;
use crate::error::{Error, Result};
use crate::geometry::bounds;

/// Closed curve in the plane of the frame. Positions are along the frame's x and y from the frame's origin, mm. Angles
/// are from the frame's x, radians.
#[derive(Debug, Clone, PartialEq)]
pub enum Outline {
    /// Circle.
    Circle {
        /// Radius.
        radius: f64,
        /// Centre.
        center: [f64; 2],
    },
    /// Ellipse.
    Ellipse {
        /// Semi-axes.
        semi_axes: [f64; 2],
        /// Angle of the first axis.
        angle: f64,
        /// Centre.
        center: [f64; 2],
    },
    /// Polygon without holes, with vertices in either orientation.
    Polygon {
        /// Vertices.
        vertices: Vec<[f64; 2]>,
    },
}

/// Maximum distance from the curve at which a point counts as on the curve. It is relative to the size of a circle or ellipse, or
/// to the length of a polygon's edge. Mirror images of a cell are thus both inside or both outside.
const BOUNDARY_TOLERANCE: f64 = 1e-10;

/// Maximum number of vertices of a polygon. The number is limited, because all pairs of edges are compared.
const MAX_VERTICES: usize = 10_000;

impl Outline {
    /// Checks that the outline encloses an area and does not intersect itself.
    ///
    /// # Errors
    /// If a value is not finite, or a length is not positive. If a polygon has fewer than 3 or too many vertices, equal successive
    /// vertices, or edges that meet.
    pub fn check(&self) -> Result<()> {
        let positive = |what: &str, value: f64| {
            let fine = value.is_finite() && value > 0.0;
            if fine {
                Ok(())
            } else {
                Err(Error::input(format!("the {what} {value} must be positive and finite")))
            }
        };
        match self {
            Self::Circle { radius, center } => {
                finite(center)?;
                positive("radius", *radius)
            }
            Self::Ellipse { semi_axes, angle, center } => {
                finite(center)?;
                finite(&[*angle])?;
                positive("semi-axis", semi_axes[0])?;
                positive("semi-axis", semi_axes[1])
            }
            Self::Polygon { vertices } => check_polygon(vertices),
        }
    }

    /// Whether the point lies inside or on the curve.
    pub fn contains(&self, [x, y]: [f64; 2]) -> bool {
        match self {
            Self::Circle { radius, center } => {
                (x - center[0]).hypot(y - center[1]) <= radius * (1.0 + BOUNDARY_TOLERANCE)
            }
            Self::Ellipse { semi_axes, angle, center } => {
                let (s, c) = angle.sin_cos();
                let (dx, dy) = (x - center[0], y - center[1]);
                let along = [c * dx + s * dy, c * dy - s * dx];
                (along[0] / semi_axes[0]).hypot(along[1] / semi_axes[1]) <= 1.0 + BOUNDARY_TOLERANCE
            }
            Self::Polygon { vertices } => in_polygon(vertices, [x, y]),
        }
    }

    /// Enclosed area, mm2.
    pub fn area(&self) -> f64 {
        match self {
            Self::Circle { radius, .. } => PI * radius * radius,
            Self::Ellipse { semi_axes: [a, b], .. } => PI * a * b,
            Self::Polygon { vertices } => {
                let next = vertices.iter().cycle().skip(1);
                let twice: f64 = vertices.iter().zip(next).map(|(a, b)| a[0] * b[1] - a[1] * b[0]).sum();
                0.5 * twice.abs()
            }
        }
    }

    /// Smallest and largest coordinates along x and y.
    pub fn extent(&self) -> [[f64; 2]; 2] {
        match self {
            Self::Circle { radius, center } => center.map(|c| [c - radius, c + radius]),
            Self::Ellipse { semi_axes: [a, b], angle, center } => {
                let (s, c) = angle.sin_cos();
                let reach = [(a * c).hypot(b * s), (a * s).hypot(b * c)];
                [0, 1].map(|k| [center[k] - reach[k], center[k] + reach[k]])
            }
            Self::Polygon { vertices } => [0, 1].map(|k| bounds(vertices.iter().map(|v| v[k]))),
        }
    }

    /// Box that contains all points for which [`Self::contains`] holds.
    fn box_around(&self) -> [[f64; 2]; 2] {
        let [x, y] = self.extent();
        let largest = x.iter().chain(&y).fold(0.0_f64, |most, end| most.max(end.abs()));
        let margin = 10.0 * BOUNDARY_TOLERANCE * (x[1] - x[0] + y[1] - y[0]) + 1e-12 * largest;
        [x, y].map(|[low, high]| [low - margin, high + margin])
    }
}

impl ContactFrame {
    /// Retains the cells of a grid whose centres lie inside `outline` or on it, with their grid positions.
    ///
    /// # Errors
    /// If the outline is not admissible, no cell lies inside, or the frame is no whole grid.
    pub fn clipped_to(mut self, outline: &Outline) -> Result<Self> {
        outline.check()?;
        if self.whole_grid().is_none() {
            return Err(Error::input("an outline needs a complete grid frame"));
        }
        let box_around = outline.box_around();
        let in_box = |x: [f64; 2]| (0..2).all(|k| (box_around[k][0]..=box_around[k][1]).contains(&x[k]));
        let is_inside = |cell: usize| {
            let x = self.plane_coordinates(cell);
            in_box(x) && outline.contains(x)
        };
        let inside: Vec<bool> = (0..self.n_cells()).into_par_iter().map(is_inside).collect();
        if !inside.contains(&true) {
            return Err(Error::input(
                "no cell of the frame has its centre inside the outline: the outline lies outside the frame, or is smaller than a cell",
            ));
        }
        if inside.contains(&false) {
            let places = (0..inside.len()).filter(|&place| inside[place]).collect();
            self = self.select(&inside);
            self.grid_indices = Some(places);
        }
        Ok(self)
    }
}

fn finite(values: &[f64]) -> Result<()> {
    match values.iter().find(|value| !value.is_finite()) {
        Some(bad) => Err(Error::input(format!("{bad} must be a finite number"))),
        None => Ok(()),
    }
}

fn check_polygon(vertices: &[[f64; 2]]) -> Result<()> {
    let n = vertices.len();
    if n > MAX_VERTICES {
        return Err(Error::input(format!(
            "the polygon has {n} vertices; at most {MAX_VERTICES} are allowed"
        )));
    }
    if n < 3 {
        return Err(Error::input(format!("a polygon needs at least 3 vertices, but this one has {n}")));
    }
    finite(vertices.as_flattened())?;
    let edge = |i: usize| [vertices[i], vertices[(i + 1) % n]];
    if let Some(i) = (0..n).find(|&i| edge(i)[0] == edge(i)[1]) {
        return Err(Error::input(format!(
            "the vertices {} and {} are the same point: remove one (the polygon is closed automatically)",
            i + 1,
            (i + 1) % n + 1
        )));
    }
    for i in 0..n {
        for j in i + 1..n {
            let neighbours = j == i + 1 || (i == 0 && j == n - 1);
            let crosses = if neighbours { folds_back(edge(i), edge(j)) } else { meet(edge(i), edge(j)) };
            if crosses {
                return Err(Error::input(format!(
                    "the polygon crosses or touches itself: edges {} and {} (from vertex {} and vertex {}) meet",
                    i + 1,
                    j + 1,
                    i + 1,
                    j + 1
                )));
            }
        }
    }
    Ok(())
}

/// Twice the signed area of the triangle a, b, c; 0 within rounding.
fn turn(a: [f64; 2], b: [f64; 2], c: [f64; 2]) -> f64 {
    let (first, second) = ((b[0] - a[0]) * (c[1] - a[1]), (b[1] - a[1]) * (c[0] - a[0]));
    let size = (b[0] - a[0]).hypot(b[1] - a[1]) * (c[0] - a[0]).hypot(c[1] - a[1]);
    if (first - second).abs() <= 1e-14 * size { 0.0 } else { first - second }
}

/// Whether `c`, on the line through a and b, lies between them.
fn between([a, b]: [[f64; 2]; 2], c: [f64; 2]) -> bool {
    (0..2).all(|k| c[k] >= a[k].min(b[k]) && c[k] <= a[k].max(b[k]))
}

fn meet(p: [[f64; 2]; 2], q: [[f64; 2]; 2]) -> bool {
    let sides =
        [turn(p[0], p[1], q[0]), turn(p[0], p[1], q[1]), turn(q[0], q[1], p[0]), turn(q[0], q[1], p[1])];
    if sides[0] * sides[1] < 0.0 && sides[2] * sides[3] < 0.0 {
        return true;
    }
    let on = |side: f64, segment: [[f64; 2]; 2], point: [f64; 2]| side == 0.0 && between(segment, point);
    on(sides[0], p, q[0]) || on(sides[1], p, q[1]) || on(sides[2], q, p[0]) || on(sides[3], q, p[1])
}

/// Whether two edges with a common vertex overlap.
fn folds_back(p: [[f64; 2]; 2], q: [[f64; 2]; 2]) -> bool {
    let (common, a, b) = if p[1] == q[0] { (p[1], p[0], q[1]) } else { (p[0], p[1], q[0]) };
    let along = (a[0] - common[0]) * (b[0] - common[0]) + (a[1] - common[1]) * (b[1] - common[1]);
    turn(common, a, b) == 0.0 && along > 0.0
}

/// Whether a point lies in a polygon or on its border, by the parity of the number of edges to its right.
fn in_polygon(vertices: &[[f64; 2]], [x, y]: [f64; 2]) -> bool {
    let n = vertices.len();
    let mut inside = false;
    for i in 0..n {
        let (a, b) = (vertices[i], vertices[(i + 1) % n]);
        let edge = [b[0] - a[0], b[1] - a[1]];
        let length = edge[0].hypot(edge[1]);
        let share = ((x - a[0]) * edge[0] + (y - a[1]) * edge[1]) / (length * length);
        let foot = [0, 1].map(|k| a[k] + share.clamp(0.0, 1.0) * edge[k]);
        if (x - foot[0]).hypot(y - foot[1]) <= BOUNDARY_TOLERANCE * length {
            return true;
        }
        if (a[1] > y) != (b[1] > y) && x < a[0] + edge[0] * (y - a[1]) / edge[1] {
            inside = !inside;
        }
    }
    inside
}

#[cfg(test)]
mod tests {
    use super::*;

    fn area(outline: &Outline) -> f64 {
        let frame = ContactFrame::grid([2.0, 2.0], [200, 200], [5.0, 1.0], 0.3).unwrap();
        frame.clipped_to(outline).unwrap().areas.iter().sum()
    }

    /// Truth: the cells inside an outline have the area of the outline. Tolerance 3e-3: error of counting cells, with
    /// at least 30 cells along a radius or semi-axis. The tolerance of the L-shaped polygon is 0.02.
    #[test]
    fn cells_fill_the_outline() {
        let circle = Outline::Circle { radius: 1.5, center: [0.2, -0.1] };
        assert!((area(&circle) / (PI * 2.25) - 1.0).abs() < 3e-3 && circle.area() == PI * 2.25);
        let ellipse = Outline::Ellipse { semi_axes: [1.7, 0.6], angle: 0.5, center: [0.0, 0.1] };
        assert!((area(&ellipse) / (PI * 1.7 * 0.6) - 1.0).abs() < 3e-3 && ellipse.area() == PI * 1.7 * 0.6);
        let vertices = vec![[-1.0, -1.0], [-1.0, 1.5], [0.0, 1.5], [0.0, 0.5], [1.5, 0.5], [1.5, -1.0]];
        let letter = Outline::Polygon { vertices };
        assert!((area(&letter) / (1.0 * 2.5 + 1.5 * 1.5) - 1.0).abs() < 0.02 && letter.area() == 4.75);
        assert_eq!(letter.extent(), [[-1.0, 1.5], [-1.0, 1.5]]);
        let [x, y] = ellipse.extent();
        let on = (0..1000).map(|i| {
            let (s, c) = (f64::from(i) * std::f64::consts::TAU / 1000.0).sin_cos();
            let (sin, cos) = 0.5f64.sin_cos();
            [cos * 1.7 * c - sin * 0.6 * s, 0.1 + sin * 1.7 * c + cos * 0.6 * s]
        });
        let reach = on.fold([0.0f64; 2], |reach, p| [reach[0].max(p[0]), reach[1].max(p[1])]);
        assert!((x[1] - reach[0]).abs() < 1e-4 && (y[1] - reach[1]).abs() < 1e-4, "{x:?} {y:?} {reach:?}");
    }

    /// Truth: mirror images of a cell on the border are both inside or both outside the outline.
    #[test]
    fn lines_through_centres_are_symmetric() {
        let frame = ContactFrame::grid([1.0, 1.0], [10, 10], [0.0, 0.0], 0.0).unwrap();
        // The outlines pass through cell centres.
        for outline in [
            Outline::Circle { radius: 0.3_f64.hypot(0.5), center: [0.0, 0.0] },
            Outline::Polygon { vertices: vec![[-0.5, -0.5], [0.5, -0.5], [0.5, 0.5], [-0.5, 0.5]] },
        ] {
            let kept = frame.clone().clipped_to(&outline).unwrap();
            let mean = kept.centers.iter().sum::<crate::geometry::Point>();
            assert!(mean.norm() < 1e-12, "{outline:?} {mean}");
            assert!(kept.n_cells().is_multiple_of(4) && kept.n_cells() >= 24, "{}", kept.n_cells());
            assert!(kept.edge_cells().iter().all(|rim| !rim), "the outline is no rim");
        }
        let wide = frame.clone().clipped_to(&Outline::Circle { radius: 1.2, center: [0.0, 0.0] }).unwrap();
        assert!(wide.edge_cells().contains(&true), "the grid's edge is one");
    }

    /// Truth: each inadmissible outline is an error that names the wrong value, edges or vertices by number, or the outline's size.
    #[test]
    fn nonsense_is_refused() {
        let refused = |outline: Outline, word: &str| {
            let frame = ContactFrame::grid([1.0, 1.0], [4, 4], [0.0, 0.0], 0.0).unwrap();
            let error = frame.clipped_to(&outline).expect_err("refused");
            assert!(error.message().contains(word), "{error}");
        };
        let polygon = |vertices: &[[f64; 2]]| Outline::Polygon { vertices: vertices.to_vec() };
        refused(Outline::Circle { radius: -1.0, center: [0.0; 2] }, "radius -1");
        refused(Outline::Circle { radius: 0.01, center: [0.0; 2] }, "smaller than a cell");
        refused(
            Outline::Ellipse { semi_axes: [1.0, f64::NAN], angle: 0.0, center: [0.0; 2] },
            "semi-axis NaN",
        );
        refused(polygon(&[[0.0, 0.0], [1.0, 0.0]]), "3 vertices");
        refused(polygon(&[[0.0, 0.0], [1.0, 0.0], [1.0, 0.0], [0.0, 1.0]]), "2 and 3 are the same");
        refused(polygon(&[[0.0, 0.0], [1.0, 0.0], [0.0, 1.0], [0.0, 0.0]]), "4 and 1 are the same");
        refused(polygon(&[[0.0, 0.0], [1.0, 1.0], [1.0, 0.0], [0.0, 1.0]]), "edges 1 and 3");
        refused(polygon(&[[0.0, 0.0], [1.0, 0.0], [0.5, 0.0]]), "edges 1 and 2");
        refused(polygon(&[[-0.5, 0.0], [0.5, 0.0], [0.5, 0.5], [0.0, 0.0], [-0.5, 0.5]]), "edges 1 and 3");
    }
}
