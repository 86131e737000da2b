"""Cases of the verification catalogue with independent reference values: scenes and known results."""

import csv
import json
import math
from dataclasses import dataclass, field
from pathlib import Path

import layer

ROOT = Path(__file__).resolve().parent.parent.parent
PI = math.pi
E, NU = 210e3, 0.3
STAR = E / (1 - NU**2)

STEEL = f'[materials.steel]\nmodel = "isotropic"\nE = {E}\nnu = {NU}\n'
# Poisson's ratio of zero, for which the solutions of Cattaneo and Mindlin are exact.
PLAIN = '[materials.plain]\nmodel = "isotropic"\nE = 210e3\nnu = 0.0\n'
CFRP = ('[materials.cfrp]\nmodel = "orthotropic"\nE1 = 167230.0\nE2 = 9544.0\nE3 = 9544.0\nG12 = 5292.0\nG13 = 5292.0\n'
        "G23 = 3483.0\nnu12 = 0.272\nnu13 = 0.272\nnu23 = 0.369\n")
# Material of the case aniso-hertz-cfrp of the catalogue.
FRP = ('[materials.frp]\nmodel = "orthotropic"\nE1 = 140e3\nE2 = 10e3\nE3 = 9e3\nnu12 = 0.30\nnu13 = 0.28\nnu23 = 0.45\n'
       "G23 = 3.3e3\nG13 = 4.8e3\nG12 = 5.2e3\n")
RIGID = 'kind = "rigid"\n'
ON_FRP = "[friction]\nlaw = \"frp\"\nmu_L = 0.4\nmu_T = 0.5\nmu_N = 0.55\n"
WORN_FRP = "[wear]\nlaw = \"frp\"\ni_L = 5.0e-10\ni_T = 6.25e-10\ni_N = 6.875e-10\n"


@dataclass
class Case:
    """A scene and its reference values. Each reference value has a step, the name of the result, the value, and the
    scale of the relative error.
    """

    name: str
    source: str
    text: str
    truths: list
    of: list = field(default_factory=list)
    keep: list = field(default_factory=list)
    known: float = 0.0
    # Function that writes further files of the scene into a folder.
    prepare: object = None


def half_space(material, more=""):
    return f'kind = "half-space"\nmaterial = "{material}"\n{more}'


def scene(materials, below, above, half_width, gap, rest, cells=(16, 16), frame=""):
    """Returns the text of a scene on a grid frame."""
    return (f"{materials}[body1]\n{below}[body2]\n{above}[frame]\nkind = \"grid\"\nhalf_width = [{half_width[0]}, {half_width[1]}]\n"
            f"cells = [{cells[0]}, {cells[1]}]\n{frame}[gap]\n{gap}[output]\nfields = []\n{rest}")


def press(**keys):
    return step("press", **keys)


def step(name, **keys):
    return f'[[steps]]\nname = "{name}"\n' + "".join(f"{key} = {value}\n" for key, value in keys.items())


def known(step_name, **values):
    return [(step_name, name.replace("_X", " x").replace("_Y", " y"), value, abs(value)) for name, value in values.items()]


def elliptic(k):
    """Complete elliptic integrals K and E of modulus k, by the arithmetic-geometric mean (Abramowitz and Stegun 17.6)."""
    a, b, c, s, power = 1.0, math.sqrt(1 - k * k), k, 0.5 * k * k, 1.0
    while abs(c) > 1e-16:
        a, b, c = (a + b) / 2, math.sqrt(a * b), (a - b) / 2
        s += power * c * c
        power *= 2
    return PI / (2 * a), PI / (2 * a) * (1 - s)


def hertz(force, radius, star):
    """Contact radius, approach and peak pressure of a sphere (Johnson 4.22 to 4.24). `star` is the modulus E*."""
    a = (0.75 * force * radius / star) ** (1 / 3)
    return a, a * a / radius, 1.5 * force / (PI * a * a)


def spheres():
    sphere = 'kind = "sphere"\nradius = 10.0\n'
    a, approach, peak = hertz(1000.0, 10.0, STAR)
    both = known("press", approach=approach, peak_pressure=peak)
    of = lambda half, gap, text, cells=(16, 16): scene(STEEL, half_space("steel"), RIGID, half, gap, text, cells)
    force = press(normal_force=1000.0)
    yield Case("hertz, force", "Hertz 1882", of((0.4, 0.4), sphere, force), both)
    yield Case("hertz, approach", "Hertz 1882", of((0.4, 0.4), sphere, press(approach=approach)),
               known("press", normal_force=1000.0, peak_pressure=peak))
    yield Case("hertz, beside the centre", "Hertz 1882", of((0.5, 0.47), sphere + "offset = [0.037, 0.021]\n", force), both)
    yield Case("hertz, long frame", "Hertz 1882", of((0.9, 0.37), sphere, force, (40, 18)), both)
    _, approach, peak = hertz(500.0, 210.0, STAR / 2)
    socket = scene(STEEL, half_space("steel"), half_space("steel"), (1.1, 1.1), 'kind = "sphere"\nradius = 210.0\n', press(normal_force=500.0))
    yield Case("hertz, socket", "Hertz 1882", socket, known("press", approach=approach, peak_pressure=peak))
    for name, long, half, cells, approach, peak in [
        ("2 to 1", 20.0, (0.55, 0.35), (22, 14), 0.009013045858, 3770.476978),
        ("10 to 1", 100.0, (1.15, 0.26), (36, 8), 0.006475759353, 2478.08091),
    ]:
        gap = f'kind = "ellipsoid"\nradii = [{long}, 10.0]\n'
        yield Case(f"ellipse {name}", "Hertz 1882", of(half, gap, force, cells), known("press", approach=approach, peak_pressure=peak))
    yield from profiles(of)


def profiles(of):
    """Other axisymmetric indenters (Sneddon 1965)."""
    force, tangent = press(normal_force=1000.0), math.tan(math.radians(5.0))
    depth = math.sqrt(1000.0 * PI * tangent / (2 * STAR))
    yield Case("cone", "Sneddon 1965", of((0.22, 0.22), 'kind = "cone"\nslope = 5.0\n', force), known("press", approach=depth), ["load"])
    # Gap B r^4 and contact radius a: the approach is d = 8/3 B a^4, the load P = 2 E* 4/5 d a. The pressure p = 5 P / (6 pi a^5)
    # (a^2 + 2 r^2) sqrt(a^2 - r^2) is largest at r = a / sqrt 2.
    a = (1000.0 * 15 / (64 * STAR * 1e-3)) ** 0.2
    peak = math.sqrt(2) * 5 * 1000.0 / (6 * PI * a * a)
    yield Case("power, r^4", "Sneddon 1965", of((1.25, 1.25), 'kind = "power"\nexponent = 4.0\ncoefficient = 1e-3\n', force),
               known("press", approach=8 / 3 * 1e-3 * a**4, peak_pressure=peak))
    depth = 2.0 * math.log(14 / 6)
    load = STAR / 2 * (116 * math.log(14 / 6) - 80)
    yield Case("sphere, exact profile", "Sneddon 1965",
               of((5.0, 5.0), 'kind = "sphere"\nradius = 10.0\nexact = true\n', press(approach=depth)), known("press", normal_force=load), ["load"])


def lines():
    """Cases in plane strain: a cylinder, rolling cylinders, and a wavy surface."""
    a = math.sqrt(4 * 500.0 * 20.0 / (PI * STAR))
    peak = 1000.0 / (PI * a)
    approach = 1000.0 / (PI * STAR) * (math.log(1.0 / a) + 0.5)
    cylinder = 'kind = "cylinder"\nradius = 20.0\nangle = 90.0\n'
    along = "periodic = [false, true]\n"
    yield Case("line", "Hertz 1882, Johnson 1985",
               scene(STEEL, half_space("steel"), RIGID, (0.5, 0.5), cylinder, press(normal_force=500.0), (50, 1), along),
               known("press", approach=approach, peak_pressure=peak))
    # Creepages at which the tangential force is half and three quarters of the friction limit.
    a = math.sqrt(8 * 500.0 * 20.0 / (PI * STAR))
    for share in (0.5, 0.75):
        creepage = 0.3 * a / 20.0 * (1 - math.sqrt(1 - share))
        text = ('[friction]\nlaw = "coulomb"\nmu = 0.3\n' + press(normal_force=500.0)
                + step("roll", rolling=f"{{ direction = 0.0, creepage = [{creepage!r}, 0.0] }}", increments=4))
        yield Case(f"rolling, {share}", "Carter 1926",
                   scene(STEEL, half_space("steel"), half_space("steel"), (0.4, 0.5), cylinder, text, (50, 1), along),
                   [("roll", "tangential_force x", share * 150.0, math.hypot(500.0, share * 150.0))]
                   + known("roll", peak_pressure=1000.0 / (PI * a)))
    # The mean pressure p_m is half of the mean pressure that closes the gap. The contact half-width b then satisfies
    # sin^2(pi b) = 1/2, and the peak pressure is 2 p_m / sin(pi b).
    mean = PI * STAR * 2e-3 / 2
    yield Case("wave", "Westergaard 1939",
               scene(STEEL, half_space("steel"), RIGID, (0.5, 0.5), 'kind = "heights"\nfile = "wave.csv"\nspacing = [0.00048828125, 1.0]\n',
                     press(normal_force=repr(mean)), (50, 1), "periodic = [true, true]\n"),
               known("press", peak_pressure=2 * math.sqrt(2) * mean), ["peak_pressure"], known=2e-6, prepare=wave)


def wave(folder):
    """Writes wave.csv: the gap 2e-3 mm (1 - cos 2 pi x) at the centres of 2048 intervals. The code has + cos, because
    i counts from one end, and x from the middle.
    """
    with open(folder / "wave.csv", "w", newline="", encoding="utf-8") as out:
        csv.writer(out).writerows([[2e-3 * (1 + math.cos(2 * PI * (i + 0.5) / 2048))] for i in range(2048)])


def punches():
    flat = 'kind = "flat"\n'
    of = lambda half, frame="", material=("steel", STEEL), more="": scene(
        material[1], half_space(material[0], more), RIGID, (half, half), flat, press(approach=0.01), (16, 16), frame)
    outline = 'outline = { shape = "circle", radius = 2.0 }\n'
    yield Case("punch, circle", "Boussinesq 1885", of(2.2, outline), known("press", normal_force=4 * STAR * 0.01), ["load"])
    yield Case("punch, square", "Read 1997", of(0.5), known("press", normal_force=PI * 0.3667896 * STAR * 0.01), ["load"], known=1e-6)
    # Ellipse with the semi-axes a = 2 and 1 and the eccentricity e: the force at the approach d is F = pi E* a d /
    # K(e).
    outline = 'outline = { shape = "ellipse", semi_axes = [2.0, 1.0] }\n'
    load = PI * STAR * 2.0 * 0.01 / elliptic(math.sqrt(0.75))[0]
    yield Case("punch, ellipse", "Johnson 1985, 3.42", of(2.2, outline), known("press", normal_force=load), ["load"])


def anisotropic():
    """Rigid spheres of radius R = 10 mm on an orthotropic half-space under P = 100 N (Willis 1966). The values are
    from the catalogue.
    """
    for name, tilt, azimuth, half, approach, peak in [
        ("along x", 0.0, 0.0, 0.5, 0.01674191382, 287.2075736),
        ("turned by 30", 0.0, 30.0, 0.5, 0.01674191382, 287.2075736),
        ("along the normal", 90.0, 0.0, 0.32, 0.006243497122, 764.7988351),
    ]:
        text = scene(FRP, half_space("frp", f"fibre = {{ tilt = {tilt}, azimuth = {azimuth} }}\n"), RIGID, (half, half),
                     'kind = "sphere"\nradius = 10.0\n', press(normal_force=100.0))
        yield Case(f"orthotropic, {name}", "Willis 1966", text, known("press", approach=approach, peak_pressure=peak))


def friction():
    """Partial slip of equal bodies with nu = 0 (Cattaneo 1938, Mindlin 1949, Mindlin and Deresiewicz 1953, Ciavarella
    1998), and indentation by rigid spheres with friction (Spence 1975).
    """
    star, mu, force = 105e3, 0.3, 1000.0
    a, approach, peak = hertz(force, 10.0, star)
    most = 3 * mu * force / (16 * a) * 4 / 105e3
    moved = lambda share: most * (1 - (1 - share) ** (2 / 3))
    law = '[friction]\nlaw = "coulomb"\nmu = 0.3\n'
    of = lambda text, gap='kind = "sphere"\nradius = 10.0\n', half=0.5: scene(
        PLAIN, half_space("plain"), half_space("plain"), (half, half), gap, law + text)
    shift = lambda name, value, beside: (name, "shift x", value, math.hypot(value, beside))
    pressed = press(normal_force=force)
    for share in (0.3, 0.9):
        text = pressed + step("pull", tangential_force=[share * mu * force, 0.0])
        yield Case(f"partial slip, {share}", "Cattaneo 1938, Mindlin 1949", of(text),
                   [shift("pull", moved(share), approach)] + known("pull", approach=approach, peak_pressure=peak))
    text = (pressed + step("pull", tangential_force=[0.6 * mu * force, 0.0]) + step("back", tangential_force=[0.0, 0.0]))
    left = moved(0.6) - 2 * most * (1 - 0.7 ** (2 / 3))
    yield Case("loading and unloading", "Mindlin, Deresiewicz 1953", of(text),
               [shift("pull", moved(0.6), approach), shift("back", left, approach)] + known("back", peak_pressure=peak))
    text = press(normal_force=force, tangential_force=[200.0, 0.0])
    yield Case("oblique force", "Mindlin, Deresiewicz 1953", of(text),
               [shift("press", 0.2 * approach, approach)] + known("press", approach=approach, peak_pressure=peak))
    tangent = math.tan(math.radians(5.0))
    depth = math.sqrt(force * PI * tangent / (2 * star))
    text = pressed + step("pull", tangential_force=[0.5 * mu * force, 0.0])
    # For nu = 0, the tangential and normal contact compliances are equal (E*/G* = 1).
    yield Case("partial slip of a cone", "Ciavarella 1998", of(text, 'kind = "cone"\nslope = 5.0\n', 0.32),
               [shift("pull", mu * depth * (1 - math.sqrt(0.5)), depth)] + known("pull", approach=depth), ["load"])
    for nu, mu, kappa, ratio in [(0.3, 0.2, 1.01927, 1.01487), (0.0, 0.5, 1.07479, 1.05997), (0.3, 0.3, 1.0243, 1.01948)]:
        star = E / (1 - nu**2)
        load = kappa / math.sqrt(ratio) * 4 / 3 * star * math.sqrt(10.0) * 0.01**1.5
        text = f'[friction]\nlaw = "coulomb"\nmu = {mu}\n' + press(approach=0.01)
        yield Case(f"indentation with friction, nu {nu}, mu {mu}", "Spence 1975",
                   scene(STEEL.replace("nu = 0.3", f"nu = {nu}"), half_space("steel"), RIGID, (0.4, 0.4), 'kind = "sphere"\nradius = 10.0\n', text),
                   known("press", normal_force=load), ["load"], known=1e-5)


def fibres():
    """CFRP under a steel sphere of radius R = 50 mm. Without friction, the values are exact (Willis 1966). With
    friction and wear, they come from an independent program.
    """
    data = json.loads((ROOT / "tests/data/sphere-on-frp.json").read_text(encoding="utf-8"))
    of = lambda tilt, half, text: scene(STEEL + CFRP, half_space("cfrp", f"fibre = {{ tilt = {tilt} }}\n"), half_space("steel"), (half, half),
                                        'kind = "sphere"\nradius = 50.0\n', text)
    indent = step("indent", approach=0.02)
    for tilt in (0.0, 30.0, 60.0, 90.0):
        case = data["cases"][f"{tilt:.0f}"]
        exact = case["exact"]
        yield Case(f"CFRP, tilt {tilt:.0f}", "Willis 1966", of(tilt, 1.2, indent), known("indent", normal_force=exact["P"], peak_pressure=exact["p0"]))
        text = ON_FRP + indent + step("shift", shift="{ distance = 0.008, angle = 45.0 }")
        truths = []
        for name, values in (("indent", case["FR"]), ("shift", case["FR_T45"])):
            p, x, y, p0 = (values[key]["value"] for key in ("P", "Q1", "Q2", "p0"))
            whole = math.hypot(p, x, y)
            truths += [(name, "normal_force", p, whole), (name, "tangential_force x", x, whole), (name, "tangential_force y", y, whole)]
            # The peak pressures of the independent program have errors of 1e-3 at 60 degrees.
            truths += [] if tilt == 60.0 else [(name, "peak_pressure", p0, p0)]
        yield Case(f"CFRP, tilt {tilt:.0f}, friction", "independent program", of(tilt, 1.2, text), truths, [], ["increments"], 5e-5)
    for tilt in ("0", "90"):
        worn = data["wear"][tilt]
        text = (ON_FRP + WORN_FRP + step("indent", approach=0.02, wear="false", friction="false")
                + step("fretting", cycles="{ count = 100_000, amplitude = 0.08 }"))
        yield Case(f"CFRP, tilt {tilt}, fretting wear", "independent program", of(float(tilt), 1.5, text),
                   known("fretting", worn_volume=worn["V"]), ["worn_volume"], ["increments"], 6e-5)


def wear():
    """Wear of a sphere that slides under a force: wear volumes (Archard, friction energy), and approach of the worn
    sphere (from the catalogue, four decimals).
    """
    star, force, radius = STAR, 1000.0, 10.0
    a, approach, peak = hertz(force, radius, star)
    of = lambda text, half, gap='kind = "sphere"\nradius = 10.0\n': scene(STEEL, half_space("steel"), RIGID, (half, half), gap, text)
    archard = '[wear]\nlaw = "archard"\ni = 1e-8\n'
    pressed = press(normal_force=force)
    yield Case("sliding, volume", "Archard 1953", of(archard + pressed + step("slide", sliding="{ distance = 10000.0 }"), 0.8),
               known("slide", worn_volume=0.1), ["worn_volume"])
    energy = '[friction]\nlaw = "coulomb"\nmu = 0.3\n[wear]\nlaw = "energy"\nk = 3e-8\n'
    yield Case("sliding, volume by energy", "k mu P s", of(energy + pressed + step("slide", sliding="{ distance = 10000.0 }"), 0.8),
               known("slide", worn_volume=0.09), ["worn_volume"])
    for tau, depth, half in ((1.0, 1.3561, 0.52), (10.0, 2.8966, 0.85)):
        path = tau * approach / (peak * 1e-8)
        text = archard + pressed + step("slide", sliding=f"{{ distance = {path!r} }}")
        yield Case(f"sliding, tau {tau:.0f}", "catalogue, wear-sphere-elastic", of(text, half), known("slide", approach=depth * approach),
                   ["load"], known=2e-4)


def finite_elements():
    """A sphere on a bonded layer (benchmarks/pareto/layer.py: 1685.686 N, 3571.290 MPa)."""
    text = (ROOT / "benchmarks/pareto/layer.toml").read_text(encoding="utf-8")
    yield Case("bonded layer of finite elements", "integral equation", text.replace("cells = [64, 64]", "cells = [16, 16]") + "[output]\nfields = []\n",
               known("press", normal_force=1685.686, peak_pressure=3571.290), known=2e-5, prepare=layer.make)


def every():
    """All cases."""
    for group in (spheres, lines, punches, anisotropic, friction, fibres, wear, finite_elements):
        yield from group()
