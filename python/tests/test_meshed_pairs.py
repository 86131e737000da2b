"""Random pairs of meshed bodies converge, and the solutions satisfy the contact and friction conditions."""

import importlib.util

import pytest
from conftest import ROOT

#: Numbers of the pairs. They contain thin and unsupported bodies in contact with half-spaces, rigid bodies and thick
#: bodies. The steps press, shift, pull by up to 0.95 of the friction limit, and move in fretting cycles.
PAIRS = [20, 26, 47, 49, 68, 69, 90, 147, 175, 46, 144, 153]


@pytest.fixture(scope="module")
def pairs():
    spec = importlib.util.spec_from_file_location("pairs", ROOT / "benchmarks" / "meshed_pairs" / "pairs.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.mark.parametrize("number", PAIRS)
def test_pair_converges(number, pairs, program, tmp_path):
    """Truth: `pairs.faults` finds no fault in the residual, the friction limit and the dissipation of the solution."""
    row, _ = pairs.run(program.path, pairs.draw(1, number), tmp_path, threads=2)
    assert (row["outcome"], row["faults"]) == ("converged", ""), row
