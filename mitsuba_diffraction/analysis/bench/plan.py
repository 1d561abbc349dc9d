"""How much is measured."""

from __future__ import annotations

from dataclasses import dataclass

#: µm: the patch of 1332² pixels is as wide as the default coherence window.
PIXEL = 65.0 / 1332
#: The numbers that directions and wavelengths are drawn with.
SEED = 20140113


@dataclass(frozen=True)
class Plan:
    """Sizes and repetitions.

    Attributes
    ----------
    pixels : a side of the patch that `eval` is measured on.
    more_pixels : sides of further patches whose tables are built, with the same size of pixels.
    other_tables : build `patch` and Taylor tables too.
    lanes : calls at once.
    slow_lanes : likewise, for the thesis' configuration.
    rounds : timed calls of each contender.
    resolution, spp : of the rendered pictures.
    reference_spp : of pictures that are to have converged.
    map_resolution : directions of view along each axis, to compare colours at.
    """

    pixels: int = 1332
    more_pixels: tuple[int, ...] = (4096, 8192)
    other_tables: bool = True
    lanes: int = 1 << 20
    slow_lanes: int = 1 << 17
    rounds: int = 15
    resolution: int = 256
    spp: int = 16
    reference_spp: int = 2048
    map_resolution: int = 256


FULL = Plan()
QUICK = Plan(
    more_pixels=(),
    other_tables=False,
    lanes=1 << 18,
    slow_lanes=1 << 15,
    rounds=5,
    resolution=128,
    spp=4,
    reference_spp=256,
    map_resolution=96,
)
