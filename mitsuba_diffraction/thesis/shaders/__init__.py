"""Methods of the thesis as methods of the shaders: flss, nmm and pq.

Importing this registers them. Their sources in GLSL lie beside this file.

Contents
--------
pack  tables of the methods as textures
"""

from __future__ import annotations

import functools
from typing import TYPE_CHECKING

from ...realtime.glsl.methods import ShaderMethod, register_method

if TYPE_CHECKING:
    from ...plugin.description import Consumer, Surface
    from ...realtime.glsl.texels import Packed

_SPECTRUM = ("taylor.glsl", "spectrum.glsl")
#: Sources of each method.
FILES = {"flss": _SPECTRUM, "nmm": ("taylor.glsl", "nmm.glsl"), "pq": _SPECTRUM}


def _consumer(name: str) -> Consumer:
    from ...plugin.description import Consumer, Feature
    from ...realtime.glsl.features import GLSL

    features = GLSL.shows - {Feature.ORDERS}
    return Consumer(f"method {name} of the thesis", features, "use method fast")


def _tables(name: str, described: Surface) -> Packed:
    from .pack import pack_method, thesis_method  # takes a second: not for --help

    assert described.heights is not None
    return pack_method(thesis_method(name, described.heights(), described.patch))


for _name, _files in FILES.items():
    register_method(
        _name,
        ShaderMethod(
            _files, __name__, functools.partial(_consumer, _name), functools.partial(_tables, _name)
        ),
    )
