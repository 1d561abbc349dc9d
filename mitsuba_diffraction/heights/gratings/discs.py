"""Pressed optical discs: tracks of pits, as an atomic-force microscope sees them.

| | CD | DVD | source |
|---|---|---|---|
| track pitch | 1.6 µm ± 0.1 | 0.74 µm ± 0.03 | ECMA-130; ECMA-267 |
| shortest and longest pit | 0.833, 3.05 µm | 0.400, 1.47 µm | 3 and 11 channel bits |
| channel bit | 0.2777 µm | 0.1333 µm | 1.2 m/s at 4.3218 Mbit/s (ECMA-130); ECMA-267, one layer |
| pit width | 0.5 µm | 0.32 µm | common practice; AFM images of discs show these |
| pit depth | 0.12 µm | 0.105 µm | about λ/4 in polycarbonate (n = 1.55–1.58) at 780 and 650 nm |

Both codes (EFM and EFMPlus, an 8-to-16 code) keep runs of equal bits between 3 and 11; how often
each length occurs is taken from the run-length-limited code of largest entropy, to which they come
close: P(n) = λ⁻ⁿ with Σ P = 1 (Zehavi and Wolf, On runlength codes, 1988). Synchronisation marks,
the tracks' curvature and the spiral's offset from turn to turn are left out.

These are the bare surfaces. Seen through its polycarbonate, as a disc usually is, the light's path
in a pit is longer by the refractive index: use `height_scale` 1.55 (or `depth`).
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from ...arrays import Real
from ..field import HeightField
from ..lengths import number_between
from .fingers import ramp
from .noise import Counts, Lengths, Rng, grain, grid, patch

_SHORTEST_RUN, _LONGEST_RUN = 3, 11  # channel bits
# λ of P(n) = λ⁻ⁿ: the root above 1 of Σ λ⁻ⁿ = 1 over n = 3..11; 2 to the capacity, 0.5418 bit
_GROWTH = 1.455785


@dataclass(frozen=True)
class DiscFormat:
    """Sizes of a disc's pits and their tolerances; lengths in µm."""

    name: str
    bit: float  # length of a channel bit along the track
    width: float  # width of a pit, half way down
    slope: float  # horizontal length of a pit's wall
    jitter: float  # rms displacement of a pit's ends along the track
    wander: float  # rms displacement of a pit across the track
    roughness: float  # rms roughness of land and pits


# Walls rise at 50° to 60° over the depth. Pits of a DVD are placed within 7 nm across the track, a
# figure of AFM quality control; 10 nm is assumed for a CD.
CD = DiscFormat(
    name="cd", bit=0.27766, width=0.5, slope=0.1, jitter=0.015, wander=0.01, roughness=0.002
)
DVD = DiscFormat(
    name="dvd", bit=0.13333, width=0.32, slope=0.07, jitter=0.008, wander=0.007, roughness=0.0015
)


def cd(
    extent: Lengths = 64.0,
    pixels: Counts = 1312,
    seed: int = 0,
    *,
    depth: float = 0.12,
    track_pitch: float = 1.6,
    irregularity: float = 1.0,
) -> HeightField:
    """Generate a patch of a pressed compact disc: tracks along x, colours spread along y.

    Raises a DiffractionError if a parameter is out of its range.

    Parameters
    ----------
    extent
        Size in µm, one length or (along x, along y), 4 to 500. The pitch of tracks and the length
        of channel bits are adjusted so that whole numbers of them fit and the patch tiles; 64 µm
        holds 40 tracks of 1.6 µm.
    pixels
        Samples, one count or (along x, along y). Pixels above 0.1 µm do not resolve pits.
    seed
        A whole number; each seed encodes different data.
    depth
        Height of the mean land above the mean bottom of a pit, which is at 0, µm.
    track_pitch
        Distance between tracks, µm, at most half of the extent along y.
    irregularity
        Factor of the jitter of pits' ends, the wander of tracks and the roughness; 1 is a good
        disc, 0 a perfect one.
    """
    return _disc(CD, extent, pixels, seed, depth, track_pitch, irregularity)


def dvd(
    extent: Lengths = 65.12,
    pixels: Counts = 1408,
    seed: int = 0,
    *,
    depth: float = 0.105,
    track_pitch: float = 0.74,
    irregularity: float = 1.0,
) -> HeightField:
    """Generate a patch of a pressed DVD, one layer: tracks along x; 65.12 µm holds 88 of 0.74 µm.

    Parameters and errors as in `cd`.
    """
    return _disc(DVD, extent, pixels, seed, depth, track_pitch, irregularity)


def _disc(
    disc: DiscFormat,
    extent: Lengths,
    pixels: Counts,
    seed: int,
    depth: float,
    track_pitch: float,
    irregularity: float,
) -> HeightField:
    """Check the parameters (see `cd`), and draw a patch of a disc."""
    name = disc.name
    size, (ny, nx), seeds = grid(name, extent, pixels, seed, (4.0, 500.0), 4096)
    full = number_between(depth, f"{name}: depth", 0.0, 10.0, " µm")
    # pits of tracks that are closer than 1.2 widths would merge
    least = 1.2 * disc.width
    pitch = number_between(track_pitch, f"{name}: track_pitch", least, size[1] / 2, " µm")
    amount = number_between(irregularity, f"{name}: irregularity", 0.0, 3.0)
    data, texture = map(np.random.default_rng, seeds.spawn(2))
    tracks = round(size[1] / pitch)
    x = np.arange(nx, dtype=np.float64) * (size[0] / nx)
    drawn = [_track(data, disc, size[0], x, amount) for _ in range(tracks)]
    ahead, aside, half = (np.stack(parts) for parts in zip(*drawn, strict=True))
    place = np.arange(ny) * (tracks / ny)  # y in track pitches
    track = np.floor(place).astype(np.intp)  # a track's centre is half a pitch from its start
    across = ((place - track - 0.5) * (size[1] / tracks))[:, None] - aside[track]
    outside = np.hypot(ahead[track], across) - half[track]
    relief = ramp(-disc.slope / 2, disc.slope / 2, outside)
    heights = full * relief + amount * disc.roughness * grain(texture, size, (ny, nx), (0.05, 0.05))
    return patch(name, heights, size)


def _track(
    rng: Rng, disc: DiscFormat, length: float, x: Real, irregularity: float
) -> tuple[Real, Real, Real]:
    """Draw the pits of one track of `length` µm, which is closed.

    Returns
    -------
    ahead, aside, half
        Of the stadium-shaped pit nearest to each x, µm, (nx,): distance along the track to the
        stadium's axis, position of the axis across the track, and radius.
    """
    runs = _runs(rng, round(length / disc.bit))
    bit = length / runs.sum()
    ends = np.cumsum(runs) * bit + length * rng.random()
    n = runs.size // 2
    jitter = irregularity * disc.jitter * rng.standard_normal((2, n))
    begin, end = ends[0::2] + jitter[0], ends[1::2] + jitter[1]  # pits and lands alternate
    # pits vary in width, and long ones are a little wider
    half = 0.5 * disc.width * (1 + irregularity * 0.03 * rng.standard_normal(n))
    half *= 1 + irregularity * 0.05 * (runs[1::2] / 5 - 1).clip(-1, 1)
    axis = np.maximum((end - begin) / 2 - half, 0)  # half the length of the stadium's axis
    offset = x[:, None] - (begin + end) / 2
    offset -= length * np.round(offset / length)
    ahead = np.maximum(np.abs(offset) - axis, 0)
    nearest = (ahead - half).argmin(axis=1)
    aside = irregularity * disc.wander * rng.standard_normal(n)
    return ahead[np.arange(x.size), nearest], aside[nearest], half[nearest]


def _runs(rng: Rng, bits: int) -> npt.NDArray[np.int64]:
    """Draw an even number of run lengths, 3 to 11, that add up to `bits`, at least 6."""
    lengths = np.arange(_SHORTEST_RUN, _LONGEST_RUN + 1)
    chance = _GROWTH ** -lengths.astype(np.float64)
    chance /= chance.sum()
    mean = float((lengths * chance).sum())
    n = 2 * max(1, round(bits / mean / 2))
    n = min(max(n, 2 * math.ceil(bits / _LONGEST_RUN / 2)), 2 * (bits // _SHORTEST_RUN // 2))
    runs = rng.choice(lengths, size=n, p=chance)
    while (missing := bits - int(runs.sum())) != 0:
        step = 1 if missing > 0 else -1
        free = np.flatnonzero((runs + step >= _SHORTEST_RUN) & (runs + step <= _LONGEST_RUN))
        chosen = rng.choice(free, size=min(abs(missing), free.size), replace=False)
        runs[chosen] += step
    return runs
