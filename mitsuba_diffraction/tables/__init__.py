"""Precomputed series of diffraction orders: what the renderer looks up (NumPy only).

Contents
--------
DiffractionTable   a table: `build`, `load`, `save`, `brdf` (in `table`)
spectrum           DFT of exp(iκh) at some κ, cropped to the orders that light can reach
expansion          series in κ: which functions, with which weights
choose             how many terms and intervals a tolerance takes
window             the coherence window, cut to a few taps
coefficients       of the series, from transforms of the heights
halves             these as half floats
attempt            one try at a table, and its error
build              tries until the tolerance is met
error              the one error measure of the project
checks             what cannot be built
coarse             what a table of a restricted domain has everywhere else
describe           what a table remembers of its heights
lookup             the NumPy twin of the renderer's look-up
powers             powers of the orders as series in κ
proposals          densities in spatial frequency to draw directions from
atoms              the orders as a few strong ones and a density
albedo             the directional albedo of the raw model
bound              an upper bound of it on a grid of directions
colour_table       the sum over daylight's wavelengths: `ColourTable`
colour_build       how it is summed
colour_proposals   densities to draw directions from, by brightness
polar              the grid of a colour table
loss               how much colours change from one table to another
"""

from __future__ import annotations

from .table import DiffractionTable

__all__ = ["DiffractionTable"]
