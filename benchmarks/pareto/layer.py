"""Reference solution of the benchmark's layer: a sphere, treated as elastic half-space, on an elastic layer bonded to
a rigid base.

    python3 benchmarks/pareto/layer.py            (needs numpy)

The contact is frictionless, and the layer is laterally infinite. p^(k) is the Hankel transform of order 0 of the
pressure. The surfaces approach each other by

    u(r) = 2/E* int_0^oo g(k) p^(k) J0(kr) dk,        g(k) = (G(kh) E* / E1* + E* / E2*),        1/E* = 1/E1* + 1/E2*.

E1* belongs to the layer, E2* to the half-space. For a bonded layer of thickness h (Hayes, Keer, Herrmann and
Mockros 1972; Johnson, Contact Mechanics, 1985, section 5.8),

    G(y) = (2 K sinh 2y - 4 y) / (2 K cosh 2y + 4 y^2 + 1 + K^2),        K = 3 - 4 nu.

Substitute p^(k) = int_0^a phi(t) cos(kt) dt and u = d - r^2 / 2R in r < a. Abel's integral then gives (Lebedev and
Ufliand 1958 for the punch)

    phi(x) + (2/pi) int_0^a M(x, t) phi(t) dt = E*/pi (d - x^2 / R),        M = int_0^oo (g(k) - 1) cos kx cos kt dk.

The condition phi(a) = 0 determines the contact radius a for a given approach d. The force is 2 pi int phi, and the
peak pressure is -int phi'(t) / t dt. phi is even and smooth, and is approximated by a polynomial in x^2 through
Gauss points. Gauss quadrature integrates the kernel until g - 1 is below 1e-16.

Checks: the table of a flat punch, Hertz for a thick layer, and doubling the resolution (none of nine digits
changes).

The benchmark's layer is a block of finite half-width W. Between free and clamped sides, the force differs by 1.6e-5
for W = 4 mm (used here), and by 1.2e-4 for W = 3 mm. The sides act like image forces. At the distance 2 W of the
first images, a force moves the surface of the layer by less than 1e-6 of the approach.
"""

import numpy as np
from numpy.polynomial import chebyshev
from numpy.polynomial.legendre import leggauss


def bonded(y, nu):
    """G(y), without overflow."""
    kappa, e = 3 - 4 * nu, np.exp(-2 * y)
    above = kappa * (1 - e * e) - 4 * y * e
    return above / (kappa * (1 + e * e) + (4 * y * y + 1 + kappa**2) * e)


class Layer:
    """Frictionless contact of a half-space with a bonded layer."""

    def __init__(self, modulus, other, nu, thickness, fineness=1):
        """modulus, other: E / (1 - nu^2) of the layer and of the half-space, MPa (np.inf: rigid). thickness: thickness
        of the layer, mm. fineness: factor of the numbers of quadrature points and of unknowns.
        """
        self.combined = 1 / (1 / modulus + 1 / other)
        self.share = self.combined / modulus
        self.nu, self.thickness = nu, thickness
        pieces, per_piece = 25 * fineness, 16
        x, w = leggauss(per_piece)
        ends = np.linspace(0, 25 / thickness, pieces + 1)
        half, middle = np.diff(ends) / 2, (ends[1:] + ends[:-1]) / 2
        self.k = (middle[:, None] + half[:, None] * x).ravel()
        weight = (half[:, None] * w).ravel()
        self.weight = weight * self.share * (bonded(self.k * thickness, nu) - 1)
        self.order = 20 * fineness

    def solve(self, a, rights):
        """Gauss points from 0 to a, their weights, and phi for the given right-hand sides."""
        x, w = leggauss(2 * self.order)
        x, w = a * x[self.order:], a * w[self.order:]
        cosines = np.cos(np.outer(x, self.k))
        matrix = np.eye(self.order) + (2 / np.pi) * (cosines * self.weight) @ (cosines.T * w)
        return x, w, np.linalg.solve(matrix, np.stack([right(x) for right in rights], axis=1))

    def fit(self, a, x, phi):
        """Chebyshev series of phi in x / a. Its odd coefficients vanish."""
        both, values = np.concatenate([-x[::-1], x]) / a, np.concatenate([phi[::-1], phi])
        return chebyshev.chebfit(both, values, 2 * (self.order // 2))

    def sphere_of_radius(self, a, radius):
        """(approach, force, peak pressure) at contact radius a."""
        unit = lambda x: np.full_like(x, self.combined / np.pi)
        bowl = lambda x: -self.combined / np.pi * x**2 / radius
        x, w, phi = self.solve(a, [unit, bowl])
        at_edge = [chebyshev.chebval(1.0, self.fit(a, x, phi[:, i])) for i in range(2)]
        approach = -at_edge[1] / at_edge[0]
        whole = approach * phi[:, 0] + phi[:, 1]
        slope = chebyshev.chebder(self.fit(a, x, whole)) / a
        peak = -np.sum(w * chebyshev.chebval(x / a, slope) / x)
        return approach, 2 * np.pi * np.sum(w * whole), peak

    def sphere(self, approach, radius):
        """(contact radius, force, peak pressure) at a given approach."""
        # Secant method. It starts from the contact radius of a half-space, and from 0.8 times this radius.
        ends = [np.sqrt(approach * radius), 0.8 * np.sqrt(approach * radius)]
        errors = [self.sphere_of_radius(a, radius)[0] - approach for a in ends]
        while abs(ends[1] - ends[0]) > 1e-12 * ends[1] and errors[1] != errors[0]:
            ends = [ends[1], ends[1] - errors[1] * (ends[1] - ends[0]) / (errors[1] - errors[0])]
            errors = [errors[1], self.sphere_of_radius(ends[1], radius)[0] - approach]
        return (ends[1], *self.sphere_of_radius(ends[1], radius)[1:])

    def punch(self, a):
        """Force on a flat punch of radius a, divided by 2 E* a times the approach."""
        _, w, phi = self.solve(a, [lambda x: np.full_like(x, 1.0)])
        return np.sum(w * phi[:, 0]) / a

    def point(self, r):
        """Displacement of the layer's surface at the distance r from a unit force."""
        x, w = leggauss(400)
        k = 12.5 / self.thickness * (x + 1)
        w = 12.5 / self.thickness * w
        angle = np.pi * (np.arange(400) + 0.5) / 400
        bessel = np.array([np.mean(np.cos(ki * r * np.sin(angle))) for ki in k])
        layer = np.sum(w * (bonded(k * self.thickness, self.nu) - 1) * bessel) + 1 / r
        return self.share * layer / (np.pi * self.combined)


def main():
    nu, thickness, radius, approach = 0.3, 1.0, 10.0, 0.02
    modulus = 210e3 / (1 - nu**2)
    for width, known in [(0.5, 1.624025), (1.0, 2.483525)]:
        found = Layer(modulus, np.inf, nu, 1.0).punch(width)
        print(f"flat punch, a/h = {width}: {found:.6f}, table {known}")
        assert abs(found - known) < 2e-6
    a, force, peak = Layer(modulus, np.inf, nu, 1000.0).sphere(approach, radius)
    hertz = 4 / 3 * modulus * np.sqrt(radius) * approach**1.5
    top = 2 * modulus * a / (np.pi * radius)
    print(f"thick layer: force over Hertz's {force / hertz:.6f}, peak over that of its contact radius {peak / top:.8f}")
    assert abs(force / hertz - 1) < 1e-3 and abs(peak / top - 1) < 1e-6
    for name, other in [("rigid sphere", np.inf), ("steel sphere", modulus)]:
        for fineness in [1, 2]:
            pair = Layer(modulus, other, nu, thickness, fineness)
            a, force, peak = pair.sphere(approach, radius)
            print(f"{name}, fineness {fineness}: a {a:.10f} mm, force {force:.8f} N, peak {peak:.8f} MPa")
        share = [force * pair.point(2 * width) / approach for width in (3, 4, 5)]
        print("    images of the sides at 2 W for W = 3, 4, 5 mm, over the approach:", *(f"{s:.1e}" for s in share))


if __name__ == "__main__":
    main()
