"""Pictures of results with matplotlib, which is imported when the first one is made.

Each function draws into `ax`, or into a figure of its own, and returns the axes: titles, limits, legends and more lines are
matplotlib's. Numbers are drawn as they are, with the scene's units. Colours are told apart by the colour-blind, too.
"""

from .entries import convergence, history, loop
from .frame import field, section

__all__ = ["convergence", "field", "history", "loop", "section"]
