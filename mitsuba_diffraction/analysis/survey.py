"""Surveys of many scans: table, map, statistics, gratings and colours of each.

Scans that the folder does not yet have are measured, in this process or on workers; then the CSV
of all rows, the means of repeated scans and contact sheets are written.
"""

from __future__ import annotations

import io
import json
import math
import tempfile
import time
import warnings
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from PIL import Image

from ..atomic import atomic_path, make_folder
from ..cluster.jobs import WorkerCalls
from ..cluster.tasks import Failed, MissingFiles, SceneFiles
from ..digests import key_of, sha256_of
from ..errors import DiffractionError, DiffractionWarning, one_line
from ..files import FileKind, readable_file
from ..heights import Source
from ..heights.coherence import REPEATS, widest_window
from ..heights.spectra import examine_periods
from ..plugin.dictionary import bsdf_dict
from ..progress import Progress, silent
from ..scene import set_variant
from ..tables import DiffractionTable, TableSource
from .crops import crops_of
from .iridescence import WINDOW, MaterialFactor, light_and_chance
from .maps import brdf_map
from .maps.result import BrdfMap, LightDirection
from .media import in_medium, optical_scale
from .repeats import sample_of, scan_files, write_repeats
from .scans import bsdf_of, table_of
from .survey_files import FILES, SHEET, write_rows, write_sheets
from .treatments import Treatment

#: Version of the rows: raise it when their values change.
VERSION = 12
#: Number of gratings in a row.
PERIODS = 3
#: Names of the files in a survey's folder.
TABLE, SAMPLES, SCANS = "survey.csv", "samples.csv", "scans"
# Of the last surface, by surface, angle of the light and variant.
_materials: dict[Any, MaterialFactor] = {}


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
    surface: tuple[tuple[str, Any], ...] = ()  # parameters of the BSDF
    # which crop of `iridescence.WINDOW` of how many; None for the whole scan
    crop: tuple[int, int] | None = None

    @property
    def key(self) -> str:
        """Digest of all parameters that the row depends on."""
        treatment = [self.treatment.options.specified(), dict(self.treatment.settings)]
        variant = self.variant.partition("_")[2]
        parameters = (VERSION, self.theta, self.resolution, variant, *self.surface)
        crop = () if self.crop is None else ("crop", *self.crop)
        return key_of("survey", self.files.digest, treatment, *parameters, *crop)[:32]


@dataclass(frozen=True)
class Measured:
    """Results of one scan: a row of plain numbers and texts, and files by suffix."""

    row: dict[str, Any]
    files: dict[str, bytes]


def measure(job: Job, contents: Mapping[str, bytes] | None = None) -> Measured:
    """Measure one scan in this process; the row's `reason` has the error, if any."""
    start = time.perf_counter()
    row: dict[str, Any] = {"reason": ""}
    files: dict[str, bytes] = {}
    try:
        job.files.require(contents or {})
        # the row has the table's warnings
        with warnings.catch_warnings(action="ignore", category=DiffractionWarning):
            files = _measure(job, row)
    except MissingFiles:
        raise
    except DiffractionError as error:
        row["reason"] = str(error)
    except Exception as error:  # one scan must not end a survey of a thousand
        row["reason"] = f"unexpected {type(error).__name__}: {one_line(str(error))}"
    row["time_s"] = round(time.perf_counter() - start, 2)
    return Measured(row, files)


def _measure(job: Job, row: dict[str, Any]) -> dict[str, bytes]:
    """Fill the row of a scan, so far as no error ends it, and return table and map."""
    set_variant(job.variant, job.threads)
    path, _ = job.files.here()
    with warnings.catch_warnings(record=True) as overrides:
        warnings.simplefilter("always", DiffractionWarning)
        source = TableSource.of(path, job.treatment.options).read()
    settings = source.settings_for(job.treatment.settings, optical_scale(dict(job.surface)))
    if job.crop is not None:
        which, count = job.crop
        crops = crops_of(path, job.treatment.options, count, WINDOW)
        source = TableSource.of(crops[which])
        row["crop"] = which + 1
    patches = source.fields()
    for name in ("range", "rms_height", "rms_slope"):
        row[f"{name}_um" if name != "rms_slope" else name] = getattr(patches[0], name)
    (ny, nx), (width, height) = patches[0].shape, patches[0].extent
    row |= {"patches": len(patches), "pixels_x": nx, "pixels_y": ny}
    row |= {"width_um": width, "height_um": height}
    gratings, weak = examine_periods(patches[0], PERIODS)
    for n, grating in enumerate(gratings, 1):
        row |= {f"period_{n}_um": grating.period, f"direction_{n}_deg": grating.direction}
        row[f"share_{n}"] = grating.share
    if weak is not None:
        row |= {"weak_period_um": weak.period, "weak_direction_deg": weak.direction}
        row["weak_share"] = weak.share
    source = in_medium(source, dict(job.surface).get("ext_ior"))
    table = table_of(source, settings)
    row |= {"orders_x": table.coefficients.shape[2], "orders_y": table.coefficients.shape[1]}
    row |= {"table_mb": table.nbytes / 1e6, "table_error": table.largest_error}
    row |= {"coherence_width_um": table.coherence_width, "window_width_um": table.window_width}
    row["tiling"] = REPEATS if table.source.get("repeats") else ""
    if "windows" in table.source:
        row["windows"] = table.source["windows"]["number"]
        if "standard_error" in table.source["windows"]:
            row["standard_error"] = table.source["windows"]["standard_error"]["colours"]
    said = (str(warning.message) for warning in overrides)
    row["warnings"] = "; ".join([*said, *source.warnings(settings)])
    phi = gratings[0].direction if gratings else 0.0
    # the energy of a metal is solved for some ten seconds; neither map nor index need it
    surface = {**dict(job.surface), "energy_conserving": False}
    light = LightDirection(job.theta, phi)
    factor = _material(job, table).at(light)
    with ThreadPoolExecutor(1) as beside:  # the index takes about as long as BSDF and map
        colours = beside.submit(light_and_chance, table, light, factor)
        bsdf = bsdf_of(bsdf_dict(table, **surface))
        measured = brdf_map(bsdf, job.theta, phi, resolution=job.resolution)
        diffracted, floor = colours.result()
    row["surface"] = bsdf.describe().summary
    row |= {"light_theta_deg": job.theta, "light_phi_deg": phi}
    row["diffracted"] = diffracted.share
    brightest, theta, phi = diffracted.brightest()
    row |= {"brightest": brightest, "brightest_theta_deg": theta, "brightest_phi_deg": phi}
    index = diffracted.iridescence()
    row |= {"iridescence": index, "iridescence_by_chance": floor}
    # colour beyond chance, weighed by how much of the light has it
    row["iridescent_light"] = (
        math.sqrt(index**2 - floor**2) * row["diffracted"] if (index > floor) else ""
    )
    # flat heights repeat exactly; as a scan they are as wide as they are
    flat = all(patch.range == 0.0 for patch in patches)
    enough = (min(width, height) if flat else widest_window(patches)) >= 0.99 * WINDOW
    row["ranked_among"] = f"scans {'from' if enough else 'below'} {WINDOW:g} µm"
    row |= {f"share_{name}": share for name, share in diffracted.hues().items()}
    return {".exr": _exr(table), ".png": _png(measured)}


def _material(job: Job, table: DiffractionTable) -> MaterialFactor:
    """Return the factor of the surface's material, which all scans share.

    Mitsuba takes seconds to change the variant: it loads its integrators again.
    """
    key = job.surface, job.theta, job.variant
    if key not in _materials:
        set_variant(job.variant.replace("rgb", "spectral"))  # wavelengths, not colours
        bsdf = bsdf_of(bsdf_dict(table, **{**dict(job.surface), "energy_conserving": False}))
        _materials.clear()
        _materials[key] = MaterialFactor.of(bsdf, job.theta)
        set_variant(job.variant)
    return _materials[key]


def _exr(table: DiffractionTable) -> bytes:
    """Encode the table as an EXR file."""
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "table.exr"
        table.save(file)
        return file.read_bytes()


def _png(brdf_map: BrdfMap) -> bytes:
    """Encode the map as a PNG, the largest y first."""
    stream = io.BytesIO()
    pixels = np.round(255.0 * brdf_map.srgb(brdf_map.exposure())[::-1]).astype(np.uint8)
    Image.fromarray(pixels, "RGBA").save(stream, "PNG")
    return stream.getvalue()


def run_survey(
    files: Sequence[Path],
    folder: Path,
    *,
    treatment: Callable[[Path], Treatment] = lambda file: Treatment(),
    variant: str = "llvm_ad_rgb",
    theta: float = 30.0,
    resolution: int = 160,
    threads: int = 0,
    surface: Mapping[str, Any] | None = None,
    repeats: str = "name",
    crops: int | None = None,
    client: Any = None,
    progress: Progress = silent,
) -> list[dict[str, Any]]:
    """Measure every scan that the folder does not have yet, and write the results of all.

    The folder holds `survey.csv`, a row for each scan, sorted by `ranked`; `samples.csv`, means and
    standard errors of repeated scans; contact sheets of the maps; and in `scans` a table (.exr), a
    map (.png) and a row (.json) of each scan. They are named by the content of the scan and its
    treatment.

    Raises a DiffractionError if there are no files, a folder or a pattern yields none, or the
    folder cannot be written.

    Parameters
    ----------
    files : scans of any format, recipes, folders of them, or patterns as in "scans/*.spm".
    folder : folder of the survey, created if it does not exist.
    treatment : returns a file's treatment, as `load_treatments` makes it.
    variant : variant of Mitsuba, RGB or spectral.
    theta : angle of the light from the normal, degrees, across the strongest grating's grooves.
    resolution : pixels a side of the maps.
    threads : threads of Dr.Jit in workers; 0 for one per core.
    surface : parameters of the BSDF, e.g. {"material": "keratin"}; a dielectric of 1.5 without.
    repeats : how repeated scans of a sample are told, one of `repeats.REPEATS`.
    crops : measure so many crops of each scan, of `iridescence.WINDOW`, or as many as fit; scans
        that are narrower, or have pixels as wide, and recipes are measured as a whole.
    client : `distributed.Client`, or None to measure in this process.
    progress : called as progress(scans done, scans in all, text).

    Returns
    -------
    The rows, in the order of the files; rows of failed scans have a `reason`.
    """
    files = scan_files(files)
    if not files:
        raise DiffractionError("there is no scan to survey; name files")
    calls = None if client is None else WorkerCalls(client, variant)
    scans = folder / SCANS
    make_folder(scans)
    shown = tuple((surface or {}).items())
    rows: list[dict[str, Any]] = []  # without a reason until they are known
    jobs: list[tuple[int, Job]] = []  # with the row's place
    for file in files:
        name = {"file": str(file), "sample": sample_of(file, repeats)}
        try:
            of_scan = SceneFiles.from_scene(readable_file(file), {})
            Source.of(file)  # a recipe is checked
            job = Job(of_scan, treatment(file), theta, resolution, variant, threads, shown)
            parts = [job] if crops is None else _crops_of(job, file, crops)
        except DiffractionError as error:
            rows.append(name | {"reason": str(error)})
            continue
        for part in parts:
            stored = _stored_row(scans, part)
            if stored is None:
                jobs.append((len(rows), part))
            rows.append(name | (stored or {}))
    names, given = [Path(rows[n]["file"]).name for n, _ in jobs], [job for _, job in jobs]
    progress(0, len(jobs), _next(names, 0, client))
    results = enumerate(map(measure, given)) if calls is None else calls.answers(measure, given)
    for done, (which, result) in enumerate(results, 1):
        n, job = jobs[which]
        if isinstance(result, Failed):
            rows[n]["reason"] = f"{result.text} {result.worker}".strip()
        else:
            rows[n] |= _store(scans, Path(rows[n]["file"]), job, result)
        # complete even if Ctrl-C ends the next scan
        write_rows(folder / TABLE, [row for row in rows if "reason" in row])
        progress(done, len(jobs), _next(names, done, client))
    write_repeats(folder / SAMPLES, rows)
    ranking = ranked(rows)
    write_rows(folder / TABLE, ranking)
    write_sheets(folder, ranking)
    return rows


def _next(names: Sequence[str], done: int, client: Any) -> str:
    """Return the scan that is measured next, for a progress bar; workers measure several."""
    return names[done] if client is None and done < len(names) else "scans"


def files_in(folder: Path) -> list[Path]:
    """List the files that a survey of any scans writes into its folder, one of a scan's too."""
    names = TABLE, SAMPLES, f"{SHEET}.png", f"{SHEET}-001.png", f"{SCANS}/scan.png"
    return [folder / name for name in names]


def ranked(rows: Sequence[dict[str, Any]]) -> list[dict[str, Any]]:
    """Sort rows: wide scans before narrow ones, each by iridescent light; failed scans last.

    The index of scans below `iridescence.WINDOW` has fewer orders in each direction, so that
    chance has a larger part in it: they are ranked among themselves.
    """

    def place(row: Mapping[str, Any]) -> tuple[bool, bool, float]:
        narrow = "below" in row.get("ranked_among", "")
        return bool(row["reason"]), narrow, -(row.get("iridescent_light") or 0.0)

    return sorted(rows, key=place)


def _crops_of(job: Job, file: Path, count: int) -> list[Job]:
    """Return a job for each crop of a scan; the job itself for recipes, and scans without crops."""
    options = job.treatment.options
    if Source.of(file, options).kind is FileKind.RECIPE:
        return [job]
    found = crops_of(file, options, count, WINDOW)
    return [replace(job, crop=(n, count)) for n in range(len(found))] or [job]


def _stored_row(scans: Path, job: Job) -> dict[str, Any] | None:
    """Read the row that an earlier run has stored, if neither row nor files have changed since."""
    try:
        (path,) = scans.glob(f"*-{job.key}.json")
        row, seal = json.loads(path.read_text("utf-8"))
        return _with_files(row, path) if seal == _seal(row, path) else None
    except (OSError, ValueError, LookupError, TypeError, RecursionError):  # missing, or damaged
        return None


def _store(scans: Path, file: Path, job: Job, result: Measured) -> dict[str, Any]:
    """Write a scan's files, the row last; after unexpected errors no row: the next run retries."""
    path, row = scans / f"{file.stem[:60]}-{job.key}.json", result.row
    for suffix, content in result.files.items():
        with atomic_path(path.with_suffix(suffix)) as temporary:
            temporary.write_bytes(content)
    if not row["reason"].startswith("unexpected"):
        with atomic_path(path) as temporary:
            temporary.write_text(json.dumps([row, _seal(row, path)]), "utf-8")
    return _with_files(row, path)


def _seal(row: Mapping[str, Any], path: Path) -> str:
    """Return a digest of a row and of its files, by which damage is found."""
    files = [] if row["reason"] else [path.with_suffix(suffix) for suffix in FILES]
    return key_of(row, *map(sha256_of, files))


def _with_files(row: Mapping[str, Any], path: Path) -> dict[str, Any]:
    """Return a row with the names of its files, which lie beside its own."""
    names = {name: f"{SCANS}/{path.with_suffix(suffix).name}" for suffix, name in FILES.items()}
    return {**row, **({} if row["reason"] else names)}
