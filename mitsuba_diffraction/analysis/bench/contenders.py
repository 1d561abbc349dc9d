"""What `eval` is compared with: other BSDFs, other settings, and the bare gathers."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import drjit as dr
import mitsuba as mi

from ...heights import gratings
from ...heights.field import HeightField
from ...plugin.lookup import DeviceTable
from ...plugin.restricted import device_table
from ...progress import Progress
from ...tables.table import DiffractionTable
from .measured_file import write_measured
from .plan import PIXEL, SEED, Plan
from .saved import saved_bsdf, thesis_bsdf

ALUMINIUM = "roughconductor, Al"
DEFAULT = "diffraction, the defaults"
DEFAULT_AL = "diffraction, Al"
KIRCHHOFF = "diffraction, kirchhoff"
KIRCHHOFF_AL = "diffraction, Al, kirchhoff"
COARSE = "diffraction, tolerance 1e-2"
THESIS = "thesis: Taylor, 37 terms, 3×3, an image a term"
TAYLOR = "the same series, all terms of a bin together"


@dataclass(frozen=True)
class Tables:
    """The tables of one patch that the contenders look up, as files."""

    folder: Path
    patch: str
    heights: HeightField
    paths: dict[str, Path] = field(default_factory=dict)

    def bsdf(self, name: str, **parameters: Any) -> Any:
        """The plugin with one of the tables, in the current variant."""
        return saved_bsdf(self.paths[name], **parameters)

    def load(self, name: str) -> DiffractionTable:
        """One of the tables."""
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
        THESIS: lambda: thesis_bsdf(tables.paths["thesis"]),
        TAYLOR: ours("thesis"),
    }


def is_slow(name: str) -> bool:
    """Whether fewer calls do, for the sake of the user's time."""
    return name in (THESIS, TAYLOR)


@dataclass(frozen=True)
class Queries:
    """Random questions to a BSDF, evaluated and in memory."""

    si: Any
    wo: Any
    sample1: Any
    sample2: Any

    @classmethod
    def random(cls, lanes: int) -> Queries:
        """Directions uniform over the hemisphere, wavelengths as Mitsuba draws them."""
        random = mi.PCG32(size=lanes, initstate=SEED)

        def hemisphere() -> Any:
            pair = mi.Point2f(random.next_float32(), random.next_float32())
            return mi.warp.square_to_uniform_hemisphere(pair)

        si = dr.zeros(mi.SurfaceInteraction3f, lanes)
        si.wi = hemisphere()
        wo = hemisphere()
        if mi.is_spectral:
            si.wavelengths = mi.sample_rgb_spectrum(mi.sample_shifted(random.next_float32()))[0]
        sample1 = random.next_float32()
        sample2 = mi.Point2f(random.next_float32(), random.next_float32())
        dr.eval(si, wo, sample1, sample2)
        return cls(si, wo, sample1, sample2)


def bare_gathers(table: DiffractionTable, queries: Queries) -> Callable[[], Any]:
    """All packets that `eval` reads for these queries, added up: the floor beneath any look-up.

    Where they are is found out beforehand.
    """
    device = device_table(table)
    assert isinstance(device, DeviceTable)  # only scalar variants have another
    si, total = queries.si, queries.si.wi + queries.wo
    firsts = []
    for n in range(len(si.wavelengths)):
        k = 2e3 * dr.pi / si.wavelengths[n]
        firsts.append(device.first_bin(k * total.x, k * total.y, k * total.z))
    dr.eval(firsts)

    def body(n: Any, firsts: list[Any], total: Any) -> tuple[Any, list[Any], Any]:
        for row, columns in enumerate(table.grid.tapped()):
            for column in columns:
                for packet in device.read(firsts[0] + table.grid.index(0, row, column)):
                    total += dr.sum(packet, axis=0)
        return n + 1, [*firsts[1:], firsts[0]], total

    def call() -> Any:
        state = (mi.UInt32(0), firsts, mi.Float(0.0))
        return dr.while_loop(state, lambda n, *_: n < len(firsts), body)[2]

    return call
