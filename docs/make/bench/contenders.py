"""Contenders that `eval` is compared with: other BSDFs and settings, the thesis' look-up, gathers.

No warning tells how far the model holds for the patch: here it is there to be looked up.
"""

from __future__ import annotations

import contextlib
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np
from mitsuba.python import tensor_io

from mitsuba_diffraction import DiffractionTable, HeightField, gratings
from mitsuba_diffraction.analysis.timing import PIXEL, Queries, quiet_bsdf
from mitsuba_diffraction.arrays import Single
from mitsuba_diffraction.progress import Progress
from mitsuba_diffraction.thesis.term_images import thesis_bsdf

from .figures import Plan

ALUMINIUM = "roughconductor, Al"
DEFAULT = "diffraction, the defaults"
DEFAULT_AL = "diffraction, Al"
KIRCHHOFF = "diffraction, kirchhoff"
KIRCHHOFF_AL = "diffraction, Al, kirchhoff"
COARSE = "diffraction, tolerance 1e-2"
ONE_WINDOW = "diffraction, patch"
ON_SURFACE = "diffraction, surface"
TILED = "diffraction, surface, random tiles"
THESIS = "thesis: Taylor, 37 terms, 3×3, an image a term"
TAYLOR = "the same series, all terms of a bin together"
#: Fewer calls of these do, for the sake of the user's time.
SLOW = (THESIS, TAYLOR)


@dataclass(frozen=True)
class Tables:
    """The tables of one patch that the contenders look up, as files."""

    folder: Path
    patch: str
    heights: HeightField
    paths: dict[str, Path] = field(default_factory=dict)

    def bsdf(self, name: str, **parameters: Any) -> Any:
        """The plugin with one of the tables, in the current variant."""
        return quiet_bsdf(self.paths[name], **parameters)

    def load(self, name: str) -> DiffractionTable:
        """Load the table of this name."""
        return DiffractionTable.load(self.paths[name])


def build_tables(
    plan: Plan,
    folder: Path,
    progress: Progress,
    patch: HeightField | None = None,
) -> Tables:
    """Build and save them, of `elaphe_like` if no patch is given."""
    if patch is None:
        patch = gratings.elaphe_like(plan.pixels * PIXEL, plan.pixels)
    settings: dict[str, dict[str, Any]] = {
        "default": {},
        "1e-2": {"tolerance": 1e-2},
        "patch": {"coherence": "patch"},
        # no tolerance could be met by this
        "thesis": {
            "coherence": "patch", "basis": "taylor", "terms": 37, "taps": 3, "tolerance": 0.999,
        },
    }  # fmt: skip
    words = f"{patch.name}, {patch.heights.shape[1]} × {patch.heights.shape[0]}"
    tables = Tables(folder, words, patch)
    for n, (name, arguments) in enumerate(settings.items()):
        progress(n, len(settings), "building tables")
        tables.paths[name] = folder / f"{name}.exr"
        DiffractionTable.build(patch, **arguments).save(tables.paths[name])
    progress(len(settings), len(settings), "building tables")
    return tables


def bsdf_factories(tables: Tables) -> dict[str, Callable[[], Any]]:
    """Functions that make the contenders, by name, in the current variant."""

    def ours(table: str, **parameters: Any) -> Callable[[], Any]:
        return lambda: tables.bsdf(table, **parameters)

    def measured() -> Any:
        file = tables.folder / "even.bsdf"
        if not file.exists():
            write_measured(file)
        return mi.load_dict({"type": "measured", "filename": str(file)})

    return {
        ALUMINIUM: lambda: mi.load_dict({"type": "roughconductor", "material": "Al"}),
        "principled, metal": lambda: mi.load_dict(
            {"type": "principled", "metallic": 1.0, "roughness": 0.3}
        ),
        "measured": measured,
        DEFAULT: ours("default"),
        KIRCHHOFF: ours("default", model="kirchhoff"),
        DEFAULT_AL: ours("default", material="Al"),
        KIRCHHOFF_AL: ours("default", material="Al", model="kirchhoff"),
        COARSE: ours("1e-2"),
        ONE_WINDOW: ours("patch"),
        ON_SURFACE: ours("patch", coherence="surface", uv_scale=1e4),
        TILED: ours("patch", coherence="surface", uv_scale=1e4, tiling="random"),
        THESIS: lambda: thesis_bsdf(tables.paths["thesis"]),
        TAYLOR: ours("thesis"),
    }


def bare_gathers(bsdf: Any, queries: Queries) -> Callable[[], Any]:
    """All packets that `eval` reads for these queries, added up: the floor beneath any look-up.

    Half floats are added up as words, without unpacking. Where they are is found out beforehand.
    """
    table, device = bsdf.table, bsdf.power.device
    packets, nothing = device.read, mi.Float(0.0)
    if device.halves is not None:
        packets, nothing = device.halves.words, mi.Int32(0)
    si, total = queries.si, queries.si.wi + queries.wo
    firsts = []
    for n in range(len(si.wavelengths)):
        k = 2e3 * dr.pi / si.wavelengths[n]
        firsts.append(device.first_bin(k * total.x, k * total.y, k * total.z))
    dr.eval(firsts)

    def body(n: Any, firsts: list[Any], total: Any) -> tuple[Any, list[Any], Any]:
        for row, columns in enumerate(table.grid.tapped()):
            for column in columns:
                for packet in packets(firsts[0] + table.grid.index(0, row, column)):
                    total += dr.sum(packet, axis=0)
        return n + 1, [*firsts[1:], firsts[0]], total

    def call() -> Any:
        state = (mi.UInt32(0), firsts, nothing)
        return dr.while_loop(state, lambda n, *_: n < len(firsts), body)[2]

    return call


# what an anisotropic surface takes, in the sampling of Dupuy and Jakob 2018
AZIMUTHS, ANGLES, WAVELENGTHS, SIDE = 8, 8, 195, 32


def write_measured(path: Path) -> None:
    """A surface that reflects alike everywhere: values do not matter for the time that it takes."""

    def ones(*shape: int) -> Single:
        return np.ones(shape, np.float32)

    arrays: dict[str, Any] = {
        "description": "even",
        "theta_i": np.linspace(0.0, 1.5, ANGLES, dtype=np.float32),
        "phi_i": np.linspace(-np.pi, np.pi, AZIMUTHS, dtype=np.float32),
        "ndf": ones(128, 128),
        "sigma": ones(128, 128),
        "vndf": ones(AZIMUTHS, ANGLES, 128, 128),
        "luminance": ones(AZIMUTHS, ANGLES, SIDE, SIDE),
        "spectra": ones(AZIMUTHS, ANGLES, WAVELENGTHS, SIDE, SIDE),
        "wavelengths": np.linspace(360.0, 1000.0, WAVELENGTHS, dtype=np.float32),
        "jacobian": np.zeros(1, np.uint8),
    }
    with contextlib.redirect_stdout(None):  # it says what it wrote
        tensor_io.write(str(path), **arrays)
