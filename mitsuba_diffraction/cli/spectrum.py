"""`mitsuba-diffraction spectrum`: reflectance spectra as a spectrometer measures them."""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from dataclasses import replace
from itertools import chain
from pathlib import Path
from typing import Any

import numpy as np

from ..analysis.known_wavelengths import known_range
from ..analysis.observers import eye_of, illuminant_of, quantum_catches
from ..analysis.scans import check_surface
from ..analysis.spectra import Spectra
from ..analysis.spectrometer import MeasurementGeometry, column_name
from ..errors import DiffractionError, counted
from ..images import save_figure
from ..scene.load import set_variant
from ..text_spectra import read_shares
from . import options
from .brdf_map import surface_options, surface_parameters
from .console import Bar, say
from .measured_spectra import Measurement, known
from .report import Figures, elapsed, output_of
from .values import limits, number_between, numbers, pair, path_ending_in, value, whole_number

_RANGE = (300.0, 830.0)
# Per cent of the standard below which a spectrum is said to be without light.
_NOTHING = 1e-3
# Files of an animal's catches and contrasts.
_SEEN = ("catches", "contrasts")


#: Options of the measurement.
_SPECTROMETER = (
    ("--light DEG", "angle of the lamp from the normal", float, 30.0),
    ("--light-azimuth --azimuth DEG", "azimuth of the lamp from x towards y, degrees, or auto: "
     "across the grooves of the strongest grating",
     value("an angle or auto", lambda text: text if text == "auto" else float(text)), 0.0),
    ("--detector DEG ...", "angles of the detectors from the normal, positive away from the lamp, "
     "or ranges FIRST:LAST:STEP; default: the mirror direction", numbers),
    ("--acceptance DEG", "full angle of the cone that a detector collects", float, 2.0),
    ("--relative", "per cent of a white standard, of a perfect mirror, or of the incident light",
     ("white", "mirror", "none"), "white"),
    ("--polarisation", "also light polarised across (s) and in (p) the plane of incidence", bool),
    ("--wavelength-range FIRST:LAST", "nm; default: 300:830, or from where a table begins",
     limits),
    ("--step NM", "between wavelengths", number_between(0.01, 1000), 5.0),
)  # fmt: skip


@options.command(
    "spectrum", "spectra as a spectrometer with a fibre measures them",
    "Measure reflectance spectra: a lamp at one angle, detectors that collect cones of "
    "directions in the plane of incidence, a white standard. Writes a CSV in per cent, `wl` "
    "in nm first and a column for each detector, as the R package pavo reads it, a table of "
    "colours and a plot beside it. Several files are scans of one kind of surface: the CSV has "
    f"their mean, and a second file the standard errors. {options.LIMITS}",
    options.files("tables, also of orders, recipes or heights", "*"),
    ("--group NAME=PATTERN", "scans of one species instead of FILE, e.g. corn='corn/*.spm'; "
     "may be given several times",
     [pair("NAME=PATTERN")], None, {"dest": "groups"}),
    ("--crops N", "cut each scan into N parts, whose standard errors are the scan's "
     "repeatability", whole_number(2)),
    ("--observer ANIMAL|CSV", "eye for quantum catches and contrasts (JND): avian_uv, "
     "avian_v, lizard, snake, dog, bee, human, or a CSV of sensitivities"),
    ("--illuminant LIGHT|CSV", "light of --observer: ideal (equal quanta), d55, d65, d75, "
     "leaves, or a file of wavelengths (nm) and photons; default: ideal"),
    ("--cone-ratios N,N,…", "relative numbers of the receptors of --observer, shortest waves "
     "first, which share the noise; default: the eye's, docs/seen.md", numbers),
    ("--weber E[,E,…]", "Weber fraction of the receptor of the longest waves, or of each; "
     "default: 0.1", numbers),
    ("--weber-luminance E", "Weber fraction of luminance; default: 0.1",
     number_between(1e-4, 1e2)),
    ("--iridescence", "also Bmax, t, gammaB, Hmax and gammaH of each scan (Gruson and others "
     "2019)", bool),
    ("--measured FILE[:COLUMN]", "measured reflectance to draw beside the curve of one detector, "
     "with the RMS difference: text of wavelengths (nm) and fractions or per cent of white"),
    ("-o --output OUT", "CSV, with a PNG beside it; default: FILE's name with -spectrum.csv in "
     "the current folder", path_ending_in(".csv")),
    options.Group("the spectrometer", _SPECTROMETER),
    surface_options(),
    options.TREATMENTS,
    options.heights(),
    options.json("the spectra"),
)  # fmt: skip
def run(args: argparse.Namespace) -> Figures:
    """Measure the spectra, and return the figures."""
    options.load_options(args)  # wrong options are reported before Mitsuba is loaded
    groups = _groups(args)
    files = [file for members in groups.values() for file in members]
    first = next(iter(groups))
    repeated = args.crops is not None or any(len(members) > 1 for members in groups.values())
    default = Path(f"{first or files[0].stem}-spectrum.csv")
    output = output_of(args, default, lambda name: _files(args, repeated, name).values())
    files_of = _files(args, repeated, output)
    lam = _wavelengths(args)
    eye, light = _eye(args, lam)
    detectors = (args.light,) if args.detector is None else tuple(chain(*args.detector))

    variant = set_variant("llvm_ad_spectral_polarized" if args.polarisation else "llvm_ad_spectral")
    from ..analysis import spectra_files as files_of_spectra

    measured = _measured_curve(args, detectors, lam)
    auto = args.light_azimuth == "auto"
    geometry = MeasurementGeometry(
        args.light, tuple(dict.fromkeys(detectors)), 0.0 if auto else args.light_azimuth,
        args.acceptance,
    )  # fmt: skip
    check_surface(surface_parameters(args))
    surface = " and ".join(
        f"{k}={v}" for k, v in options.given(args, ("material", "pigment")).items()
    )
    # before a table is built
    lam = known(args, lam, known_range(args.material, args.pigment), f"{surface} is known")
    with Bar(args) as bar:
        measurement = Measurement(args, geometry, lam, bar)
        spectra = files_of_spectra.means_of(_measured(measurement, groups))
    files = [file for members in groups.values() for file in members]
    measurement.say_notes()
    shown = spectra[first]
    asked, lam = lam.size, shown.wavelength
    if len(files) > 1 and lam.size < asked:
        say(f"columns are from {lam[0]:g} to {lam[-1]:g} nm, which every table has")
    columns = files_of_spectra.columns_of(spectra)
    files_of_spectra.save_csv(output, lam, columns)
    if errors := files_of_spectra.errors_of(spectra):
        files_of_spectra.save_csv(files_of["errors"], lam, errors)
    else:
        files_of.pop("errors", None)
    files_of_spectra.save_colours(spectra, files_of["colours"])
    if eye is not None:
        files_of_spectra.save_catches(spectra, eye, light, *(files_of[name] for name in _SEEN))
    if args.iridescence:
        files_of_spectra.save_angular(spectra, files_of["iridescence"])
    title, turned = _title(groups, args), files_of_spectra.EACH if auto and repeated else ""
    beside = {} if measured is None else _compared(args, *measured, lam, shown.value[:, 0])
    figure = files_of_spectra.spectra_figure(spectra, title, turned, measured)
    save_figure(files_of["plot"], figure)
    written = list(files_of.values())
    print(
        f"{' and '.join(map(str, written))}: "
        f"{counted(len(shown.geometry.detectors), 'spectrum', 'spectra')} of "
        f"{counted(lam.size, 'wavelength')}, {lam[0]:g} to {lam[-1]:g} nm, {title}, "
        f"{elapsed(args):.1f} s, {variant}"
    )
    if beside:
        print(
            f"  {args.measured}: RMS difference {100.0 * beside['rms']:.3g} %, mean of the "
            f"measured {100.0 * beside['mean']:.3g} %, {beside['first']:g} to {beside['last']:g} nm"
        )
    for name, each in spectra.items():
        if 100.0 * each.value.max() < _NOTHING:
            why = (
                "the surface reflects no light in the mirror direction; is its index, --material "
                "or --int-ior, that of the medium around it?"
                if args.light in detectors
                else "no order of the surface enters a detector; try --azimuth auto, across the "
                "strongest grating's grooves, or a range of detectors (--detector -60:60:5)"
            )
            say(f"{name or title}: every column is below {_NOTHING:g} %: {why}")
    return {"files": written, "sources": files, "light": args.light,
            "light_azimuth": turned or shown.geometry.azimuth,
            "detectors": shown.geometry.detectors,
            "acceptance": args.acceptance, "relative": args.relative, "measured": beside,
            # the CSV has per cent
            "wavelengths": lam.tolist(), "unit": "1", "spectra": columns}  # fmt: skip


def _measured_curve(
    args: argparse.Namespace, detectors: Sequence[float], lam: Any
) -> tuple[Any, Any] | None:
    """Return wavelengths (n,) in nm and values (n,) of --measured, or None.

    Raises a DiffractionError if the file has no reflectances, or none at these wavelengths.
    """
    if args.measured is None:
        return None
    if args.groups or len(detectors) > 1 or args.relative != "white":
        args.parser.error(
            "argument --measured: is compared with one curve, in per cent of white; give one "
            "--detector, and neither --group nor --relative"
        )
    measured = read_shares(args.measured, (lam[0], lam[-1]))
    _compared(args, *measured, lam, 0.0 * lam)
    return measured


def _compared(
    args: argparse.Namespace, nodes: Any, values: Any, lam: Any, computed: Any
) -> dict[str, Any]:
    """Return the RMS difference of a measured and a computed curve where both are known."""
    both = (lam >= nodes[0]) & (lam <= nodes[-1])
    if not both.any():
        raise DiffractionError(
            f"'{args.measured}' has {nodes[0]:g} to {nodes[-1]:g} nm, and the spectrum {lam[0]:g} "
            f"to {lam[-1]:g} nm; give others by --wavelength-range"
        )
    known = np.interp(lam[both], nodes, values)
    return {"file": args.measured, "rms": float(np.sqrt(np.mean((computed[both] - known) ** 2))),
            "mean": float(known.mean()), "first": lam[both][0], "last": lam[both][-1]}  # fmt: skip


def _measured(measurement: Measurement, groups: dict[str, list[Path]]) -> dict[str, list[Spectra]]:
    """Measure the spectra of each group.

    A file among several that cannot be measured is said and taken out of its group.

    Raises a DiffractionError if no file of a group can be measured.
    """
    spectra: dict[str, list[Spectra]] = {name: [] for name in groups}
    for name, members in groups.items():
        for file in [*members]:
            try:
                spectra[name] += measurement.of_file(file)
            except DiffractionError as error:
                if members == [file]:
                    raise
                members.remove(file)
                measurement.args.code = 1
                say(f"left out: {error}")
    return spectra


def _files(args: argparse.Namespace, repeated: bool, output: Path) -> dict[str, Path]:
    """Return the files of -o by content, with standard errors of `repeated` scans."""
    names = [
        "colours", *(_SEEN if args.observer is not None else ()),
        *(["iridescence"] if args.iridescence else []), *(["errors"] if repeated else []),
    ]  # fmt: skip
    tables = {name: output.with_name(f"{output.stem}-{name}.csv") for name in names}
    return {"spectra": output, "plot": output.with_suffix(".png"), **tables}


def _eye(args: argparse.Namespace, lam: Any) -> tuple[Any, Any]:
    """Return the eye of --observer, or None, and its light; refuse wavelengths beside its range."""
    if args.observer is None:
        theirs = ("illuminant", "cone_ratios", "weber", "weber_luminance")
        options.refuse(args, theirs, ": belongs to --observer; name one")
        return None, None
    asked = options.given(args, ("cone_ratios", "weber", "weber_luminance"))
    if "cone_ratios" in asked:
        asked["density"] = asked.pop("cone_ratios")
        if len(asked.get("weber", ())) > 1:
            args.parser.error("argument --cone-ratios: with a Weber fraction of each receptor")
    eye = replace(eye_of(args.observer), **asked)
    say(f"{args.observer}: {eye}")
    quantum_catches(eye, lam, [[0.0]] * len(lam))
    return eye, illuminant_of(args.illuminant or "ideal")


def _groups(args: argparse.Namespace) -> dict[str, list[Path]]:
    """Return the files of each group by name; without --group of one that has no name.

    Raises a DiffractionError if a group matches no file, or is named twice.
    """
    from ..analysis.repeats import sample_of, scan_files

    if bool(args.files) == bool(args.groups):
        args.parser.error("give files, or groups of them with --group NAME=PATTERN")
    if args.files:
        files = scan_files(args.files)
        samples = list(dict.fromkeys(Path(sample_of(file)).name for file in files))
        if len(samples) > 1:
            say(
                f"the mean is over scans of {len(samples)} names ({', '.join(samples[:4])}); for a "
                "curve of each: --group NAME=PATTERN"
            )
        return {"": files}
    groups: dict[str, list[Path]] = {}
    columns: dict[str, str] = {}
    for name, pattern in args.groups:
        if name in groups:
            args.parser.error(f"argument --group: {name!r} is given more than once")
        if (other := columns.setdefault(column_name(name), name)) != name:
            args.parser.error(
                f"argument --group: columns of {name!r} would have the names of {other!r}'s; "
                "rename one"
            )
        try:
            groups[name] = scan_files([Path(pattern)])
        except DiffractionError as error:
            raise DiffractionError(f"group {name}: {error}") from error
    return groups


def _title(groups: dict[str, list[Path]], args: argparse.Namespace) -> str:
    """Describe the measurement in words."""
    first, *others = (file for members in groups.values() for file in members)
    each = " each" if others else ""
    cut = f", {counted(args.crops, 'crop')}{each}" if args.crops else ""
    if "" not in groups:
        named = (f"{name} ({counted(len(files), 'scan')})" for name, files in groups.items())
        return ", ".join(named) + cut
    return (f"mean of {1 + len(others)} scans" if others else first.name) + cut


def _wavelengths(args: argparse.Namespace) -> Any:
    """Return the wavelengths (n,) that are asked for, nm."""
    first, last = args.wavelength_range or _RANGE
    if not 100.0 <= first <= last <= 10000.0:
        args.parser.error(
            f"argument --wavelength-range: {first:g}:{last:g} must be FIRST:LAST in nm, from 100 "
            "to 10000 and the shortest first, e.g. 400:700"
        )
    count = int((last - first) / args.step + 1e-9) + 1
    return first + args.step * np.arange(count)
