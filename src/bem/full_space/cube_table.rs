//! Field of a point force in a full space by polynomials over directions.

use nalgebra::{Matrix3, Vector3};
use rayon::prelude::*;

use super::barnett::BarnettField;
use crate::bem::green_tensor::GreenTensor;
use crate::cancel;
use crate::error::Result;
use crate::linalg::simd::wide;
use crate::material::voigt_to_tensor;

/// Total degree of the polynomials of a patch.
const DEGREE: usize = 10;

/// Their number.
const TERMS: usize = (DEGREE + 1) * (DEGREE + 2) / 2;

/// Nodes along a side of a patch at which it is fitted: two more than its polynomials need show what they leave out.
const NODES: usize = DEGREE + 3;

/// Entries of a direction: U (xx, yy, zz, yz, xz, xy) and its derivatives along the second and third axis, and two zeros that fill
/// wide registers.
const PADDED_LEN: usize = 20;

/// Of them, those that are not zero.
const N_ENTRIES: usize = 18;

/// Halvings of the side of a cube's face, at most.
const MOST_HALVINGS: u32 = 7;

/// Wanted error, over the largest entry.
const ERROR: f64 = 1e-9;

/// Directions in which a table is compared with the integrals.
const COMPARED: usize = 2048;

/// Rows and columns of the entries of a symmetric matrix.
const SYMMETRIC: [(usize, usize); 6] = [(0, 0), (1, 1), (2, 2), (1, 2), (0, 2), (0, 1)];

type Entries = [f64; PADDED_LEN];

/// The field on three faces of a cube about the force, each divided into patches until polynomials on them suffice.
///
/// On the face x_a = 1 the coordinates are (x_b, x_c), b and c following a; U being of degree -1 and even, ∂U of degree -2
/// and odd in x, three faces suffice for all points, and x·∂U = -U gives the derivative along a.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct CubeTable {
    /// Squares along a side of a face that the smallest patches fill.
    squares: usize,
    /// Patch of each square, `[3, squares, squares]`.
    patch_of: Vec<u32>,
    patches: Vec<ChebyshevPatch>,
    /// Largest difference from the integrals, over the largest entry.
    error: f64,
}

/// Chebyshev polynomials on a square of a face.
#[derive(Debug, Clone, PartialEq)]
struct ChebyshevPatch {
    middle: [f64; 2],
    /// 1 over half of its side.
    inverse_half_side: f64,
    /// Of T_i(u) T_j(v), i + j up to the degree, `[TERMS]`.
    coefficients: Vec<Entries>,
}

/// A square that is to be covered.
#[derive(Clone, Copy)]
struct FaceSquare {
    face: usize,
    level: u32,
    place: [usize; 2],
}

fn entries(field: &GreenTensor, face: usize) -> Entries {
    let parts = [&field.value, &field.gradient[(face + 1) % 3], &field.gradient[(face + 2) % 3]];
    std::array::from_fn(|k| if k < N_ENTRIES { parts[k / 6][SYMMETRIC[k % 6]] } else { 0.0 })
}

/// The point of a face with such coordinates.
fn on_face(face: usize, [u, v]: [f64; 2]) -> Vector3<f64> {
    let mut x = Vector3::zeros();
    (x[face], x[(face + 1) % 3], x[(face + 2) % 3]) = (1.0, u, v);
    x
}

/// T_0 to T_DEGREE at `u`.
#[inline(always)]
fn chebyshev(u: f64) -> [f64; DEGREE + 1] {
    let mut values = [1.0; DEGREE + 1];
    values[1] = u;
    for k in 2..=DEGREE {
        values[k] = 2.0 * u * values[k - 1] - values[k - 2];
    }
    values
}

/// Chebyshev nodes in [-1, 1].
fn node(k: usize) -> f64 {
    (std::f64::consts::PI * (k as f64 + 0.5) / NODES as f64).cos()
}

impl FaceSquare {
    /// Its middle and half of its side.
    fn extent(&self) -> ([f64; 2], f64) {
        let half = 1.0 / f64::from(1 << self.level);
        (self.place.map(|k| -1.0 + half * (2 * k + 1) as f64), half)
    }

    fn quarters(&self) -> [Self; 4] {
        [[0, 0], [1, 0], [0, 1], [1, 1]].map(|which| Self {
            face: self.face,
            level: self.level + 1,
            place: [0, 1].map(|c| 2 * self.place[c] + which[c]),
        })
    }
}

impl ChebyshevPatch {
    /// Fitted to the integrals, and the largest difference from them at the nodes, of displacement and derivatives.
    fn fitted(square: &FaceSquare, integrals: &BarnettField) -> Result<(Self, [f64; 2])> {
        cancel::check()?;
        let (middle, half) = square.extent();
        let nodes: Vec<[f64; 2]> = (0..NODES * NODES).map(|k| [node(k / NODES), node(k % NODES)]).collect();
        let sample = |[s, t]: &[f64; 2]| {
            let x = on_face(square.face, [middle[0] + half * s, middle[1] + half * t]);
            Ok(entries(&integrals.at(&x)?, square.face))
        };
        let samples = nodes.iter().map(sample).collect::<Result<Vec<Entries>>>()?;
        let mut coefficients = vec![[0.0; PADDED_LEN]; TERMS];
        for ([s, t], sample) in nodes.iter().zip(&samples) {
            let (along, across) = (chebyshev(*s), chebyshev(*t));
            let mut term = 0;
            for (i, along) in along.iter().enumerate() {
                for (j, across) in across[..=DEGREE - i].iter().enumerate() {
                    let twice = f64::from(1 << (u8::from(i > 0) + u8::from(j > 0)));
                    let weight = along * across * twice / (NODES * NODES) as f64;
                    let sums = coefficients[term].iter_mut().zip(sample);
                    sums.for_each(|(sum, value)| *sum += weight * value);
                    term += 1;
                }
            }
        }
        let patch = Self { middle, inverse_half_side: 1.0 / half, coefficients };
        let mut apart = [0.0_f64; 2];
        for ([s, t], sample) in nodes.iter().zip(&samples) {
            let mut found = [0.0; PADDED_LEN];
            weigh(&patch.coefficients, *s, *t, &mut found);
            for (k, (found, wanted)) in found.iter().zip(sample).enumerate() {
                let part = &mut apart[usize::from(k >= 6)];
                *part = part.max((found - wanted).abs());
            }
        }
        Ok((patch, apart))
    }
}

impl CubeTable {
    /// A table whose error is about 1e-9; larger only where the smallest patches do not suffice.
    ///
    /// # Errors
    /// If the integrals do not converge, or a stop is wished.
    pub(super) fn new(integrals: &BarnettField) -> Result<Self> {
        let compared: Vec<(Vector3<f64>, GreenTensor)> = (1..=COMPARED)
            .into_par_iter()
            .map(|k| {
                // The R2 sequence of the plastic number on the sphere.
                let [a, b] =
                    [0.754_877_666_246_692_8, 0.569_840_290_998_053_3].map(|step| step * k as f64 % 1.0);
                let (height, angle) = (1.0 - 2.0 * b, 2.0 * std::f64::consts::PI * a);
                let rho = (1.0 - height * height).sqrt();
                let x = Vector3::new(rho * angle.cos(), rho * angle.sin(), height);
                Ok((x, integrals.at(&x)?))
            })
            .collect::<Result<_>>()?;
        let fields = compared.iter().map(|(_, field)| [field.value.amax(), field.max_gradient()]);
        let size = fields.fold([0.0_f64; 2], |size, field| [0, 1].map(|k| size[k].max(field[k])));
        let (mut squares, mut patches, mut covered) = (Vec::new(), Vec::new(), Vec::new());
        squares.extend((0..3).map(|face| FaceSquare { face, level: 0, place: [0; 2] }));
        while !squares.is_empty() {
            let fitted = squares
                .par_iter()
                .map(|square| Ok((*square, ChebyshevPatch::fitted(square, integrals)?)))
                .collect::<Result<Vec<_>>>()?;
            squares.clear();
            for (square, (patch, apart)) in fitted {
                let error = (apart[0] / size[0]).max(apart[1] / size[1]);
                if error > ERROR && square.level < MOST_HALVINGS {
                    squares.extend(square.quarters());
                } else {
                    patches.push(patch);
                    covered.push(square);
                }
            }
        }
        let mut table = Self::of(patches, &covered);
        table.error = table.measure_error(&compared, size);
        Ok(table)
    }

    /// The table of patches that cover these squares.
    fn of(patches: Vec<ChebyshevPatch>, covered: &[FaceSquare]) -> Self {
        let halvings = covered.iter().map(|square| square.level).max().unwrap_or(0);
        let squares = 1 << halvings;
        let mut patch_of = vec![0; 3 * squares * squares];
        for (patch, square) in covered.iter().enumerate() {
            let side = 1 << (halvings - square.level);
            for i in 0..side {
                let row = square.face * squares + square.place[0] * side + i;
                let first = row * squares + square.place[1] * side;
                patch_of[first..first + side].fill(patch as u32);
            }
        }
        Self { squares, patch_of, patches, error: 0.0 }
    }

    /// Largest difference from the integrals, over the largest entries.
    fn measure_error(&self, wanted: &[(Vector3<f64>, GreenTensor)], size: [f64; 2]) -> f64 {
        let apart = wanted.iter().map(|(x, wanted)| {
            let found = self.at(x);
            let value = (found.value - wanted.value).amax() / size[0];
            value.max(found.max_gradient_difference(wanted) / size[1])
        });
        apart.fold(0.0, f64::max)
    }

    /// Largest difference found from the integrals, over the largest entry.
    pub(super) fn error(&self) -> f64 {
        self.error
    }

    /// What a table is restored from: the error, the halvings, and of each patch face, halvings, place and coefficients.
    pub(super) fn values(&self) -> Vec<f64> {
        let mut values = vec![self.error];
        for (index, patch) in self.patches.iter().enumerate() {
            let first = self.patch_of.iter().position(|&of| of as usize == index).unwrap_or(0);
            let face = first / (self.squares * self.squares);
            values.extend([face as f64, patch.inverse_half_side, patch.middle[0], patch.middle[1]]);
            values.extend(patch.coefficients.iter().flat_map(|entries| &entries[..N_ENTRIES]));
        }
        values
    }

    /// The table of such values; `None` if they are none of a table.
    pub(super) fn from_values(values: &[f64]) -> Option<Self> {
        let (&error, rest) = values.split_first()?;
        let of_patch = rest.chunks_exact(4 + TERMS * N_ENTRIES);
        if !of_patch.remainder().is_empty() {
            return None;
        }
        let (mut patches, mut covered, mut area) = (Vec::new(), Vec::new(), 0.0);
        for values in of_patch {
            let &[face, inverse_half_side, u, v] = &values[..4] else { return None };
            let level = (0..=MOST_HALVINGS).find(|k| f64::from(1 << k) == inverse_half_side)?;
            let place = [u, v].map(|middle| ((middle + 1.0) * inverse_half_side - 1.0) / 2.0);
            let inside = |k: f64| k.fract() == 0.0 && (0.0..inverse_half_side).contains(&k);
            if ![0.0, 1.0, 2.0].contains(&face) || !place.into_iter().all(inside) {
                return None;
            }
            covered.push(FaceSquare { face: face as usize, level, place: place.map(|k| k as usize) });
            area += 1.0 / (inverse_half_side * inverse_half_side);
            let coefficients = values[4..].chunks_exact(N_ENTRIES).map(|used| {
                let mut entries = [0.0; PADDED_LEN];
                entries[..N_ENTRIES].copy_from_slice(used);
                entries
            });
            patches.push(ChebyshevPatch {
                middle: [u, v],
                inverse_half_side,
                coefficients: coefficients.collect(),
            });
        }
        (area == 3.0).then(|| Self { error, ..Self::of(patches, &covered) })
    }

    /// The field at a point other than the origin.
    #[inline]
    pub(super) fn at(&self, x: &Vector3<f64>) -> GreenTensor {
        let face = x.iamax();
        let (b, c) = ((face + 1) % 3, (face + 2) % 3);
        let inverse = 1.0 / x[face];
        let (u, v) = (x[b] * inverse, x[c] * inverse);
        let half = 0.5 * self.squares as f64;
        let square = |u: f64| (((u + 1.0) * half) as usize).min(self.squares - 1);
        let place = (face * self.squares + square(u)) * self.squares + square(v);
        let patch = &self.patches[self.patch_of[place] as usize];
        let mut sums = [0.0; PADDED_LEN];
        let [s, t] = [
            (u - patch.middle[0]) * patch.inverse_half_side,
            (v - patch.middle[1]) * patch.inverse_half_side,
        ];
        weigh(&patch.coefficients, s, t, &mut sums);
        let matrix =
            |part: usize, factor: f64| voigt_to_tensor(&std::array::from_fn(|k| factor * sums[6 * part + k]));
        let slope = inverse * inverse.abs();
        let value = matrix(0, inverse.abs());
        let mut gradient = [Matrix3::zeros(); 3];
        (gradient[b], gradient[c]) = (matrix(1, slope), matrix(2, slope));
        gradient[face] = (value + gradient[b] * x[b] + gradient[c] * x[c]) * -inverse;
        GreenTensor { value, gradient }
    }
}

/// The sums of the polynomials of a patch at (s, t) in [-1, 1]².
fn weigh(coefficients: &[Entries], s: f64, t: f64, sums: &mut Entries) {
    wide!(weigh_inline(
        coefficients => coefficients: &[Entries], s => s: f64, t => t: f64, sums => sums: &mut Entries
    ))
}

#[inline(always)]
fn weigh_inline(coefficients: &[Entries], s: f64, t: f64, sums: &mut Entries) {
    let (along, across) = (chebyshev(s), chebyshev(t));
    let mut total = [0.0; PADDED_LEN];
    let mut terms = coefficients.iter();
    for (i, along) in along.iter().enumerate() {
        for (across, term) in across[..=DEGREE - i].iter().zip(&mut terms) {
            let weight = along * across;
            (0..PADDED_LEN).for_each(|k| total[k] += weight * term[k]);
        }
    }
    *sums = total;
}
