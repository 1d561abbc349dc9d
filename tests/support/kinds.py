"""Surfaces of every kind, each beside the reference: a new kind is one row, and gets all tests."""

from __future__ import annotations

from typing import Any, NamedTuple

import drjit as dr
import mitsuba as mi
import numpy as np
import pytest
from numpy.testing import assert_allclose

import mitsuba_diffraction as md
from mitsuba_diffraction import reference
from tests.support.directions import Array, as_single, turned
from tests.support.lanes import with_bitmaps
from tests.support.layered import BELOW, INDICES, PATCH, SIDES, WIDTH, both, load, pairs
from tests.support.stokes import matrices, reference_matrices
from tests.support.variants import evaluate

METAL = {"eta": 0.9, "k": 6.0}
COATED = METAL | {"coat_ior": 1.58}, METAL | {"coat": 1.58}
FILMED = METAL | {"film_ior": 1.77, "film_thickness": 250.0}, METAL | {"film": (1.77, 250.0)}
#: A quarter of the way from 100 to 700 nm.
QUARTER = {
    "film_thickness_min": 100.0, "film_thickness_max": 700.0,
    "film_thickness": np.full((2, 2), 0.25),
}  # fmt: skip
PIGMENT = {"type": "diffuse", "reflectance": {"type": "uniform", "value": 0.4}}
PLANE = {"model": "kirchhoff"}
SLOPE = {"model": "small_slope"}
ON_SURFACE = {"coherence": "surface", "uv_scale": 10.0}
PLACED = {"coherence": "surface"}
WINDOW = {"coherence": "patch"}


class Kind(NamedTuple):
    """Parameters of the plugin, and of the reference where it knows the kind.

    Arrays are texels of a bitmap. `stretch` and `height` are factors on the lengths and heights of
    the reference's patch, which is turned by `turn` degrees.
    """

    parameters: dict[str, Any]
    reference: dict[str, Any] | None = None
    stretch: float = 1.0
    height: float = 1.0
    turn: float = 0.0

    def known(self, place: tuple[float, float] = (0.0, 0.0)) -> dict[str, Any]:
        """Patch and parameters of the reference, for light at a place of surfaces."""
        assert self.reference is not None
        patch = md.HeightField(self.height * PATCH.heights, PATCH.pixel_size)
        # stretched heights keep the table's window, which the light's limits
        own = {"coherence_width": WIDTH * min(self.stretch, 1.0)} | self.reference
        own |= {"place": place} if own.get("coherence") == "surface" else {}
        return {"field": patch.stretched(self.stretch), **own}


KINDS: dict[str, Kind] = {
    "mirror": Kind({"material": "none"}, {}),
    "dielectric": Kind(INDICES, SLOPE | {"eta": 1.5}),
    "metal": Kind(METAL, METAL | SLOPE),
    "coat": Kind(COATED[0], COATED[1] | SLOPE),
    "film": Kind(FILMED[0], FILMED[1] | SLOPE),
    "pigment": Kind(INDICES | {"pigment": PIGMENT}),
    "height scales": Kind(
        {"material": "none", "height_scale": np.full((2, 2), 0.7)}, {}, height=0.7
    ),
    "surface": Kind({"material": "none"} | ON_SURFACE, PLACED),
    "narrower": Kind(INDICES | {"lateral_scale": 0.7}, SLOPE | {"eta": 1.5}, stretch=0.7),
}
#: Of `make test-all` alone.
MORE: dict[str, Kind] = {
    "less dense": Kind({"int_ior": 1.0, "ext_ior": 1.4}, SLOPE | {"eta": 1.0 / 1.4}),
    "nearly a dielectric": Kind({"eta": 1.56, "k": 1e-3}, SLOPE | {"eta": 1.56, "k": 1e-3}),
    "coat on a dielectric": Kind(
        {"int_ior": 1.7, "ext_ior": 1.0, "coat_ior": 1.4}, SLOPE | {"eta": 1.7, "coat": 1.4},
    ),
    "film on a dielectric": Kind(
        INDICES | {"film_ior": 2.4, "film_k": 0.1, "film_thickness": 150.0},
        SLOPE | {"eta": 1.5, "film": (2.4 + 0.1j, 150.0)},
    ),
    "one window": Kind({"material": "none"} | WINDOW, WINDOW),
    "one window of a metal": Kind(METAL | WINDOW, METAL | SLOPE | WINDOW),
    "turned, powers of the phase": Kind(
        {"material": "none", "basis": "taylor", "orientation": 25.0, "height_scale": 0.8}, {},
        height=0.8, turn=25.0,
    ),
    "turned by a picture": Kind(
        {"material": "none", "orientation": np.tile([-0.6, 0.8, 0.0], (2, 2, 1))}, {},
        turn=126.86989765,
    ),
    "in its own shade": Kind(METAL | {"shadowing": "vcavity"}),
    "dielectric, tangent plane": Kind(INDICES | PLANE, PLANE | {"eta": 1.5}),
    "metal, tangent plane": Kind(METAL | PLANE, METAL | PLANE),
    "coat, tangent plane": Kind(COATED[0] | PLANE, COATED[1] | PLANE),
    "film, tangent plane": Kind(FILMED[0] | PLANE, FILMED[1] | PLANE),
    "film, lower": Kind(FILMED[0] | {"height_scale": 0.5}, FILMED[1] | SLOPE, height=0.5),
    "film of a picture, lower": Kind(
        FILMED[0] | QUARTER | PLANE | {"height_scale": 0.5}, FILMED[1] | PLANE, height=0.5
    ),
    "coat, narrower": Kind(COATED[0] | {"lateral_scale": 0.7}, COATED[1] | SLOPE, stretch=0.7),
    "wider": Kind({"material": "none", "lateral_scale": 1.4}, {}, stretch=1.4),
    "surface, narrower": Kind(
        {"material": "none", "lateral_scale": 0.7} | ON_SURFACE, PLACED, stretch=0.7
    ),
    "surface under a coat, narrower": Kind(
        COATED[0] | ON_SURFACE | {"lateral_scale": 0.7}, COATED[1] | SLOPE | PLACED, stretch=0.7
    ),
}  # fmt: skip

#: Light that goes through.
THROUGH: dict[str, dict[str, Any]] = {
    **{f"through a {name}": parameters for name, parameters in SIDES.items()},
    "through a narrower dielectric": {"lateral_scale": 0.7},
}
#: Mixes; the sheets of `make test-all` alone.
MIX, MIXED_SHEETS = "blended patches", "through blended sheets"
#: Their parts, of which the first has a weight of 0.3.
PARTS = {MIX: ("mirror", "dielectric"), MIXED_SHEETS: ("through a sheet", "through a sheet")}


def made(kind: str, field: md.HeightField = PATCH, **more: Any) -> Any:
    """The BSDF of a kind that reflects or transmits, or a mix, in the variant that is set."""
    if kind in PARTS:
        one, two = (made(part, field, **more) for part in PARTS[kind])
        return mi.load_dict({"type": "diffraction_mix", "one": one, "two": two, "weight_one": 0.3})
    if kind in THROUGH:
        return both(field, wavelength=600.0, **THROUGH[kind], **more)
    parameters = (KINDS | MORE)[kind].parameters | more
    return load(field, wavelength=600.0, **with_bitmaps(parameters))


def exact(kind: str, wi: Array, wo: Array, wavelengths: Array) -> Array | None:
    """The reference's f |cosθo| (n, channels) of wavelengths of that shape, if it knows the kind.

    Radiance of what goes through is that of equal media on both sides.
    """
    if kind in PARTS:
        one, two = (exact(part, wi, wo, wavelengths) for part in PARTS[kind])
        return 0.3 * one + 0.7 * two
    if kind in THROUGH:
        own = SLOPE | {"eta": 1.5} | THROUGH[kind]
        like, function = Kind({}, own, own.pop("lateral_scale", 1.0)), reference.btdf
    else:
        like, function = (KINDS | MORE)[kind], reference.brdf
    if like.reference is None:
        return None
    known, pair = like.known(), (turned(wi, -like.turn), turned(wo, -like.turn))
    patch = known.pop("field")
    columns = [function(patch, *pair, one, **known) for one in wavelengths.T]
    return np.stack(columns, axis=1) * np.abs(wo[:, 2:])


#: Where light falls; v runs against the second axis of the frame.
_UV = np.array([0.4, -0.9])
_HIT = {"uv": _UV.tolist(), "dp_du": [1, 0, 0], "dp_dv": [0, -1, 0]}


def check_matrices(kind: str) -> None:
    """Compare matrices of a kind that reflects with the reference, in a polarised variant."""
    like = (KINDS | MORE)[kind]
    wi, wo, lam = (part[[8, -1]] for part in lit(kind, 200))  # near the mirror direction, and far
    found = matrices(made(kind), wi, wo, lam, **_HIT)
    known = like.known(tuple(10.0 * _UV * [1, -1]))
    expected = reference_matrices(known.pop("field"), wi, wo, lam, like.turn, **known)
    # the table's tolerance where light is scarce; 1e-3 of every value elsewhere
    assert_allclose(found, expected, rtol=1e-3, atol=1e-5 * expected.max())


def lit(kind: str, count: int) -> tuple[Array, Array, Array]:
    """Directions of light and eye, to where the kind sends light, and wavelengths (count, 4)."""
    wi, wo, lam = (part[:count] for part in pairs())
    return wi, as_single(wo * BELOW) if kind.startswith("through") else wo, lam


def check(kind: str, count: int) -> None:
    """Compare a kind with the reference and with itself, in the variant that is set.

    `eval` and `eval_pdf` agree, components add up, samples are as dense and bright as these say.
    """
    wi, wo, lam = lit(kind, count)
    lam = lam if mi.is_spectral else np.full_like(lam, 600.0)
    samples = as_single(np.random.default_rng(2).random((len(wi), 3)))
    bsdf = made(kind)
    value, pdf, again, pdf_again, drawn, density, weight = evaluate(bsdf, wi, wo, samples, lam)
    assert np.all(np.isfinite(value))
    assert np.any(value > 0.0)
    assert again == pytest.approx(value, rel=1e-5)
    assert pdf_again == pytest.approx(pdf, rel=1e-5)
    assert np.all(np.isfinite(weight))
    assert np.all(np.isfinite(density))
    valid = density > 0.0
    assert np.linalg.norm(drawn[valid], axis=1) == pytest.approx(1.0, abs=1e-5)
    there, dense, *_ = evaluate(bsdf, wi, np.where(valid[:, None], drawn, wo), samples, lam)
    assert density[valid] == pytest.approx(dense[valid], rel=1e-3)
    product = (weight * density[:, None])[valid]
    assert product == pytest.approx(there[valid], rel=2e-3, abs=1e-5 * np.abs(there).max())
    if not dr.is_jit_v(mi.Float):  # each component would be another kernel
        components = range(bsdf.component_count())
        parts = [evaluate(bsdf, wi, wo, samples, lam, component)[0] for component in components]
        assert sum(parts) == pytest.approx(value, rel=1e-5)
        assert kind not in THROUGH or not parts[0].any()  # component 0 is reflected light
    expected = None if mi.is_rgb else exact(kind, wi, wo, lam if mi.is_spectral else lam[:, :1])
    if expected is not None:
        # the table's tolerance where light is scarce; 1e-3 of every value elsewhere
        assert value == pytest.approx(expected, rel=1e-3, abs=1e-5 * expected.max())
