"""Materials that a page can give to its surfaces: indices of the vocabulary, packed for shaders."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from ...optics.materials import METALS, TISSUES
from ...plugin.conductors import tabulated_index
from ..glsl.packing import pack_conductor
from ..glsl.texels import Packed, Texture, as_half
from .sections import Sections, packed_parts

#: Names as authors write them, by the tables' names; of two spellings the first.
NAMES = {name: name for name in TISSUES} | {
    symbol: name for name, symbol in reversed(METALS.items())
}
#: Definition of a surface with a material of `packed_materials`.
INDEXED = {"SURFACE_KIND": "2"}


def packed_materials(coats: Sequence[float], sections: Sections) -> list[dict[str, Any]]:
    """Pack all materials in air for the page's header, as JSON types.

    coats : indices of the layers above the structures, 1 without one.

    Returns
    -------
    For each material its name in the vocabulary; whether it absorbs light that is not reflected, so
    that none reaches a base beneath; and parts, the numbers of its sections for each of `coats`.
    """
    if not coats:
        return []
    entries = []
    for symbol, name in NAMES.items():
        absorbs = symbol not in TISSUES or TISSUES[symbol].absorbs
        wavelengths, index = tabulated_index(symbol)
        parts = []
        for coat in coats:
            packed = pack_conductor(wavelengths, index.real / coat, index.imag / coat)
            (texture,) = packed.textures
            half = Texture(texture.name, as_half(texture.data.astype(np.float32)))
            parts.append(packed_parts(Packed((half,), packed.uniforms), sections))
        entries.append({"name": name, "absorbs": absorbs, "parts": parts})
    return entries
