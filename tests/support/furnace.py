"""White furnaces: the albedo of surfaces that gain light without conservation of energy."""

from __future__ import annotations

import tempfile
from pathlib import Path
from typing import Any, NamedTuple

import mitsuba as mi
import numpy as np

import mitsuba_diffraction as md
from mitsuba_diffraction.tables.energy.settings import EnergySettings
from tests.support.coarse import COARSE, energy_as
from tests.support.directions import polar
from tests.support.lanes import interaction, with_bitmaps
from tests.support.patches import SMALL_SCAN

ANGLES = (0.0, 20.0, 40.0, 55.0, 65.0, 75.0, 80.0, 84.0, 87.0, 89.0)
AZIMUTHS = (0.0, 37.0, 90.0, 180.0)
SAMPLES = 1 << 13


def isotropic(pixels: int, pixel: float, cutoff: float) -> np.ndarray:
    """Isotropic noise of RMS 1, (pixels, pixels), with waves up to about a frequency in 1/µm."""
    frequency = np.hypot(*np.meshgrid(*2 * [np.fft.fftfreq(pixels, pixel)]))
    noise = np.random.default_rng(4).standard_normal((pixels, pixels))
    heights = np.fft.ifft2(np.fft.fft2(noise) * np.exp(-((frequency / cutoff) ** 2))).real
    return heights / heights.std()


def sinusoid() -> md.HeightField:
    """1.6 µm period, 0.3 µm deep: orders up to ±4, strong Rayleigh spikes."""
    return md.gratings.sinusoidal(1.6, 0.3, periods=1, pixels_per_period=64, rows=16)


def sawtooth() -> md.HeightField:
    """2.5 µm period, 0.25 µm deep."""
    return md.gratings.blazed(2.5, 0.25, periods=1, pixels_per_period=100, rows=16)


def rough() -> md.HeightField:
    """20 µm of noise, 60 nm rms, correlated over about 1.5 µm."""
    return md.HeightField(0.06 * isotropic(160, 0.125, 0.3), 0.125)


DIELECTRIC = {"material": None, "int_ior": 1.5}
SURFACES = {
    "sinusoid": (sinusoid, {}),
    "sawtooth": (sawtooth, {}),
    "rough": (rough, {"coherence_width": 20.0}),
}


def bsdf(name: str, **parameters):
    field, own = SURFACES[name]
    given = {"material": "none", **own, **parameters}
    given = {key: value for key, value in given.items() if value is not None}
    return mi.load_dict(md.bsdf_dict(field(), **given))


def loaded(field: md.HeightField, parameters: dict[str, Any]) -> Any:
    """A surface whose arrays are texels of bitmaps, and whose `layers` are a file's text."""
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder, "stack.toml")
        if "layers" in parameters:
            file.write_text(parameters["layers"], encoding="utf-8")
            parameters = parameters | {"layers": str(file)}
        return mi.load_dict(md.bsdf_dict(field, **with_bitmaps(parameters)))


def furnace(surface, angles=ANGLES, azimuths=AZIMUTHS, seed=0) -> tuple[np.ndarray, np.ndarray]:
    """Albedo (4, directions) at four wavelengths for each direction, and its standard error."""
    directions = np.array([polar(theta, phi) for theta in angles for phi in azimuths])
    return furnace_in(surface, directions, seed)


def furnace_in(
    surface, directions: np.ndarray, seed: int, **light: object
) -> tuple[np.ndarray, np.ndarray]:
    """The same for directions (n, 3); `light` as in `sent_on`."""
    weights = sent_on(surface, directions, seed, **light)
    return weights.mean(axis=2), weights.std(axis=2) / np.sqrt(weights.shape[2])


def sent_on(
    surface, directions: np.ndarray, seed: int, wavelength=None, mode="Radiance", samples=SAMPLES
) -> np.ndarray:
    """Weights (wavelengths, directions, samples) of what a surface sends on from directions (n, 3).

    wavelength : nm, one or four; by default four at random for each direction.
    mode : of transport; radiance is n² times as large in a dielectric, importance is not.
    """
    count = len(directions)
    wavelengths = np.random.default_rng(seed).uniform(360.0, 830.0, (4, count))
    if wavelength is not None:
        wavelengths[:] = np.reshape(wavelength, (-1, 1))
    si = interaction(*(np.repeat(a, samples, axis=0) for a in (directions, wavelengths.T)))
    rng = mi.PCG32(count * samples, seed)
    sample1, sample2 = rng.next_float32(), mi.Point2f(rng.next_float32(), rng.next_float32())
    context = mi.BSDFContext(getattr(mi.TransportMode, mode))
    weight = mi.unpolarized_spectrum(surface.sample(context, si, sample1, sample2)[1])
    return np.array(weight, float).reshape(-1, count, samples)


def random_directions(rng: np.random.Generator, steepest: float) -> np.ndarray:
    """(40, 3), polar angles in degrees."""
    theta, phi = rng.uniform(0.0, steepest, 40), rng.uniform(0.0, 360.0, 40)
    return np.array([polar(t, p) for t, p in zip(theta, phi, strict=True)])


def steep_sinusoid() -> md.HeightField:
    """A scale is found for some height scales, and none needed for others near them."""
    x = np.arange(66) * 0.0915
    heights = 0.166 * np.sin(2 * np.pi * x / (66 * 0.0915 / 2))
    return md.HeightField(np.tile(heights, (22, 1)).copy(), (0.0915, 0.0656), periodic=True)


def noise(slope):
    """4.8 µm of isotropic noise of an RMS slope."""
    heights, pixel = isotropic(48, 0.1, 0.9), 0.1
    rms = np.sqrt(sum(((np.roll(heights, -1, axis) - heights) ** 2).mean() for axis in (0, 1)))
    return md.HeightField(heights * (slope * pixel / rms), pixel, periodic=True)


class Furnace(NamedTuple):
    """A surface that made light once, or might.

    parameters : of the plugin, as `loaded` takes them.
    most : bound of the albedo up to 85°; it is 0.04 larger beyond, where a lobe is cut.
    """

    field: md.HeightField
    parameters: dict[str, Any]
    most: float = 1.01
    variant: str = "llvm_ad_mono"
    energy: EnergySettings = EnergySettings()


#: 1.6 µm period, 60 nm deep.
_SHALLOW = md.gratings.sinusoidal(1.6, 0.06, periods=1, pixels_per_period=64, rows=16)
_FLAT = md.HeightField(np.zeros((8, 8)), 0.5, periodic=True)
_FINE = md.HeightField(np.zeros((8, 8)), 0.05, periodic=True)
_STEEP = md.HeightField(0.1 * np.random.default_rng(3).random((40, 40)), 0.1, periodic=True)
_STEPS = md.HeightField(0.29 * (np.arange(13) % 8 < 4) + np.zeros((22, 1)), (0.113, 0.0905))
_WALLS = md.HeightField(0.21 * (np.arange(59) % 8 < 4) + np.zeros((8, 1)), 0.0733)
_X = np.linspace(-1.0, 1.0, 20, endpoint=False)
_CAP = np.maximum(1.0 - _X**2 - _X[:, None] ** 2, 0.0)
_GROOVES = md.HeightField(0.09 * np.tile(np.arange(24) % 8 < 4, (8, 1)), 0.07)
_THROUGH = {"plugin": "diffraction_dielectric", "ext_ior": 1.0, "coherence_width": 5.0}
_SHEET = _THROUGH | {"thin": True}
_METAL = {"material": "Al", "coherence_width": 4.8}
_MIRROR, _GLASS = {"material": "none"}, {"int_ior": 1.5}
#: What lies beneath.
WHITE = {"beneath": {"type": "diffuse", "reflectance": {"type": "uniform", "value": 1.0}}}
_SPECTRAL = {"variant": "llvm_ad_spectral"}
_COARSE: dict[str, Any] = {"energy": COARSE}
_WIDE: dict[str, Any] = _SPECTRAL | _COARSE
_QUICK: dict[str, Any] = {"energy": EnergySettings(polar=24, azimuthal=12), **_SPECTRAL}
_VARYING = np.array([[0.95, 0.6, 1.0]])
#: Fringes come and go within 25 nm; a window of a wavelength smears them.
_FRINGES = WHITE | {"film_ior": 1.32, "int_ior": 1.1, "ext_ior": 1.0, "coherence_width": 0.5}
_STACK = 'layers = [["2.3", 0.0598], ["1.38", 0.0996]]\nrepeat = 10'

#: Of `make test` as well.
FURNACES = {
    "steep noise, narrower": Furnace(noise(0.5), _METAL | {"lateral_scale": 0.5}),
    "a thick film": Furnace(_FLAT, {
        "material": "Al", "film_ior": 1.206, "film_thickness": 1638.0, "coherence_width": 3.0,
        "wavelength": 573.0}),
    "a coat": Furnace(_SHALLOW, {"material": "Al", "coat_ior": 1.58, "coherence_width": 12.8}),
    "tangent planes": Furnace(noise(0.3), {
        "int_ior": 1.8, "ext_ior": 1.0, "model": "kirchhoff", "coherence_width": 4.8}),
    # the horizon cuts a lobe whose light rises as 1/cosθ: 1.18 came from 88.5°
    "orders that graze along steps": Furnace(_STEPS, _MIRROR | {
        "model": "kirchhoff", "coherence_width": 9.5, "wavelength": 600.0, "orientation": 108.0}),
    "a film of next to no contrast": Furnace(rough(), {
        "int_ior": 1.01, "ext_ior": 1.0, "film_ior": 1.05, "film_thickness": 50.0,
        "coherence_width": 20.0}, **_COARSE),
    # from inside beyond 80.3°: the index's rounding moves the critical angle
    "a narrow window at a critical angle": Furnace(
        _FLAT, _THROUGH | {"int_ior": 1.0145, "coherence_width": 2.0}, **_COARSE),
    # light is totally reflected from 72.25° on, where the albedo rises to 1 within a lobe
    **{f"white beneath a less dense medium, {width} µm": Furnace(
        _FINE, WHITE | {"int_ior": 1.0, "ext_ior": 1.05, "coherence_width": width}, **_COARSE)
       for width in (1.5, 6.0, 65.0)},
    "glass": Furnace(rough(), _GLASS | {"coherence_width": 20.0}, **_SPECTRAL),
    "glass over white": Furnace(rough(), _GLASS | WHITE | {"coherence_width": 20.0}, **_SPECTRAL),
}  # fmt: skip
#: Of `make test-all` alone.
FURNACES_MORE = {
    "steeper noise, narrower": Furnace(noise(1.33), _METAL | {"lateral_scale": 0.5}),
    "a narrower window of a sheet": Furnace(
        _FLAT, _SHEET | {"int_ior": 1.5, "coherence": "patch", "lateral_scale": 0.5}),
    "a window of a sheet of little contrast": Furnace(
        _FLAT, _SHEET | {"int_ior": 1.02, "coherence": "patch"}),
    "one narrow window": Furnace(_FLAT, _MIRROR | {"coherence": "patch", "coherence_width": 0.5}),
    "one window, a tenth as wide": Furnace(
        _FLAT, _MIRROR | {"coherence": "patch", "coherence_width": 10.0, "lateral_scale": 0.1}),
    "an interface of tangent planes": Furnace(_FLAT, _THROUGH | {
        "int_ior": 1.5, "model": "kirchhoff", "coherence_width": 1.2, "lateral_scale": 0.34,
        "wavelength": 624.0}),
    "a shallow mirror": Furnace(_SHALLOW, _MIRROR | {"coherence_width": 12.8}),
    "a thin coat on steep noise": Furnace(noise(0.55), _METAL | {"coat_ior": 1.01}),
    "a coat over white": Furnace(_FLAT, WHITE | {
        "int_ior": 1.012, "ext_ior": 1.0, "coat_ior": 1.306, "coherence_width": 1.0}),
    "deep mirror, narrower": Furnace(sinusoid(), _MIRROR | {"lateral_scale": 0.8}, 1.03, **_COARSE),
    "deep mirror, partly narrower": Furnace(
        sinusoid(), _MIRROR | {"lateral_scale": np.array([[0.8, 0.8, 1.0]])}, 1.03, **_COARSE),
    "deep mirror, higher": Furnace(sinusoid(), _MIRROR | {"height_scale": 1.3}),
    "deep mirror in its own shade": Furnace(sinusoid(), _MIRROR | {"shadowing": "vcavity"}),
    "deep mirror in a spectrum": Furnace(sinusoid(), _MIRROR, **_SPECTRAL),
    "saw over white in a spectrum": Furnace(sawtooth(), _GLASS | WHITE, **_SPECTRAL),
    "colours of a saw": Furnace(
        sawtooth(), _MIRROR | {"coherence_width": 15.0}, variant="llvm_ad_rgb"),
    "fringes": Furnace(_FINE, _FRINGES | {"film_thickness": 1738.0}, **_QUICK),
    "fringes of a texture": Furnace(_FINE, _FRINGES | {
        "film_thickness": np.array([[0.7, 0.0, 1.0]]), "film_thickness_min": 600.0,
        "film_thickness_max": 700.0}, **_QUICK),
    "stretched fringes": Furnace(
        _FINE, _FRINGES | {"film_thickness": 1738.0, "lateral_scale": _VARYING}, **_QUICK),
    # light of a stretch that differs from the mean one has other indices: 1.27, 1.45 under the film
    "stretched gold": Furnace(_GROOVES, {
        "material": "Au", "coherence_width": 0.9, "lateral_scale": _VARYING}, 1.04, **_WIDE),
    "stretched film": Furnace(_GROOVES, {
        "material": "Al", "film_ior": 1.5, "film_thickness": 300.0, "coherence_width": 0.9,
        "lateral_scale": _VARYING}, 1.04, **_WIDE),
    # a scale was looked up at the light of the mean stretch: 1.3
    "stretched layers of varied heights": Furnace(
        md.HeightField(0.157 * _CAP, 0.0907, periodic=True), {
            "int_ior": 1.065, "ext_ior": 1.0, "model": "kirchhoff", "coherence_width": 0.5,
            "layers": 'layers = [["1.0949", 0.0617], ["2.095", 0.0251], ["1.0", 0.0324]]',
            "lateral_scale": np.array([[1.0, 0.6, 0.78]]) * 0.455, "wavelength": 557.0,
            "height_scale": np.array([[1.32, 0.83, 1.0]])}, 1.02, **_COARSE),
    # one and a half fringes
    "silver under a film of a texture": Furnace(
        md.gratings.sinusoidal(1.6, 0.2, periods=1, pixels_per_period=24, rows=8),
        {"eta": 0.05, "k": 4.0, "coherence_width": 8.0, "film_ior": 1.4,
         "film_thickness_max": 300.0, "film_thickness": np.full((2, 2), 0.37)}, 1.02,
        **_COARSE),
    # 20 quarter waves of 550 nm: a stop band of 0.999
    **{f"a stack, {variant}": Furnace(
        md.gratings.sinusoidal(period=1.5, depth=0.1, periods=2),
        {"coherence_width": 3.0, "layers": _STACK}, variant=variant, **_COARSE)
       for variant in ("llvm_ad_rgb", "llvm_ad_mono_polarized")},
    # flat, it reflects 3e-5; a window of 1.4 wavelengths reflects 0.01 of light from 65°
    "a gap over white": Furnace(_FINE, WHITE | {
        "int_ior": 1.01, "ext_ior": 1.0, "layers": 'layers = [["1.0", 0.1]]',
        "coherence_width": 0.8}, **_WIDE),
    # the critical angle cuts lobes, and orders graze it within: 1.04
    **{f"walls of index {index}": Furnace(_WALLS, _THROUGH | {
        "int_ior": index, "model": "kirchhoff", "coherence_width": 6.73, "wavelength": wavelength})
       for index, wavelength in ((1.2945, 672.0), (2.106, 540.0))},
    # red has negative weights
    **{f"colours through {'a sheet' if thin else 'an interface'}": Furnace(
        _STEEP, _THROUGH | {"int_ior": 2.4, "coherence_width": 12.0, "thin": thin},
        variant="llvm_ad_rgb", **_COARSE) for thin in (False, True)},
    **{f"small scan, {name}": Furnace(SMALL_SCAN, given, **_COARSE) for name, given in {
        "mirror": _MIRROR, "metal": {"material": "Al"},
        "coat": {"material": "Al", "coat_ior": 1.5},
        "interface": {"plugin": "diffraction_dielectric", "int_ior": 1.5},
        "sheet": {"plugin": "diffraction_dielectric", "int_ior": 1.5, "thin": True}}.items()},
}  # fmt: skip
_ANGLES = (30.0, 60.0, 72.1, 75.0, 84.0, 87.4, 88.5, 89.5, 89.8, 89.9)
_LUMINANCE = np.array([0.2126, 0.7152, 0.0722])


def check_furnace(name: str) -> None:
    """At no angle, and on neither side, more light is sent on than is received."""
    surface_of = (FURNACES | FURNACES_MORE)[name]
    mi.set_variant(surface_of.variant)
    with energy_as(surface_of.energy):
        surface = loaded(surface_of.field, surface_of.parameters)
    sides = (1, -1) if "plugin" in surface_of.parameters else (1,)
    directions = np.array([polar(t, 30.0) * [1, 1, side] for side in sides for t in _ANGLES])
    mean, error = furnace_in(surface, directions, 1, mode="Importance")
    if mi.is_rgb:  # colours outside the gamut have negative channels
        mean, error = _LUMINANCE @ mean, _LUMINANCE @ error
    assert np.isfinite(mean).all()
    most = surface_of.most + 0.04 * (np.tile(_ANGLES, len(sides)) > 85.0)
    assert np.all(mean <= most + 4.0 * error), mean
