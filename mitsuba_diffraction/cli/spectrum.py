"""`mitsuba-diffraction spectrum`: reflectance spectra as a spectrometer measures them."""

from __future__ import annotations

import argparse
import time
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ..errors import DiffractionError
from ..files import FileKind, kind_of
from ..scene.load import set_variant
from ..settings import TableSettings
from . import options
from .brdf_map import add_surface, surface_parameters
from .console import Bar, mitsuba_warnings, say
from .options import number_between
from .report import check_outputs, save_report

if TYPE_CHECKING:
    from ..analysis.spectra import Geometry, Spectra
    from ..tables.orders import OrderTable

_RANGE = (300.0, 830.0)


def add_parser(subparsers: options.Subparsers) -> None:
    parser = options.add_command(
        subparsers, "spectrum", run, "spectra as a spectrometer with a fibre measures them",
        "Measure reflectance spectra: a lamp at one angle, detectors that collect cones of "
        "directions in the plane of incidence, a white standard. Writes a CSV in per cent, `wl` "
        "in nm first and a column for each detector, as the R package pavo reads it, and a plot "
        "beside it. Several files are scans of one kind of surface: the CSV has their mean, "
        f"and a second file the standard errors. {options.LIMITS}",
    )  # fmt: skip
    options.add_files(parser, "tables, also of orders, recipes or heights of any format")
    options.add_output(
        parser, "CSV, with a PNG beside it; default: FILE's name with -spectrum.csv in the current "
        "folder", ".csv",
    )  # fmt: skip
    group = parser.add_argument_group("the spectrometer")
    group.add_argument(
        "--light", metavar="DEG", type=float, default=30.0,
        help="angle of the lamp from the normal; default: 30",
    )  # fmt: skip
    group.add_argument(
        "--light-azimuth", metavar="DEG", type=float, default=0.0,
        help="azimuth of the lamp from the patch's x axis towards y; default: 0",
    )  # fmt: skip
    group.add_argument(
        "--detector", metavar="DEG", type=float, nargs="+", default=None,
        help="angles of the detectors from the normal, positive on the far side from the lamp; "
        "default: where a mirror reflects the lamp to",
    )  # fmt: skip
    group.add_argument(
        "--acceptance", metavar="DEG", type=float, default=2.0,
        help="full angle of the cone that a detector collects; default: 2",
    )  # fmt: skip
    group.add_argument(
        "--relative", choices=("white", "mirror", "none"), default="white",
        help="per cent of a white standard, of a perfect mirror, or of the incident light; "
        "default: white",
    )  # fmt: skip
    group.add_argument(
        "--polarisation", action="store_true",
        help="also light polarised across (s) and in (p) the plane of incidence",
    )  # fmt: skip
    group.add_argument(
        "--wavelength-range", metavar=("FIRST", "LAST"), nargs=2, type=number_between(100, 10000),
        help="nm; default: 300 830, or from where a table begins",
    )  # fmt: skip
    group.add_argument(
        "--step", metavar="NM", type=number_between(0.01, 1000), default=5.0,
        help="between wavelengths; default: 5",
    )  # fmt: skip
    add_surface(parser.add_argument_group("the surface"))
    options.add_heights(parser)
    options.add_json(parser, "the spectra")


def run(args: argparse.Namespace) -> int:
    """Measure the spectra, and return the exit code."""
    start = time.perf_counter()
    options.load_options(args)  # wrong options are reported before Mitsuba is loaded
    from ..analysis.repeats import scan_files

    files = scan_files(args.files)
    output = args.output or Path(f"{files[0].stem}-spectrum.csv")
    written = [output, output.with_suffix(".png")]
    if len(files) > 1:
        written.append(output.with_name(f"{output.stem}-errors.csv"))
    check_outputs(written, files, "spectrum")
    lam = _wavelengths(args)

    variant = set_variant("llvm_ad_spectral_polarized" if args.polarisation else "llvm_ad_spectral")
    from ..analysis.spectra import Geometry, mean_spectra
    from ..analysis.spectra_files import save_csv, save_errors, spectra_figure
    from ..atomic import atomic_path

    detectors = (args.light,) if args.detector is None else tuple(args.detector)
    geometry = Geometry(args.light, detectors, args.light_azimuth, args.acceptance)
    lam = _known_wavelengths(args, lam)  # before a table is built
    with mitsuba_warnings(), Bar(args) as bar:
        spectra = mean_spectra([_measured(args, file, geometry, lam, bar) for file in files])
    save_csv(spectra, output)
    if spectra.error is not None:
        save_errors(spectra, written[2])
    title = files[0].name if len(files) == 1 else f"mean of {len(files)} scans"
    with atomic_path(written[1]) as temporary:
        spectra_figure(spectra, title).savefig(temporary, format="png")
    lam = spectra.wavelength
    print(
        f"{' and '.join(map(str, written))}: {len(detectors)} spectra of {lam.size} wavelengths, "
        f"{lam[0]:g} to {lam[-1]:g} nm, {title}, {time.perf_counter() - start:.1f} s, {variant}"
    )
    columns = {name: values.tolist() for name, values in spectra.columns().items()}
    save_report(args, {"files": written, "sources": files, "light": args.light,
                       "light_azimuth": args.light_azimuth, "detectors": detectors,
                       "acceptance": args.acceptance, "relative": args.relative,
                       "wavelengths": lam.tolist(), "spectra": columns})  # fmt: skip
    return 0


def _wavelengths(args: argparse.Namespace) -> Any:
    """Return the wavelengths (n,) that are asked for, nm."""
    import numpy as np

    first, last = args.wavelength_range or _RANGE
    if first > last:
        args.parser.error("argument --wavelength-range: give the shortest first, e.g. 400 700")
    count = int((last - first) / args.step + 1e-9) + 1
    return first + args.step * np.arange(count)


def _known_wavelengths(args: argparse.Namespace, lam: Any) -> Any:
    """Return the wavelengths at which the material and the pigment are known.

    Raises a DiffractionError if --wavelength-range names others, or there is no such material.
    """
    from ..analysis.spectra import check_material, known_range

    if args.wavelength_range is None:
        first, last = known_range(args.material, args.pigment)
        known = lam[(lam >= first) & (lam <= last)]
        if known.size and known.size < lam.size:
            say(f"material or pigment are known from {known[0]:g} to {known[-1]:g} nm alone")
            lam = known
    check_material(args.material, lam, args.pigment)
    return lam


def _measured(
    args: argparse.Namespace, file: Path, geometry: Geometry, lam: Any, bar: Bar
) -> Spectra:
    """Measure the spectra of one file."""
    from ..analysis.scans import bsdf_of, read_scan, table_of
    from ..analysis.spectra import spectrum
    from ..heights.load import notes_line
    from ..optics.colour import LONGEST, SHORTEST
    from ..tables.build.checks import warnings_of
    from ..tables.orders import OrderTable
    from ..tables.store import loaded_table

    kind = kind_of(file)
    solved = kind is FileKind.ORDERS
    if solved or kind is FileKind.TABLE:
        names = [f"--{n.replace('_', '-')}" for n in options.table_options(args)]
        names = [name for name in names if name != "--wavelength-range"]
        if refused := [*options.used_heights_options(args), *names]:
            raise DiffractionError(
                f"'{file}' is a table, which has its own; leave {refused[0]} out"
            )
        table = OrderTable.load(file) if solved else loaded_table(file)
        if isinstance(table, OrderTable):
            lam = _within(table, lam, file)
        elif args.wavelength_range is None:
            lam = lam[lam >= table.wavelength_range[0]]
    else:
        # Mitsuba loads no table that begins later than the light that it renders
        span = (min(lam[0], SHORTEST), max(lam[-1], LONGEST))
        how = options.load_options(args)
        asked = options.table_options(args) | {"wavelength_range": span}
        bar(0, 0, f"tabulating {file.name}")
        scan = read_scan(file, how, asked)
        table = table_of(scan, bar)
        if line := notes_line(warnings_of(*scan), file, how, TableSettings(**asked)):
            say(line)
    return spectrum(
        bsdf_of(table, **surface_parameters(args)),
        geometry.light, geometry.detectors, light_azimuth=geometry.azimuth,
        acceptance=geometry.acceptance, relative=args.relative, wavelengths=lam, progress=bar,
    )  # fmt: skip


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
