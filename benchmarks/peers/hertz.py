"""Test case of all programs, and the errors of a result against the exact solution.

A rigid paraboloid of radius 10 mm is pressed on a half-space of steel (E = 210 GPa, nu = 0.3) with 1000 N without
friction. The frame is a square of n x n cells, twice as wide as the contact. Lengths are in mm, forces in N.
"""

import math

import numpy as np

YOUNG, POISSON, RADIUS, FORCE = 210e3, 0.3, 10.0, 1000.0
REDUCED = YOUNG / (1 - POISSON**2)
CONTACT_RADIUS = (3 * FORCE * RADIUS / (4 * REDUCED)) ** (1 / 3)
APPROACH = CONTACT_RADIUS**2 / RADIUS
PEAK = 3 * FORCE / (2 * math.pi * CONTACT_RADIUS**2)
WIDTH = 4 * CONTACT_RADIUS
TOLERANCE = 1e-8


def centers(n):
    """Coordinates x, y of the cell centres, both [n, n]."""
    x = ((np.arange(n) + 0.5) / n - 0.5) * WIDTH
    return np.meshgrid(x, x, indexing="ij")


def gap(n):
    """Gap of the undeformed surfaces, [n, n]."""
    x, y = centers(n)
    return (x**2 + y**2) / (2 * RADIUS)


def love(n):
    """Normal displacements around a cell under unit pressure (Love 1929), [2n, 2n]. The indices are offsets from the
    cell, modulo 2n.
    """
    h = WIDTH / n
    d = np.fft.fftfreq(2 * n, 1 / (2 * n)) * h
    x, y = np.meshgrid(d, d, indexing="ij")

    def corner(x, y):
        r = np.hypot(x, y)
        return x * np.arcsinh(y / np.abs(x)) + y * np.arcsinh(x / np.abs(y)) + 0 * r

    a = h / 2
    total = corner(x + a, y + a) - corner(x - a, y + a) - corner(x + a, y - a) + corner(x - a, y - a)
    return total / (math.pi * REDUCED)


def natural_residual(pressure):
    """Natural residual max |p - max(0, p - g / S_ii)| / p_max. g is the gap, and S_ii the displacement of a cell by
    its own unit pressure. The approach in g is the mean, over the cells with pressure, of elastic displacement plus
    undeformed gap.
    """
    n = pressure.shape[0]
    kernel = love(n)
    padded = np.zeros((2 * n, 2 * n))
    padded[:n, :n] = pressure
    elastic = np.fft.irfft2(np.fft.rfft2(padded) * np.fft.rfft2(kernel), s=(2 * n, 2 * n))[:n, :n]
    total = elastic + gap(n)
    open_gap = total - total[pressure > 0].mean()
    return np.abs(pressure - np.maximum(0, pressure - open_gap / kernel[0, 0])).max() / pressure.max()


def errors(pressure):
    """Relative errors of force, contact area, peak pressure, approach and pressure (L2), and the natural residual."""
    n = pressure.shape[0]
    x, y = centers(n)
    cell = (WIDTH / n) ** 2
    exact = PEAK * np.sqrt(np.maximum(0, 1 - (x**2 + y**2) / CONTACT_RADIUS**2))
    kernel = love(n)
    padded = np.zeros((2 * n, 2 * n))
    padded[:n, :n] = pressure
    elastic = np.fft.irfft2(np.fft.rfft2(padded) * np.fft.rfft2(kernel), s=(2 * n, 2 * n))[:n, :n]
    approach = (elastic + gap(n))[pressure > 0].mean()
    return {
        "force": pressure.sum() * cell / FORCE - 1,
        "approach": approach / APPROACH - 1,
        "area": (pressure > 0).sum() * cell / (math.pi * CONTACT_RADIUS**2) - 1,
        "peak": pressure.max() / PEAK - 1,
        "l2": np.linalg.norm(pressure - exact) / np.linalg.norm(exact),
        "residual": natural_residual(pressure),
    }
