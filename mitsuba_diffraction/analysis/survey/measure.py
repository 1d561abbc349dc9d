"""One scan of a survey: its table, map, statistics, gratings and colours, as a row and files."""

from __future__ import annotations

import io
import tempfile
import time
import warnings
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from ...cluster.files import SceneFiles
from ...cluster.tasks import Lacking
from ...errors import DiffractionError, DiffractionWarning, one_line
from ...heights.field import HeightField
from ...heights.load import load_heights
from ...heights.read import is_recipe
from ...heights.recipes import Recipe
from ...heights.spectra import dominant_periods
from ...scene.load import error_of
from ...settings import TableSettings
from ...tables.build.build import build_with
from ...tables.store import cached_table, key_of
from ..maps import brdf_map
from .iridescence import colours_of, iridescence
from .treatments import Treatment

#: Raised whenever rows would differ.
VERSION = 2
#: Gratings in a row.
PERIODS = 3


@dataclass(frozen=True)
class Job:
    """A scan to measure.

    Attributes
    ----------
    files : the scan, or a recipe with its sources.
    treatment : how it is read.
    theta : of the light, degrees; its azimuth is across the grooves of the strongest grating.
    resolution : pixels of the map a side.
    variant, threads : of Mitsuba and Dr.Jit.
    """

    files: SceneFiles
    treatment: Treatment
    theta: float
    resolution: int
    variant: str
    threads: int

    @property
    def key(self) -> str:
        """Changes when the row may."""
        treatment = [self.treatment.options.given(), dict(self.treatment.settings)]
        own = (VERSION, self.theta, self.resolution, self.variant.partition("_")[2])
        return key_of("survey", self.files.digest, treatment, *own)[:32]


@dataclass(frozen=True)
class Measured:
    """What a scan gave: a row of plain numbers and texts, and files by suffix."""

    row: dict[str, Any]
    files: dict[str, bytes]


def measure(job: Job, contents: Mapping[str, bytes] | None = None) -> Measured | Lacking:
    """Measure one scan in this process; what is wrong with it is its row's `reason`."""
    job.files.keep(contents or {})
    lacking = job.files.missing()
    if lacking:
        return Lacking(tuple(lacking))
    start = time.perf_counter()
    row: dict[str, Any] = {"reason": ""}
    files: dict[str, bytes] = {}
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", DiffractionWarning)  # they are the table's, in the row
            files = _measured(job, row)
    except DiffractionError as error:
        row["reason"] = str(error)
    except Exception as error:  # one scan must not end a survey of a thousand
        row["reason"] = f"unexpected {type(error).__name__}: {one_line(str(error))}"
    row["seconds"] = round(time.perf_counter() - start, 2)
    return Measured(row, files)


def _measured(job: Job, row: dict[str, Any]) -> dict[str, bytes]:
    import drjit as dr
    import mitsuba as mi

    from ...scene.load import set_variant

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
    for n, one in enumerate(gratings, 1):
        row |= {f"period_{n}_um": one.period, f"direction_{n}_deg": one.direction}
        row[f"share_{n}"] = one.share
    digest = key_of("survey", *(field.digest() for field in fields))
    table = cached_table(digest, settings, lambda: build_with(fields, settings))
    row |= {"orders_x": table.coefficients.shape[2], "orders_y": table.coefficients.shape[1]}
    row |= {"table_mb": table.nbytes / 1e6, "table_error": table.largest_error}
    if "windows" in table.source:
        row["windows"] = table.source["windows"]["number"]
        row["standard_error"] = table.source["windows"]["standard_error"]["colours"]
    row["warnings"] = "; ".join(table.source.get("warnings", ()))
    phi = gratings[0].direction if gratings else 0.0
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "table.exr"
        table.save(file)
        # ideal reflection: what the structure does, whatever it is made of
        try:
            bsdf = mi.load_dict({"type": "diffraction", "table": str(file), "material": "none"})
        except RuntimeError as error:
            raise error_of("cannot map it", error) from error
        made = brdf_map(bsdf, job.theta, phi, resolution=job.resolution)
        content = file.read_bytes()
    row |= {"light_theta_deg": job.theta, "light_phi_deg": phi}
    row["iridescence"] = iridescence(made)
    row |= {f"share_{name}": share for name, share in colours_of(made).items()}
    row["diffracted"] = _beside_mirror(made)
    return {".exr": content, ".png": _png(made)}


def _heights(path: Path, treatment: Treatment) -> tuple[list[HeightField], TableSettings]:
    """The patches of a scan or a recipe, and its table's settings."""
    if is_recipe(path):
        recipe = Recipe.load(path)
        settings = {**recipe.table, **treatment.settings}
        return recipe.fields(treatment.options), TableSettings(**settings)
    return [load_heights(path, treatment.options)], TableSettings(**treatment.settings)


def _beside_mirror(made: Any) -> float:
    """Share of the luminous power that leaves the mirror's lobe."""
    luminance = made.luminance
    return float(luminance[made.away_from_mirror()].sum() / max(luminance.sum(), 1e-30))


def _png(made: Any) -> bytes:
    """The map as a picture, the largest y first."""
    from PIL import Image

    stream = io.BytesIO()
    shown = np.round(255.0 * made.srgb(made.exposure())[::-1]).astype(np.uint8)
    Image.fromarray(shown, "RGBA").save(stream, "PNG")
    return stream.getvalue()
