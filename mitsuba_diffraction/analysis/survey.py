"""Surveys of many scans: table, map, statistics, gratings and colours of each.

Scans that the folder does not yet have are measured, in this process or on workers; then the CSV
of all rows and contact sheets are written. A TOML file of patterns selects reading options and
treatments:

    ["snakes/*.png"]
    pixel_size = 0.0488
    max_height = 0.375
    level = "plane"

Patterns are matched with the whole path and with the file's name. Where several match, later ones
override earlier ones. Keys are those of recipes.
"""

from __future__ import annotations

import csv
import fnmatch
import io
import json
import math
import os
import tempfile
import time
import tomllib
import warnings
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ..atomic import atomic_path
from ..cluster.jobs import run_jobs
from ..cluster.tasks import Failed, MissingFiles, SceneFiles
from ..errors import DiffractionError, DiffractionWarning, one_line
from ..files import read_text, readable_file
from ..heights.coherence import REPEATS
from ..heights.field import HeightField
from ..heights.load import load_heights
from ..heights.read import LoadOptions, is_recipe
from ..heights.recipes import LOAD_KEYS, Recipe, options_and_settings
from ..heights.spectra import dominant_periods
from ..progress import Progress, silent
from ..scene.load import error_of
from ..settings import RECIPE_SETTINGS, TableSettings
from ..tables.build.build import build_with
from ..tables.store import cached_table, key_of
from .maps import brdf_map
from .maps.result import BrdfMap, colours_of, iridescence

if TYPE_CHECKING:
    from matplotlib.figure import Figure

#: Version of the rows: raise it when their values change.
VERSION = 3
#: Number of gratings in a row.
PERIODS = 3
#: Names of the files in a survey's folder.
TABLE, SHEET, SCANS = "survey.csv", "sheet", "scans"
_COLUMNS, _ROWS = 6, 8  # maps in a contact sheet


@dataclass(frozen=True)
class Treatment:
    """Options to read a file, and settings of its table."""

    options: LoadOptions = field(default_factory=LoadOptions)
    settings: Mapping[str, Any] = field(default_factory=dict)

    def updated(self, other: Treatment) -> Treatment:
        """Return this treatment, replaced by the values that `other` sets."""
        return Treatment(self.options.updated(other.options), {**self.settings, **other.settings})


def load_treatments(
    path: str | os.PathLike[str] | None,
) -> Sequence[tuple[str, Treatment]]:
    """Read patterns and their treatments from a TOML file, in its order; none if path is `None`.

    Raises
    ------
    DiffractionError
        If the file cannot be read, or a pattern has an option without a valid value.
    """
    if path is None:
        return []
    try:
        content = tomllib.loads(read_text(path))
    except tomllib.TOMLDecodeError as error:
        raise DiffractionError(f"cannot read '{path}': {one_line(str(error))}") from error
    return [(pattern, _treatment(f"'{path}': [{pattern!r}]", v)) for pattern, v in content.items()]


def treatment_for(file: Path, treatments: Sequence[tuple[str, Treatment]]) -> Treatment:
    """Combine the treatments of the patterns that match a file."""
    result = Treatment()
    for pattern, treatment in treatments:
        if fnmatch.fnmatch(str(file), pattern) or fnmatch.fnmatch(file.name, pattern):
            result = result.updated(treatment)
    return result


def _treatment(where: str, values: Any) -> Treatment:
    """Check the options of one pattern."""
    if not isinstance(values, dict):
        raise DiffractionError(f"{where}: expected a pattern in brackets with options below it")
    unknown = set(values) - {*LOAD_KEYS, *RECIPE_SETTINGS}
    if unknown:
        raise DiffractionError(
            f"{where}: unknown key {min(unknown)!r}; known are "
            f"{', '.join((*LOAD_KEYS, *RECIPE_SETTINGS))}"
        )
    return Treatment(*options_and_settings(values, where))


@dataclass(frozen=True)
class Job:
    """Parameters of the measurement of one scan."""

    files: SceneFiles  # the scan, or a recipe with its sources
    treatment: Treatment
    # polar angle of the light, degrees; the azimuth is across the strongest grating's grooves
    theta: float
    resolution: int  # pixels a side of the map
    variant: str  # variant of Mitsuba
    threads: int  # threads of Dr.Jit

    @property
    def key(self) -> str:
        """Digest of all parameters that the row depends on."""
        treatment = [self.treatment.options.specified(), dict(self.treatment.settings)]
        parameters = (VERSION, self.theta, self.resolution, self.variant.partition("_")[2])
        return key_of("survey", self.files.digest, treatment, *parameters)[:32]


@dataclass(frozen=True)
class Measured:
    """Results of one scan: a row of plain numbers and texts, and files by suffix."""

    row: dict[str, Any]
    files: dict[str, bytes]


def measure(job: Job, contents: Mapping[str, bytes] | None = None) -> Measured | MissingFiles:
    """Measure one scan in this process; the row's `reason` has the error, if any."""
    job.files.keep(contents or {})
    lacking = job.files.missing()
    if lacking:
        return MissingFiles(tuple(lacking))
    start = time.perf_counter()
    row: dict[str, Any] = {"reason": ""}
    files: dict[str, bytes] = {}
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", DiffractionWarning)  # the row has the table's warnings
            files = _measure(job, row)
    except DiffractionError as error:
        row["reason"] = str(error)
    except Exception as error:  # one scan must not end a survey of a thousand
        row["reason"] = f"unexpected {type(error).__name__}: {one_line(str(error))}"
    row["seconds"] = round(time.perf_counter() - start, 2)
    return Measured(row, files)


def _measure(job: Job, row: dict[str, Any]) -> dict[str, bytes]:
    """Fill the row of a scan, so far as no error ends it, and return table and map."""
    import drjit as dr
    import mitsuba as mi

    from ..scene.load import set_variant

    set_variant(job.variant)
    if job.variant.startswith("llvm") and job.threads and dr.thread_count() != job.threads:
        dr.set_thread_count(job.threads)
    path, _ = job.files.here()
    fields, settings = _heights(path, job.treatment)
    for name in ("range", "rms_height", "rms_slope"):
        row[f"{name}_um" if name != "rms_slope" else name] = getattr(fields[0], name)
    (ny, nx), (width, height) = fields[0].shape, fields[0].extent
    row |= {"patches": len(fields), "pixels_x": nx, "pixels_y": ny}
    row |= {"width_um": width, "height_um": height}
    gratings = dominant_periods(fields[0], PERIODS)
    for n, grating in enumerate(gratings, 1):
        row |= {f"period_{n}_um": grating.period, f"direction_{n}_deg": grating.direction}
        row[f"share_{n}"] = grating.share
    digest = key_of("survey", *(field.digest() for field in fields))
    table = cached_table(digest, settings, lambda: build_with(fields, settings))
    row |= {"orders_x": table.coefficients.shape[2], "orders_y": table.coefficients.shape[1]}
    row |= {"table_mb": table.nbytes / 1e6, "table_error": table.largest_error}
    row["coherence_width_um"] = table.coherence_width
    row["tiling"] = REPEATS if table.source.get("repeats") else ""
    if "windows" in table.source:
        row["windows"] = table.source["windows"]["number"]
        row["standard_error"] = table.source["windows"]["standard_error"]["colours"]
    row["warnings"] = "; ".join(table.source.get("warnings", ()))
    phi = gratings[0].direction if gratings else 0.0
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "table.exr"
        table.save(file)
        # ideal reflection: the effect of the structure alone, without a material
        try:
            bsdf = mi.load_dict({"type": "diffraction", "table": str(file), "material": "none"})
        except RuntimeError as error:
            raise error_of("cannot map it", error) from error
        measured = brdf_map(bsdf, job.theta, phi, resolution=job.resolution)
        content = file.read_bytes()
    row |= {"light_theta_deg": job.theta, "light_phi_deg": phi}
    row["iridescence"] = iridescence(measured)
    row |= {f"share_{name}": share for name, share in colours_of(measured).items()}
    row["diffracted"] = _diffracted_share(measured)
    return {".exr": content, ".png": _png(measured)}


def _heights(path: Path, treatment: Treatment) -> tuple[list[HeightField], TableSettings]:
    """Read the patches of a scan or a recipe, and return them with the settings of their table."""
    if is_recipe(path):
        recipe = Recipe.load(path)
        settings = {**recipe.table, **treatment.settings}
        return recipe.fields(treatment.options), TableSettings(**settings)
    return [load_heights(path, treatment.options)], TableSettings(**treatment.settings)


def _diffracted_share(brdf_map: BrdfMap) -> float:
    """Return the share of the luminous power outside the mirror direction's lobe."""
    luminance = brdf_map.luminance
    return float(luminance[brdf_map.away_from_mirror()].sum() / max(luminance.sum(), 1e-30))


def _png(brdf_map: BrdfMap) -> bytes:
    """Encode the map as a PNG, the largest y first."""
    from PIL import Image

    stream = io.BytesIO()
    pixels = np.round(255.0 * brdf_map.srgb(brdf_map.exposure())[::-1]).astype(np.uint8)
    Image.fromarray(pixels, "RGBA").save(stream, "PNG")
    return stream.getvalue()


def run_survey(
    files: Sequence[Path],
    folder: Path,
    *,
    treatments: Sequence[tuple[str, Treatment]] = (),
    common: Treatment | None = None,
    variant: str = "llvm_ad_rgb",
    theta: float = 30.0,
    resolution: int = 160,
    threads: int = 0,
    client: Any = None,
    progress: Progress = silent,
) -> list[dict[str, Any]]:
    """Measure every scan that the folder does not have yet, and write the results of all.

    The folder holds `survey.csv`, a row for each scan; contact sheets of the maps; and in `scans` a
    table (.exr), a map (.png) and a row (.json) of each scan. They are named by the content of the
    scan and its treatment.

    Parameters
    ----------
    files : scans of any format, or recipes.
    folder : folder of the survey, created if it does not exist.
    treatments : treatments by patterns (`load_treatments`).
    common : treatment of all files, which takes precedence.
    variant : variant of Mitsuba, RGB or spectral.
    theta : angle of the light from the normal, degrees, across the strongest grating's grooves.
    resolution : pixels a side of the maps.
    threads : threads of Dr.Jit in workers; 0 for one per core.
    client : `distributed.Client`, or None to measure in this process.
    progress : called as progress(scans done, scans in all, text).

    Returns
    -------
    The rows, in the order of the files; rows of failed scans have a `reason`.

    Raises
    ------
    DiffractionError
        If there are no files, or the folder cannot be written.
    """
    if not files:
        raise DiffractionError("there is no scan to survey; name files")
    scans = folder / SCANS
    scans.mkdir(parents=True, exist_ok=True)
    rows: dict[int, dict[str, Any]] = {}
    jobs: dict[int, Job] = {}
    for n, file in enumerate(files):
        try:
            treatment = treatment_for(file, treatments).updated(common or Treatment())
            job = Job(_files_of(file), treatment, theta, resolution, variant, threads)
        except DiffractionError as error:
            rows[n] = {"reason": str(error)}
            continue
        stored = _stored_row(scans, job)
        if stored is None:
            jobs[n] = job
        else:
            rows[n] = stored
    todo = list(jobs)
    progress(0, len(todo), "scans")
    results = run_jobs(client, measure, [jobs[n] for n in todo])
    for done, (which, result) in enumerate(results, 1):
        n = todo[which]
        if isinstance(result, Failed):
            rows[n] = {"reason": f"{result.text} {result.worker}".strip()}
        else:
            rows[n] = _store(scans, files[n], jobs[n], result)
        _write_table(folder / TABLE, files, rows)  # complete even if Ctrl-C ends the next scan
        progress(done, len(todo), "scans")
    named = _write_table(folder / TABLE, files, rows)
    _write_sheets(folder, named)
    return named


def _files_of(file: Path) -> SceneFiles:
    """Return the scan's files, after a check of the recipe if it is one."""
    files = SceneFiles.from_scene(readable_file(file), {})
    if is_recipe(file):
        Recipe.load(file)
    return files


def _stored_row(scans: Path, job: Job) -> dict[str, Any] | None:
    """Read the row that an earlier run has stored, if its files exist."""
    try:
        (path,) = scans.glob(f"*-{job.key}.json")
        row: dict[str, Any] = json.loads(path.read_text("utf-8"))
    except ValueError:  # no such file, or damaged
        return None
    complete = row["reason"] or all(path.with_suffix(s).is_file() for s in (".exr", ".png"))
    return row if complete else None


def _store(scans: Path, file: Path, job: Job, result: Measured) -> dict[str, Any]:
    """Write a scan's files, the row last; after unexpected errors no row: the next run retries."""
    stem = f"{file.stem[:60]}-{job.key}"
    row = dict(result.row)
    for suffix, content in result.files.items():
        with atomic_path(scans / f"{stem}{suffix}") as temporary:
            temporary.write_bytes(content)
        row[{".exr": "table", ".png": "map"}[suffix]] = f"{SCANS}/{stem}{suffix}"
    if not row["reason"].startswith("unexpected"):
        with atomic_path(scans / f"{stem}.json") as temporary:
            temporary.write_text(json.dumps(row), "utf-8")
    return row


def _write_table(
    path: Path, files: Sequence[Path], rows_by_number: Mapping[int, Mapping[str, Any]]
) -> list[dict[str, Any]]:
    """Write the measured rows in the order of the files as CSV, and return them."""
    rows = [{"file": str(files[n]), **rows_by_number[n]} for n in sorted(rows_by_number)]
    columns = dict.fromkeys(name for row in sorted(rows, key=len, reverse=True) for name in row)
    names = ["file", "reason", *(n for n in columns if n not in ("file", "reason"))]
    text = io.StringIO()
    writer = csv.DictWriter(text, names, restval="", lineterminator="\n")
    writer.writeheader()
    writer.writerows(rows)
    with atomic_path(path) as temporary:
        temporary.write_text(text.getvalue(), "utf-8")
    return rows


def _write_sheets(folder: Path, rows: Sequence[Mapping[str, Any]]) -> None:
    """Write contact sheets of all maps."""
    per_page = _COLUMNS * _ROWS
    measured = [row for row in rows if not row["reason"]]
    for page in range(math.ceil(len(measured) / per_page)):
        name = SHEET if len(measured) <= per_page else f"{SHEET}-{page + 1:03d}"
        with atomic_path(folder / f"{name}.png") as temporary:
            sheet = _sheet(folder, measured[page * per_page : (page + 1) * per_page])
            sheet.savefig(temporary, format="png")


def _sheet(folder: Path, rows: Sequence[Mapping[str, Any]]) -> Figure:
    """Draw a contact sheet: maps with file name, strongest grating and iridescence."""
    from matplotlib.figure import Figure
    from PIL import Image

    lines = math.ceil(len(rows) / _COLUMNS)
    figure = Figure(figsize=(2.2 * _COLUMNS, 2.7 * lines), dpi=100, layout="constrained")
    for axes, row in zip(figure.subplots(lines, _COLUMNS, squeeze=False).flat, rows, strict=False):
        with Image.open(folder / row["map"]) as picture:
            axes.imshow(picture)
        period = row.get("period_1_um")
        title = "" if period is None else f"{period:.3g} µm at {row['direction_1_deg']:.0f}°, "
        axes.set_title(
            f"{Path(row['file']).name[:34]}\n{title}iridescence {row['iridescence']:.2g}"
            + (f"\n{row['tiling']}" if row["tiling"] else ""),
            fontsize=6,
        )
    for axes in figure.axes:
        axes.set_axis_off()
    return figure
