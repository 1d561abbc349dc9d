"""χ² tests: `pdf` is the density of `sample`'s directions, for every kind of table.

Mitsuba's own adapter leaves the wavelengths 0 and builds the BSDF anew in every call; ours sets the
wavelengths and builds it once. Its `SphericalDomain`, uniform in (cosθ, φ), does not suit orders
either: near the normal a step of 0.01 in cosθ is 8°, across many of them. So the histogram here
lies over Lambert's equal-area disc of the hemisphere, x and y over √(1 + cosθ), where orders are
about equally wide, 1/(√2 kσ), and the density is finite up to the horizon.

How fine the quadrature must be follows from that width: it is 25 mrad and more for the 5 µm windows
below, which a grid over the whole disc resolves, but 3 mrad at 65 µm. There the histogram covers a
square of 0.2 around one order instead, with the steps of 0.3 mrad that this takes; samples that
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
import pytest

import mitsuba_diffraction as md
from tests.directions import polar, rough_patch
from tests.lanes import interaction

pytestmark = pytest.mark.filterwarnings("ignore::mitsuba_diffraction.DiffractionWarning")

ROUGH = rough_patch((64, 60), (0.085, 0.085), 0.12)
DEEP = rough_patch((64, 60), (0.085, 0.085), 0.8)
SMALL = {"coherence_width": 5.0}
BLAZED = {"coherence_width": 6.0, "height_scale": 1.2, "orientation": 25.0}
PIGMENT = {
    "int_ior": 1.5,
    "pigment": {"type": "diffuse", "reflectance": {"type": "uniform", "value": 0.4}},
}
PRINCIPLED = {"int_ior": 1.5, "pigment": {"type": "principled", "roughness": 0.3}}
GLOSSY_BELOW = {"int_ior": 1.5, "pigment": {"type": "roughplastic", "alpha": 0.2}}
DISPERSED = (400.0, 480.0, 560.0, 700.0)
AZIMUTH = 40.0


def blazed() -> md.HeightField:
    return md.gratings.blazed(2.0, 0.15, periods=3, pixels_per_period=24)


def sinusoid() -> md.HeightField:
    return md.gratings.sinusoidal(2.0, 0.15, periods=4, pixels_per_period=24)


def like_elaphe() -> md.HeightField:
    """20 µm of a made scale, for windows of 20 µm."""
    return md.gratings.elaphe_like(20.0, 300)


@dataclass(frozen=True)
class Case:
    """A surface, light from θ degrees, wavelengths in nm, where the histogram looks, and which
    component the context asks for."""

    heights: Any
    theta: float
    wavelengths: tuple[float, ...]
    parameters: dict[str, Any] = field(default_factory=dict)
    order: tuple[float, float] | None = None  # rad/µm; None for the whole disc
    component: int | None = None  # None for all

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


TAYLOR, PATCH = {"basis": "taylor"}, {"coherence": "patch"}
PERIOD = 2.0 * math.pi / 2.0  # of the gratings' orders, rad/µm
CASES = {
    "chebyshev, ensemble, 0°": Case(ROUGH, 0.0, (550.0,), SMALL),
    "chebyshev, ensemble, 45°": Case(ROUGH, 45.0, (400.0,), SMALL),
    "chebyshev, ensemble, 80°": Case(ROUGH, 80.0, (700.0,), SMALL),
    "chebyshev, patch, 30°": Case(ROUGH, 30.0, (550.0,), SMALL | PATCH),
    "chebyshev, patch, 80°": Case(ROUGH, 80.0, (400.0,), SMALL | PATCH),
    "taylor, ensemble, 20°": Case(ROUGH, 20.0, (700.0,), SMALL | TAYLOR),
    "taylor, ensemble, 70°": Case(ROUGH, 70.0, (400.0,), SMALL | TAYLOR),
    "taylor, patch, 50°": Case(ROUGH, 50.0, (550.0,), SMALL | TAYLOR | PATCH),
    "deep, 35°": Case(DEEP, 35.0, (400.0,), SMALL),
    "deep, dispersed, 60°": Case(DEEP, 60.0, DISPERSED, SMALL),
    "dispersed, 0°": Case(ROUGH, 0.0, DISPERSED, SMALL),
    "blazed, turned and scaled, 35°": Case(blazed, 35.0, (550.0,), BLAZED),
    "blazed, turned, dispersed, 75°": Case(blazed, 75.0, DISPERSED, BLAZED),
    "over pigment, 35°": Case(ROUGH, 35.0, (550.0,), SMALL | PIGMENT),
    "over pigment, turned, dispersed, 70°": Case(
        ROUGH, 70.0, DISPERSED, SMALL | PIGMENT | {"orientation": -50.0}
    ),
    "over gloss, 50°": Case(ROUGH, 50.0, (700.0,), SMALL | GLOSSY_BELOW),
    **{
        f"{name}, component {n}, 35°": Case(ROUGH, 35.0, (550.0,), SMALL | beneath, component=n)
        for name, beneath in (("over pigment", PIGMENT), ("over principled", PRINCIPLED))
        for n in (0, 1)
    },
    "mirror, 65 µm, its lobe": Case(
        md.HeightField(np.zeros((60, 60)), 0.085), 30.0, (550.0,), {}, (0.0, 0.0)
    ),
    "sinusoid, 65 µm, order 0": Case(sinusoid, 60.0, (550.0,), {}, (0.0, 0.0)),
    "sinusoid, 65 µm, order 1": Case(sinusoid, 20.0, (400.0,), {}, (PERIOD, 0.0)),
    "sinusoid, 65 µm, dispersed": Case(sinusoid, 20.0, DISPERSED, {}, (PERIOD, 0.0)),
    "lobes far apart, order 1": Case(
        rough_patch((60, 60), (0.13, 0.13), 0.12),
        20.0,
        (550.0,),
        {"coherence_width": 60.0},
        (2.0 * math.pi / 7.8, 0.0),
    ),
    "a made scale, 20 µm, 10°": Case(like_elaphe, 10.0, (550.0,), {"coherence_width": 20.0}),
    "measured scale, 65 µm, its specks": Case("elaphe", 45.0, (550.0,), {}, (5.9, 0.0)),
    "measured scale, 16 µm, 80°": Case("elaphe", 80.0, (400.0,), {"coherence_width": 16.0}),
}
RESOLUTION = 64
SAMPLES = 1 << 21


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


def chi_square(bsdf: Any, case: Case, *, pdf_at: tuple[float, ...] | None = None) -> Any:
    """The test of a case; `pdf_at` asks for the density at other wavelengths than sampled."""
    wi = polar(case.theta, AZIMUTH)
    context = mi.BSDFContext(mi.TransportMode.Radiance, int(mi.BSDFFlags.All), case.component)

    def lanes(wavelengths: tuple[float, ...]) -> Any:
        si = interaction(wi, np.broadcast_to(wavelengths, (1, 4)))
        dr.eval(si)
        return si

    sampled, asked = lanes(case.wavelengths), lanes(pdf_at or case.wavelengths)
    # what is folded to near the horizon has narrow cells there, lit most by grazing light
    domain, subdivisions = EqualAreas(), 48 if case.theta >= 75.0 else 24
    if case.order is not None:
        k = 2e3 * math.pi / case.wavelengths[0]
        x, y = (float(q / k - w) for q, w in zip(case.order, wi[:2], strict=True))
        domain = EqualAreas((x, y), 0.1)
        subdivisions = 12

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
        sample_count=SAMPLES,
        res=RESOLUTION,
        ires=subdivisions,
        seed=1,
    )


@pytest.mark.parametrize("name", CASES)
def test_the_density_is_that_of_the_samples(variant, request, name):
    case = CASES[name]
    shared = request.getfixturevalue("shared_afm") if case.heights == "elaphe" else None
    test = chi_square(case.load(shared), case)
    # 1 % for all cases together; the numbers drawn are always the same
    assert test.run(0.01, len(CASES), quiet=True), test.messages
    # enough of the samples fall where the histogram looks to say something
    assert test.histogram_sum[0] > 0.01, test.messages


def test_a_wrong_density_is_rejected(variant):
    case = CASES["chebyshev, ensemble, 45°"]
    test = chi_square(case.load(), case, pdf_at=(404.0,))  # 1 % beside the samples' wavelength
    assert not test.run(0.01, len(CASES), quiet=True)
