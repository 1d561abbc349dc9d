"""Materials by name or number: the one vocabulary of plugin, commands, recipes and solver.

A material is `none` (R = 1), an index such as `1.56` or `1.56+0.05i`, a tissue or a liquid of this
module, or a conductor that Mitsuba has tabulated, by symbol or plain name.

References
----------
keratin, chitin : H. L. Leertouwer, B. D. Wilts and D. G. Stavenga, Refractive index and dispersion
    of butterfly chitin and bird keratin measured by polarizing interference microscopy, Optics
    Express 19, 24061-24066 (2011): Cauchy's n = A + B/λ².
melanin : D. G. Stavenga, H. L. Leertouwer, D. C. Osorio and B. D. Wilts, High refractive index of
    melanin in shiny occipital feathers of a bird of paradise, Light: Science & Applications 4, e243
    (2015): Cauchy's n, and k = a exp(−λ/b).
guanine : A. Levy-Lior et al., Biogenic guanine crystals from the skin of fish may be designed to
    enhance light reflectance, Crystal Growth & Design 8, 507-511 (2008): n = 1.83 in the plane of
    the crystals' plates; dispersion and birefringence are neglected.
water : M. Daimon and A. Masumura, Measurement of the refractive index of distilled water from the
    near-infrared region to the ultraviolet region, Applied Optics 46, 3811-3820 (2007), at 20 °C;
    k is below 1e-6 (G. M. Hale and M. R. Querry, Applied Optics 12, 555-563, 1973) and neglected.
sio2 : I. H. Malitson, Interspecimen comparison of the refractive index of fused silica, Journal of
    the Optical Society of America 55, 1205-1208 (1965).
mgf2 : M. J. Dodge, Refractive properties of magnesium fluoride, Applied Optics 23, 1980-1985
    (1984), ordinary ray; evaporated films are some per cent rarer.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..arrays import Real
from ..errors import DiffractionError, quoted

#: Name of the perfect conductor, R = 1.
PERFECT = "none"
#: Wavelength of an index that is one number, nm: sodium's D line, as in Mitsuba's table.
SODIUM = 589.3
#: Bounds of n and k that are given as numbers.
REAL, IMAGINARY = (0.01, 100.0), (0.0, 100.0)

#: Symbols of Mitsuba's tabulated conductors by plain name.
METALS = {
    "aluminium": "Al", "aluminum": "Al", "chromium": "Cr", "copper": "Cu", "gold": "Au",
    "iridium": "Ir", "lithium": "Li", "mercury": "Hg", "molybdenum": "Mo", "niobium": "Nb",
    "rhodium": "Rh", "silver": "Ag", "tantalum": "Ta", "tungsten": "W",
    "nickel": "Ni_palik", "vanadium": "V_palik",
}  # fmt: skip

_NUMBER = re.compile(r"[\s+\-.\d]")


@dataclass(frozen=True)
class Tissue:
    """Published complex index of a transparent or absorbing substance.

    Attributes
    ----------
    name : in the vocabulary.
    n, k : parts of the index at wavelengths in nm.
    first, last : wavelengths that the formula serves, nm; measurements may end earlier.
    """

    name: str
    n: Callable[[Real], Real]
    k: Callable[[Real], Real] | None = None
    first: float = 270.0
    last: float = 1200.0

    def index(self, wavelengths: ArrayLike) -> NDArray[np.complex128]:
        """Return n + ik (n,) at wavelengths (n,) in nm."""
        lam = np.asarray(wavelengths, np.float64)
        return np.asarray(self.n(lam) + 1j * (self.k(lam) if self.k else 0.0 * lam))

    @property
    def absorbs(self) -> bool:
        """Whether k is above 0."""
        return self.k is not None

    @property
    def nodes(self) -> Real:
        """Wavelengths (n,), nm, between which the index is linear to 1e-4."""
        return np.arange(self.first, self.last + 1.0, 5.0)


def _cauchy(a: float, b: float) -> Callable[[Real], Real]:
    return lambda lam: a + b / lam**2


def _sellmeier(*terms: tuple[float, float]) -> Callable[[Real], Real]:
    """Return n² = 1 + Σ c λ²/(λ² − pole), λ in µm and poles in µm²."""

    def n(lam: Real) -> Real:
        square = np.square(1e-3 * lam)
        return np.sqrt(1.0 + sum(c * square / (square - pole) for c, pole in terms))

    return n


_WATER = (
    (5.684027565e-1, 5.101829712e-3), (1.726177391e-1, 1.821153936e-2),
    (2.086189578e-2, 2.620722293e-2), (1.130748688e-1, 1.069792721e1),
)  # fmt: skip
_SILICA = (0.6961663, 0.0684043**2), (0.4079426, 0.1162414**2), (0.8974794, 9.896161**2)
_FLUORIDE = (
    (0.48755108, 0.04338408**2), (0.39875031, 0.09461442**2), (2.3120353, 23.793604**2),
)  # fmt: skip


TISSUES = {
    tissue.name: tissue
    for tissue in (
        Tissue("keratin", _cauchy(1.532, 5.89e3)),
        Tissue("chitin", _cauchy(1.517, 8.80e3)),
        Tissue("melanin", _cauchy(1.648, 2.37e4), lambda lam: 0.56 * np.exp(-lam / 270.0)),
        Tissue("guanine", lambda lam: np.full_like(lam, 1.83)),
        Tissue("water", _sellmeier(*_WATER)),
        Tissue("sio2", _sellmeier(*_SILICA)),
        Tissue("mgf2", _sellmeier(*_FLUORIDE)),
    )
}


def material_named(value: str | float | complex, parameter: str = "material") -> str | complex:
    """Return a material's name as the tables have it, or its index n + ik.

    value : a name of any case, a number, or a number's text, e.g. "1.56+0.05i".

    Raises a DiffractionError if a number is not an index. Names are checked at look-up.
    """
    if isinstance(value, str):
        text = value.strip()
        if not _NUMBER.match(text):
            lower = text.lower()
            if lower in TISSUES or lower == PERFECT:
                return lower
            return METALS.get(lower, text)
        try:
            number = complex(text.replace(" ", "").replace("i", "j"))
        except ValueError:
            raise _no_index(value, parameter) from None
    else:
        number = complex(value)
    in_range = REAL[0] <= number.real <= REAL[1] and IMAGINARY[0] <= number.imag <= IMAGINARY[1]
    if not in_range:
        raise _no_index(value, parameter)
    return number


def lets_light_through(value: str | float) -> bool:
    """Return whether light that a material does not reflect reaches a nested BSDF."""
    material = material_named(value)
    if isinstance(material, complex):
        return not material.imag
    return material in TISSUES and not TISSUES[material].absorbs


def index_at_sodium(value: str | float, parameter: str) -> float | str:
    """Return a clear medium's index as a number, or a name that Mitsuba has to know.

    Raises a DiffractionError if the medium absorbs.
    """
    material = material_named(value, parameter)
    if isinstance(material, str):
        tissue = TISSUES.get(material)
        if tissue is None:
            return material
        if tissue.absorbs:
            raise DiffractionError(
                f"{parameter}={value!r} absorbs light; give a clear medium here, or "
                f"material={material}"
            )
        return float(tissue.index(SODIUM).real)
    if material.imag:
        raise DiffractionError(
            f"{parameter}={value} absorbs light; give it as the material instead: material={value}"
        )
    return material.real


def _no_index(value: object, parameter: str) -> DiffractionError:
    return DiffractionError(
        f"{parameter}={quoted(value)}: an index is n + ik with n from 0.01 to 100 and k from 0 to "
        "100, such as 1.56 or 0.65+5.6i"
    )
