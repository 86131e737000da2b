"""Green's functions and flexibilities against closed-form solutions."""

import numpy as np
import pytest
from conftest import small

import orthowear

E, NU = 210e3, 0.3
STEEL = {"model": "isotropic", "E": E, "nu": NU}


def test_green_isotropic():
    """Truth: Boussinesq 1885, Cerruti 1882 (Johnson 1985, 3.2 and 3.6): point forces on the surface."""
    phi = np.array([0.0, 30.0, 90.0, 200.0])
    found = orthowear.green(STEEL, phi)
    shear = E / (2 * (1 + NU))
    c, s = np.cos(np.radians(phi)), np.sin(np.radians(phi))
    factor = 1 / (2 * np.pi * shear)
    assert found.shape == (4, 3, 3)
    assert np.allclose(found[:, 2, 2], (1 - NU) * factor, rtol=1e-12)
    assert np.allclose(found[:, 0, 0], factor * (1 - NU + NU * c**2), rtol=1e-12)
    assert np.allclose(found[:, 1, 1], factor * (1 - NU + NU * s**2), rtol=1e-12)
    assert np.allclose(found[:, 0, 1], factor * NU * c * s, rtol=0, atol=1e-12 * factor)
    # A compressive force displaces the surface towards the force.
    assert np.allclose(found[:, 0, 2], (1 - 2 * NU) / 2 * factor * c, rtol=0, atol=1e-12 * factor)


def test_green_of_a_fibre_turned_about_the_normal():
    """Truth: rotating a half-space by the azimuth rotates its Green's function."""
    cfrp = {"model": "transversely-isotropic", "E1": 140e3, "E2": 10e3, "G12": 5e3, "nu12": 0.3, "nu23": 0.4}
    turned = orthowear.green(cfrp, 50.0, tilt=20.0, azimuth=35.0)
    straight = orthowear.green(cfrp, 15.0, tilt=20.0)
    c, s = np.cos(np.radians(35.0)), np.sin(np.radians(35.0))
    turn = np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]])
    assert np.allclose(turned, turn @ straight @ turn.T, rtol=1e-10, atol=1e-12 * abs(turned).max())


def test_flexibility_of_a_square():
    """Truth: Love 1929: uniform pressure p on a square of side a displaces its centre by 4 ln(1 + sqrt 2) (1 - nu^2) p a / (pi E).
    """
    operator = orthowear.Scene.from_dict(small()).flexibility()
    n = operator.shape[0] // 3
    pressure = np.zeros((n, 3))
    cell, side = 7 * 16 + 7, 0.05
    pressure[cell, 2] = 1.0
    exact = 4 * np.log(1 + np.sqrt(2)) * (1 - NU**2) * side / (np.pi * E)
    assert operator.apply(pressure)[cell, 2] == pytest.approx(exact, rel=1e-9)


def test_flexibility_is_symmetric_and_positive():
    """Truth: the flexibility is symmetric (Betti's theorem) and positive definite (elastic energy). The flexibility of
    both bodies is the sum of the flexibilities of each body.
    """
    scene = orthowear.Scene.from_dict(small()).replace(
        {"frame.cells": [6, 6], "body2": {"kind": "half-space", "material": "steel"}}
    )
    both = scene.flexibility().to_dense()
    assert np.allclose(both, both.T, rtol=0, atol=1e-12 * abs(both).max())
    assert np.linalg.eigvalsh(both).min() > 0
    parts = [scene.flexibility(body).to_dense() for body in (1, 2)]
    assert np.allclose(both, parts[0] + parts[1], rtol=0, atol=1e-12 * abs(both).max())


def test_flexibility_gives_the_gap_of_a_run(scene):
    """Truth: the gap is the sphere r^2 / 2 R minus the approach, plus the elastic change S P by the tractions P."""
    result = scene.run()
    operator = scene.flexibility()
    x, y = result.xy.T
    sphere = (x**2 + y**2) / (2 * 10.0)
    approach = operator.apply(result.tractions)[:, 2] + sphere - result.gap[:, 2]
    assert np.allclose(approach, result.entries[-1]["approach"], rtol=1e-6)


def test_wrong_shapes_and_sizes(scene):
    """Truth: the message names the allowed shape, size or material parameter."""
    operator = scene.flexibility()
    with pytest.raises(orthowear.InputError, match=r"must be \(256, 3\)"):
        operator.apply(np.zeros((4, 3)))
    with pytest.raises(ValueError, match="raise `largest`"):
        operator.to_dense(largest=1000)
    with pytest.raises(orthowear.InputError, match="E"):
        orthowear.green({"model": "isotropic", "E": -1.0, "nu": 0.3}, 0.0)


def test_green_refuses_what_is_no_angle():
    """Truth: docs/scene.md: tilts are from -90 to 90. The message names the wrong value and the allowed values."""
    cfrp = {"model": "transversely-isotropic", "E1": 140e3, "E2": 10e3, "G12": 5e3, "nu12": 0.3, "nu23": 0.4}
    for material in (STEEL, cfrp):
        for tilt in (90.5, -120.0):
            with pytest.raises(orthowear.InputError, match=f"tilt: {tilt:g}; allowed: at least -90 and at most 90"):
                orthowear.green(material, 0.0, tilt=tilt)
        for name in ("tilt", "azimuth", "angles"):
            for wrong in (np.nan, np.inf):
                with pytest.raises(orthowear.InputError, match=f"{name}: {wrong}; allowed: finite numbers") as caught:
                    orthowear.green(material, **{"angles": 0.0, name: wrong})
                assert caught.value.exit_code == 2
    with pytest.raises(orthowear.InputError, match="angles: nan"):
        orthowear.green(STEEL, [0.0, np.nan])
    with pytest.raises(orthowear.InputError, match=r"tilt: an array of the shape \(2,\); allowed: one"):
        orthowear.green(STEEL, 0.0, tilt=[0.0, 1.0])
    with pytest.raises(TypeError, match="angles: 'east' is of the type str; allowed: finite numbers"):
        orthowear.green(STEEL, "east")
    with pytest.raises(TypeError, match="material: 'steel' is of the type str; allowed: a dict"):
        orthowear.green("steel", 0.0)
    # For a tilt of 90°, the surface is the plane of isotropy for any azimuth.
    normal = orthowear.green(cfrp, [0.0, 70.0], tilt=90.0)[:, 2, 2]
    assert normal[1] == pytest.approx(normal[0], rel=1e-9)
