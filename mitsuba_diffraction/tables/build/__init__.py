"""Building a table: which series, how many terms and taps, and the proof that they suffice.

Contents
--------
build         tries until the tolerance is met: `build_table`
choose        how many terms and intervals a tolerance takes
checks        what cannot be built
screens       patches as tiles, or a scan cut into overlapping windows, averaged
powers        the mean power of screens, by batches, on workers if given
spectrum      DFT of exp(iκh) at some κ, cropped to the orders that light can reach
coefficients  of the series, from transforms of the heights; as half floats
error         the one error measure of the project
derivatives   of the coefficients by the heights of a patch that tiles the plane
describe      statistics of the heights that a table stores, and what tells hills from pits
"""

from __future__ import annotations

__all__ = ["build", "checks", "derivatives"]
