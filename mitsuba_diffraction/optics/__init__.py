"""Optics in double precision (NumPy; no files, no Dr.Jit).

Contents
--------
geometry   directions, wave numbers, the coherence window, the Kirchhoff factor
fresnel    amplitudes and fields of a smooth interface, or of a thin film
boundary   Jones and Mueller matrices of a pair of directions: small slope, Kirchhoff
blend      which of the two an order of a surface follows
second_order  the second order of small slope as a factor, and what it needs of the heights
mean_second_order  its mean under a thin film, as a factor of either direction
coat       a clear coat over a structure
through    light that goes through a dielectric, or a thin sheet
colour     from spectra to XYZ and sRGB; differences of colours
"""
