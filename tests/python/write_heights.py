"""Writes the heights of a paraboloid as text and as NumPy arrays. The radii of curvature are 10 and 5 mm, on 24 x 24
points with a spacing of 0.05 mm.
"""

import pathlib
import sys

import numpy

folder = pathlib.Path(sys.argv[1])
x = (numpy.arange(24) - 11.5) * 0.05
heights = (x[:, None] ** 2 + 2.0 * x[None, :] ** 2) / 20.0
numpy.savetxt(folder / "heights.csv", heights, delimiter=",", fmt="%.17g")
numpy.save(folder / "c.npy", heights)
numpy.save(folder / "fortran.npy", numpy.asfortranarray(heights))
numpy.save(folder / "single.npy", heights.astype("<f4"))
with open(folder / "v2.npy", "wb") as file:
    numpy.lib.format.write_array(file, heights, version=(2, 0))
heights[3, 5] = numpy.nan
numpy.save(folder / "nan.npy", heights)
numpy.save(folder / "three.npy", numpy.zeros((2, 2, 2)))
