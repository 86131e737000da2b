//! The symmetries of a rectangle of equal cells: reflections and turns by right angles about the normal through its middle.

/// One of these eight; the unmoved one among them.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct GridSymmetry {
    /// Image of (x, y), row by row; each row and each column has one entry of +1 or -1.
    matrix: [[i8; 2]; 2],
}

impl GridSymmetry {
    /// That which moves nothing.
    pub const IDENTITY: Self = Self { matrix: [[1, 0], [0, 1]] };

    /// All of them, the unmoved one first, then the reflections that leave the axes where they are.
    pub const ALL: [Self; 8] = [
        Self::IDENTITY,
        Self { matrix: [[1, 0], [0, -1]] },
        Self { matrix: [[-1, 0], [0, 1]] },
        Self { matrix: [[-1, 0], [0, -1]] },
        Self { matrix: [[0, 1], [1, 0]] },
        Self { matrix: [[0, -1], [-1, 0]] },
        Self { matrix: [[0, -1], [1, 0]] },
        Self { matrix: [[0, 1], [-1, 0]] },
    ];

    /// First `first`, then this one.
    pub fn after(self, first: Self) -> Self {
        let entry = |i: usize, j: usize| {
            self.matrix[i][0] * first.matrix[0][j] + self.matrix[i][1] * first.matrix[1][j]
        };
        Self { matrix: [0, 1].map(|i| [0, 1].map(|j| entry(i, j))) }
    }

    /// The way back.
    pub fn inverse(self) -> Self {
        let m = self.matrix;
        Self { matrix: [[m[0][0], m[1][0]], [m[0][1], m[1][1]]] }
    }

    /// -1 of reflections, else 1.
    pub fn handedness(self) -> f64 {
        let m = self.matrix.map(|row| row.map(f64::from));
        m[0][0] * m[1][1] - m[0][1] * m[1][0]
    }

    /// Image of a vector in the surface.
    pub fn apply(self, [x, y]: [f64; 2]) -> [f64; 2] {
        // A sum of one of them and a zero; not -0.
        self.matrix.map(|[a, b]| f64::from(a) * x + f64::from(b) * y + 0.0)
    }

    /// Image of a rotation or a moment (x, y, n), whose sense a reflection turns round.
    pub fn apply_axial(self, [x, y, n]: [f64; 3]) -> [f64; 3] {
        let ([x, y], hand) = (self.apply([x, y]), self.handedness());
        [hand * x, hand * y, hand * n].map(|component| component + 0.0)
    }

    /// What belongs to the image's x and y of what belongs to x and y without a sense: numbers of cells, sides.
    pub fn swap_axes<T: Copy>(self, [x, y]: [T; 2]) -> [T; 2] {
        if self.matrix[0][0] == 0 { [y, x] } else { [x, y] }
    }

    /// Of each cell of a grid of `cells` (place `ix * cells[1] + iy`) the place of its image in the image of the grid.
    pub fn cell_permutation(self, cells: [usize; 2]) -> Vec<usize> {
        let image = self.swap_axes(cells);
        // Twice the distance from the middle, in cells: whole.
        let from_middle = |i: usize, n: usize| 2.0 * i as f64 + 1.0 - n as f64;
        let index = |distance: f64, n: usize| ((distance + n as f64 - 1.0) / 2.0) as usize;
        let place = |ix: usize, iy: usize| {
            let [x, y] = self.apply([from_middle(ix, cells[0]), from_middle(iy, cells[1])]);
            index(x, image[0]) * image[1] + index(y, image[1])
        };
        (0..cells[0]).flat_map(|ix| (0..cells[1]).map(move |iy| place(ix, iy))).collect()
    }

    /// What an image is to what it is made of.
    pub fn description(self) -> &'static str {
        match self.matrix {
            [[1, 0], [0, 1]] => "the same as",
            [[1, 0], [0, -1]] => "the mirror image (y to -y) of",
            [[-1, 0], [0, 1]] => "the mirror image (x to -x) of",
            [[-1, 0], [0, -1]] => "the image by a turn of 180 degrees of",
            [[0, 1], [1, 0]] => "the mirror image (x to y) of",
            [[0, -1], [-1, 0]] => "the mirror image (x to -y) of",
            [[0, -1], [1, 0]] => "the image by a turn of 90 degrees of",
            _ => "the image by a turn of -90 degrees of",
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::Point;

    /// Truth: the group of the square: closed, with inverses, as its action on vectors says.
    #[test]
    fn the_eight_are_a_group() {
        let v = [0.3, -1.7];
        for a in GridSymmetry::ALL {
            assert_eq!(a.inverse().after(a), GridSymmetry::IDENTITY);
            for b in GridSymmetry::ALL {
                assert!(GridSymmetry::ALL.contains(&a.after(b)));
                assert_eq!(a.after(b).apply(v), a.apply(b.apply(v)));
                assert_eq!(a.after(b).handedness(), a.handedness() * b.handedness());
            }
        }
        let words: std::collections::BTreeSet<_> = GridSymmetry::ALL.map(GridSymmetry::description).into();
        assert_eq!(words.len(), 8);
    }

    /// Truth: a moment is r x F: that of the images is the image of that.
    #[test]
    fn moments_are_axial() {
        let (r, f) = (Point::new(0.4, -0.9, 0.3), Point::new(-2.0, 0.7, 1.1));
        for image in GridSymmetry::ALL {
            let of = |v: Point| {
                let [x, y] = image.apply([v.x, v.y]);
                Point::new(x, y, v.z)
            };
            let moment = of(r).cross(&of(f));
            assert!((moment - Point::from(image.apply_axial(r.cross(&f).into()))).norm() < 1e-15);
        }
    }

    /// Truth: the image of the centre of a cell is the centre of its image.
    #[test]
    fn cells_move_with_their_centres() {
        let cells = [3, 4];
        let centre = |place: usize, cells: [usize; 2]| {
            let (ix, iy) = (place / cells[1], place % cells[1]);
            [ix as f64 - 0.5 * (cells[0] as f64 - 1.0), iy as f64 - 0.5 * (cells[1] as f64 - 1.0)]
        };
        for image in GridSymmetry::ALL {
            for (place, moved) in image.cell_permutation(cells).into_iter().enumerate() {
                let wanted = image.apply(centre(place, cells));
                assert_eq!(centre(moved, image.swap_axes(cells)), wanted, "{image:?} {place}");
            }
        }
    }
}
