"""Spectra of files of `mitsuba-diffraction spectrum`: tables, scans and their crops."""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ..errors import DiffractionError
from ..files import FileKind, kind_of
from ..settings import TableSettings
from . import options
from .brdf_map import surface_parameters
from .console import Bar, say

if TYPE_CHECKING:
    from ..analysis.spectra import Spectra
    from ..analysis.treatments import Treatment
    from ..heights.field import HeightField
    from ..tables.orders import OrderTable

# Treatments of edges between which a band is drawn.
_TREATMENTS = ("smooth", "taper", "none")


def measured_spectra(
    args: argparse.Namespace, file: Path, geometry: Any, lam: Any, bar: Bar
) -> list[Spectra]:
    """Measure the spectra of one file, or of its crops."""
    from ..tables.orders import load_any_orders
    from ..tables.store import loaded_table

    kind = kind_of(file)
    if kind is FileKind.ORDERS:
        return [_of_table(args, load_any_orders(file), file, geometry, lam, bar)]
    if kind is FileKind.TABLE:
        return [_of_table(args, loaded_table(file), file, geometry, lam, bar)]
    how = _treatment(args, file).options
    if args.crops is not None:
        from ..analysis.crops import crops_of

        return [
            _of_heights(args, [crop], file, how, geometry, lam, bar)
            for crop in crops_of(file, how, args.crops)
        ]
    from ..analysis.scans import read_scan

    patches = read_scan(file, how, {}).patches
    spectra = _of_heights(args, patches, file, how, geometry, lam, bar)
    return [_with_band(args, spectra, patches, file, how, geometry, lam, bar)]


def _treatment(args: argparse.Namespace, file: Path) -> Treatment:
    """Return how a file is read: by its name, and by the command line, which precedes."""
    from ..analysis.treatments import Treatment, load_treatments, treatment_for

    found = treatment_for(file, load_treatments(args.treatments))
    return found.updated(Treatment(options.load_options(args)))


def _with_band(
    args: argparse.Namespace, spectra: Spectra, patches: Sequence[HeightField], file: Path,
    how: Any, geometry: Any, lam: Any, bar: Bar,
) -> Spectra:  # fmt: skip
    """Add the band over treatments where treatment removed as much as it kept, and warn."""
    import numpy as np

    from ..heights.load import load_heights
    from ..heights.treatment import treatment_warning

    line = treatment_warning(file, how, patches[0]) if len(patches) == 1 else ""
    if not line:
        return spectra
    say(f"{line}; the band is over periodic={', '.join(_TREATMENTS)}")
    others = [
        _of_heights(args, [load_heights(file, replace(how, periodic=name))], file, how, geometry,
                    lam, bar, quiet=True).value
        for name in _TREATMENTS
    ]  # fmt: skip
    values = np.stack([spectra.value, *others])
    return replace(spectra, band=(values.min(axis=0), values.max(axis=0)))


def _of_table(
    args: argparse.Namespace, table: Any, file: Path, geometry: Any, lam: Any, bar: Bar
) -> Spectra:
    """Measure the spectra of a table."""
    own = (*options.HEIGHTS, *options.TABLE, "crops", "ext_ior")
    if refused := options.given(args, own):
        option = options.option_of(args, next(iter(refused)))
        raise DiffractionError(
            f"'{file}' is a table, which has its own; leave {option} out, or give heights"
        )
    if args.light_azimuth == "auto":
        raise DiffractionError(
            f"'{file}' is a table, without heights to find gratings in; give --azimuth in degrees"
        )
    if kind_of(file) is FileKind.ORDERS:
        lam = _within(table, lam, file)
    elif args.wavelength_range is None:
        lam = lam[lam >= table.wavelength_range[0]]
    return _spectrum(args, table, geometry, lam, bar, angular=args.iridescence)


def _of_heights(
    args: argparse.Namespace, patches: Sequence[HeightField], file: Path, how: Any, geometry: Any,
    lam: Any, bar: Bar, *, quiet: bool = False,
) -> Spectra:  # fmt: skip
    """Measure the spectra of heights; `auto` turns the lamp across their strongest grating."""
    from ..analysis.media import in_medium, medium_index
    from ..analysis.scans import Scan, read_scan, table_of
    from ..analysis.spectra import table_range
    from ..heights.coherence import blur
    from ..heights.load import notes_line
    from ..heights.spectra import dominant_periods
    from ..tables.build.checks import warnings_of

    asked = {**_treatment(args, file).settings, **options.table_options(args)}
    asked["wavelength_range"] = table_range(lam)
    bar(0, 0, f"tabulating {file.name}")
    settings = read_scan(file, how, asked).settings
    scan = in_medium(Scan(list(patches), settings), args.ext_ior, float(lam[0]))
    table = table_of(scan, bar)
    line = notes_line(warnings_of(*scan), file, how, TableSettings(**asked))
    if line and not quiet and args.crops is None:
        _say_first(args, line)
    if table.settings.window_width is not None:
        index = medium_index(args.ext_ior, float(lam[0]))
        _say_once(args, blur(table.window_width, index))
    if args.light_azimuth == "auto":
        gratings = dominant_periods(patches[0])
        geometry = replace(geometry, azimuth=gratings[0].direction if gratings else 0.0)
        if not quiet:
            found = f"across {gratings[0]}" if gratings else "0°, since there is no grating"
            say(f"{file.name}: azimuth {found}")
    return _spectrum(args, table, geometry, lam, bar, angular=args.iridescence and not quiet)


def _spectrum(
    args: argparse.Namespace, table: Any, geometry: Any, lam: Any, bar: Bar, *, angular: bool
) -> Spectra:
    """Measure the spectra of a table's BSDF, and its variables over all angles."""
    from ..analysis.angular_variables import angular_variables
    from ..analysis.media import follow, loaded_in_media
    from ..analysis.scans import bsdf_of
    from ..analysis.spectra import spectrum

    parameters = surface_parameters(args)
    bsdf = bsdf_of(table, **loaded_in_media(parameters))
    before = follow(bsdf, parameters, float(lam[0]))
    azimuth, cone = geometry.azimuth, geometry.acceptance
    spectra = spectrum(
        bsdf, geometry.light, geometry.detectors, light_azimuth=azimuth, acceptance=cone,
        relative=args.relative, wavelengths=lam, before=before, progress=bar,
    )  # fmt: skip
    if not angular:
        return spectra
    variables = angular_variables(bsdf, lam, azimuth, cone, before, bar)
    return replace(spectra, angular=(variables,))


def _within(table: OrderTable, lam: Any, file: Path) -> Any:
    """Return the wavelengths that a table of orders has.

    Raises a DiffractionError if it has none of them.
    """
    low, high = table.wavelengths
    inside = lam[(lam >= low) & (lam <= high)]
    if not len(inside):
        raise DiffractionError(
            f"'{file}' has orders of {low:g} to {high:g} nm, and none of {lam[0]:g} to "
            f"{lam[-1]:g} nm; choose others by --wavelength-range"
        )
    if len(inside) < len(lam):
        say(f"'{file}' has orders of {low:g} to {high:g} nm: other wavelengths are left out")
    return inside


def say_notes(args: argparse.Namespace) -> None:
    """Print on how many scans there are notes beside the first one's."""
    noted = vars(args).get("noted", 0)
    if noted > 1:
        others = "1 more scan" if noted == 2 else f"{noted - 1} more scans"
        say(f"notes on {others}: 'mitsuba-diffraction info' prints them")


def _say_first(args: argparse.Namespace, line: str) -> None:
    """Print the notes on the first scan that has any, and warnings; count the others."""
    from ..heights.validity import UNRELIABLE

    args.noted = vars(args).get("noted", 0) + 1
    if args.noted == 1 or UNRELIABLE in line:
        say(line)


def _say_once(args: argparse.Namespace, line: str) -> None:
    """Print a line that holds for several scans, once."""
    said = vars(args).setdefault("said", set())
    if line not in said:
        said.add(line)
        say(line)
