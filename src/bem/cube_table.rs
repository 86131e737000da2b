//! Table of the displacement field G(x) of a unit force at the origin. On the faces of a cube around the force,
//! piecewise polynomials of the direction approximate the field.

use nalgebra::{Matrix3, Vector3};
use rayon::prelude::*;

use crate::bem::green_tensor::GreenTensor;
use crate::cancel;
use crate::error::Result;
use crate::linalg::cache::{Cache, CacheKey, CacheKeyBuilder, CacheLookup};
use crate::linalg::simd::wide;
use crate::material::{Stiffness, voigt_to_tensor};

/// Version of the table's contents. Increase with every change of the contents or of their arithmetic.
const FORMAT: u64 = 4;

pub(super) const CACHE_EXTENSION: &str = "directions";

/// Total degree of the polynomials of a patch.
const DEGREE: usize = 10;

const TERMS: usize = (DEGREE + 1) * (DEGREE + 2) / 2;

/// Number of fitting nodes along a side of a patch. `DEGREE` + 1 nodes suffice for the fit. With one more node, the
/// residuals show the truncation error.
const NODES: usize = DEGREE + 2;

/// Maximum number of halvings of the side of a cube face.
const MOST_HALVINGS: u32 = 7;

const MAX_PATCHES: usize = 1024;

/// Number of directions in which the error of a table of three faces is measured. A table that covers less or more of
/// the cube uses proportionally many.
const COMPARED: usize = 2048;

/// Number of values stored before the coefficients of a cached patch: face, level and two position indices.
const SQUARE_LEN: usize = 4;

/// Row and column of each stored entry of a matrix, in row-major order.
const GENERAL: [(usize, usize); 9] = [(0, 0), (0, 1), (0, 2), (1, 0), (1, 1), (1, 2), (2, 0), (2, 1), (2, 2)];
/// Row and column of each stored entry of a symmetric matrix: xx, yy, zz, yz, xz, xy.
const SYMMETRIC: [(usize, usize); 6] = [(0, 0), (1, 1), (2, 2), (1, 2), (0, 2), (0, 1)];

/// Number of stored values per direction for symmetric G: three times 6 entries, and two zeros for SIMD alignment.
pub(super) const SYMMETRIC_LEN: usize = 20;

/// Number of stored values per direction for unsymmetric G: three times 9 entries, and one zero for SIMD alignment.
pub(super) const GENERAL_LEN: usize = 28;

/// Symmetry of the field under changes of sign of the coordinates. The table stores the field for only one direction of
/// each set of equivalent directions.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum DirectionSymmetry {
    /// Inversion of a full space: G(-x) = G(x).
    Inversion,
    /// Reflections of a half-space z <= 0 across the planes x = 0 and y = 0. `true` marks a plane of material symmetry.
    Planes([bool; 2]),
}

/// Field of a unit force at the centre of a cube, approximated by polynomials on square patches of the cube's faces.
///
/// On a face normal to axis a, the face coordinates are x_b / |x_a| and x_c / |x_a|. The axes b and c follow a in
/// cyclic order. The table stores G and its derivatives along b and c. The derivative along a follows from x·∂G = -G,
/// because G is homogeneous of degree -1.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct CubeTable<const LEN: usize> {
    symmetry: DirectionSymmetry,
    /// Ratio of the side of a face to the side of the smallest patch.
    squares: usize,
    /// Index of the patch that covers each square of the smallest size, `[6, squares, squares]`.
    patch_of: Vec<u32>,
    patches: Vec<ChebyshevPatch<LEN>>,
    /// Estimated relative error: the largest of the measured differences from the integrals and of the error estimates
    /// of the integrals. The differences are relative to the largest displacement or gradient entry.
    error: f64,
}

#[derive(Debug, Clone, PartialEq)]
struct ChebyshevPatch<const LEN: usize> {
    square: FaceSquare,
    middle: [f64; 2],
    inverse_half_side: f64,
    /// Coefficients of the products T_i(s) T_j(t) of Chebyshev polynomials with i + j up to the degree, `[TERMS]`. The
    /// patch is the square -1 <= s, t <= 1.
    coefficients: Vec<[f64; LEN]>,
}

/// One of the 2^level x 2^level squares of a face. Face a lies at x_a = 1 and face a + 3 at x_a = -1, for a = 0, 1, 2.
#[derive(Debug, Clone, Copy, PartialEq)]
struct FaceSquare {
    face: usize,
    level: u32,
    place: [usize; 2],
}

pub(super) fn cache_key(kind: &str, stiffness: &Stiffness) -> CacheKey {
    let mut hash = CacheKeyBuilder::new(&format!("{kind} {FORMAT}"));
    hash.update(stiffness.voigt().as_slice(), |value| value.to_le_bytes());
    hash.finish()
}

/// Directions spread evenly over the sphere by the R2 low-discrepancy sequence. The steps of this sequence are powers
/// of the inverse plastic number.
fn spread_directions() -> impl Iterator<Item = Vector3<f64>> {
    (1..).map(|k| {
        let [a, b] = [0.754_877_666_246_692_8, 0.569_840_290_998_053_3].map(|step| step * f64::from(k) % 1.0);
        let (height, angle) = (1.0 - 2.0 * b, 2.0 * std::f64::consts::PI * a);
        let rho = (1.0 - height * height).sqrt();
        Vector3::new(rho * angle.cos(), rho * angle.sin(), height)
    })
}

fn components<const LEN: usize>() -> &'static [(usize, usize)] {
    if LEN == SYMMETRIC_LEN { &SYMMETRIC } else { &GENERAL }
}

fn entries<const LEN: usize>(field: &GreenTensor, axis: usize) -> [f64; LEN] {
    let parts = [&field.value, &field.gradient[(axis + 1) % 3], &field.gradient[(axis + 2) % 3]];
    let used = parts.iter().flat_map(|part| components::<LEN>().iter().map(|&place| part[place]));
    let mut entries = [0.0; LEN];
    entries.iter_mut().zip(used).for_each(|(entry, value)| *entry = value);
    entries
}

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

impl DirectionSymmetry {
    /// Factors ±1 of the coordinates that map the point `x` to the equivalent point in the table. `axis` is the axis of
    /// the largest coordinate of `x`.
    #[inline]
    fn signs(self, x: &Vector3<f64>, axis: usize) -> Vector3<f64> {
        let sign = |folds: bool, x: f64| if folds { 1.0_f64.copysign(x) } else { 1.0 };
        match self {
            Self::Inversion => Vector3::repeat(sign(true, x[axis])),
            Self::Planes([across_x, across_y]) => Vector3::new(sign(across_x, x.x), sign(across_y, x.y), 1.0),
        }
    }

    /// Whether a table with this symmetry covers `square`, which must have at most half the side of a face.
    fn covers(self, square: &FaceSquare) -> bool {
        let x = square.point([0.0; 2]);
        match self {
            Self::Inversion => square.face < 3,
            Self::Planes(mirrors) => x.z < 0.0 && (0..2).all(|axis| !mirrors[axis] || x[axis] > 0.0),
        }
    }

    /// All quarter faces that a table with this symmetry covers.
    fn squares(self) -> impl Iterator<Item = FaceSquare> {
        let faces = (0..6).map(|face| FaceSquare { face, level: 0, place: [0; 2] });
        faces.flat_map(|face| face.quarters()).filter(move |square| self.covers(square))
    }
}

impl FaceSquare {
    /// Centre and half side of the square.
    fn extent(&self) -> ([f64; 2], f64) {
        let half = 1.0 / f64::from(1 << self.level);
        (self.place.map(|k| -1.0 + half * (2 * k + 1) as f64), half)
    }

    /// Point at the coordinates (s, t) of the square. The corners of the square have s, t = ±1.
    fn point(&self, [s, t]: [f64; 2]) -> Vector3<f64> {
        let ([u, v], half) = self.extent();
        let (axis, mut x) = (self.face % 3, Vector3::zeros());
        x[axis] = if self.face < 3 { 1.0 } else { -1.0 };
        (x[(axis + 1) % 3], x[(axis + 2) % 3]) = (u + half * s, v + half * t);
        x
    }

    fn quarters(&self) -> [Self; 4] {
        [[0, 0], [1, 0], [0, 1], [1, 1]].map(|which| Self {
            face: self.face,
            level: self.level + 1,
            place: [0, 1].map(|c| 2 * self.place[c] + which[c]),
        })
    }
}

impl<const LEN: usize> ChebyshevPatch<LEN> {
    fn new(square: FaceSquare, coefficients: Vec<[f64; LEN]>) -> Self {
        let (middle, half) = square.extent();
        Self { square, middle, inverse_half_side: 1.0 / half, coefficients }
    }

    /// Fits the polynomials of a patch to the integrals at the fitting nodes. Returns the patch, the largest residuals
    /// of displacement and of derivatives, and the largest error estimate of the integrals.
    fn fitted(
        square: FaceSquare,
        integral: &impl Fn(&Vector3<f64>) -> Result<(GreenTensor, f64)>,
    ) -> Result<(Self, [f64; 2], f64)> {
        cancel::check()?;
        let nodes: Vec<[f64; 2]> = (0..NODES * NODES).map(|k| [node(k / NODES), node(k % NODES)]).collect();
        let (mut samples, mut uncertainty) = (Vec::with_capacity(nodes.len()), 0.0_f64);
        for node in &nodes {
            let (field, error) = integral(&square.point(*node))?;
            samples.push(entries::<LEN>(&field, square.face % 3));
            uncertainty = uncertainty.max(error);
        }
        let mut coefficients = vec![[0.0; LEN]; TERMS];
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
        let patch = Self::new(square, coefficients);
        let mut apart = [0.0_f64; 2];
        for ([s, t], sample) in nodes.iter().zip(&samples) {
            let mut found = [0.0; LEN];
            weigh(&patch.coefficients, *s, *t, &mut found);
            for (k, (found, wanted)) in found.iter().zip(sample).enumerate() {
                let part = &mut apart[usize::from(k >= components::<LEN>().len())];
                *part = part.max((found - wanted).abs());
            }
        }
        Ok((patch, apart, uncertainty))
    }
}

impl<const LEN: usize> CubeTable<LEN> {
    /// Computes a table with an error of about `tolerance`. The error is larger if the integrals are inaccurate, or if
    /// `MAX_PATCHES` or `MOST_HALVINGS` ends the refinement. The error is measured in evenly spread directions and in
    /// the directions `others`. `integral` returns the field and an estimate of its relative error.
    ///
    /// # Errors
    /// If `integral` fails, or if the run is cancelled.
    pub(super) fn new(
        symmetry: DirectionSymmetry,
        tolerance: f64,
        others: impl Iterator<Item = Vector3<f64>>,
        integral: impl Fn(&Vector3<f64>) -> Result<(GreenTensor, f64)> + Sync,
    ) -> Result<Self> {
        let mut squares: Vec<FaceSquare> = symmetry.squares().collect();
        let below = |x: Vector3<f64>| match symmetry {
            DirectionSymmetry::Inversion => x,
            DirectionSymmetry::Planes(_) => Vector3::new(x.x, x.y, -x.z.abs()),
        };
        let spread = spread_directions().take(COMPARED * squares.len() / 12).map(below);
        let compared = (spread.chain(others).collect::<Vec<_>>().into_par_iter())
            .map(|x| Ok((x, integral(&x)?.0)))
            .collect::<Result<Vec<(Vector3<f64>, GreenTensor)>>>()?;
        let fields = compared.iter().map(|(_, field)| [field.value.amax(), field.max_gradient()]);
        let size = fields.fold([0.0_f64; 2], |size, field| [0, 1].map(|k| size[k].max(field[k])));
        let (mut patches, mut at_nodes) = (Vec::new(), 0.0_f64);
        while !squares.is_empty() {
            let fitted = squares
                .par_iter()
                .map(|&square| {
                    let (patch, apart, uncertainty) = ChebyshevPatch::fitted(square, &integral)?;
                    Ok(((apart[0] / size[0]).max(apart[1] / size[1]), uncertainty, patch))
                })
                .collect::<Result<Vec<_>>>()?;
            squares.clear();
            let (mut divided, kept): (Vec<_>, Vec<_>) =
                fitted.into_iter().partition(|(error, uncertainty, patch)| {
                    *error > tolerance.max(*uncertainty) && patch.square.level < MOST_HALVINGS
                });
            divided.sort_by(|a, b| b.0.total_cmp(&a.0));
            let room = MAX_PATCHES.saturating_sub(patches.len() + kept.len() + divided.len()) / 3;
            let rest = divided.split_off(room.min(divided.len()));
            squares.extend(divided.iter().flat_map(|(.., patch)| patch.square.quarters()));
            for (error, uncertainty, patch) in kept.into_iter().chain(rest) {
                at_nodes = at_nodes.max(error).max(uncertainty);
                patches.push(patch);
            }
        }
        let mut table = Self::of(symmetry, patches, 0.0);
        table.error = table.measure_error(&compared, size).max(at_nodes);
        Ok(table)
    }

    /// Reads the table from a cache, or computes it and writes it to the cache. Also returns a warning for a damaged
    /// cache entry or a failed write.
    ///
    /// # Errors
    /// If `compute` fails, or if memory does not suffice.
    pub(super) fn load_or_compute(
        kind: &str,
        stiffness: &Stiffness,
        symmetry: DirectionSymmetry,
        cache: Option<&Cache>,
        compute: impl FnOnce() -> Result<Self>,
    ) -> Result<(Self, Option<String>)> {
        let Some(cache) = cache else { return Ok((compute()?, None)) };
        let key = cache_key(kind, stiffness);
        let damage = match cache.read_list(&key, CACHE_EXTENSION)? {
            CacheLookup::Hit(values) => match Self::from_values(symmetry, &values) {
                Some(table) => return Ok((table, None)),
                None => Some("its shape is wrong".to_owned()),
            },
            CacheLookup::Miss => None,
            CacheLookup::Damaged(how) => Some(how),
        };
        let table = compute()?;
        let written = cache.write_list(&key, CACHE_EXTENSION, &table.values());
        let note = damage.map(|how| {
            format!("the field of a point force in the cache was damaged ({how}); it was computed again")
        });
        Ok((table, note.or(written.err().map(|error| error.to_string()))))
    }

    fn of(symmetry: DirectionSymmetry, patches: Vec<ChebyshevPatch<LEN>>, error: f64) -> Self {
        let halvings = patches.iter().map(|patch| patch.square.level).max().unwrap_or(0);
        let squares = 1 << halvings;
        let mut patch_of = vec![0; 6 * squares * squares];
        for (index, patch) in patches.iter().enumerate() {
            let FaceSquare { face, level, place } = patch.square;
            let side = 1 << (halvings - level);
            for i in 0..side {
                let first = (face * squares + place[0] * side + i) * squares + place[1] * side;
                patch_of[first..first + side].fill(index as u32);
            }
        }
        Self { symmetry, squares, patch_of, patches, error }
    }

    fn measure_error(&self, wanted: &[(Vector3<f64>, GreenTensor)], size: [f64; 2]) -> f64 {
        let apart = wanted.iter().map(|(x, wanted)| {
            let found = self.at(x);
            let value = (found.value - wanted.value).amax() / size[0];
            value.max(found.max_gradient_difference(wanted) / size[1])
        });
        apart.fold(0.0, f64::max)
    }

    pub(super) fn error(&self) -> f64 {
        self.error
    }

    /// Serialised table: the error, then face, level, position and coefficients of each patch.
    pub(super) fn values(&self) -> Vec<f64> {
        let mut values = vec![self.error];
        for patch in &self.patches {
            let FaceSquare { face, level, place: [i, j] } = patch.square;
            values.extend([face as f64, f64::from(level), i as f64, j as f64]);
            values.extend(patch.coefficients.iter().flat_map(|entries| &entries[..Self::used()]));
        }
        values
    }

    /// Number of stored values per coefficient, without the zeros for SIMD alignment.
    fn used() -> usize {
        3 * components::<LEN>().len()
    }

    /// Inverse of [`Self::values`]; `None` if the values do not form a table.
    pub(super) fn from_values(symmetry: DirectionSymmetry, values: &[f64]) -> Option<Self> {
        let (&error, rest) = values.split_first()?;
        let of_patch = rest.chunks_exact(SQUARE_LEN + TERMS * Self::used());
        if !of_patch.remainder().is_empty() {
            return None;
        }
        let (mut patches, mut area) = (Vec::new(), 0.0);
        for values in of_patch {
            let level = (1..=MOST_HALVINGS).find(|&level| f64::from(level) == values[1])?;
            let whole = |k: usize, end: usize| (0..end).find(|&whole| whole as f64 == values[k]);
            let place = [whole(2, 1 << level)?, whole(3, 1 << level)?];
            let square = FaceSquare { face: whole(0, 6)?, level, place };
            if !symmetry.covers(&square) {
                return None;
            }
            area += 4.0 / f64::from(1 << (2 * level));
            let coefficients = values[SQUARE_LEN..].chunks_exact(Self::used()).map(|used| {
                let mut entries = [0.0; LEN];
                entries[..Self::used()].copy_from_slice(used);
                entries
            });
            patches.push(ChebyshevPatch::new(square, coefficients.collect()));
        }
        (area == symmetry.squares().count() as f64).then(|| Self::of(symmetry, patches, error))
    }

    /// Field at a point other than the origin.
    #[inline]
    pub(super) fn at(&self, x: &Vector3<f64>) -> GreenTensor {
        debug_assert_eq!(LEN == SYMMETRIC_LEN, self.symmetry == DirectionSymmetry::Inversion);
        let axis = x.iamax();
        let signs = self.symmetry.signs(x, axis);
        let x = x.component_mul(&signs);
        let (b, c) = ((axis + 1) % 3, (axis + 2) % 3);
        let inverse = 1.0 / x[axis].abs();
        let (u, v) = (x[b] * inverse, x[c] * inverse);
        let half = 0.5 * self.squares as f64;
        let square = |u: f64| (((u + 1.0) * half) as usize).min(self.squares - 1);
        let face = if x[axis] < 0.0 { axis + 3 } else { axis };
        let place = (face * self.squares + square(u)) * self.squares + square(v);
        let patch = &self.patches[self.patch_of[place] as usize];
        let mut sums = [0.0; LEN];
        let [s, t] = [
            (u - patch.middle[0]) * patch.inverse_half_side,
            (v - patch.middle[1]) * patch.inverse_half_side,
        ];
        weigh(&patch.coefficients, s, t, &mut sums);
        let pairs = signs * signs.transpose();
        let matrix = |part: usize, factor: f64| {
            if LEN == SYMMETRIC_LEN {
                // All signs of an inversion are equal, so their products are 1.
                voigt_to_tensor(&std::array::from_fn(|k| factor * sums[6 * part + k]))
            } else {
                Matrix3::from_fn(|i, k| factor * pairs[(i, k)] * sums[9 * part + 3 * i + k])
            }
        };
        let slope = inverse * inverse;
        let value = matrix(0, inverse);
        let mut gradient = [Matrix3::zeros(); 3];
        (gradient[b], gradient[c]) = (matrix(1, slope * signs[b]), matrix(2, slope * signs[c]));
        let across = gradient[b] * (x[b] * signs[b]) + gradient[c] * (x[c] * signs[c]);
        gradient[axis] = (value + across) * (-signs[axis] / x[axis]);
        GreenTensor { value, gradient }
    }
}

/// Evaluates the polynomials of a patch at (s, t) in [-1, 1]².
fn weigh<const LEN: usize>(coefficients: &[[f64; LEN]], s: f64, t: f64, sums: &mut [f64; LEN]) {
    wide!(weigh_inline<LEN>(
        coefficients => coefficients: &[[f64; LEN]], s => s: f64, t => t: f64, sums => sums: &mut [f64; LEN]
    ))
}

#[inline(always)]
fn weigh_inline<const LEN: usize>(coefficients: &[[f64; LEN]], s: f64, t: f64, sums: &mut [f64; LEN]) {
    let (along, across) = (chebyshev(s), chebyshev(t));
    let mut total = [0.0; LEN];
    let mut terms = coefficients.iter();
    for (i, along) in along.iter().enumerate() {
        for (across, term) in across[..=DEGREE - i].iter().zip(&mut terms) {
            let weight = along * across;
            // Groups of four entries let the compiler keep all sums in registers.
            for (sums, entries) in total.as_chunks_mut::<4>().0.iter_mut().zip(term.as_chunks::<4>().0) {
                (0..4).for_each(|k| sums[k] += weight * entries[k]);
            }
        }
    }
    *sums = total;
}
