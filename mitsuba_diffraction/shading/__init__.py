"""Formulas of `optics` as programs in shading languages.

Contents
--------
symbols     numbers that record a formula's expressions
programs    formulas written as functions of a shading language
dialects    words of GLSL and OSL
powers      powers of a patch's orders as textures
orders      efficiencies of solved orders as a texture, and formulas that read it
spectra     values of textures, BSDFs and emitters at many wavelengths
pair_power  power of a boundary model for a pair of directions, under a coat or bare
"""

__all__ = ["dialects", "orders", "pair_power", "powers", "programs", "spectra"]
