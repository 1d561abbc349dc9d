"""A survey: what is new is measured, then the table of all rows and contact sheets are written."""

from __future__ import annotations

import csv
import io
import json
import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ...atomic import atomic_path
from ...cluster.each import each
from ...cluster.files import SceneFiles
from ...cluster.tasks import Failed
from ...errors import DiffractionError, quoted
from ...heights.read import is_recipe
from ...heights.recipes import Recipe
from ...progress import Progress, silent
from ...scene.passes import Stop
from .measure import Job, Measured, measure
from .treatments import Treatment, treatment_for

if TYPE_CHECKING:
    from matplotlib.figure import Figure

#: Names of the files in a survey's folder.
TABLE, SHEET, SCANS = "survey.csv", "sheet", "scans"
_COLUMNS, _ROWS = 6, 8  # of a contact sheet


def run_survey(
    files: Sequence[Path],
    folder: Path,
    *,
    treatments: Sequence[tuple[str, Treatment]] = (),
    own: Treatment | None = None,
    variant: str = "llvm_ad_rgb",
    theta: float = 30.0,
    resolution: int = 160,
    threads: int = 0,
    client: Any = None,
    stop: Stop | None = None,
    progress: Progress = silent,
) -> list[dict[str, Any]]:
    """Measure every scan that is not in the folder yet, and write what is known of all.

    The folder holds `survey.csv`, a row for each scan; contact sheets of their maps; and in `scans`
    a table (.exr), a map (.png) and a row (.json) of each, found again by the content of the scan
    and how it is treated.

    Parameters
    ----------
    files : scans of any format, or recipes.
    folder : is made if it is missing.
    treatments, own : by patterns (`treatments_of`), and for all, which takes precedence.
    variant : of Mitsuba, in RGB or spectral.
    theta : of the light, degrees from the normal, across the grooves of the strongest grating.
    resolution : pixels of a map a side.
    threads : of Dr.Jit, in workers; 0 for one a core.
    client : `distributed.Client`, or None to do all in this process.
    stop, progress : as in `scene.passes.render_passes`; progress counts scans.

    Returns
    -------
    The rows, in the order of the files; those that failed have a `reason`. A run that was stopped
    has rows for what is done.

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
            job = Job(_files_of(file), treatment_for(file, treatments).updated(own or Treatment()),
                      theta, resolution, variant, threads)  # fmt: skip
        except DiffractionError as error:
            rows[n] = {"reason": str(error)}
            continue
        known = _known(scans, job)
        if known is None:
            jobs[n] = job
        else:
            rows[n] = known
    todo = list(jobs)
    progress(0, len(todo), "scans")
    found = each(client, measure, [jobs[n] for n in todo], stop or Stop())
    for done, (which, result) in enumerate(found, 1):
        n = todo[which]
        if isinstance(result, Failed):
            rows[n] = {"reason": f"{result.text} {result.worker}".strip()}
        else:
            rows[n] = _keep(scans, files[n], jobs[n], result)
        progress(done, len(todo), "scans")
    named = [{"file": str(files[n]), **rows[n]} for n in sorted(rows)]
    _write_table(folder / TABLE, named)
    _write_sheets(folder, named)
    return named


def _files_of(file: Path) -> SceneFiles:
    if not file.is_file():
        raise DiffractionError(f"{quoted(str(file))} does not exist, or is no file; check the path")
    found = SceneFiles.of(file, {})
    if is_recipe(file):
        Recipe.load(file)
    return found


def _known(scans: Path, job: Job) -> dict[str, Any] | None:
    """The row that an earlier run has kept, with its files."""
    try:
        (path,) = scans.glob(f"*-{job.key}.json")
        row: dict[str, Any] = json.loads(path.read_text("utf-8"))
    except ValueError:  # none, or damaged
        return None
    there = row["reason"] or all(path.with_suffix(s).is_file() for s in (".exr", ".png"))
    return row if there else None


def _keep(scans: Path, file: Path, job: Job, result: Measured) -> dict[str, Any]:
    """Write a scan's files, the row last; what nobody expected to fail is tried again next time."""
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


def _write_table(path: Path, rows: Sequence[Mapping[str, Any]]) -> None:
    columns = dict.fromkeys(name for row in sorted(rows, key=len, reverse=True) for name in row)
    names = ["file", "reason", *(n for n in columns if n not in ("file", "reason"))]
    text = io.StringIO()
    writer = csv.DictWriter(text, names, restval="", lineterminator="\n")
    writer.writeheader()
    writer.writerows(rows)
    with atomic_path(path) as temporary:
        temporary.write_text(text.getvalue(), "utf-8")


def _write_sheets(folder: Path, rows: Sequence[Mapping[str, Any]]) -> None:
    """Pages of maps, with what makes them and how iridescent they are."""
    each_page = _COLUMNS * _ROWS
    shown = [row for row in rows if not row["reason"]]
    for page in range(math.ceil(len(shown) / each_page)):
        mine = shown[page * each_page : (page + 1) * each_page]
        name = SHEET if len(shown) <= each_page else f"{SHEET}-{page + 1:03d}"
        with atomic_path(folder / f"{name}.png") as temporary:
            _sheet(folder, mine).savefig(temporary, format="png")


def _sheet(folder: Path, rows: Sequence[Mapping[str, Any]]) -> Figure:
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
            f"{Path(row['file']).name[:34]}\n{title}iridescence {row['iridescence']:.2g}",
            fontsize=6,
        )
    for axes in figure.axes:
        axes.set_axis_off()
    return figure
