"""Cross-sections of a snake from snout to tail tip, and features of its head."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.interpolate import CubicSpline, PchipInterpolator

from .limits import check_limits

Floats = NDArray[np.float64]

# Proportions read off photographs of colubrid snakes. Body: half-width in girth radii over the
# share of the length; the vent is at 0.85, behind it the tail.
# fmt: off
BODY = np.array(
    [
        (0.00, 0.60), (0.05, 0.60), (0.10, 0.70), (0.22, 0.90), (0.40, 1.00),
        (0.60, 1.00), (0.76, 0.90), (0.85, 0.66), (0.92, 0.42), (1.00, 0.10),
    ]
)
# Head: half-width, height over and depth under the axis, in head half-widths over head lengths.
HEAD = np.array(
    [
        (0.00, 0.47, 0.40, 0.34), (0.12, 0.56, 0.47, 0.36), (0.25, 0.67, 0.56, 0.38),
        (0.40, 0.80, 0.64, 0.40), (0.55, 0.93, 0.69, 0.44), (0.72, 1.00, 0.71, 0.47),
        (0.88, 0.96, 0.71, 0.50), (1.05, 0.83, 0.70, 0.56),
    ]
)
# fmt: on
#: Lowest and highest value of each parameter of `Anatomy`; of the length, in girth radii.
LIMITS: dict[str, tuple[float, float]] = {
    "girth_radius": (0.05, 50.0),
    "taper": (0.0, 1.5),
    "head": (1.5, 4.0),
}
LENGTH_LIMITS = (20.0, 200.0)
NECK = 1.35  # head lengths from the snout to where the body's own proportions hold


@dataclass(frozen=True)
class Anatomy:
    """Size and proportions of a snake; lengths in cm.

    Attributes
    ----------
    length : from snout to tail tip.
    girth_radius : half the width of the body at its thickest.
    taper : how far the body thins towards neck and tail: 0 a hose, 1 a colubrid, up to 1.5.
    head : length of the head in girth radii.
    """

    length: float = 118.0
    girth_radius: float = 1.499
    taper: float = 1.0
    head: float = 2.5
    _profile: PchipInterpolator = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        check_limits(self, LIMITS)
        low, high = (share * self.girth_radius for share in LENGTH_LIMITS)
        check_limits(self, {"length": (low, high)})
        object.__setattr__(self, "_profile", self._interpolate())

    @property
    def head_length(self) -> float:
        """From snout to neck, cm."""
        return self.head * self.girth_radius

    @property
    def head_half_width(self) -> float:
        """At its widest, cm."""
        return 0.36 * self.head_length

    def _interpolate(self) -> PchipInterpolator:
        share, radius = BODY.T
        # every tail ends in a point
        taper = np.interp(share, (0.85, 0.95), (self.taper, max(self.taper, 1.0)))
        thinned = 1 - np.minimum(taper * (1 - radius), 0.92)
        wide = self.girth_radius * thinned
        body = np.column_stack([share * self.length, wide, 0.94 * wide, 0.80 * wide])
        head = HEAD * np.array([self.head_length] + 3 * [self.head_half_width])
        start = NECK * self.head_length
        at_neck = PchipInterpolator(body[:, 0], body[:, 1:])(start)
        knots = np.concatenate(
            [head, [[start, *at_neck]], body[body[:, 0] > start + self.girth_radius]]
        )
        return PchipInterpolator(knots[:, 0], knots[:, 1:])

    def profile(self, arc: ArrayLike) -> tuple[Floats, Floats, Floats]:
        """Half-width, height above and depth below the spine at an arc length from the snout."""
        s = np.clip(np.asarray(arc, dtype=np.float64), 0, self.length)
        rounded = _round_end(s, 0.24 * self.head_length)
        rounded *= _round_end(self.length - s, 0.35 * self.girth_radius)
        wide, above, below = np.moveaxis(self._profile(s), -1, 0) * rounded
        return wide, above, below

    def mean_radius(self, arc: ArrayLike) -> Floats:
        """Radius of the circle that stands for the cross-section in lengths around the body."""
        wide, above, below = self.profile(arc)
        return (2 * wide + above + below) / 4

    def squareness(self, arc: ArrayLike) -> Floats:
        """Exponent of the superellipse: 2 is an ellipse; the head is a little boxier."""
        s = np.asarray(arc, dtype=np.float64) / self.head_length
        return 2.0 + 0.5 * np.exp(-(((s - 0.55) / 0.45) ** 2))

    def conformal(self, count: int = 4001) -> tuple[CubicSpline, float]:
        """Arc length as a function of u = ∫ ds / (2π r(s)), and the largest u.

        With v the share of the way around, a step in u and one in v are the same length on the
        skin, so that scales and patches keep their shape wherever the body is thick or thin.
        """
        # both ends are round, r ~ √s: in τ, with s ~ τ² there, the integrand stays finite
        tau = np.linspace(0, 1, count)
        arc = self.length * (1 - np.cos(np.pi * tau)) / 2
        middle = (tau[1:] + tau[:-1]) / 2
        speed = self.length * np.pi * np.sin(np.pi * middle) / 2
        inner = self.length * (1 - np.cos(np.pi * middle)) / 2
        steps = speed / (2 * np.pi * self.mean_radius(inner)) / (count - 1)
        u = np.concatenate([[0], np.cumsum(steps)])
        return CubicSpline(u, arc), float(u[-1])


def _round_end(distance: Floats, reach: float) -> Floats:
    """A quarter ellipse: 0 at the end, 1 from `reach` on."""
    x = np.clip(distance / reach, 0, 1)
    return np.sqrt(x * (2 - x))
