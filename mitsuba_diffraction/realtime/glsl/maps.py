"""Mitsuba's textures as values, pictures and mesh attributes for shaders."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...arrays import Real
from ...errors import DiffractionError
from ...plugin.description import Mix, Surface
from ...plugin.parameter_changes import children
from ...scene.elements import attribute_of
from ...shading.spectra import evaluated, uploaded
from .packing import colour_weights

#: Wavelengths (n,) in nm, and values (n,).
Spectrum = tuple[Real, Real]

_CHEQUERS = 512  # texels a side of a picture of 2 × 2 chequers
_LAM = np.linspace(380.0, 740.0, 36)  # nm
_SOME = 256  # texels whose spectra are stored


@dataclass(frozen=True)
class Map:
    """Value over a surface: a constant, a picture, or an attribute of the mesh."""

    value: Real  # (channels,), the constant
    # (rows, columns, channels), row 0 at v = 0
    picture: NDArray[np.floating] | None = None
    to_uv: Real = field(default_factory=lambda: np.eye(3))  # from texture coordinates to it
    attribute: str | None = None  # name of a mesh attribute
    clamped: bool = False  # whether the picture is clamped at its edges; else it repeats
    nearest: bool = False  # whether each texel has one value; else texels are interpolated
    spectra: NDArray[np.floating] | None = None  # reflectances of some texels over `_LAM`, (n, 36)
    # colours of these texels under the light of the picture, (n, 3)
    colours: NDArray[np.floating] | None = None

    def under(self, wavelengths: Real, spectrum: Real) -> Real:
        """Return the matrix (3, 3) from colours, as rows, to colours under another light.

        The matrix is a least-squares fit to the texels with stored spectra, since three numbers do
        not determine a spectrum.
        """
        if self.spectra is None or self.colours is None or spectrum.ndim > 1:
            return np.eye(3)
        change = self.spectra @ _weights((wavelengths, spectrum)) - self.colours
        return np.eye(3) + self._fit @ change

    @cached_property
    def _fit(self) -> Real:
        """Pseudo-inverse (3, n) of the texels' colours, for fits to their spectra."""
        assert self.colours is not None
        return np.asarray(np.linalg.pinv(self.colours.astype(float), rcond=1e-3))


def raw_picture(bsdf: Any, name: str, channels: int, scale: float, shift: float = 0.0) -> Map:
    """Return the values of a wrapper's raw texture of one or three channels, scaled and shifted."""
    texture = children(bsdf)[name]

    def look_up(uv: Real) -> NDArray[np.floating]:
        si = _interaction(uv)
        value = texture.eval_1(si) if channels == 1 else texture.eval_3(si)
        return scale * np.array(value, np.float32).reshape(channels, -1).T + shift

    return _picture([texture], look_up, name)


def colour_map(texture: Any, light: Spectrum) -> Map:
    """Return a texture of reflectances in linear sRGB, to be multiplied with the light's colour."""
    if attribute := attribute_of(texture):
        return Map(np.ones(3), attribute=attribute)
    import mitsuba as mi

    width, height = _size(texture)
    uv, to_uv = _centres(texture, width, height)
    colours = _lit(texture, uv, light) if mi.is_spectral else evaluated(texture, uv, np.zeros(3))
    if width * height == 1:
        result = Map(colours[0].astype(float))
    else:
        clamped = _clamps(lambda uv: evaluated(texture, uv, np.full(4, 550.0)), to_uv)
        result = Map(np.ones(3), colours.reshape(height, width, 3), to_uv, clamped=clamped)
    if not mi.is_spectral:
        return result
    some = slice(None, None, max(len(uv) // _SOME, 1))
    return replace(result, spectra=evaluated(texture, uv[some], _LAM), colours=colours[some])


def _weights(light: Spectrum) -> Real:
    """Return the matrix (36, 3) from reflectances over `_LAM` to colours under a light."""
    return colour_weights(_LAM, np.interp(_LAM, *light))


def _lit(texture: Any, uv: Real, light: Spectrum) -> NDArray[np.float32]:
    """Return the colours (points, 3) of a texture under a light, relative to the light's colour."""
    weights, total = _weights(light).astype(np.float32), np.zeros((len(uv), 3), np.float32)
    for start in range(0, len(_LAM), 4):
        four = slice(start, start + 4)
        total += evaluated(texture, uv, _LAM[four]) @ weights[four]
    return total


def axis_map(described: Surface) -> Map:
    """Return the patch's frame: (cos, sin) of its x axis in the tangent frame, and its stretch.

    Raises a DiffractionError for textures that do not fit one picture.
    """
    turned, stretched = described.orientation, described.lateral_scale
    if turned.texture is None and stretched.texture is None:
        angle = np.radians(turned.number)
        return Map(np.array([np.cos(angle), np.sin(angle), stretched.number]))
    attribute = attribute_of(turned.texture)
    if attribute and stretched.texture is None:
        return Map(np.array([1.0, 0.0, stretched.number]), attribute=attribute)

    def frame(uv: Real) -> Real:
        """Evaluate both textures."""
        values = described.frame(_interaction(uv))
        return np.stack([np.broadcast_to(np.array(x, float).ravel(), len(uv)) for x in values], 1)

    textures = [q.texture for q in (turned, stretched) if q.texture is not None]
    return _picture(textures, frame, "orientation and lateral_scale")


def interval_maps(mix: Mix) -> list[Map]:
    """Return the interval of [0, 1) that each surface of a mix takes, two channels.

    Raises a DiffractionError for textures that do not fit one picture.
    """

    def edges(uv: Real) -> Real:
        """Evaluate the cumulative weights; the outer ones lie beyond 0 and 1."""
        weights = mix.weights(_interaction(uv))
        values = [np.broadcast_to(np.array(weight, float).ravel(), len(uv)) for weight in weights]
        inner = np.cumsum(values, axis=0)[:-1]
        return np.stack([np.full(len(uv), -1.0), *inner, np.full(len(uv), 2.0)], axis=1)

    if mix.textures:
        whole = _picture(mix.textures, edges, "the weights of a mix")
    else:
        whole = Map(np.zeros(2), edges(np.zeros((1, 2))).reshape(1, 1, -1))
    assert whole.picture is not None
    return [replace(whole, picture=whole.picture[..., n : n + 2]) for n in range(len(mix.parts))]


def _picture(
    textures: Sequence[Any], look_up: Callable[[Real], NDArray[np.floating]], name: str
) -> Map:
    """Evaluate a function of textures at the texels of the largest one."""
    sizes, transforms = [], []
    for texture in textures:
        if attribute_of(texture):
            raise DiffractionError(
                f"{name}: a mesh attribute is not supported by the shaders; use textures, or "
                "render the scene with Mitsuba"
            )
        sizes.append(_size(texture))
        transforms.append(_centres(texture, 1, 1)[1])
    (width, height), to_uv = max(zip(sizes, transforms, strict=True), key=lambda pair: pair[0])
    if any(size != (1, 1) and not np.allclose(other, to_uv)
           for size, other in zip(sizes, transforms, strict=True)):  # fmt: skip
        raise DiffractionError(
            f"{name}: the textures differ in to_uv, which the shaders do not support; scale them "
            "alike, or render the scene with Mitsuba"
        )
    uv, _ = _centres(textures[sizes.index((width, height))], width, height)
    values = look_up(uv)
    aside = np.linalg.inv(to_uv)[:2, :2] @ np.array([0.3 / width, 0.3 / height])
    first, clamped = values[0].astype(float), _clamps(look_up, to_uv)
    nearest = bool(np.allclose(look_up(uv + aside), values))
    picture = values.reshape(height, width, -1)
    return Map(first, picture, to_uv, clamped=clamped, nearest=nearest)


def _size(texture: Any) -> tuple[int, int]:
    """Return the width and height of a picture that shows a texture, texels."""
    if texture.class_name() == "Checkerboard":
        return _CHEQUERS, _CHEQUERS  # fine, since filtering blurs edges by a texel
    width, height = (max(int(n), 1) for n in texture.resolution())
    return width, height


def _clamps(look_up: Callable[[Real], NDArray[np.floating]], to_uv: Real) -> bool:
    """Return whether a texture is clamped: outside, it is closer to its edge than repeated."""
    along = np.linspace(0.02, 0.98, 16)
    back = np.linalg.inv(to_uv)

    def values(across: float) -> NDArray[np.floating]:
        """Evaluate the texture along lines at u = `across` and v = `across`."""
        lines = [np.stack([np.full(16, across), along]), np.stack([along, np.full(16, across)])]
        points = np.concatenate([np.concatenate(lines, axis=1), np.ones((1, 32))])
        return look_up((back @ points)[:2].T)

    beyond = values(-0.3)
    return bool(np.abs(beyond - values(1e-4)).sum() < np.abs(beyond - values(0.7)).sum())


def _centres(texture: Any, width: int, height: int) -> tuple[Real, Real]:
    """Return (u, v) of the centres of all texels, and the texture's transform of coordinates."""
    import mitsuba as mi

    parameters = mi.traverse(texture)
    to_uv = np.eye(3)
    if "to_uv" in parameters:
        to_uv = np.array(parameters["to_uv"].matrix, np.float64).reshape(3, 3)
    x, y = np.meshgrid((np.arange(width) + 0.5) / width, (np.arange(height) + 0.5) / height)
    inside = np.stack([x.ravel(), y.ravel(), np.ones(x.size)])
    return (np.linalg.inv(to_uv) @ inside)[:2].T, to_uv


def _interaction(uv: Real) -> Any:
    """Return surface interactions at texture coordinates (n, 2)."""
    import drjit as dr
    import mitsuba as mi

    si = dr.zeros(mi.SurfaceInteraction3f, len(uv))
    si.uv = mi.Point2f(*uploaded(uv))
    return si
