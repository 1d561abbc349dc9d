"""Conversion of spectra to colours; no other module of the project does it.

What most processes need comes from tables of colour-science in a file, since its import takes over
a second; the rest is computed by colour-science itself.

The observer is the CIE 1931 2° standard observer, the display sRGB (IEC 61966-2-1), and the eye is
adapted to the illuminant, so that what reflects all wavelengths alike is white, (1, 1, 1), under
each of them.
"""

from __future__ import annotations

import functools
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..errors import check_choice
from .arithmetic import Number, of

#: CIE standard illuminant D65 (daylight), and E, equal energy at all wavelengths.
ILLUMINANTS = ("D65", "E")

#: Where the observer's tables begin and end, nm.
SHORTEST, LONGEST = 360.0, 830.0

#: Working spaces of Blender, by its names, and colour-science's names of their primaries.
WORKING_SPACES = {
    "Linear Rec.709": "sRGB",
    "Linear Rec.2020": "ITU-R BT.2020",
    "ACEScg": "ACEScg",
}

#: Linear sRGB of X, of Y and of Z by illuminant: the matrix of IEC 61966-2-1, after CAT02 from the
#: illuminant to D65.
_MATRICES = {
    "D65": ((3.2406, -0.9689, 0.0557), (-1.5372, 1.8758, -0.2040), (-0.4986, 0.0415, 1.0570)),
    "E": (
        (3.1748210722005314, -0.9899325492487889, 0.06047909499102054),
        (-1.6974555545245795, 1.9499869504250902, -0.2089180222454224),
        (-0.4775222350011802, 0.04004474775986926, 1.1485133649443713),
    ),
}

#: Mean wavelength of linear red, green and blue under D65, nm: ∫λ s̄ dλ / ∫s̄ dλ. A quantity that is
#: linear in λ has its channel's value there.
RGB_WAVELENGTHS = (642.4, 543.0, 440.8)


def response(wavelength: ArrayLike, illuminant: str = "D65") -> NDArray[np.float64]:
    """Contribution of a reflectance of 1 to X, Y and Z per nanometre, shape (..., 3), 1/nm.

    The result is S(λ)·(x̄, ȳ, z̄)(λ) / ∫ S ȳ dλ, so a reflectance of 1 at all wavelengths has Y = 1.
    The tables, at 1 nm (the observer) and 5 nm (D65), are interpolated linearly, as CIE 15
    prescribes for D65; outside 360–830 nm the result is 0.

    Parameters
    ----------
    wavelength : nm, any shape.
    illuminant : one of `ILLUMINANTS`.
    """
    check_choice("illuminant", illuminant, ILLUMINANTS)
    nodes, values = _responses(illuminant)
    lam = np.asarray(wavelength, np.float64)
    return np.stack([np.interp(lam, nodes, v, left=0.0, right=0.0) for v in values.T], axis=-1)


def daylight(wavelength: ArrayLike) -> NDArray[np.float64]:
    """D65 of luminance 1, scaled as in renderers so that ∫ S ȳ dλ = ∫ ȳ dλ, shape of λ (nm)."""
    nodes, _, luminous, _, power = _cie()
    scale = luminous.sum() / (power @ luminous)
    return np.asarray(scale * np.interp(np.asarray(wavelength, np.float64), nodes, power))


def daylight_shares(wavelengths: ArrayLike) -> NDArray[np.float64]:
    """Weights (n, 3) of values at wavelengths (n,), nm, in red, green and blue under daylight.

    Values are linear in log λ in between. The weights of a colour add up to 1; some are negative.
    The result is cached, and read-only.
    """
    return _daylight_shares(np.asarray(wavelengths, np.float64).tobytes())


@functools.lru_cache(maxsize=64)
def _daylight_shares(wavelengths: bytes) -> NDArray[np.float64]:
    """Return `daylight_shares` of the bytes of an array (n,), read-only."""
    light, nodes = np.arange(360.0, 830.5, 2.0), np.log(np.frombuffer(wavelengths))
    hats = [np.interp(np.log(light), nodes, row) for row in np.eye(len(nodes))]
    weights = np.stack(hats) @ linear_srgb(response(light))
    weights /= weights.sum(axis=0)
    weights.flags.writeable = False
    return weights


def illuminant_power(name: str, wavelength: ArrayLike) -> NDArray[np.float64]:
    """Relative power of a CIE illuminant, e.g. D55, shape of λ (300 to 780 nm)."""
    import colour

    light = colour.SDS_ILLUMINANTS[name]
    lam = np.asarray(wavelength, np.float64)
    return np.asarray(np.interp(lam, light.wavelengths, light.values))


def leaf_green(wavelength: ArrayLike) -> NDArray[np.float64]:
    """Reflectance of CIE 13.3's sample 14, leaf green, shape of λ; constant below 360 nm."""
    from colour.quality import SDS_TCS

    sample = SDS_TCS["CIE 1995"]["TCS14"]
    lam = np.asarray(wavelength, np.float64)
    return np.asarray(np.interp(lam, sample.wavelengths, sample.values))


def cone_fundamentals(wavelength: ArrayLike) -> NDArray[np.float64]:
    """Stockman and Sharpe's sensitivities of S, M and L to power, 2 degrees, (3, n) of λ (n,)."""
    import colour

    lam = np.asarray(wavelength, np.float64)
    cones = colour.MSDS_CMFS["Stockman & Sharpe 2 Degree Cone Fundamentals"]
    return np.stack(
        [np.interp(lam, cones.wavelengths, row, 0.0, 0.0) for row in cones.values.T[::-1]]
    )


def linear_srgb(xyz: NDArray[np.floating], illuminant: str = "D65") -> NDArray[np.floating]:
    """Linear sRGB of X, Y, Z, shape (..., 3), in the precision of the input; white is (1, 1, 1).

    Colours outside the display's gamut have negative components; they are kept.
    """
    check_choice("illuminant", illuminant, ILLUMINANTS)
    return xyz @ np.array(_MATRICES[illuminant], xyz.dtype)


def linear_in(space: str, xyz: NDArray[np.floating]) -> NDArray[np.floating]:
    """Linear RGB of X, Y, Z under D65 in one of `WORKING_SPACES`, shape (..., 3)."""
    import colour

    matrix = colour.matrix_RGB_to_RGB("sRGB", WORKING_SPACES[space], "Bradford")
    return linear_srgb(xyz) @ matrix.T.astype(xyz.dtype)


def metal_tint(
    wavelengths: ArrayLike, reflectance: ArrayLike, channels: ArrayLike
) -> NDArray[np.float64]:
    """T (3, 3) for colours of a metal: T @ (channels · colour) approximates ∫ R(λ) s̄(λ) P(λ) dλ.

    A coloured metal weights the wavelengths within a channel, so that one reflectance for each
    channel gives spectral lines a wrong hue. T is exact for white light (P = 1), and otherwise the
    least-squares fit over lines of one wavelength.

    Parameters
    ----------
    wavelengths : (n,) nm, evenly over the visible.
    reflectance : (n,) R at these wavelengths.
    channels : (3,) reflectances of red, green and blue that T corrects; T is 1 where one is below
        1e-9.
    """
    factors = np.asarray(channels, np.float64)
    if factors.min() < 1e-9:
        return np.eye(3)
    lines = linear_srgb(response(wavelengths))  # s̄, (n, 3)
    reflected = np.asarray(reflectance, np.float64)[:, None] * lines
    white = lines.sum(axis=0)
    inverse = np.linalg.inv(lines.T @ lines)
    fit = reflected.T @ lines @ inverse
    multiplier = inverse @ white / (white @ inverse @ white)
    fit += np.outer(reflected.sum(axis=0) - fit @ white, multiplier)
    return np.asarray(fit / factors)


def decode_srgb(encoded: ArrayLike) -> NDArray[np.float64]:
    """Return linear sRGB from encoded values, both from 0 to 1 (IEC 61966-2-1)."""
    values = np.asarray(encoded, np.float64)
    return np.where(values <= 0.04045, values / 12.92, ((values + 0.055) / 1.055) ** 2.4)


def encode_srgb(linear: ArrayLike) -> NDArray[np.float64]:
    """Encode linear sRGB for a display: clip to 0 to 1 and apply the transfer curve of sRGB."""
    return np.asarray(encoded_channel(np.asarray(linear, np.float64)))


def encoded_channel(linear: Number) -> Number:
    """Encode a channel of linear sRGB for a display (IEC 61966-2-1), clipped to 0 to 1."""
    xp = of(linear)
    light = xp.clip(linear, 0.0, 1.0)
    curve = 1.055 * xp.power(light, 1.0 / 2.4) - 0.055
    return xp.where(light > 0.0031308, curve, 12.92 * light)


def encoded_colour(linear: tuple[Number, Number, Number]) -> tuple[Number, Number, Number]:
    """Encode linear sRGB for a display, each channel by itself."""
    red, green, blue = linear
    return encoded_channel(red), encoded_channel(green), encoded_channel(blue)


def delta_e(
    reference: ArrayLike, other: ArrayLike, *, exposure: float | None = None, least: float = 0.01
) -> NDArray[np.float64]:
    """ΔE2000 between two pictures as a display shows them; NaN where there is almost no light.

    Parameters
    ----------
    reference, other : linear sRGB, shape (..., 3).
    exposure : factor on both; by default the 95th percentile of the reference's Y becomes white.
        Then both are clipped to the display's range.
    least : Y of the reference, exposed, that a pixel must have; 0 counts all.
    """
    import colour

    first, second = (np.asarray(image, np.float64) for image in (reference, other))
    to_xyz = np.linalg.inv(linear_srgb(np.eye(3)))
    luminance = first @ to_xyz[:, 1]
    if exposure is None:
        white = np.percentile(luminance, 95.0)
        exposure = 1.0 / white if white > 0.0 else 1.0
    lab = [colour.XYZ_to_Lab(np.clip(exposure * a, 0.0, 1.0) @ to_xyz) for a in (first, second)]
    difference = np.asarray(colour.delta_E(lab[0], lab[1], method="CIE 2000"))
    return np.where((exposure * luminance > least) | (least == 0.0), difference, np.nan)


@functools.cache
def _responses(illuminant: str) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Wavelengths (n,) in nm and responses (n, 3) in 1/nm."""
    nodes, *observer, daylit = _cie()
    power = {"D65": daylit, "E": np.full_like(nodes, 100.0)}[illuminant]
    values = power[:, None] * np.stack(observer, axis=-1)
    return nodes, values / (values[:, 1].sum() * (nodes[1] - nodes[0]))


@functools.cache
def _cie() -> list[NDArray[np.float64]]:
    """Columns (n,) of the file: wavelengths in nm, x̄, ȳ, z̄, and the power of D65."""
    file = Path(__file__).with_name("cie.csv")
    return list(np.loadtxt(file, delimiter=",", skiprows=3, unpack=True, encoding="utf-8"))
