"""Names for the types of arguments; Mitsuba's own types differ by variant.

In JIT variants every number stands for one in each lane of a kernel; in scalar variants it is a
plain number.
"""

from __future__ import annotations

from typing import Any, NamedTuple, TypeAlias

Float: TypeAlias = Any
"""`mi.Float`: an angle's cosine, a frequency (rad/µm), a random number, a density (1/sr)."""

Number: TypeAlias = Any
"""`mi.Float` or `mi.Complex2f`: a refractive index, an entry of a Jones matrix."""

Index: TypeAlias = Any
"""`mi.UInt32`."""

Mask: TypeAlias = Any
"""`mi.Mask`: which lanes are asked for."""

Vector2f: TypeAlias = Any
"""`mi.Vector2f`: a tangential part, of the shading frame or of the patch's."""

Vector3f: TypeAlias = Any
"""`mi.Vector3f`: a unit vector in the shading frame, pointing away from the surface."""

Colour: TypeAlias = Any
"""`mi.UnpolarizedSpectrum`: a number for each wavelength, or for red, green and blue."""

Spectrum: TypeAlias = Any
"""`mi.Spectrum`: the same; in polarised variants a Mueller matrix for each wavelength."""

Context: TypeAlias = Any
"""`mi.BSDFContext`: the transport mode, and masks of types and of one component."""

Interaction: TypeAlias = Any
"""`mi.SurfaceInteraction3f`: `wi`, in the shading frame, and `wavelengths`, nm, are read."""

Sample: TypeAlias = Any
"""`mi.BSDFSample3f`."""

Properties: TypeAlias = Any
"""`mi.Properties`."""

Callback: TypeAlias = Any
"""`mi.TraversalCallback`."""

Texture: TypeAlias = Any
"""`mi.Texture`."""

BSDF: TypeAlias = Any
"""`mi.BSDF`."""

Kind: TypeAlias = Any
"""A type of numbers, as `mi.Float` or `mi.UInt32`."""

Buffer: TypeAlias = Any
"""What `memory.upload` made: an array of Dr.Jit's, of NumPy's in scalar variants."""

Packet: TypeAlias = Any
"""`mi.ArrayXf`: numbers that lie side by side, of each lane."""

Rotation: TypeAlias = tuple[Float, Float]
"""(cos, sin) of the angle from the first tangent to the patch's x axis."""


class Powers(NamedTuple):
    """⟨|P|²⟩ / (4π²σ⁴ λ²) in 1/µm² per channel.

    Attributes
    ----------
    others, zeroth : of all orders but 0, and of order 0.
    cosine : of the phase between both under one window; None where powers add up.
    """

    others: Colour
    zeroth: Colour
    cosine: Colour | None = None
