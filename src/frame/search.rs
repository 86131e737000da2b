//! Uniform bins that answer which faces may lie over a cell.

/// Rectangle [low, high] in the plane.
pub(super) type Extent = [[f64; 2]; 2];

/// Extent of some points.
pub(super) fn extent(points: impl Iterator<Item = [f64; 2]>) -> Extent {
    points.fold([[f64::INFINITY; 2], [f64::NEG_INFINITY; 2]], |[low, high], x| {
        [std::array::from_fn(|k: usize| low[k].min(x[k])), std::array::from_fn(|k: usize| high[k].max(x[k]))]
    })
}

/// Items sorted into square bins, about one item per bin.
pub(super) struct Bins {
    low: [f64; 2],
    side: f64,
    shape: [usize; 2],
    starts: Vec<usize>,
    items: Vec<usize>,
    extents: Vec<Extent>,
}

impl Bins {
    /// Sorts items with the given extents.
    pub(super) fn new(extents: Vec<Extent>) -> Self {
        let whole = extent(extents.iter().flatten().copied());
        let sides: [f64; 2] = std::array::from_fn(|k| (whole[1][k] - whole[0][k]).max(0.0));
        let n = extents.len().max(1) as f64;
        let side = (sides[0] * sides[1] / n).sqrt().max(sides[0].max(sides[1]) / n).max(f64::MIN_POSITIVE);
        let shape = sides.map(|s| ((s / side) as usize + 1).min(1 << 12));
        let mut bins = Self { low: whole[0], side, shape, starts: Vec::new(), items: Vec::new(), extents };
        bins.fill();
        bins
    }

    fn fill(&mut self) {
        let mut starts = vec![0; self.shape[0] * self.shape[1] + 1];
        let ranges: Vec<[[usize; 2]; 2]> = self.extents.iter().map(|e| self.range(e)).collect();
        for range in &ranges {
            self.each(range, |bin| starts[bin + 1] += 1);
        }
        for bin in 1..starts.len() {
            starts[bin] += starts[bin - 1];
        }
        let mut next = starts.clone();
        let mut items = vec![0; *starts.last().expect("at least one bin")];
        for (item, range) in ranges.iter().enumerate() {
            self.each(range, |bin| {
                items[next[bin]] = item;
                next[bin] += 1;
            });
        }
        (self.starts, self.items) = (starts, items);
    }

    /// Items whose extent meets `wanted`, ascending, left in `found`.
    pub(super) fn query(&self, wanted: &Extent, found: &mut Vec<usize>) {
        found.clear();
        self.each(&self.range(wanted), |bin| {
            found.extend(self.items[self.starts[bin]..self.starts[bin + 1]].iter().filter(|&&item| {
                let e = &self.extents[item];
                (0..2).all(|k| e[0][k] <= wanted[1][k] && e[1][k] >= wanted[0][k])
            }));
        });
        found.sort_unstable();
        found.dedup();
    }

    fn range(&self, extent: &Extent) -> [[usize; 2]; 2] {
        std::array::from_fn(|end| {
            std::array::from_fn(|k| {
                let index = ((extent[end][k] - self.low[k]) / self.side).floor();
                index.clamp(0.0, (self.shape[k] - 1) as f64) as usize
            })
        })
    }

    fn each(&self, range: &[[usize; 2]; 2], mut visit: impl FnMut(usize)) {
        for ix in range[0][0]..=range[1][0] {
            for iy in range[0][1]..=range[1][1] {
                visit(ix * self.shape[1] + iy);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Truth: comparison with every item in turn.
    #[test]
    fn finds_what_overlaps() {
        let extents: Vec<Extent> = (0..200)
            .map(|i| {
                let (x, y) = (((i * 37) % 101) as f64, ((i * 53) % 97) as f64);
                [[x, y], [x + (i % 7) as f64, y + (i % 5) as f64]]
            })
            .collect();
        let bins = Bins::new(extents.clone());
        let mut found = Vec::new();
        for wanted in
            [[[10.0, 10.0], [20.0, 30.0]], [[-5.0, -5.0], [0.0, 0.0]], [[90.0, 90.0], [300.0, 300.0]]]
        {
            bins.query(&wanted, &mut found);
            let all: Vec<usize> = (0..200)
                .filter(|&i| {
                    (0..2).all(|k| extents[i][0][k] <= wanted[1][k] && extents[i][1][k] >= wanted[0][k])
                })
                .collect();
            assert_eq!(found, all);
        }
    }
}
