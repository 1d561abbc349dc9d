"""Pigment under the scales: images over a snake's (u, v), and its eyes.

Colours are sRGB, 0 to 1, chosen by eye after photographs. The pattern is looked up half at the
pixel and half at the middle of the scale around it, so that its borders follow the scales.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter

from . import head
from .scales import BELLY, Scales
from .snake import Snake

Floats = NDArray[np.float64]
Pattern = Callable[[Floats, Floats], Floats]

CREAM = np.array([0.84, 0.79, 0.66])
BLACK = np.array([0.055, 0.045, 0.04])


@dataclass(frozen=True)
class ScaleMap:
    """Which scale is seen at each place.

    Attributes
    ----------
    u, v : middle of the visible scale.
    along : 0 at its hidden front to 1 at its free end.
    across : -1 to 1, 0 on the keel.
    tone : a number per scale, uniform in -1 to 1.
    belly : True on the scutes.
    """

    u: Floats
    v: Floats
    along: Floats
    across: Floats
    tone: Floats
    belly: NDArray[np.bool_]


def visible_scales(scales: Scales, u: Floats, v: Floats, seed: int) -> ScaleMap:
    """Find the uppermost scale at each (u, v)."""
    level = (v - BELLY) / scales.row_pitch
    stretch = 1 + scales.overlap
    along, across = np.zeros_like(u), np.zeros_like(u)
    row, column = np.full(u.shape, -1), np.zeros(u.shape, dtype=np.int64)
    for side in (0, 1):
        candidate = np.floor(level).astype(np.int64) + side - 1  # its middle is at level row + 1
        odd = candidate % 2
        for back in (0, 1):
            here = np.floor(u / scales.pitch - odd / 2 + 0.5).astype(np.int64) - back
            a = (u / scales.pitch - here - odd / 2 + 0.5) / stretch
            b = level - candidate - 1
            p, q = a - b / 2, a + b / 2
            rear = 1 + scales.roundness * 4 * np.maximum(
                np.minimum(p, q) * (1 - np.minimum(p, q)), 0
            )
            inside = (np.minimum(p, q) >= 0) & (np.maximum(p, q) <= rear)
            inside &= (candidate >= 0) & (candidate < scales.rows) & (a > along)
            along[inside], across[inside] = a[inside], b[inside]
            row[inside], column[inside] = candidate[inside], here[inside]
    belly = row < 0
    column = np.where(belly, np.floor(u / scales.pitch - 0.1).astype(np.int64), column)
    along = np.where(belly, np.clip(u / scales.pitch - column, 0, 1), along)
    middle = np.where(belly, column + 0.5, column + np.where(row % 2 == 1, 0.5, 0.0))
    centre = np.where(belly, v, BELLY + (row + 1) * scales.row_pitch)
    tones = np.random.default_rng(seed).uniform(-1, 1, (scales.rows + 1, column.max() + 2))
    return ScaleMap(middle * scales.pitch, centre, along, across, tones[row, column], belly)


def corn_snake(snake: Snake, width: int = 4096, height: int = 256, seed: int = 7) -> Floats:
    """Pantherophis guttatus: red-brown saddles edged in black on a sandy ground; (h, w, 3)."""
    ground, side = np.array([0.71, 0.52, 0.30]), np.array([0.70, 0.61, 0.47])
    saddle, blotch = np.array([0.60, 0.20, 0.06]), np.array([0.50, 0.27, 0.12])
    rng = np.random.default_rng(seed)
    u_max = snake.skin.u_max
    count = round(u_max / 0.52)
    shift = rng.normal(0, 0.03, (3, count + 4))

    def spots(u: Floats, v: Floats, which: int, offset: float, long: float, wide: float) -> Floats:
        """Signed distance to the nearest blotch of a row, in its own size."""
        period = u_max / count
        n = np.clip(np.floor(u / period - offset), -1, count + 1).astype(np.int64)
        du = u - (n + 0.5 + offset + shift[which][n + 1]) * period
        size = 1 + 2.5 * shift[(which + 1) % 3][n + 1]
        return ((np.abs(du / (long * size)) ** 3 + np.abs(v / wide) ** 3) ** (1 / 3) - 1) * size

    warp = [_noise(rng, (height, width), 9.0) for _ in range(2)]

    def pattern(u: Floats, v: Floats) -> Floats:
        d = np.abs(v - 0.5)
        i = np.clip((v * height).astype(np.int64), 0, height - 1)
        j = np.clip((u / u_max * width).astype(np.int64), 0, width - 1)
        uu, dd = u + 0.018 * warp[0][i, j], d + 0.012 * warp[1][i, j]
        colour = _mix(ground, side, _step(dd, 0.10, 0.26))
        small = spots(uu, np.abs(dd) - 0.25, 1, 0.5, 0.105, 0.050)
        large = spots(uu, dd, 0, 0.0, 0.165, 0.155)
        for distance, inner in ((small, blotch), (large, saddle)):
            colour = _mix(colour, 1.15 * colour, _step(-distance, -0.40, -0.2))
            colour = _mix(colour, BLACK, _step(-distance, -0.20, -0.10))
            colour = _mix(colour, inner, _step(-distance, 0.06, 0.22))
        return colour

    def belly(u: Floats, v: Floats, tone: Floats) -> Floats:
        # checks of black squares on cream, a half scute each
        checks = (np.abs(tone) < 0.45) & (np.minimum(v, 1 - v) > 0.015)
        return np.where(checks[..., None], 1.6 * BLACK, CREAM)

    marks: head.Polylines = (
        ((0.30, 0.0), (0.27, 0.10), (0.37, 0.185), (0.66, 0.225), (0.98, 0.27)),
        ((0.46, 0.0), (0.60, 0.025), (0.85, 0.075), (1.3, 0.10)),
    )

    def face(x: Floats, d: Floats) -> Floats:
        distance = head.line_distance(marks, snake.skin.anatomy, x, d)
        colour = _mix(1.05 * ground, BLACK, _step(-distance, -0.062, -0.050))
        return _mix(colour, 1.05 * saddle, _step(-distance, -0.042, -0.030))

    return _paint(snake, width, height, seed, pattern, belly, face)


def sunbeam_snake(snake: Snake, width: int = 4096, height: int = 256, seed: int = 11) -> Floats:
    """Xenopeltis unicolor: dark brown above, pale below, two rows between; (h, w, 3)."""
    back = np.array([0.17, 0.115, 0.095])

    def pattern(u: Floats, v: Floats) -> Floats:
        d = np.abs(v - 0.5)
        return _mix(back, 0.9 * CREAM, 0.8 * _step(d, 0.315, 0.36))

    def belly(u: Floats, v: Floats, tone: Floats) -> Floats:
        return np.broadcast_to(CREAM + 0.03, (*u.shape, 3))

    def face(x: Floats, d: Floats) -> Floats:
        return np.broadcast_to(0.95 * back, (*x.shape, 3))

    return _paint(snake, width, height, seed, pattern, belly, face)


def _paint(
    snake: Snake,
    width: int,
    height: int,
    seed: int,
    pattern: Pattern,
    belly: Callable[[Floats, Floats, Floats], Floats],
    face: Pattern,
) -> Floats:
    skin, anatomy = snake.skin, snake.skin.anatomy
    # Mitsuba puts the top row of an image at v = 1
    u, v = np.meshgrid(
        (np.arange(width) + 0.5) / width * skin.u_max, 1 - (np.arange(height) + 0.5) / height
    )
    seen = visible_scales(snake.scales, u, v, seed)
    colour = (pattern(u, v) + pattern(seen.u, seen.v)) / 2
    colour = np.where(seen.belly[..., None], belly(seen.u, v, seen.tone), colour)
    colour = colour * np.where(seen.belly, 1.0, _shade(seen))[..., None]

    x, d = skin.arc(u) / anatomy.head_length, np.abs(v - 0.5)
    paint = face(x, d)
    pale = _step(d, 0.225, 0.25) * _step(-x, -0.98, -0.80)
    paint = _mix(paint, 0.92 * CREAM, pale)
    sutures = np.exp(-((head.line_distance(head.SUTURES, anatomy, x, d) / 0.010) ** 2))
    paint = _mix(paint, 0.45 * paint, sutures * (x < 0.9) * (1 - 0.75 * _step(d, 0.225, 0.24)))
    lips = np.exp(-((head.mouth_distance(anatomy, x, d) / 0.009) ** 2)) * _step(x, 0.005, 0.03)
    nostril = head.line_distance(((head.NOSTRIL, head.NOSTRIL),), anatomy, x, d)
    paint = _mix(paint, BLACK / 2, np.maximum(lips, np.exp(-((nostril / 0.016) ** 2))))
    colour = _mix(paint, colour, _step(x, 0.90, 1.02))
    return np.clip(colour, 0, 1)


def _shade(seen: ScaleMap) -> Floats:
    """Skin shows between the scales, and scales wear pale at their free ends."""
    return 1 + 0.06 * seen.tone - 0.32 * _step(-seen.along, -0.34, -0.14)


def corn_snake_piece(
    scales: Scales, columns: int, rows: int, width: int = 1024, seed: int = 7
) -> Floats:
    """The edge of a saddle, over what `piece` shows of `rows` × `columns` scales; (h, width, 3)."""
    long, wide = columns * scales.pitch, rows * scales.row_pitch
    height = round(width * wide / long)
    u, v = np.meshgrid(
        ((np.arange(width) + 0.5) / width - 0.5) * long,
        0.5 - ((np.arange(height) + 0.5) / height - 0.5) * wide,
    )
    seen = visible_scales(scales, u + columns * scales.pitch, v, seed)
    warp = _noise(np.random.default_rng(seed), u.shape, width / 40)

    def pattern(u: Floats, v: Floats) -> Floats:
        distance = (u + 0.09 * long + 1.2 * (v - 0.5) ** 2) / long
        colour = _mix(np.array([0.60, 0.20, 0.06]), BLACK, _step(distance, -0.05, 0.0))
        return _mix(colour, np.array([0.71, 0.52, 0.30]), _step(distance, 0.07, 0.10))

    colour = pattern(u + 0.004 * warp, v)
    colour = (colour + pattern(seen.u - columns * scales.pitch, seen.v)) / 2
    return np.clip(colour * _shade(seen)[..., None], 0, 1)


def eye(iris: Floats, width: int = 128) -> Floats:
    """A round pupil in an iris, over the u of `head.eyes`; shape (4, width, 3)."""
    u = (np.arange(width) + 0.5) / width
    colour = _mix(iris, 0.5 * iris, _step(u, 0.23, 0.34))
    colour = _mix(colour, BLACK / 2, np.maximum(_step(-u, -0.225, -0.205), _step(u, 0.33, 0.36)))
    return np.broadcast_to(colour, (4, width, 3))


def back(height: int = 64) -> Floats:
    """Where a snake's back is, (height, 2): 1 there, 0 on its belly; v runs around it."""
    v = (np.arange(height) + 0.5) / height
    return np.repeat(_step(np.abs(v - 0.5), 0.29, 0.25)[:, None], 2, axis=1)


def stone(size: int = 768, seed: int = 3) -> Floats:
    """A slab of weathered stone that tiles, (size, size, 3)."""
    rng = np.random.default_rng(seed)
    octaves = (size / 5, size / 14, size / 40, size / 120, 1.6, 0.7)
    weights = (0.35, 0.30, 0.35, 0.35, 0.45, 0.5)
    value = sum(w * _noise(rng, (size, size), s) for w, s in zip(weights, octaves, strict=True))
    warm = _noise(rng, (size, size), size / 8)
    specks = _noise(rng, (size, size), 1.2)
    tone = 0.50 + 0.055 * value - 0.10 * _step(specks, 2.1, 2.6) + 0.10 * _step(-specks, 2.3, 2.7)
    tint = np.stack([1.03 + 0.02 * warm, np.full_like(warm, 1.0), 0.93 - 0.025 * warm], axis=-1)
    return np.clip(tone[..., None] * tint, 0, 1)


def _noise(rng: np.random.Generator, shape: tuple[int, int], size: float) -> Floats:
    """Smooth noise with unit variance that tiles; `size` in pixels."""
    noise = gaussian_filter(rng.standard_normal(shape), size, mode="wrap")
    return noise / noise.std()


def _step(x: Floats, low: float, high: float) -> Floats:
    t = np.clip((x - low) / (high - low), 0, 1)
    return t * t * (3 - 2 * t)


def _mix(a: Floats, b: Floats, share: Floats) -> Floats:
    return a + (b - a) * np.asarray(share)[..., None]
