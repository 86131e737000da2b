"""Plots of results with matplotlib. The first plot imports matplotlib.

Each function draws into `ax`, or into a new figure, and returns the axes. Use matplotlib for titles, limits,
legends and more lines. Values are drawn unscaled, in the scene's units. Colours are safe for colour-blind readers.
"""

from .entries import convergence, history, loop
from .frame import field, section

__all__ = ["convergence", "field", "history", "loop", "section"]
