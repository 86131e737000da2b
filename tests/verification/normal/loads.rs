//! Surface displacements under uniform pressure and shear, against closed forms on discs and rectangles. Cases are those of the
//! catalogue (docs/verification.md).

use std::f64::consts::PI;

use nalgebra::Matrix3;
use orthowear::bem::half_space::integrals::polygon;
use orthowear::bem::half_space::{CrossBlocks, FftFlexibility, PatchIntegrator, Side, SurfaceGreen};
use orthowear::flexibility::Flexibility;
use orthowear::material::Stiffness;

use crate::common::{relative, steel};
use crate::crystals::cfrp_of_tables;

const SHEAR: f64 = 210e3 / 2.6;
const NU: f64 = 0.3;

fn green(stiffness: &Stiffness) -> SurfaceGreen {
    SurfaceGreen::new(stiffness, Side::Lower).expect("a converged Green's function")
}

/// Displacements at `target` due to unit tractions on a disc of radius `a`. Regular polygons approximate the disc. Their error is
/// a series in the square of the angle of a side. Two steps of Richardson extrapolation remove the first two terms.
fn disc(green: &SurfaceGreen, a: f64, target: [f64; 2]) -> Matrix3<f64> {
    let [coarse, fine, finest] = [500, 1000, 2000].map(|sides| {
        // With these angles, targets on the x axis lie on an axis of symmetry of the polygon.
        let angle = |k: usize| 2.0 * PI * (k as f64 + 0.5) / sides as f64;
        let corners: Vec<[f64; 2]> = (0..sides).map(|k| [a * angle(k).cos(), a * angle(k).sin()]).collect();
        polygon::integrate(green, &corners, target)
    });
    let (once, twice) = ((fine * 4.0 - coarse) / 3.0, (finest * 4.0 - fine) / 3.0);
    (twice * 16.0 - once) / 15.0
}

/// Truth: case `load-uniform-disc`, the displacement under a uniform pressure on a disc (Johnson 1985, 3.4). The tolerance is
/// 1e-9, because published values have 10 digits and extrapolated polygons are accurate to 1e-11.
#[test]
fn displacement_under_a_disc() {
    let green = green(&steel());
    for (x, published) in [(0.0, 0.001733333333), (1.0, 0.001619306793), (4.0, 0.000448340368)] {
        let found = 100.0 * disc(&green, 2.0, [x, 0.0])[(2, 2)];
        assert!(relative(found, published) < 1e-9, "{x}: {found} {published}");
    }
    // For a target on the edge, the error of polygons with sides h decreases only as h² ln h.
    let edge = 100.0 * disc(&green, 2.0, [2.0, 0.0])[(2, 2)];
    assert!(relative(edge, 0.001103474272) < 1e-5, "{edge}");
}

/// Truth: case `load-uniform-disc`, the mean displacement 16 p a / (3 pi E*) of a disc of radius a under the pressure p. A disc
/// of cells agrees to 5e-3, as in the catalogue. In case `aniso-uniform-disc` the centre moves by p a <H33>, to 1e-8 on the exact
/// disc and to 1e-3 on cells. <H33> is the mean over all directions of 2 pi r u, with the normal displacement u at the distance r
/// from a unit force.
#[test]
fn discs_of_cells_and_of_cfrp() {
    let (a, n) = (2.0, 200);
    let h = 2.4 * a / n as f64;
    let place = |i: usize| (i as f64 + 0.5 - n as f64 / 2.0) * h;
    let inside: Vec<f64> =
        (0..n * n).map(|k| f64::from(u8::from(place(k / n).hypot(place(k % n)) < a))).collect();
    let count: f64 = inside.iter().sum();
    let field = |material: &Stiffness| {
        let operator =
            FftFlexibility::new([n, n], [h, h], &green(material), CrossBlocks::Keep).expect("made");
        let mut gap = vec![0.0; n * n];
        operator.apply_normal(&inside, &mut gap);
        gap
    };
    let gap = field(&steel());
    let mean = gap.iter().zip(&inside).map(|(g, i)| g * i).sum::<f64>() / count;
    assert!(relative(100.0 * mean, 0.001471299029) < 5e-3, "{mean}");
    let published = 0.003663079204;
    let exact = 10.0 * disc(&green(&cfrp_of_tables()), a, [0.0, 0.0])[(2, 2)];
    assert!(relative(exact, published) < 1e-8, "{exact}");
    let gap = field(&cfrp_of_tables());
    let middle = n / 2 * n + n / 2;
    let center = [middle, middle - 1, middle - n, middle - n - 1].map(|k| gap[k]).iter().sum::<f64>() / 4.0;
    assert!(relative(10.0 * center, published) < 1e-3, "{center}");
}

/// Displacements (u_x, u_y) at a corner of an a x b rectangle under unit shear traction along x (Cerruti's solution, integrated;
/// Johnson 1985, 3.6).
fn cerruti_corner(a: f64, b: f64) -> [f64; 2] {
    let k1 = a * (b / a).asinh() + b * (a / b).asinh();
    let k2 = b * (a / b).asinh();
    let k3 = a + b - a.hypot(b);
    [((1.0 - NU) * k1 + NU * k2) / (2.0 * PI * SHEAR), NU * k3 / (2.0 * PI * SHEAR)]
}

/// Truth: case `load-tangential-rectangle`: [`cerruti_corner`], to 1e-12 of the displacement along the traction.
#[test]
fn shear_on_rectangles_is_cerruti() {
    let green = green(&steel());
    let integrator = PatchIntegrator::new(&green);
    for (a, b) in [(4.0, 4.0), (8.0, 2.0), (2.0, 8.0), (1.0, 30.0)] {
        let corners = [[0.0, 0.0], [a, 0.0], [a, b], [0.0, b]];
        let corner = cerruti_corner(a, b);
        let center = 4.0 * cerruti_corner(a / 2.0, b / 2.0)[0];
        for found in
            [polygon::integrate(&green, &corners, [0.0, 0.0]), integrator.polygon(&corners, [0.0, 0.0])]
        {
            assert!(relative(found[(0, 0)], corner[0]) < 1e-12, "{a} x {b}");
            assert!((found[(1, 0)] - corner[1]).abs() < 1e-12 * corner[0], "{a} x {b}: {}", found[(1, 0)]);
        }
        let middle = polygon::integrate(&green, &corners, [a / 2.0, b / 2.0]);
        assert!(relative(middle[(0, 0)], center) < 1e-12, "{a} x {b}");
        let rectangle = integrator.rectangle([a, b], [0.0, 0.0]);
        assert!(relative(rectangle[(0, 0)], center) < 1e-12, "{a} x {b}");
        // A traction along y on an a x b rectangle acts as a traction along x on a b x a rectangle.
        assert!(relative(rectangle[(1, 1)], 4.0 * cerruti_corner(b / 2.0, a / 2.0)[0]) < 1e-12, "{a} x {b}");
        assert!(rectangle[(1, 0)].abs() < 1e-14 * center);
    }
}

/// Truth: case `load-tangential-rectangle`, at a distance r along the force Q on a square of side L. Cerruti's kernel is (1 - nu)
/// / s + nu x² / s³ at the distance s. On the line of the force, its Laplacian is (1 - 2 nu) / r³. The second moments of the
/// square therefore give u_x = Q / (2 pi G r) (1 + (1 - 2 nu) L² / (24 r²)). The next term is of order (L / r)⁴. The tolerance is
/// 1e-10 at r = 1e3 and 1e6 sides, where cancellation makes the closed form for edges inaccurate.
#[test]
fn shear_far_away_does_not_cancel() {
    let integrator = PatchIntegrator::new(&green(&steel()));
    for r in [1e3, 1e6] {
        let expected = (1.0 + (1.0 - 2.0 * NU) / (24.0 * r * r)) / (2.0 * PI * SHEAR * r);
        let found = integrator.rectangle([1.0, 1.0], [r, 0.0])[(0, 0)];
        assert!(relative(found, expected) < 1e-10, "{r}: {found} {expected}");
    }
}

/// Truth: case `hertz-circular`, without a contact solution. Inside the contact radius a, Hertz's pressure of peak p0 moves the
/// surface by delta - r² / 2R. Outside, the displacement is p0 / (2 a E*) ((2a² - r²) asin(a / r) + a sqrt(r² - a²)). The
/// tolerance is 1e-3 of delta, as in the catalogue. Within a cell of the edge it is 2e-3, because a constant pressure
/// approximates a square root.
#[test]
fn hertz_pressure_gives_hertz_displacement() {
    let (a, delta, p0, radius, modulus) = (0.3191252, 0.01018409, 4688.341, 10.0, 210e3 / 0.91);
    let outside = |r: f64| {
        p0 / (2.0 * a * modulus) * ((2.0 * a * a - r * r) * (a / r).asin() + a * (r * r - a * a).sqrt())
    };
    assert!(relative(outside(2.0 * a), 0.002220086) < 1e-6);
    let n = 80;
    let h = a / 16.0;
    let middle = |i: usize| (i as f64 + 0.5 - n as f64 / 2.0) * h;
    let points = |i: usize| (0..20).map(move |k| middle(i) + ((f64::from(k) + 0.5) / 20.0 - 0.5) * h);
    let mean = |cell: usize| -> f64 {
        let at = |x: f64, y: f64| (1.0 - (x * x + y * y) / (a * a)).max(0.0).sqrt();
        points(cell / n).map(|x| points(cell % n).map(|y| at(x, y)).sum::<f64>()).sum::<f64>() * p0 / 400.0
    };
    let pressure: Vec<f64> = (0..n * n).map(mean).collect();
    let operator = FftFlexibility::new([n, n], [h, h], &green(&steel()), CrossBlocks::Keep).expect("made");
    let mut gap = vec![0.0; n * n];
    operator.apply_normal(&pressure, &mut gap);
    for (cell, found) in gap.iter().enumerate() {
        let r = middle(cell / n).hypot(middle(cell % n));
        let wanted = if r <= a { delta - r * r / (2.0 * radius) } else { outside(r) };
        let tolerance = if (r - a).abs() < h { 2e-3 } else { 1e-3 };
        assert!((found - wanted).abs() < tolerance * delta, "{}: {found} {wanted}", r / a);
    }
}
