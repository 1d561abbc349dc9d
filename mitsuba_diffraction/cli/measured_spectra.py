"""Spectra of files of `mitsuba-diffraction spectrum`: tables, scans and their crops."""

from __future__ import annotations

import argparse
import functools
import math
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from ..analysis.crops import crops_of
from ..analysis.media import follow, in_medium, loaded_in_media, medium_index, optical_scale
from ..analysis.scans import bsdf_of, table_of
from ..analysis.spectra import Spectra, spectrum, table_range
from ..analysis.spectrometer import MeasurementGeometry
from ..analysis.treatments import Treatment, load_treatments
from ..errors import DiffractionError, counted
from ..files import FileKind
from ..heights import dominant_periods, stands_in_full
from ..heights.coherence import blur
from ..heights.source import notes_line
from ..plugin.dictionary import bsdf_dict
from ..settings import TableSettings
from ..tables import DiffractionTable, TableSource
from ..tables.source import loaded_table
from . import options
from .brdf_map import OF_ORDERS, surface_parameters
from .console import Bar, say


@dataclass
class Measurement:
    """Spectra of one file after the other, by the options of `spectrum`.

    args : the command line.
    geometry : lamp and detectors.
    lam : wavelengths (n,), nm.
    bar : shows the progress.
    """

    args: argparse.Namespace
    geometry: MeasurementGeometry
    lam: Any
    bar: Bar
    _notes: list[str] = field(default_factory=list)
    _say_once: Callable[[str], None] = field(default_factory=lambda: functools.cache(say))

    def of_file(self, file: Path) -> list[Spectra]:
        """Measure the spectra of one file, or of its crops.

        It is treated as its name says; the command line precedes.
        """
        from ..orders.file import load_orders

        asked = Treatment(options.load_options(self.args))
        treatment = load_treatments(self.args.treatments, asked)(file)
        source = TableSource.of(file, treatment.options)
        if source.kind is FileKind.ORDERS:
            return [self._of_table(load_orders(file), file)]
        if source.kind is FileKind.TABLE:
            return [self._of_table(loaded_table(file), file)]
        if self.args.crops is not None:
            crops = crops_of(file, treatment.options, self.args.crops)
            return [self._of_heights(TableSource.of(crop), file, treatment) for crop in crops]
        return [self._of_heights(source.read(), file, treatment)]

    def say_notes(self) -> None:
        """Print the notes on the first scan that has any, and warnings; count the others."""
        for n, line in enumerate(self._notes):
            if n == 0 or stands_in_full(line):
                say(line)
        if len(self._notes) > 1:
            others = counted(len(self._notes) - 1, "more scan")
            say(f"notes on {others}: 'mitsuba-diffraction info' prints them")

    def _of_table(self, table: Any, file: Path) -> Spectra:
        """Measure the spectra of a table."""
        args = self.args
        # a table of heights serves all light above its shortest wavelength
        heights = isinstance(table, DiffractionTable)
        own = (*options.HEIGHTS, *options.TABLE, "crops", "ext_ior")
        options.refuse_of_table(args, file, own if heights else (*own, *OF_ORDERS))
        if args.light_azimuth == "auto":
            raise DiffractionError(
                f"'{file}' is a table, without heights to find gratings in; give --azimuth in "
                "degrees"
            )
        limits = (table.wavelength_range[0], math.inf) if heights else table.wavelengths
        remedy = ", or make a table of a wider range"
        lam = known(args, self.lam, limits, f"'{file}' has light", remedy, self._say_once)
        return self._spectrum(table, self.geometry, lam)

    def _of_heights(self, source: TableSource, file: Path, treatment: Treatment) -> Spectra:
        """Measure the spectra of heights; `auto` turns the lamp across their strongest grating."""
        args, geometry, first = self.args, self.geometry, float(self.lam[0])
        asked = {**treatment.settings, **options.table_options(args, options.TABLE)}
        asked["wavelength_range"] = table_range(self.lam)
        self.bar(0, 0, f"tabulating {file.name}")
        settings = source.settings_for(asked, optical_scale(surface_parameters(args)))
        within = in_medium(source, args.ext_ior, first)
        table = table_of(within, settings, self.bar)
        notes = within.warnings(settings)
        line = notes_line(notes, file, treatment.options, TableSettings(**asked))
        if line and args.crops is None:
            self._notes.append(line)
        if table.settings.window_width is not None:
            self._say_once(blur(table.window_width, medium_index(args.ext_ior, first)))
        if args.light_azimuth == "auto":
            gratings = dominant_periods(source.fields()[0])
            geometry = replace(geometry, azimuth=gratings[0].direction if gratings else 0.0)
            found = f"across {gratings[0]}" if gratings else "0°, since there is no grating"
            say(f"{file.name}: azimuth {found}")
        return self._spectrum(table, geometry, self.lam)

    def _spectrum(self, table: Any, geometry: MeasurementGeometry, lam: Any) -> Spectra:
        """Measure the spectra of a table's BSDF; with --iridescence its variables, too."""
        from ..analysis.angular_variables import angular_variables

        parameters = surface_parameters(self.args)
        bsdf = bsdf_of(bsdf_dict(table, **loaded_in_media(parameters)))
        before = follow(bsdf, parameters, float(lam[0]))
        azimuth, cone = geometry.azimuth, geometry.acceptance
        spectra = spectrum(
            bsdf, geometry.light, geometry.detectors, light_azimuth=azimuth, acceptance=cone,
            relative=self.args.relative, wavelengths=lam, before=before, progress=self.bar,
        )  # fmt: skip
        if not self.args.iridescence:
            return spectra
        variables = angular_variables(bsdf, lam, azimuth, cone, before, self.bar)
        return replace(spectra, angular=(variables,))


def known(
    args: argparse.Namespace, lam: Any, limits: tuple[float, float], what: str, remedy: str = "",
    say: Callable[[str], None] = say,
) -> Any:  # fmt: skip
    """Return the wavelengths (n,) within limits, nm; say that others are left out.

    what : name of the surface or material with the limits, and a verb, for messages.
    remedy : what else to do than to give other wavelengths.

    Raises a DiffractionError if --wavelength-range names others, or none is left.
    """
    low, high = limits
    inside = lam[(lam >= low) & (lam <= high)]
    if len(inside) == len(lam):
        return lam
    span = f"{what} from {low:g} " + ("nm on" if math.isinf(high) else f"to {high:g} nm")
    if args.wavelength_range is not None or not len(inside):
        raise DiffractionError(
            f"{span}, and the wavelengths are {lam[0]:g} to {lam[-1]:g} nm; give others by "
            f"--wavelength-range{remedy}"
        )
    say(f"{span}: other wavelengths are left out")
    return inside
