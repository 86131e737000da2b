"""Solves the case with one of the peers, in its own environment: solve.py PROGRAM CELLS THREADS FILE.

Prints the seconds of operator set-up and solution, and the iterations, as JSON. Imports and the height map are not
timed. Writes the pressures to FILE (.npy).
"""

import contextlib
import io
import json
import os
import sys
import time

import numpy as np

import hertz


def tamaas(n, threads):
    """Non-periodic Boussinesq operator. Conjugate gradients of Polonsky and Keer on pressures with prescribed force."""
    import tamaas as tm

    tm.initialize(threads)
    tm.set_log_level(tm.LogLevel.error)
    surface = -hertz.gap(n)
    solve_by = tm.PolonskyKeerRey.pressure

    def set_up():
        model = tm.Model(tm.model_type.basic_2d, [hertz.WIDTH, hertz.WIDTH], [n, n])
        model.E, model.nu = hertz.YOUNG, hertz.POISSON
        tm.ModelFactory.registerNonPeriodic(model, "free")
        solver = tm.PolonskyKeerRey(model, surface, hertz.TOLERANCE, primal_type=solve_by, constraint_type=solve_by)
        solver.setIntegralOperator("free")
        solver.max_iter = 10_000
        return model, solver

    def solve(state):
        model, solver = state
        error = solver.solve(hertz.FORCE / hertz.WIDTH**2)
        if not error <= hertz.TOLERANCE:
            raise SystemExit(f"not converged: {error}")
        return np.array(model.traction), None

    return set_up, solve


def contact_mechanics(n, _threads):
    """Half-space on a free (non-periodic) grid, with the constrained conjugate gradients that NonSmoothContactSystem
    uses by default.
    """
    from ContactMechanics import FreeFFTElasticHalfSpace
    from ContactMechanics.Systems import NonSmoothContactSystem
    from SurfaceTopography import Topography

    surface = Topography(-hertz.gap(n), (hertz.WIDTH, hertz.WIDTH))

    def set_up():
        substrate = FreeFFTElasticHalfSpace((n, n), hertz.REDUCED, (hertz.WIDTH, hertz.WIDTH))
        return NonSmoothContactSystem(substrate, surface)

    def solve(system):
        # The tolerance of the penetration is relative to the approach. The tolerance of the forces is relative to the
        # mean force of a cell.
        result = system.minimize_proxy(
            external_force=hertz.FORCE, pentol=hertz.TOLERANCE * hertz.APPROACH,
            forcetol=hertz.TOLERANCE * hertz.FORCE / n**2, thermotol=hertz.TOLERANCE)
        if not result.success:
            raise SystemExit(result.message)
        return np.asarray(result.jac) / (hertz.WIDTH / n) ** 2, int(result.nit)

    return set_up, solve


def slippy(n, threads):
    """Love's influence matrix, convolution by FFTW, and conjugate gradients of Polonsky and Keer with prescribed
    force.
    """
    import slippy as package

    package.CUDA, package.CORES = False, threads
    from slippy import core

    gap = hertz.gap(n)
    spacing = (hertz.WIDTH / n, hertz.WIDTH / n)
    shear = hertz.YOUNG / (2 * (1 + hertz.POISSON))

    def set_up():
        matrix = core.elastic_influence_matrix_spatial("zz", (2 * n, 2 * n), spacing, shear, hertz.POISSON)
        return core.plan_convolve(gap, matrix, None, circular=False, fft_im=False)

    def solve(convolve):
        failed, pressure, _ = core.polonsky_and_keer(
            convolve, np.ones_like(gap), gap, hertz.FORCE, spacing, eps_0=hertz.TOLERANCE)
        if failed:
            raise SystemExit("not converged")
        return pressure, None

    return set_up, solve


PROGRAMS = {"tamaas": tamaas, "ContactMechanics": contact_mechanics, "slippy": slippy}


def main():
    program, n, threads, file = sys.argv[1], int(sys.argv[2]), int(sys.argv[3]), sys.argv[4]
    said = io.StringIO()
    with contextlib.redirect_stdout(said):
        set_up, solve = PROGRAMS[program](n, threads)
        started = time.perf_counter()
        state = set_up()
        ready = time.perf_counter()
        pressure, iterations = solve(state)
        done = time.perf_counter()
    np.save(file, pressure)
    print(json.dumps({"set_up": ready - started, "solve": done - ready, "iterations": iterations}))
    sys.stdout.flush()
    os._exit(0)


if __name__ == "__main__":
    main()
