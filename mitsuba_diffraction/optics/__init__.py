"""Optics in double precision (NumPy; no files, no Dr.Jit).

Contents
--------
geometry   directions, wave numbers, the coherence window, the Kirchhoff factor
fresnel    reflectance of a smooth interface
colour     from spectra to XYZ and sRGB; differences of colours
"""
