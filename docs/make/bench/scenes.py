"""Scenes to measure with; noise and variance beside drawing directions by the cosine."""

from __future__ import annotations

import time
import warnings
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np

from mitsuba_diffraction.analysis.maps import LightDirection
from mitsuba_diffraction.errors import DiffractionWarning
from mitsuba_diffraction.progress import Progress

from .contenders import Tables
from .figures import Goal, Plan, Row, Section

#: Of noise: angle of incidence in degrees, relative standard deviation that one sample may have.
_GOALS = {0.0: 0.6, 45.0: 0.8, 75.0: 1.2}
#: Azimuths of the light, degrees.
AZIMUTHS = (0.0, 30.0, 60.0, 90.0, 120.0, 150.0)
#: Wavelengths of the light whose noise is measured, nm.
WAVELENGTHS = (450.0, 550.0, 650.0)
# Seed of random numbers; share of directions that the plugin draws evenly
_SEED, _EVEN = 20140113, 0.03
#: Samples a pixel of the rendering in which bright pixels are looked for.
FIREFLY_SPP = 64


def furnace(bsdf: Any, resolution: int) -> Any:
    """A ball that fills the picture's circle, under the same light from everywhere."""
    return mi.load_dict(
        {
            **_frame(
                mi.ScalarTransform4f().look_at(origin=[0, -3, 0], target=[0, 0, 0], up=[0, 0, 1]),
                resolution,
                resolution,
            ),
            "body": {"type": "sphere", "bsdf": bsdf},
            "light": {"type": "constant", "radiance": {"type": "d65"}},
        }
    )


def window(rows: int = 128) -> dict[str, Any]:
    """A dim sky, dark ground, and a bright window of 20 × 20 degrees; `rows` of the map."""
    light = np.full((rows, 2 * rows, 3), 0.5, np.float32)
    light[rows // 2 :] = 0.05
    degree = rows / 180.0
    top, left = int(35 * degree), int(200 * degree)
    light[top : top + int(20 * degree), left : left + int(20 * degree)] = 30.0
    turned = mi.ScalarTransform4f().rotate([1, 0, 0], 90)
    return {"light": {"type": "envmap", "bitmap": mi.Bitmap(light), "to_world": turned}}


def pigment(scenes: Path) -> dict[str, Any]:
    """The snake's own colours, to lie beneath the diffracting surface."""
    file = scenes / "textures" / "elaphe.png"
    scale = mi.ScalarTransform4f().scale([0.05, 1.0, 1.0])
    return {
        "type": "diffuse",
        "reflectance": {"type": "bitmap", "filename": str(file), "to_uv": scale},
    }


def snake(bsdf: Any, scenes: Path, width: int, height: int, light: dict[str, Any]) -> Any:
    """The coiled snake without the ground."""
    mesh = scenes / "meshes" / "elaphe.ply"
    above = mi.ScalarTransform4f().look_at(
        origin=[2.3, -32, 26], target=[1.4, -0.7, 0.6], up=[0, 0, 1]
    )
    return mi.load_dict(
        {
            **_frame(above @ mi.ScalarTransform4f().scale([9.0, 9.0, 1.0]), width, height),
            "body": {
                "type": "ply",
                "filename": str(mesh),
                "bsdf": {"type": "twosided", "bsdf": bsdf},
            },
            **light,
        }
    )


def snake_scene(scenes: Path, table: Path, **parameters: str) -> Any:
    """`snake.xml` with a table, without warnings of how far the model holds for it."""
    file = scenes / "snake.xml"
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", DiffractionWarning)
        return mi.load_file(str(file), patch=str(table), **parameters)


def skin_of(scene: Any) -> Any:
    """The snake in its scene."""
    return next(shape for shape in scene.shapes() if shape.id() == "snake")


def pixels_of(scene: Any, shape: Any) -> Any:
    """Which pixels see the shape at their centre, (height, width) of bool."""
    width, height = scene.sensors()[0].film().crop_size()
    _, ray = rays(scene, 1)
    hit = scene.ray_intersect_preliminary(ray)
    seen = hit.is_valid() & (hit.shape == mi.ShapePtr(shape))
    return np.array(seen, bool).reshape(height, width)


def rays(scene: Any, side: int) -> tuple[int, Any]:
    """Number of pixels, and side² rays through each of them, one pixel after the other."""
    sensor = scene.sensors()[0]
    width, height = sensor.film().crop_size()
    index = dr.arange(mi.UInt32, width * height * side**2)
    pixel, part = index // side**2, index % side**2
    position = mi.Point2f(
        (mi.Float(pixel % width) + (mi.Float(part % side) + 0.5) / side) / width,
        (mi.Float(pixel // width) + (mi.Float(part // side) + 0.5) / side) / height,
    )
    return width * height, sensor.sample_ray(0.0, 0.5, position, mi.Point2f(0.5))[0]


def _frame(to_world: Any, width: int, height: int) -> dict[str, Any]:
    return {
        "type": "scene",
        "integrator": {"type": "path", "max_depth": 4},
        "sensor": {
            "type": "orthographic",
            "to_world": to_world,
            "film": {
                "type": "hdrfilm",
                "width": width,
                "height": height,
                "component_format": "float32",
                "rfilter": {"type": "box"},
            },
            "sampler": {"type": "independent"},
        },
    }


def measure_noise(plan: Plan, tables: Tables, progress: Progress) -> Section:
    """Relative standard deviation of one sample's estimate of the directional albedo."""
    orders = tables.bsdf("default", material="none", energy_conserving=False)
    cosine = draws_by_cosine(tables.bsdf("default", material="none", energy_conserving=False))
    rows = []
    for n, (theta, goal) in enumerate(_GOALS.items()):
        progress(n, len(_GOALS), "noise")
        row = noise_row(f"{theta:g}°", orders, theta, goal, plan.lanes)
        row.values["by the cosine"] = deviation_of(cosine, theta, 0.0, 550.0, plan.lanes)[0]
        rows.append(row)
    progress(len(_GOALS), len(_GOALS), "noise")
    title = (
        "noise: relative standard deviation of one sample's albedo, R = 1, raw Kirchhoff, "
        f"{len(AZIMUTHS)} azimuths of the light and {len(WAVELENGTHS)} wavelengths from "
        f"{WAVELENGTHS[0]:g} to {WAVELENGTHS[-1]:g} nm"
    )
    return Section(title, rows)


def noise_row(name: str, bsdf: Any, theta: float, most: float, lanes: int) -> Row:
    """Return the noise of one sample for light at an angle; `most` is the goal."""
    samples = [
        deviation_of(bsdf, theta, phi, wavelength, lanes)
        for phi in AZIMUTHS
        for wavelength in WAVELENGTHS
    ]
    deviations, weights = (list(column) for column in zip(*samples, strict=True))
    values: dict[str, float | None] = {
        "least": min(deviations), "median": float(np.median(deviations)), "most": max(deviations),
        "largest weight": max(weights),
    }  # fmt: skip
    goals = [Goal(f"at most {most:g}", max(deviations) <= most)]
    return Row(name, values, goals, {"standard deviations": deviations})


def measure_efficiency(plan: Plan, tables: Tables, scenes: Path, progress: Progress) -> Section:
    """Variance × time of pictures, against drawing by the cosine; and pixels far too bright."""
    size = plan.resolution

    def bsdf() -> Any:
        return tables.bsdf("default", material="none")

    cases: dict[str, Callable[[Any], Any]] = {
        "white furnace": lambda b: furnace(b, size // 2),
        "snake under a window": lambda b: snake(b, scenes, size // 2, size // 3, window()),
    }
    rows = []
    for n, (name, make) in enumerate(cases.items()):
        progress(n, len(cases), name)
        orders, cosine = make(bsdf()), make(draws_by_cosine(bsdf()))
        pixels = pixels_of(orders, orders.shapes()[0])
        variance, seconds = _variance_and_time(orders, pixels, plan)
        cosine_variance, cosine_seconds = _variance_and_time(cosine, pixels, plan)
        ratio = cosine_variance * cosine_seconds / (variance * seconds)
        brightest = _brightest(orders, pixels, plan)
        values: dict[str, float | None] = {
            "variance × time, ratio": ratio, "variance, ratio": cosine_variance / variance,
            "time, ratio": cosine_seconds / seconds, "brightest pixel, ratio": brightest,
        }  # fmt: skip
        goals = [Goal("at least 100×", ratio >= 100.0)]
        if name.startswith("snake"):
            goals.append(Goal("brightest within 5×", brightest <= 5.0))
        rows.append(Row(name, values, goals))
    progress(len(cases), len(cases), "efficiency")
    title = (
        "efficiency: drawing by the cosine over our own, path integrator, material=none, variance "
        f"of the body's pixels; their brightest at {FIREFLY_SPP} samples a pixel over that at "
        f"{plan.reference_spp}"
    )
    return Section(title, rows)


def draws_by_cosine(bsdf: Any) -> Any:
    """Have the plugin draw directions from the cosine lobe instead of the orders."""

    def draw(ctx: Any, site: Any, sample1: Any, sample2: Any) -> Any:
        even = mi.warp.square_to_uniform_hemisphere(sample2)
        return dr.select(sample1 < _EVEN, even, mi.warp.square_to_cosine_hemisphere(sample2))

    bsdf.draw, bsdf.power = draw, _ByCosine(bsdf.power)
    return bsdf


class _ByCosine:
    """A power model with another density."""

    def __init__(self, power: Any) -> None:
        self._model = power

    def __getattr__(self, name: str) -> Any:
        return getattr(self._model, name)

    def answers(self, pair: Any, *others: Any) -> Any:
        power, _ = self._model.answers(pair, *others)
        return power, mi.warp.square_to_cosine_hemisphere_pdf(pair.outer.wo)


def deviation_of(
    bsdf: Any, theta: float, phi: float, wavelength: float, lanes: int
) -> tuple[float, float]:
    """Relative standard deviation of the weights, and the largest of them."""
    si = dr.zeros(mi.SurfaceInteraction3f, lanes)
    si.wi = mi.Vector3f(*(float(c) for c in LightDirection(theta, phi).direction))
    si.wavelengths = mi.Spectrum(wavelength)
    dr.make_opaque(si.wi, si.wavelengths)  # one kernel for all of them
    random = mi.PCG32(size=lanes, initstate=_SEED)
    numbers = [random.next_float32() for _ in range(3)]
    _, weight = bsdf.sample(mi.BSDFContext(), si, numbers[0], mi.Point2f(numbers[1], numbers[2]))
    weights = np.array(weight[0], float)
    return float(weights.std() / weights.mean()), float(weights.max())


def _variance_and_time(scene: Any, pixels: Any, plan: Plan) -> tuple[float, float]:
    """Mean over the pixels of the luminance's variance between renderings, and seconds for one."""
    pictures, seconds = [], []
    for seed in range(-1, 2 * plan.rounds):  # the first compiles
        start = time.perf_counter()
        picture = mi.render(scene, spp=plan.spp, seed=seed + 1)
        dr.eval(picture)
        dr.sync_thread()
        if seed >= 0:
            seconds.append(time.perf_counter() - start)
            pictures.append(_luminance(picture)[pixels])
    return float(np.var(pictures, axis=0, ddof=1).mean()), float(np.median(seconds))


def _brightest(scene: Any, pixels: Any, plan: Plan) -> float:
    """Brightest pixel of a fast rendering over the brightest of a converged one."""

    def brightest(spp: int, seeds: Sequence[int]) -> float:
        mean = np.mean([_luminance(mi.render(scene, spp=spp, seed=s)) for s in seeds], axis=0)
        return float(mean[pixels].max())

    passes = max(1, plan.reference_spp // 256)
    converged = brightest(plan.reference_spp // passes, range(1000, 1000 + passes))
    return brightest(FIREFLY_SPP, [_SEED]) / converged


def _luminance(picture: Any) -> Any:
    rgb = np.array(picture)[..., :3]
    return rgb @ np.array([0.2126, 0.7152, 0.0722])
