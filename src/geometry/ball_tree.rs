//! Tree of bounding balls that finds the balls near a line.

use crate::geometry::Point;

const LEAF: usize = 8;

#[derive(Debug, Clone, Copy)]
pub(crate) struct Ball {
    pub(crate) center: Point,
    pub(crate) radius: f64,
}

impl Ball {
    pub(crate) fn around(points: &[Point]) -> Self {
        let center = points.iter().sum::<Point>() / points.len() as f64;
        Self { center, radius: points.iter().map(|x| (x - center).norm()).fold(0.0, f64::max) }
    }

    /// Whether the ball is at most `reach` away from the line through `start` along the unit vector `along`.
    fn meets(&self, start: &Point, along: &Point, reach: f64) -> bool {
        let arm = self.center - start;
        let across = arm - along * along.dot(&arm);
        // The margin prevents rounding from excluding balls at exactly the distance `reach`.
        across.norm() <= (self.radius + reach) * (1.0 + 1e-9)
    }
}

/// Binary tree of balls. Branches with more than `LEAF` balls are halved along the longest extent of their centres.
pub(crate) struct BallTree {
    balls: Vec<Ball>,
    order: Vec<usize>,
    branches: Vec<Branch>,
}

struct Branch {
    ball: Ball,
    items: std::ops::Range<usize>,
    children: Option<[usize; 2]>,
}

impl BallTree {
    pub(crate) fn new(balls: Vec<Ball>) -> Self {
        let mut tree = Self { order: (0..balls.len()).collect(), balls, branches: Vec::new() };
        if !tree.balls.is_empty() {
            tree.grow(0..tree.balls.len());
        }
        tree
    }

    fn grow(&mut self, items: std::ops::Range<usize>) -> usize {
        let (mut low, mut high) = (Point::repeat(f64::INFINITY), Point::repeat(f64::NEG_INFINITY));
        for &item in &self.order[items.clone()] {
            (low, high) = (low.inf(&self.balls[item].center), high.sup(&self.balls[item].center));
        }
        let center = 0.5 * (low + high);
        let reach = |item: &usize| (self.balls[*item].center - center).norm() + self.balls[*item].radius;
        let radius = self.order[items.clone()].iter().map(reach).fold(0.0, f64::max);
        let here = self.branches.len();
        self.branches.push(Branch { ball: Ball { center, radius }, items: items.clone(), children: None });
        if items.len() > LEAF {
            let axis = (high - low).imax();
            let balls = &self.balls;
            self.order[items.clone()]
                .sort_by(|&a, &b| balls[a].center[axis].total_cmp(&balls[b].center[axis]).then(a.cmp(&b)));
            let middle = items.start + items.len() / 2;
            let children = [self.grow(items.start..middle), self.grow(middle..items.end)];
            self.branches[here].children = Some(children);
        }
        here
    }

    /// Overwrites `found` with the ascending indices of the balls that are at most `reach` away from a line. The line
    /// goes through `start` along the unit vector `along`.
    pub(crate) fn query(&self, start: &Point, along: &Point, reach: f64, found: &mut Vec<usize>) {
        found.clear();
        if !self.branches.is_empty() {
            self.visit(0, &|ball| ball.meets(start, along, reach), found);
        }
        found.sort_unstable();
    }

    fn visit(&self, branch: usize, meets: &dyn Fn(&Ball) -> bool, found: &mut Vec<usize>) {
        let branch = &self.branches[branch];
        if !meets(&branch.ball) {
            return;
        }
        match branch.children {
            Some(children) => children.into_iter().for_each(|child| self.visit(child, meets, found)),
            None => {
                let items = self.order[branch.items.clone()].iter();
                found.extend(items.filter(|&&item| meets(&self.balls[item])));
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Truth: testing every ball against the line finds the same balls.
    #[test]
    fn finds_what_the_line_passes() {
        let balls: Vec<Ball> = (0..500)
            .map(|i| {
                let x = |k: usize| ((i * k) % 101) as f64;
                Ball { center: Point::new(x(37), x(53), x(71)), radius: (i % 5) as f64 }
            })
            .collect();
        let tree = BallTree::new(balls.clone());
        let mut found = Vec::new();
        for (start, along, reach) in [
            (Point::new(50.0, 50.0, 50.0), Point::new(0.0, 0.0, 1.0), 3.0),
            (Point::new(10.0, 90.0, 20.0), Point::new(0.6, 0.0, 0.8), 0.0),
            (Point::new(-500.0, 0.0, 0.0), Point::new(0.0, 1.0, 0.0), 5.0),
        ] {
            tree.query(&start, &along, reach, &mut found);
            let all: Vec<usize> = (0..500).filter(|&i| balls[i].meets(&start, &along, reach)).collect();
            assert_eq!(found, all);
        }
        BallTree::new(Vec::new()).query(&Point::zeros(), &Point::x(), 1.0, &mut found);
        assert!(found.is_empty());
    }
}
