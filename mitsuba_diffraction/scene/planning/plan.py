"""A plan: from what surfaces are asked to the part of each table that suffices, as a small file."""

from __future__ import annotations

import json
import math
import os
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...atomic import atomic_path
from ...errors import DiffractionError, quoted
from ...files import read_text
from ...optics.colour import delta_e, linear_srgb
from ...optics.geometry import wavenumber
from ...tables.table import DiffractionTable

#: No planned table is coarser than this in itself.
MOST_TOLERANCE = 1e-2
#: A frequency beyond the last that was asked for: a path not traced may go a little farther.
ROOM = 1.02

#: Raised whenever an older file would mean something else.
VERSION = 2
_KIND = "mitsuba-diffraction plan"

_REMEDY = "make one with 'mitsuba-diffraction plan SCENE -o plan.json'"


@dataclass(frozen=True)
class Lookups:
    """What one table is asked, over all surfaces that share it."""

    # u, v, w: (n,) ωi + ωo in the patch's frame, w times height_scale
    u: NDArray[np.float64]
    v: NDArray[np.float64]
    w: NDArray[np.float64]
    wavelength: NDArray[np.float64]  # (n,) nm
    # (n, 3) light of the picture that each look-up adds, the whole picture's being 1
    xyz: NDArray[np.float64]
    total: float  # light of all paths that meet the surfaces, what lies beneath included

    @property
    def light(self) -> NDArray[np.float64]:
        """(n,) relative to all light of the surfaces."""
        return np.asarray(self.xyz.sum(axis=1) / self.total)

    @property
    def wavenumber(self) -> NDArray[np.float64]:
        """(n,) k in rad/µm: u and v times it are α and β."""
        return np.asarray(wavenumber(self.wavelength))

    @property
    def along(self) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """(n,), (n,) |α| and |β| in rad/µm."""
        return np.abs(self.wavenumber * self.u), np.abs(self.wavenumber * self.v)

    @property
    def frequency(self) -> NDArray[np.float64]:
        """(n,) |q| in rad/µm."""
        return np.hypot(*self.along)

    @property
    def kappa(self) -> NDArray[np.float64]:
        """(n,) rad/µm."""
        return np.asarray(self.wavenumber * self.w)

    def outside(self, crop: tuple[float, float], kappa_max: float) -> float:
        """Share of the surfaces' light that is asked of beyond a domain."""
        x, y = (q / half for q, half in zip(self.along, crop, strict=True))
        beyond = (np.hypot(x, y) > 1.0) | (self.kappa > kappa_max)
        return float(self.light[beyond].sum())


@dataclass(frozen=True)
class Domain:
    """How much of a table a scene needs."""

    # crop, kappa_max: rad/µm, see `DiffractionTable.build`
    crop: tuple[float, float]
    kappa_max: float
    tolerance: float  # of the table itself
    outside: float  # share of the surfaces' light that is looked up beyond

    def arguments(self) -> dict[str, Any]:
        """For `DiffractionTable.build`."""
        return {"q_max": self.crop, "kappa_max": self.kappa_max, "tolerance": self.tolerance}


def domain_for(
    asked: Lookups, table: DiffractionTable, height_scale: float, tolerance: float
) -> Domain:
    """The smallest domain that leaves at most `tolerance` of the surfaces' light outside.

    Diffraction is but a part of that light: the table's own relative error may be larger than the
    picture's by that factor.

    asked : what is asked of the table.
    table : the table of everything, as the scene would have it.
    height_scale : largest of the surfaces'.
    tolerance : relative error of the picture.
    """
    light = asked.light
    crop = _ellipse(asked.along, light, tolerance)
    crop = (min(crop[0] * ROOM, table.q_limit), min(crop[1] * ROOM, table.q_limit))
    # All that these heights can make: the bound of the albedo looks at every direction, and next
    # to nothing is gained by less
    kappa_max = table.q_limit * height_scale
    own = tolerance / max(float(light.sum()), 1e-6)
    return Domain(
        crop=crop,
        kappa_max=kappa_max,
        tolerance=max(table.tolerance, float(f"{min(own, MOST_TOLERANCE):.2g}")),
        outside=asked.outside(crop, kappa_max),
    )


def _ellipse(
    along: tuple[NDArray[np.float64], NDArray[np.float64]], light: NDArray[np.float64], share: float
) -> tuple[float, float]:
    """Half axes of the smallest ellipse that leaves at most a share of the light outside."""
    x, y = along
    # Fingers and tracks spread light across themselves much farther than along
    ratios = 2.0 ** np.arange(-3.0, 3.01, 0.25)
    halves = [(_reach(np.hypot(x, y / ratio), light, share), ratio) for ratio in ratios]
    half, ratio = min(halves, key=lambda found: found[0] ** 2 * found[1])
    return half, float(half * ratio)


def _reach(values: NDArray[np.float64], light: NDArray[np.float64], share: float) -> float:
    """The smallest limit that leaves at most this much of the light above it."""
    order = np.argsort(values)[::-1]
    above = np.cumsum(light[order])
    first = int(np.searchsorted(above, share, side="right"))
    return float(values[order][min(first, len(order) - 1)])


def quantiles(
    values: NDArray[np.float64], light: NDArray[np.float64], shares: list[float]
) -> list[float]:
    """Values below which these shares of the light lie."""
    order = np.argsort(values)
    below = np.cumsum(light[order])
    places = np.searchsorted(below, np.asarray(shares) * below[-1])
    return [float(values[order][min(int(n), len(order) - 1)]) for n in places]


def lobes_in_a_pixel(turn: float, sigma: float) -> float:
    """How many lobes of the window one pixel sees at once, at 550 nm, because the surface bends.

    Where ωi turns by δ in the surface's frame, so does ωo: (u, v) moves by up to 2δ, and a lobe is
    1/(kσ) wide.

    turn : δ between two places in a pixel, in direction cosines.
    sigma : of the window, µm.
    """
    return float((2.0 * turn * float(wavenumber(550.0)) * sigma) ** 2)


def wavelengths_needed(asked: Lookups, share: float = 1e-3) -> dict[str, Any]:
    """The band that all but a share of the diffracted light lies in, half of it on either side.

    Returns range_nm, and lost_colour: ΔE2000 between the mean colours of all light and of the band
    alone.
    """
    low, high = quantiles(asked.wavelength, asked.light, [0.5 * share, 1.0 - 0.5 * share])
    inside = (asked.wavelength >= low) & (asked.wavelength <= high)
    colours = [linear_srgb(asked.xyz[mine].sum(axis=0)) for mine in (slice(None), inside)]
    largest = max(float(np.abs(colours[0]).max()), 1e-30)
    lost = delta_e(colours[0][None] / largest, colours[1][None] / largest, exposure=1.0)
    return {"range_nm": [low, high], "lost_colour": float(lost[0])}


@dataclass(frozen=True)
class PlannedTable:
    """One table of the scene."""

    surfaces: list[str]  # ids of the BSDFs that look it up
    name: str  # of the heights
    digest: str  # of the heights
    domain: Domain | None  # what of it is needed, or None for all of it
    memory: tuple[int, int]  # bytes of the whole table and of the planned one


@dataclass(frozen=True)
class Plan:
    """What a scene needs of its tables."""

    scene: str  # name of the file, for people
    tolerance: float  # relative error of the picture that it was made for
    paths: int  # that were traced
    # by the key of the whole table (`tables.store.table_key`): heights and parameters
    tables: Mapping[str, PlannedTable] = field(default_factory=dict)

    def limits(self) -> dict[str, dict[str, Any]]:
        """What `session.Session` follows."""
        return {
            key: table.domain.arguments()
            for key, table in self.tables.items()
            if table.domain is not None
        }

    def save(self, path: Path) -> None:
        """Write it as JSON."""
        document = {"kind": _KIND, "version": VERSION, **asdict(self)}
        with atomic_path(path) as temporary:
            temporary.write_text(
                json.dumps(document, indent=1, ensure_ascii=False) + "\n", encoding="utf-8"
            )

    @classmethod
    def load(cls, path: str | os.PathLike[str]) -> Plan:
        """Read what `save` wrote.

        Raises a DiffractionError if the file is missing, no plan, damaged, or of another version.
        """
        try:
            document = json.loads(read_text(path))
        except (json.JSONDecodeError, RecursionError) as error:
            raise DiffractionError(f"'{path}' is no plan: it is no JSON; {_REMEDY}") from error
        if not isinstance(document, dict) or document.get("kind") != _KIND:
            raise DiffractionError(f"'{path}' is JSON but no plan; {_REMEDY}")
        if document.get("version") != VERSION:
            raise DiffractionError(
                f"'{path}' is a plan of version {quoted(document.get('version'))}, this program "
                f"reads version {VERSION}; {_REMEDY}"
            )
        try:
            return cls(
                scene=str(document["scene"]),
                tolerance=float(document["tolerance"]),
                paths=int(document["paths"]),
                tables={str(k): _table(v) for k, v in document["tables"].items()},
            )
        except (LookupError, TypeError, ValueError, OverflowError, AttributeError) as error:
            raise DiffractionError(f"'{path}' is a damaged plan ({error!r}); {_REMEDY}") from error


def _table(document: dict[str, Any]) -> PlannedTable:
    domain = document["domain"]
    if domain is not None:
        x, y = (float(value) for value in domain.pop("crop"))
        domain = Domain(crop=(x, y), **{name: float(value) for name, value in domain.items()})
        numbers = (x, y, domain.kappa_max, domain.tolerance)
        if not all(0.0 < number < math.inf for number in numbers):
            raise ValueError(f"domain {domain}")
    whole, planned = document["memory"]
    return PlannedTable(
        surfaces=[str(name) for name in document["surfaces"]],
        name=str(document["name"]),
        digest=str(document["digest"]),
        domain=domain,
        memory=(int(whole), int(planned)),
    )
