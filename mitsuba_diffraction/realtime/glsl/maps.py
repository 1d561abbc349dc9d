"""Mitsuba's textures as a shader knows them: values, pictures, attributes of meshes."""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from functools import cache, cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...optics.colour import linear_srgb, response
from ...plugin.memory import upload
from ...plugin.parameter_changes import children

Array = NDArray[np.float64]
#: Wavelengths (n,) in nm, and values (n,).
Spectrum = tuple[Array, Array]

_CHEQUERS = 512  # texels along either side of two by two
_LAM = np.linspace(380.0, 740.0, 36)  # nm
_SOME = 256  # texels whose spectra are known


@dataclass(frozen=True)
class Map:
    """A value over a surface: the same everywhere, at every vertex, or a picture."""

    value: Array  # (channels,), where it is the same
    # (rows, columns, channels), row 0 at v = 0, and `to_uv` (3, 3) that leads into it
    picture: NDArray[np.floating] | None = None
    to_uv: Array = field(default_factory=lambda: np.eye(3))
    attribute: str | None = None  # name of a mesh attribute
    clamped: bool = False  # whether the picture's edges go on beyond it, which else repeats
    spectra: NDArray[np.floating] | None = None  # of some texels of a colour, over `_LAM`, (n, 36)
    # theirs under the light that the picture is for, (n, 3)
    colours: NDArray[np.floating] | None = None

    def under(self, wavelengths: Array, spectrum: Array) -> Array:
        """Colours as rows times this matrix (3, 3) are those under another light.

        The best for the texels that are known: three numbers do not say all of a spectrum.
        """
        if self.spectra is None or self.colours is None or spectrum.ndim > 1:
            return np.eye(3)
        apart = self.spectra @ _weights((wavelengths, spectrum)) - self.colours
        return np.eye(3) + self._fit @ apart

    @cached_property
    def _fit(self) -> Array:
        """From numbers (n, k) at the texels that are known to the least squares' matrix (3, k)."""
        assert self.colours is not None
        return np.asarray(np.linalg.pinv(self.colours.astype(float), rcond=1e-3))


def raw_picture(bsdf: Any, name: str, channels: int, scale: float, shift: float = 0.0) -> Map:
    """The numbers of a wrapper's raw texture, of one or three channels, scaled and shifted."""
    texture = children(bsdf)[name]
    width, height = (int(n) for n in texture.resolution())
    uv, to_uv = _centres(texture, width, height)
    si = _interaction(uv)
    value = texture.eval_1(si) if channels == 1 else texture.eval_3(si)
    found = np.array(value, np.float32).reshape(channels, height, width)
    return Map(np.zeros(channels), scale * found.transpose(1, 2, 0) + shift, to_uv)


def colour_map(texture: Any, light: Spectrum) -> Map:
    """A texture of reflectances in linear sRGB, right when multiplied with the light's colour."""
    attribute = _attribute(texture)
    if attribute is not None:
        return Map(np.ones(3), attribute=attribute)
    import mitsuba as mi

    width, height = (int(n) for n in texture.resolution())
    if texture.class_name() == "Checkerboard":
        width = height = _CHEQUERS  # filtered only as far as a texel reaches
    elif width * height <= 1:
        width = height = 1
    uv, to_uv = _centres(texture, width, height)
    found = _lit(texture, uv, light) if mi.is_spectral else evaluated(texture, uv, np.zeros(3))
    if width * height == 1:
        whole = Map(found[0].astype(float))
    else:
        clamped = _clamps(lambda uv: evaluated(texture, uv, np.full(4, 550.0)), to_uv)
        whole = Map(np.ones(3), found.reshape(height, width, 3), to_uv, clamped=clamped)
    if not mi.is_spectral:
        return whole
    some = slice(None, None, max(len(uv) // _SOME, 1))
    return replace(whole, spectra=evaluated(texture, uv[some], _LAM), colours=found[some])


@cache
def _daylight_weights() -> Array:
    return np.asarray(linear_srgb(response(_LAM)))


def _weights(light: Spectrum) -> Array:
    """From reflectances over `_LAM` to their colours under a light, (36, 3)."""
    weights = _daylight_weights() * np.interp(_LAM, *light)[:, None]
    return np.asarray(weights / weights.sum(axis=0))


def _lit(texture: Any, uv: Array, light: Spectrum) -> NDArray[np.float32]:
    """A texture's values (points, 3) under a light, over the light's own, in linear sRGB."""
    weights, total = _weights(light).astype(np.float32), np.zeros((len(uv), 3), np.float32)
    for start in range(0, len(_LAM), 4):
        four = slice(start, start + 4)
        total += evaluated(texture, uv, _LAM[four]) @ weights[four]
    return total


def axis_map(orientation: Any) -> Map:
    """Where the patch's x axis points."""
    if not hasattr(orientation, "texture"):
        angle = np.radians(float(np.array(orientation.degrees).ravel()[0]))
        return Map(np.array([np.cos(angle), np.sin(angle)]))
    texture = orientation.texture
    attribute = _attribute(texture)
    if attribute is not None:
        return Map(np.array([1.0, 0.0]), attribute=attribute)
    width, height = (int(n) for n in texture.resolution())
    uv, to_uv = _centres(texture, width, height)

    def turned(uv: Array) -> Array:
        return np.array(texture.eval_3(_interaction(uv)), np.float64).T

    value = turned(uv).reshape(height, width, 3)[..., :2]
    return Map(np.array([1.0, 0.0]), value, to_uv, clamped=_clamps(turned, to_uv))


def _clamps(look_up: Callable[[Array], NDArray[np.floating]], to_uv: Array) -> bool:
    """Whether a texture is beyond its edge more like the edge than like the other side."""
    along = np.linspace(0.02, 0.98, 16)
    back = np.linalg.inv(to_uv)

    def values(across: float) -> NDArray[np.floating]:
        both = [np.stack([np.full(16, across), along]), np.stack([along, np.full(16, across)])]
        places = np.concatenate([np.concatenate(both, axis=1), np.ones((1, 32))])
        return look_up((back @ places)[:2].T)

    beyond = values(-0.3)
    return bool(np.abs(beyond - values(1e-4)).sum() < np.abs(beyond - values(0.7)).sum())


def _attribute(texture: Any) -> str | None:
    if texture.class_name() != "MeshAttribute":
        return None
    found = re.search(r'name = "?(\w+)', str(texture))
    return found[1] if found else None


def _centres(texture: Any, width: int, height: int) -> tuple[Array, Array]:
    """(u, v) of all texels' middles, and the transform that the texture puts before its picture."""
    import mitsuba as mi

    parameters = mi.traverse(texture)
    to_uv = np.eye(3)
    if "to_uv" in parameters:
        to_uv = np.array(parameters["to_uv"].matrix, np.float64).reshape(3, 3)
    x, y = np.meshgrid((np.arange(width) + 0.5) / width, (np.arange(height) + 0.5) / height)
    inside = np.stack([x.ravel(), y.ravel(), np.ones(x.size)])
    return (np.linalg.inv(to_uv) @ inside)[:2].T, to_uv


def _interaction(uv: Array) -> Any:
    import drjit as dr
    import mitsuba as mi

    si = dr.zeros(mi.SurfaceInteraction3f, len(uv))
    si.uv = mi.Point2f(*(upload(mi.Float, x.astype(np.float32)) for x in uv.T))
    return si


def evaluated(texture: Any, uv: Array, wavelengths: Array) -> NDArray[np.float32]:
    """A texture's values (points, wavelengths), or its three colours."""
    import mitsuba as mi

    si = _interaction(uv)
    found = []
    step = 4 if mi.is_spectral else len(wavelengths)
    for start in range(0, len(wavelengths), step):
        if mi.is_spectral:
            si.wavelengths = mi.Spectrum(*(float(w) for w in wavelengths[start : start + 4]))
        value = np.array(texture.eval(si), np.float32)
        value = value.reshape(value.shape[0], -1)
        found.append(np.broadcast_to(value, (value.shape[0], len(uv))))
    return np.concatenate(found).T
