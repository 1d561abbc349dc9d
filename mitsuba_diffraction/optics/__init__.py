"""Optics (no files, no Dr.Jit).

Contents
--------
arithmetic  the arithmetic that formulas are written in: NumPy, plain numbers, registered kinds
geometry   directions, wave numbers, the coherence window, the Kirchhoff factor, shadowing
fresnel    amplitudes and fields of a smooth interface, or of a thin film
boundary   boundary models: K, B, their blend, and the registry `MODELS`
blend      roughness of the heights by scale, and weights of K and B
stack      flat stacks of layers: transfer matrices, and means over thickness
coat       a clear coat over a structure
through    light that goes through a dielectric, or a thin sheet
paths      paths of light by a boundary: sides, widths w, matrices, order 0
orders     a grating's orders: cells of efficiencies, lobes
mirror     order 0 as a mirror's lobe, and its correction at the horizon
lobes      nodes across Gaussian lobes that the horizon cuts
colour     spectra to XYZ and sRGB; differences of colours
materials  names and numbers of materials; published indices of tissues
display    linear sRGB to the values of a screen, by a view
"""

__all__ = [
    "arithmetic", "blend", "boundary", "coat", "colour", "display", "fresnel", "geometry",
    "lobes", "materials", "mirror", "orders", "paths", "stack", "through",
]  # fmt: skip
