"""Cases for which the model is compared with rigorous solutions: a surface, its light and media.

Angles are those of the light's direction in the plane of the grooves' normal, positive towards +x;
order m leaves at sinθo = mλ/d − sinθi, positive towards +x too. Blazed gratings ascend towards +x:
light from θi > 0 falls on their steps, light from θi < 0 along the facets.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any, NamedTuple, Protocol

import numpy as np
from numpy.typing import ArrayLike

from mitsuba_diffraction import HeightField, gratings
from mitsuba_diffraction.arrays import Real, Whole
from mitsuba_diffraction.errors import DiffractionError

#: Folder of the stored solutions.
DATA = Path(__file__).parent / "data"
PROFILES = ("sinusoidal", "lamellar", "blazed")
MATERIALS = ("perfect", "aluminium", "keratin")

#: Grooves from the size of a snake scale's microstructure to that of a coarse grating, µm.
PERIODS = (1.1, 1.6, 2.5, 5.0)
DEPTHS = (0.05, 0.1, 0.2, 0.4)

#: nm. None of them sends an order along the surface at these periods and angles, where every
#: method is delicate (Rayleigh's wavelengths).
WAVELENGTHS = (410.0, 460.0, 510.0, 560.0, 610.0, 660.0, 710.0, 760.0)
#: The same for other materials, which take longer to solve.
FEW_WAVELENGTHS = (460.0, 610.0)

#: The grating that the design was first checked with, at normal incidence, over a finer scan.
PROBE_GRATING = ("sinusoidal", 2.5, 0.1)
PROBE_WAVELENGTHS = tuple(float(w) for w in range(450, 781, 30))

#: Aluminium's index n + ik by wavelength (nm): Mitsuba's own table (material `Al`), interpolated.
ALUMINIUM = {460.0: 0.646 + 5.590j, 610.0: 1.248 + 7.368j}

#: Silicon's index by wavelength (nm): Mitsuba's own table (material `Si`), interpolated.
SILICON = {460.0: 4.577 + 0.130j, 610.0: 3.906 + 0.022j}

#: Keratin's index, the middle of what is reported for hair and scales (1.54–1.58).
KERATIN = 1.56

_METALS = {"aluminium": ALUMINIUM, "silicon": SILICON}

#: Polycarbonate's index, the coat of a CD.
COAT = 1.58

#: Samples a period: 5e-6 from the closed forms of lamellar and blazed gratings.
PIXELS = 512


class Surface(Protocol):
    """Surface of a case: a `Grating`, or a cell of `patches`; its text is its name in files."""

    @property
    def field(self) -> HeightField:
        """Heights of one period."""
        ...


@dataclass(frozen=True)
class Grating:
    """Period of a grating; `period` and `depth` (peak to valley) in µm."""

    profile: str
    period: float
    depth: float

    def heights(self, pixels: int = PIXELS) -> HeightField:
        """Heights of the period: `pixels` samples along x, two rows of them.

        Raises
        ------
        DiffractionError
            If there is no such profile.
        """
        if self.profile not in PROFILES:
            raise DiffractionError(
                f"profile '{self.profile}' is unknown; choose one of {', '.join(PROFILES)}"
            )
        ascends = {"direction": "ascending"} if self.profile == "blazed" else {}
        return getattr(gratings, self.profile)(
            self.period, self.depth, periods=1, pixels_per_period=pixels, rows=2, **ascends
        )

    @cached_property
    def field(self) -> HeightField:
        """Heights with `PIXELS` samples."""
        return self.heights()

    def __str__(self) -> str:
        return f"{self.profile} {self.period:g}/{self.depth:g} µm"


@dataclass(frozen=True, eq=False)
class Sampled:
    """Any heights."""

    field: HeightField


class Light(NamedTuple):
    """Light of one wavelength (nm) from a direction (degrees); phi is from across the grooves."""

    wavelength: float
    theta: float
    phi: float = 0.0


@dataclass(frozen=True)
class Media:
    """Material beneath a surface, and what lies over it.

    Attributes
    ----------
    material : of `index_of`, or "perfect".
    film : index and thickness (nm) of a film over the surface.
    coat : index of a clear coat; `once` leaves out the light that its face sends back.
    through : whether the orders are those that go through, and with `thin` through a sheet.
    """

    material: str | complex
    film: tuple[complex, float] | None = None
    coat: float | None = None
    once: bool = False
    through: bool = False
    thin: bool = False

    @property
    def layer(self) -> dict[str, Any]:
        """Arguments of `reference.brdf` for film or coat."""
        return {name: v for name in ("film", "coat") if (v := getattr(self, name)) is not None}

    @property
    def text(self) -> str:
        """Media in words, for files of solutions."""
        film = f", film of {self.film[0]:g}, {self.film[1]:g} nm" if self.film else ""
        coat = f" under a coat of index {self.coat:g}" if self.coat else ""
        return f"{self.material}{film}{coat}{', single' if self.once else ''}"


@dataclass(frozen=True)
class Case:
    """A surface in a light."""

    surface: Surface
    light: Light
    media: Media

    @cached_property
    def wi(self) -> Real:
        """Unit vector to the light, (3,)."""
        return direction(self.light.theta, self.light.phi)

    @property
    def index(self) -> complex | None:
        """Index n + ik of the material; none of a perfect conductor."""
        perfect = self.media.material == "perfect"
        return None if perfect else index_of(self.media.material, self.light.wavelength)

    @cached_property
    def orders(self) -> Whole:
        """Reflected orders across the grooves (n, 2), in light across them."""
        orders, _ = order_sines(self.field.extent[0], self.light.wavelength, self.light.theta)
        return np.stack([orders, np.zeros_like(orders)], axis=1)

    @property
    def field(self) -> HeightField:
        """Heights of one period."""
        return self.surface.field

    def wo(self, order: Whole) -> Real:
        """Directions (n, 3) of orders (n, 2), on the other side if they go through."""
        step = self.light.wavelength / 1000 / np.array(self.field.extent)
        index, above = complex(self.index or 1.0).real, self.wi[2] > 0
        # a sheet has air on both sides
        within = index if self.media.through and not self.media.thin else 1.0
        came, left = (1.0, within) if above else (within, 1.0)
        tangential = (order * step - came * self.wi[:2]) / left
        up = np.sqrt(np.maximum(1 - np.sum(tangential**2, axis=1), 0))
        return np.column_stack([tangential, -up if self.media.through and above else up])

    def has(self, **values: Any) -> bool:
        """Whether surface, light and media have these values, or one of a list of them."""
        own, missing = self._values, object()
        return all(
            own.get(name, missing) in (value if isinstance(value, list) else [value])
            for name, value in values.items()
        )

    @cached_property
    def _values(self) -> dict[str, Any]:
        surface, media = self.surface, self.media
        return (
            {"surface": surface, "grating": surface, "media": media}
            | {**vars(surface), **vars(media)}
            | self.light._asdict()
        )


def direction(theta: float, phi: float = 0.0) -> Real:
    """Return the unit vector (3,) of angles in degrees."""
    polar, turn = np.radians([theta, phi])
    sine = np.sin(polar)
    return np.array([sine * np.cos(turn), sine * np.sin(turn), np.cos(polar)])


def in_plane(sine: ArrayLike) -> Real:
    """Unit vectors (..., 3) in the x–z plane with this x component."""
    x = np.asarray(sine, np.float64)
    return np.stack([x, np.zeros_like(x), np.sqrt(np.maximum(1 - x * x, 0))], axis=-1)


def grating_cases(material: str) -> list[Case]:
    """All gratings and lights of one material, in a fixed order.

    Raises
    ------
    DiffractionError
        If the material is not one of `MATERIALS`.
    """
    if material not in MATERIALS:
        raise DiffractionError(
            f"material '{material}' is unknown; choose one of {', '.join(MATERIALS)}"
        )
    return list(_cases(material))


def index_of(material: str | complex, wavelength: float) -> complex:
    """Index n + ik of a material, or of a number itself, at a wavelength (nm).

    Under polycarbonate both are those inside: the index is over the coat's.
    """
    if material == "aluminium under polycarbonate":
        return index_of("aluminium", wavelength * COAT) / COAT
    if not isinstance(material, str):
        return complex(material)
    if material == "keratin":
        return complex(KERATIN)
    nodes = _METALS[material]  # Mitsuba's tables are smooth between them
    return complex(np.interp(wavelength, list(nodes), list(nodes.values())))


def index_text(material: str) -> str:
    """Return the index of a material in words, for files of solutions."""
    if material not in _METALS:
        return f"{KERATIN:g}" if material == "keratin" else "perfect conductor"
    return ", ".join(f"{n:g} at {w:g} nm" for w, n in _METALS[material].items())


def _cases(material: str) -> Iterator[Case]:
    for profile in PROFILES:
        for period in PERIODS:
            for depth in DEPTHS:
                grating = Grating(profile, period, depth)
                if not _affordable(grating, material):
                    continue
                for theta in _angles(profile, material):
                    for wavelength in _wavelengths(grating, material, theta):
                        yield Case(grating, Light(wavelength, theta), Media(material))


def _affordable(grating: Grating, material: str) -> bool:
    """Whether a grating is solved: light is short in metals, and edges require a finer mesh."""
    if material == "perfect" or grating.profile == "sinusoidal":
        return True
    return grating.period in (1.1, 2.5) or (material == "aluminium" and grating.period < 5.0)


def _angles(profile: str, material: str) -> tuple[float, ...]:
    perfect = material == "perfect"
    angles = (0.0, 15.0, 30.0, 45.0, 60.0, 75.0) if perfect else (0.0, 30.0, 60.0)
    if profile == "blazed":  # not symmetric
        angles = (-60.0, -30.0, *angles) if perfect else (-30.0, *angles)
    return angles


def _wavelengths(grating: Grating, material: str, theta: float) -> tuple[float, ...]:
    if material != "perfect":
        return FEW_WAVELENGTHS
    probe = theta == 0.0 and grating == Grating(*PROBE_GRATING)
    return tuple(sorted({*WAVELENGTHS, *(PROBE_WAVELENGTHS if probe else ())}))


def order_sines(period: float, wavelength: float, theta: float) -> tuple[np.ndarray, np.ndarray]:
    """Propagating orders m, and sinθo of each: mλ/d − sinθi. µm, nm and degrees."""
    step, sine = wavelength / 1000 / period, np.sin(np.radians(theta))
    orders = np.arange(np.ceil((sine - 1) / step), np.floor((sine + 1) / step) + 1).astype(int)
    return orders, orders * step - sine
