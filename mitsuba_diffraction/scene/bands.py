"""Films with a band for each receptor of an eye; tables that cover them, or a warning."""

from __future__ import annotations

import contextlib
import functools
import re
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Any, NamedTuple

import drjit as dr
import mitsuba as mi
import numpy as np

from ..errors import DiffractionError, warn
from ..orders import OrderTable
from ..plugin.description import describe
from ..plugin.sources import SHORTEST_WAVELENGTH, TableRequest
from ..tables.table import DiffractionTable

# Parameters of a film that its size and format follow from.
_KEPT = (
    "width", "height", "crop_width", "crop_height", "crop_offset_x", "crop_offset_y",
    "sample_border",
)  # fmt: skip

#: Kind and wavelengths of a table, as `to_string` of the plugins shows them.
_SERVED = re.compile(r"\btable = (\w+).*\s+wavelengths = (\S+) to (\S+) nm")
#: Wavelengths, nm, by which a film may exceed a table without a warning: rounding of both.
_MARGIN = 0.5


class Bands(NamedTuple):
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
        """Shortest wavelength that a channel responds to, nm; responses are linear between."""
        seen = [any(values) for values in zip(*self.responses.values(), strict=True)]
        return float(self.wavelengths[max(seen.index(True) - 1, 0)])


def put_bands(state: Any, bands: Bands) -> None:
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
    from ..plugin.diffraction import Diffraction
    from ..plugin.diffraction_dielectric import DiffractionDielectric

    first = min(first, SHORTEST_WAVELENGTH)

    def table(request: TableRequest) -> DiffractionTable:
        low, last = request.settings.wavelength_range
        wider = replace(request.settings, wavelength_range=(min(first, low), last))
        return request.cached(wider)

    def make(kind: Callable[..., Any], props: Any) -> Any:
        bsdf = kind(props, table)
        shortest = getattr(describe(bsdf), "shortest_wavelength", 0.0)
        if shortest > first:
            raise DiffractionError(
                f"the table begins at {shortest:g} nm, and the eye sees from {first:g} nm; give "
                f"heights, or DiffractionTable.build(wavelength_range=({first:g}, 830))"
            )
        return bsdf

    kinds = {"diffraction": Diffraction, "diffraction_dielectric": DiffractionDielectric}
    for name, kind in kinds.items():
        mi.register_bsdf(name, functools.partial(make, kind))
    try:
        yield
    finally:
        for name, kind in kinds.items():
            mi.register_bsdf(name, kind)


def warn_of_dark_bands(sensors: Iterable[Any], surfaces: Mapping[str, Any]) -> None:
    """Warn of each surface that is black at wavelengths that a camera records.

    Colours need no warning: tables that miss visible light are refused or named when they load.

    sensors : cameras of the scene; surfaces : BSDFs that diffract, by the names of their shapes.
    """
    # spectral variants alone use a film's own responses
    banded = [
        s for s in sensors if mi.is_spectral and s.film().sensor_response_function() is not None
    ]
    ranges = [_recorded(sensor) for sensor in banded]
    if not ranges:
        return
    first, last = min(low for low, _ in ranges), max(high for _, high in ranges)
    for name, bsdf in surfaces.items():
        for kind, low, high in dict.fromkeys(_SERVED.findall(str(bsdf))):
            least, most = min(first, float(low)), max(last, float(high))
            if least < float(low) - _MARGIN or most > float(high) + _MARGIN:
                wider = f"DiffractionTable.build(wavelength_range=({least:.4g}, {most:.4g}))"
                if kind == OrderTable.__name__:
                    wider = "a wider range of wavelengths"
                warn(
                    f"{name} is black outside {low} to {high} nm, the range of its table, and the "
                    f"camera records {first:.4g} to {last:.4g} nm; make the table with {wider}"
                )


def _recorded(sensor: Any) -> tuple[float, float]:
    """Return the shortest and the longest wavelength that a sensor records, nm."""
    si = dr.zeros(mi.SurfaceInteraction3f)
    # the ends of the unit interval are the ends of the response
    ends = [np.array(sensor.sample_wavelengths(si, at)[0]) for at in (0.0, 1.0 - 1e-6)]
    return float(np.min(ends)), float(np.max(ends))
