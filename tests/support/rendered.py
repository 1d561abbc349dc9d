"""Derivatives of a rendering against differences with the same random numbers."""

from __future__ import annotations

from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np
import pytest
from numpy.typing import ArrayLike

import mitsuba_diffraction as md
from tests.support.directions import Array
from tests.support.lanes import with_bitmaps
from tests.support.plates import camera

GRATING = md.gratings.sinusoidal(1.6, 0.2, periods=3, pixels_per_period=20)
PIGMENT = {"type": "diffuse", "reflectance": {"type": "uniform", "value": 0.4}}
PIXELS = 8
#: Half the step of differences, relative to a parameter's value, below the steps in which
#: coefficients follow an index (0.01).
STEP = 1e-3
#: Half the step of angles, degrees, and of a film's thickness, nm or the texture's share of 300 nm:
#: g follows it in steps of 1 nm.
STEPS = {"orientation": 0.02, "film_thickness": 1.0, "film_thickness.data": 4e-3}
#: Texels of bitmaps: factors or weights, and directions 10° to 25° from the tangent.
TEXELS = np.array([[[0.8], [0.9]], [[0.95], [0.85]]])
_ANGLES = np.radians([[10.0, 20.0], [25.0, 15.0]])
DIRECTIONS = np.stack([np.cos(_ANGLES), np.sin(_ANGLES), 0.0 * _ANGLES], axis=2)


#: Orientation and factors of bitmaps, with room above their largest factors.
VARYING = {
    "orientation": DIRECTIONS, "height_scale": TEXELS, "height_scale_max": 1.2,
    "lateral_scale": TEXELS, "lateral_scale_max": 1.2,
}  # fmt: skip
VARIED = {
    "orientation.data": DIRECTIONS, "height_scale.data": TEXELS, "lateral_scale.data": TEXELS,
}  # fmt: skip

#: Surfaces by what they show: plugin's parameters, and the values to take derivatives at. Arrays
#: are texels of bitmaps.
SURFACES: dict[str, tuple[dict[str, Any], dict[str, Any]]] = {
    "metal": (
        {"eta": 0.9, "k": 6.0, "lateral_scale": 2.0},
        {"orientation": 20.0, "height_scale": 0.9, "lateral_scale": 1.5, "eta.value": 0.9,
         "k.value": 6.0},
    ),
    "pigment": (
        {"int_ior": 1.5, "beneath": PIGMENT},
        {"orientation": 20.0, "height_scale": 0.9, "eta": 1.5, "nested.reflectance.value": 0.4},
    ),
    "coat": (
        {"eta": 0.9, "k": 6.0, "coat_ior": 1.5, "lateral_scale": 1.0},
        {"orientation": 20.0, "height_scale": 0.9, "lateral_scale": 0.9, "coat_eta": 1.5,
         "eta.value": 0.9, "k.value": 6.0},
    ),
    "film": (
        {"eta": 0.9, "k": 6.0, "film_ior": 2.0, "film_thickness": 200.0},
        {"orientation": 20.0, "height_scale": 0.9, "film_thickness": 200.0, "film_eta": 2.0,
         "film_k": 0.05, "eta.value": 0.9, "k.value": 6.0},
    ),
    "textured film": (
        {"eta": 0.9, "k": 6.0, "film_ior": 1.6, "film_thickness": TEXELS,
         "film_thickness_max": 300.0},
        {"orientation": 20.0, "height_scale": 0.9, "film_thickness.data": TEXELS,
         "film_eta": 1.6, "film_k": 0.05, "eta.value": 0.9, "k.value": 6.0},
    ),
    "patch": (
        {"material": "none", "coherence": "patch", "lateral_scale": 1.0},
        {"orientation": 20.0, "height_scale": 0.9, "lateral_scale": 0.9},
    ),
    "places": (
        {"material": "none", "coherence": "surface", "uv_scale": 3.0, "lateral_scale": 1.0},
        {"orientation": 20.0, "height_scale": 0.9, "lateral_scale": 0.9},
    ),
    "dielectric": (
        {"plugin": "diffraction_dielectric", "lateral_scale": 1.0},
        {"orientation": 20.0, "height_scale": 0.9, "lateral_scale": 0.9, "eta": 1.5},
    ),
    "sheet": (
        {"plugin": "diffraction_dielectric", "thin": True},
        {"orientation": 20.0, "height_scale": 0.9, "eta": 1.5},
    ),
    "textures": (
        {"int_ior": 1.5, "beneath": {"type": "diffuse", "reflectance": 0.5 * TEXELS}, **VARYING},
        {"nested.reflectance.data": 0.5 * TEXELS, "eta": 1.5, **VARIED},
    ),
    "textured sheet": (
        {"plugin": "diffraction_dielectric", "thin": True, **VARYING}, {"eta": 1.5, **VARIED},
    ),
}  # fmt: skip


def scene(bsdf: dict[str, Any]) -> Any:
    """A plate that a lamp on either side lights, sampled by its lamps alone."""
    lamps = {
        f"lamp{n}": {
            "type": "sphere",
            "center": [-2, -1, z],
            "radius": 0.7,
            "emitter": {"type": "area", "radiance": {"type": "rgb", "value": 10.0}},
        }
        for n, z in enumerate((5, -4))
    }
    channels = "luminance" if mi.is_monochromatic else "rgb"
    return mi.load_dict(
        {
            "type": "scene",
            "integrator": {"type": "direct", "emitter_samples": 1, "bsdf_samples": 0},
            "sensor": camera([0.8, 0.2, 3.0], PIXELS, fov=30.0, pixel_format=channels),
            "plate": {"type": "rectangle", "bsdf": bsdf},
            **lamps,
        }
    )


def check(
    bsdf: dict[str, Any],
    at: dict[str, Any],
    spp: int = 64,
    within: float = 0.05,
    along: ArrayLike = 1.0,
    step: float | None = None,
) -> None:
    """Compare derivatives, forward and backward, with differences of the same random numbers.

    within : relative difference that is allowed.
    along : how numbers of an array move; by default all alike.
    step : half of that of differences, for parameters without one of their own.
    """
    # look-ups of colours bend between their bins: their kinks average out
    spp = 4 * spp if mi.is_rgb else spp
    loaded = scene(bsdf)
    parameters = mi.traverse(loaded)
    keys = {name: f"plate.bsdf.{name}" for name in at}

    def picture(
        values: dict[str, Any], seeds: tuple[int, int] = (2, 1), ad: tuple[str, ...] = ()
    ) -> Any:
        for name, value in values.items():
            parameters[keys[name]] = type(parameters[keys[name]])(value)
            if name in ad:
                dr.enable_grad(parameters[keys[name]])
        parameters.update()
        # derivatives are taken with the random numbers of seed_grad
        return mi.render(loaded, parameters, spp=spp, seed=seeds[0], seed_grad=seeds[1])

    def derivative(name: str) -> Array:
        """Derivative of each pixel, forward."""
        image = picture(at, (1, 2), tuple(at))
        for other, key in keys.items():
            # an array rather than a literal: one kernel serves all parameters
            same = dr.detach(parameters[key])
            seed = 0.0 * same + (type(same)(along) if other == name else 0.0)
            dr.make_opaque(seed)
            dr.set_grad(parameters[key], seed)
        dr.enqueue(dr.ADMode.Forward, *(parameters[key] for key in keys.values()))
        dr.traverse(dr.ADMode.Forward)
        return np.array(dr.grad(image), np.float64)

    forward = {name: derivative(name) for name in at}
    # a weight for each pixel: what moves within the picture counts
    weights = np.random.default_rng(3).random(next(iter(forward.values())).shape)
    image = picture(at, (1, 2), tuple(at))
    dr.backward(dr.sum(image * mi.TensorXf(weights.astype(np.float32)), axis=None))
    sums = {name: float(np.sum(pixels * weights)) for name, pixels in forward.items()}
    for name, total in sums.items():
        backward = float((np.array(dr.grad(parameters[keys[name]])) * along).sum())
        # to rounding of sums
        assert backward == pytest.approx(total, rel=2e-3, abs=2e-3 * max(map(abs, sums.values())))

    for name, value in at.items():
        own = (STEPS[key] for key in STEPS if name.endswith(key))
        half = next(own, step or STEP * float(np.mean(value)))
        moved = (value + sign * half * np.asarray(along) for sign in (1.0, -1.0))
        ends = [np.array(picture(at | {name: numbers}), np.float64) for numbers in moved]
        difference = (ends[0] - ends[1]) / (2.0 * half)
        # single precision of the sums
        noise = 1e-6 * ends[0].sum() / half
        # pixels that brighten and those that darken do not cancel
        found = float(np.sum(forward[name] * np.sign(difference)))
        assert found == pytest.approx(np.abs(difference).sum(), rel=within, abs=noise), name


def plate(name: str, width: float, **more: Any) -> dict[str, Any]:
    """A surface of the table above, without scales of energy, which bend at their nodes."""
    own = {"energy_conserving": False, "coherence_width": width, "tolerance": 1e-3}
    parameters = own | SURFACES[name][0] | more
    return md.bsdf_dict(GRATING, **with_bitmaps(parameters, filter_type="bilinear"))
