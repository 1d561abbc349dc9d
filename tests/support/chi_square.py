"""χ² tests: `pdf` is the density of `sample`'s directions, for every kind of table.

Mitsuba's own adapter leaves the wavelengths 0 and builds the BSDF anew in every call; ours sets the
wavelengths and builds it once. Its `SphericalDomain`, uniform in (cosθ, φ), does not suit orders
either: near the normal a step of 0.01 in cosθ is 8°, across many of them. So the histogram here
lies over Lambert's equal-area disc of the hemisphere, x and y over √(1 + cosθ), where orders are
about equally wide, 1/(√2 kσ), and the density is finite up to the horizon.

How fine the quadrature must be follows from that width: it is 25 mrad and more for the 5 µm windows
below, which a grid over the whole disc resolves, but 3 mrad at 65 µm. There the histogram covers a
square of 0.2 around one order instead, with the steps of 0.35 mrad that this takes; samples that
fall elsewhere do not count. The grid is turned against the patch's axes: the density is a sum over
cells of frequency with jumps between them, and a jump along a grid line is an error of half a step
in all cells of a row.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np

import mitsuba_diffraction as md
from tests.support.directions import polar, rough_patch
from tests.support.lanes import interaction

ROUGH = rough_patch((64, 60), (0.085, 0.085), 0.12)
SMALL = {"coherence_width": 5.0}
DISPERSED = (400.0, 480.0, 560.0, 700.0)
AZIMUTH = 40.0


@dataclass(frozen=True)
class Case:
    """A surface, light from θ degrees, wavelengths in nm, where the histogram looks, and which
    component the context asks for; of light that goes through, the side that it leaves to."""

    heights: Any
    theta: float
    wavelengths: tuple[float, ...]
    parameters: dict[str, Any] = field(default_factory=dict)
    order: tuple[float, float] | None = None  # rad/µm; None for the whole disc
    component: int | None = None  # None for all
    side: float = 0.0  # 1 above, -1 below

    def load(self, shared: Any = None) -> Any:
        heights = self.heights
        if heights == "elaphe":
            heights = md.HeightField.load(
                shared / "elaphe-65um.png", pixel_size=65 / 1332, max_height=0.375
            )
        elif callable(heights):
            heights = heights()
        parameters = {"energy_conserving": False} | self.parameters
        if "int_ior" not in parameters:
            parameters["material"] = "none"
        return mi.load_dict(md.bsdf_dict(heights, **parameters))


RESOLUTION = 64
SAMPLES = 1 << 20


class OneSide:
    """A BSDF whose directions on one side are as if above, and on the other none."""

    def __init__(self, bsdf: Any, side: float) -> None:
        self._bsdf, self._turn = bsdf, mi.Vector3f(1.0, 1.0, side)

    def sample(self, context: Any, si: Any, one: Any, two: Any) -> Any:
        found, weight = self._bsdf.sample(context, si, one, two)
        found.wo = found.wo * self._turn
        found.pdf = dr.select(found.wo.z > 0.0, found.pdf, 0.0)
        return found, weight

    def pdf(self, context: Any, si: Any, wo: Any) -> Any:
        return dr.select(wo.z > 0.0, self._bsdf.pdf(context, si, wo * self._turn), 0.0)


class EqualAreas:
    """Square of side 2·half around a direction on Lambert's disc, turned by 20°; dω = 2 dx dy."""

    def __init__(self, direction: tuple[float, float] = (0.0, 0.0), half: float = 1.0) -> None:
        x, y = direction
        shrink = 1.0 / math.sqrt(1.0 + math.sqrt(1.0 - x * x - y * y))
        self._centre, self._half = (x * shrink, y * shrink), half
        self._cos, self._sin = math.cos(math.radians(20.0)), math.sin(math.radians(20.0))

    def bounds(self) -> Any:
        return mi.ScalarBoundingBox2f(-self._half, self._half)

    def aspect(self) -> float:
        return 1.0

    def map_forward(self, p: Any) -> Any:
        """The direction; where there is none, one below the surface."""
        x = self._cos * p.x - self._sin * p.y + self._centre[0]
        y = self._sin * p.x + self._cos * p.y + self._centre[1]
        z = 1.0 - x * x - y * y
        grow = dr.safe_sqrt(1.0 + z)
        return mi.Vector3f(x * grow, y * grow, dr.select(z > 0.0, z, -1.0))

    def map_backward(self, wo: Any) -> Any:
        shrink = dr.rsqrt(1.0 + dr.maximum(wo.z, 0.0))
        x, y = wo.x * shrink - self._centre[0], wo.y * shrink - self._centre[1]
        return mi.Point2f(self._cos * x + self._sin * y, self._cos * y - self._sin * x)

    def contains(self, wo: Any) -> Any:
        p = self.map_backward(wo)
        return dr.maximum(dr.abs(p.x), dr.abs(p.y)) < self._half


def chi_square(
    bsdf: Any, case: Case, *, pdf_at: tuple[float, ...] | None = None, samples: int = SAMPLES
) -> Any:
    """The test of a case; `pdf_at` asks for the density at other wavelengths than sampled."""
    bsdf = OneSide(bsdf, case.side) if case.side else bsdf
    wi = polar(case.theta, AZIMUTH)
    context = mi.BSDFContext(mi.TransportMode.Radiance, int(mi.BSDFFlags.All), case.component)

    def lanes(wavelengths: tuple[float, ...]) -> Any:
        si = interaction(wi, np.broadcast_to(wavelengths, (1, 4)))
        dr.eval(si)
        return si

    sampled, asked = lanes(case.wavelengths), lanes(pdf_at or case.wavelengths)
    # what is folded to near the horizon has narrow cells there, lit most by grazing light
    domain, subdivisions = EqualAreas(), 36 if case.theta >= 75.0 else 18
    if case.order is not None:
        k = 2e3 * math.pi / case.wavelengths[0]
        x, y = (float(q / k - w) for q, w in zip(case.order, wi[:2], strict=True))
        domain = EqualAreas((x, y), 0.1)
        subdivisions = 9

    def sample(numbers: Any) -> tuple[Any, Any]:
        found, _ = bsdf.sample(context, sampled, numbers.x, mi.Point2f(numbers.y, numbers.z))
        counts = (found.pdf > 0.0) & domain.contains(found.wo)
        # one that does not count lies in the middle, with no weight
        middle = domain.map_forward(mi.Point2f(0.0, 0.0))
        return dr.select(counts, found.wo, middle), dr.select(counts, mi.Float(1.0), 0.0)

    def density(wo: Any) -> Any:
        """Per area of the disc."""
        return 2.0 * bsdf.pdf(context, asked, wo)

    return mi.chi2.ChiSquareTest(
        domain=domain,
        sample_func=sample,
        pdf_func=density,
        sample_dim=3,
        sample_count=samples,
        res=RESOLUTION,
        ires=subdivisions,
        seed=1,
    )
