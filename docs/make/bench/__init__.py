"""Measurements of speed and memory, printed by `python -m docs.make.bench`.

Contents
--------
sections     all measurements, part by part, on every backend of this machine
figures      sizes of a run; rows with goals; two runs side by side
build        tables, each built in a process of its own, whose memory is measured
contenders   BSDFs to compare, the bare gathers and the thesis' look-up among them
evaluation   `eval`, `sample` and `pdf` of all of them; RGB variants beside spectral ones
orders       `diffraction_orders`: times of the calls, noise of a sample
survey       a survey of many scans, in one process and on workers
frames       frames of the shaders
scenes       scenes to render; noise beside sampling by the cosine
updates      one change of a parameter in an optimisation
snake        the time of whole pictures, each scene in a process of its own
"""

from __future__ import annotations

import functools
import gc
from collections.abc import Callable, Collection, Iterable, Iterator
from pathlib import Path

from mitsuba_diffraction.heights.field import HeightField
from mitsuba_diffraction.progress import Progress

from .figures import Plan, Section

__all__ = ["sections"]


def sections(
    parts: Collection[str],
    plan: Plan,
    folder: Path,
    progress: Progress,
    scenes: Path,
    patch: HeightField | None = None,
) -> Iterator[Section]:
    """Measure the parts that are asked for, one after the other.

    Parameters
    ----------
    parts : of `PARTS`.
    plan : how much is measured.
    folder : for temporary files.
    progress : called as progress(done, total, text).
    scenes : folder of the project's scenes.
    patch : evaluated instead of the plan's own.
    """
    if "build" in parts:
        from .build import measure_builds

        yield measure_builds(plan, folder, progress)
    if "survey" in parts:
        from .survey import measure_survey

        yield measure_survey(plan, folder, progress)
    if set(parts) <= {"build", "survey"}:
        return
    import drjit as dr

    from mitsuba_diffraction.scene.load import set_variant

    from .contenders import build_tables
    from .evaluation import measure_colours, measure_eval, measure_sampling
    from .orders import measure_orders
    from .scenes import measure_efficiency, measure_noise
    from .snake import measure_snake
    from .updates import measure_updates

    tables = functools.cache(lambda: build_tables(plan, folder, progress, patch))

    def colours(backend: str) -> Iterable[Section]:
        return measure_colours(plan, tables(), scenes, backend, progress)

    found = [b for b in ("llvm", "cuda") if dr.has_backend(getattr(dr.JitBackend, b.upper()))]
    for backend in found:
        set_variant(f"{backend}_ad_spectral")
        measured: dict[str, Callable[[], Iterable[Section]]] = {
            "eval": lambda: [measure_eval(plan, tables(), progress)],
            "sample": lambda: measure_sampling(plan, tables(), progress),
            "snake": lambda: [measure_snake(plan, tables(), scenes, progress)],
            "orders": lambda: measure_orders(plan, scenes, progress),
            "noise": lambda: [measure_noise(plan, tables(), progress)],
            "efficiency": lambda: [measure_efficiency(plan, tables(), scenes, progress)],
            "update": lambda: [measure_updates(folder, progress)],
            "colours": functools.partial(colours, backend),
        }
        for part, measure in measured.items():
            if part in parts:
                yield from measure()
                gc.collect()  # the next part's kernels would hold the code of BSDFs of this one
    if "frames" in parts:
        from .frames import measure_frames

        yield measure_frames(plan, tables(), scenes, progress)
