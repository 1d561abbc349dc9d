"""Films with a band for each receptor of an eye; tables that cover them, or a warning."""

from __future__ import annotations

import contextlib
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Any, NamedTuple

import drjit as dr
import mitsuba as mi
import numpy as np

from ..errors import DiffractionError, warn
from ..plugin.description import Surface
from ..plugin.sources import SHORTEST_WAVELENGTH
from ..tables import DiffractionTable, TableRequest, providing

# Parameters of a film that its size and format follow from.
_KEPT = (
    "width", "height", "crop_width", "crop_height", "crop_offset_x", "crop_offset_y",
    "sample_border",
)  # fmt: skip

#: Wavelengths, nm, by which a film may exceed a table without a warning: rounding of both.
_MARGIN = 0.5


class SensorBands(NamedTuple):
    """Responses of a film's channels.

    Attributes
    ----------
    wavelengths : (n,) nm, increasing.
    responses : (n,) of each channel by name, 1/nm.
    """

    wavelengths: Sequence[float]
    responses: Mapping[str, Sequence[float]]

    @property
    def first(self) -> float:
        """Shortest wavelength that a channel responds to, nm; responses are linear between.

        Raises a DiffractionError if no channel responds to any.
        """
        seen = np.flatnonzero(np.any(list(self.responses.values()), axis=0))
        if not seen.size:
            raise DiffractionError(
                "the film responds to no wavelength: the light has none that the eye sees; give "
                "another light or eye"
            )
        return float(self.wavelengths[max(seen[0] - 1, 0)])


def put_bands(state: Any, bands: SensorBands) -> None:
    """Replace all films by spectral films of these bands.

    A channel's value is ∫ L(λ) r(λ) dλ, with the radiance L per nanometre and its response r.

    state : `mi.parser.ParserState`, its references resolved.
    """
    for node in state.nodes:
        if node.type != mi.ObjectType.Film:
            continue
        old, film = node.props, mi.Properties("specfilm")
        for name in old.keys():  # noqa: SIM118 - Properties is no mapping
            if name in _KEPT or old.type(name) == mi.Properties.Type.ResolvedReference:
                film[name] = old[name]
        film["component_format"] = "float32"
        film.set_id(old.id())
        lam = ", ".join(f"{x:g}" for x in bands.wavelengths)
        for name, response in bands.responses.items():
            values = ", ".join(f"{x:.8g}" for x in response)
            film[name] = mi.load_dict({"type": "irregular", "wavelengths": lam, "values": values})
        node.props = film


@contextlib.contextmanager
def wider_tables(first: float) -> Iterator[None]:
    """Give heights of scenes that are loaded inside tables from a wavelength on.

    first : nm; default tables begin at 360.
    """
    first = min(first, SHORTEST_WAVELENGTH)

    def table(request: TableRequest) -> DiffractionTable:
        low, last = request.settings.wavelength_range
        wider = replace(request.settings, wavelength_range=(min(first, low), last))
        return request.cached(wider)

    with providing(table):
        yield


def check_bands(
    sensors: Iterable[Any], surfaces: Mapping[str, Sequence[Surface]], eye: bool
) -> None:
    """Warn of each surface whose table lacks wavelengths that a camera records.

    Light below a table's wavelengths is black; above a table of heights, light has the values of
    the longest wavelength. Colours need no warning: tables that miss visible light are refused or
    named when they load.

    sensors : cameras of the scene.
    surfaces : surfaces that diffract, by the names of their shapes.
    eye : whether the cameras are an eye, for which tables of heights are made that it sees whole.

    Raises a DiffractionError if a table of heights, a file, begins above the light that an eye
    sees.
    """
    # spectral variants alone use a film's own responses
    banded = [s for s in sensors if s.film().sensor_response_function() is not None]
    if not banded or not mi.is_spectral:
        return
    lows, highs = zip(*map(_recorded, banded), strict=True)
    first, last = min(lows), max(highs)
    for name, described in surfaces.items():
        for solved, served in dict.fromkeys((s.solved, s.wavelengths) for s in described):
            if lacking := _lacking(solved, served, first, last):
                if eye and not solved and first < served[0] - _MARGIN:
                    raise DiffractionError(f"{name} {lacking}, or give heights")
                warn(f"{name} {lacking}")


def _lacking(solved: bool, served: tuple[float, float], first: float, last: float) -> str:
    """Return what a table lacks of the light from `first` to `last` nm, and a remedy, or "".

    served : shortest and longest wavelength of the table, nm.
    """
    (low, high), faults = served, []
    if first < low - _MARGIN:
        faults.append(f"is black below {low:.4g} nm, where its table begins")
    if last > high + _MARGIN:
        beyond = f"is black above {high:.4g} nm, where its table ends"
        values = f"has the values of {high:.4g} nm at all longer wavelengths"
        faults.append(beyond if solved else values)
    if not faults:
        return ""
    wider = f"wavelength_range=({min(first, low):.4g}, {max(last, high):.4g})"
    return (
        f"{' and '.join(faults)}, and the camera records {first:.4g} to {last:.4g} nm; make the "
        f"table with {'a wider range of wavelengths' if solved else wider} "
        f"(the command '{'solve' if solved else 'precompute'}')"
    )


def _recorded(sensor: Any) -> tuple[float, float]:
    """Return the shortest and the longest wavelength that a sensor records, nm."""
    si = dr.zeros(mi.SurfaceInteraction3f)
    # the ends of the unit interval are the ends of the response
    ends = [np.array(sensor.sample_wavelengths(si, at)[0]) for at in (0.0, 1.0 - 1e-6)]
    return float(np.min(ends)), float(np.max(ends))
