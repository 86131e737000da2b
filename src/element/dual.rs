//! Dual numbers: values with their derivatives with respect to the three reference coordinates.

use std::ops::{Add, Div, Mul, Neg, Sub};

#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Dual {
    pub value: f64,
    pub gradient: [f64; 3],
}

impl Dual {
    /// Reference coordinates of a point, whose gradients are the unit vectors.
    pub fn coordinates(xi: [f64; 3]) -> [Self; 3] {
        std::array::from_fn(|i| {
            let mut gradient = [0.0; 3];
            gradient[i] = 1.0;
            Self { value: xi[i], gradient }
        })
    }

    fn combine(value: f64, (a, x): (f64, Self), (b, y): (f64, Self)) -> Self {
        Self { value, gradient: std::array::from_fn(|i| a * x.gradient[i] + b * y.gradient[i]) }
    }

    /// The number itself, or `least` with zero gradient if the value is smaller than `least`.
    pub fn at_least(self, least: f64) -> Self {
        if self.value < least { Self { value: least, gradient: [0.0; 3] } } else { self }
    }
}

impl Add for Dual {
    type Output = Self;
    fn add(self, y: Self) -> Self {
        Self::combine(self.value + y.value, (1.0, self), (1.0, y))
    }
}

impl Sub for Dual {
    type Output = Self;
    fn sub(self, y: Self) -> Self {
        Self::combine(self.value - y.value, (1.0, self), (-1.0, y))
    }
}

impl Mul for Dual {
    type Output = Self;
    fn mul(self, y: Self) -> Self {
        Self::combine(self.value * y.value, (y.value, self), (self.value, y))
    }
}

impl Div for Dual {
    type Output = Self;
    fn div(self, y: Self) -> Self {
        let value = self.value / y.value;
        Self::combine(value, (1.0 / y.value, self), (-value / y.value, y))
    }
}

impl Neg for Dual {
    type Output = Self;
    fn neg(self) -> Self {
        self * -1.0
    }
}

impl Add<f64> for Dual {
    type Output = Self;
    fn add(self, y: f64) -> Self {
        Self { value: self.value + y, ..self }
    }
}

impl Sub<f64> for Dual {
    type Output = Self;
    fn sub(self, y: f64) -> Self {
        Self { value: self.value - y, ..self }
    }
}

impl Mul<f64> for Dual {
    type Output = Self;
    fn mul(self, y: f64) -> Self {
        Self { value: self.value * y, gradient: self.gradient.map(|g| g * y) }
    }
}

pub(super) fn one_minus(x: Dual) -> Dual {
    -x + 1.0
}

/// Quadratic shape function on the line [-1, 1] at `x`, for the node at -1, 0 or 1.
pub(super) fn quadratic(x: Dual, node: f64) -> Dual {
    if node == 0.0 { one_minus(x * x) } else { (x + node) * x * 0.5 }
}

/// Shape functions of the 6-node triangle (0,0), (1,0), (0,1): corners, then the middle nodes of the edges 0-1, 1-2, 2-0.
pub(super) fn triangle6(x: Dual, y: Dual) -> [Dual; 6] {
    let o = one_minus(x + y);
    let corner = |l: Dual| l * (l * 2.0 - 1.0);
    [corner(o), corner(x), corner(y), o * x * 4.0, x * y * 4.0, y * o * 4.0]
}
