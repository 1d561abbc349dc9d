"""CPU time of one step of an optimisation: `parameters.update()` with a new value."""

from __future__ import annotations

import os
import time
from pathlib import Path
from statistics import median
from typing import Any, NamedTuple
from unittest import mock

import drjit as dr
import mitsuba as mi

import mitsuba_diffraction as md
from mitsuba_diffraction import gratings
from mitsuba_diffraction.analysis.timing import PIXEL
from mitsuba_diffraction.progress import Progress

from .figures import Goal, Row, Section

#: CPU seconds that an update may take.
MOST_SECONDS = 0.3
_PIXELS = 256
_FILM = {"film_ior": 1.56, "film_thickness": 200.0}


class Case(NamedTuple):
    """A BSDF by its arguments, and the values that one of its parameters gets in turn."""

    name: str
    arguments: dict[str, Any]
    parameter: str
    values: tuple[float, ...]


# values of a film that are more than its step of 5 nm apart, heights in intervals of their own
CASES = (
    Case("film_thickness, on keratin", _FILM, "film_thickness", (212.0, 224.0, 236.0)),
    Case("film_thickness, on Al", {"material": "Al", **_FILM}, "film_thickness", (212.0, 224.0)),
    Case("film_eta, on Al", {"material": "Al", **_FILM}, "film_eta", (1.6, 1.64)),
    Case("height_scale, Al", {"material": "Al"}, "height_scale", (0.62, 1.37)),
)


def measure_updates(folder: Path, progress: Progress) -> Section:
    """Update each case's parameter, of which derivatives are taken, with an empty cache."""
    rows = []
    with mock.patch.dict(os.environ, {"MITSUBA_DIFFRACTION_CACHE": str(folder / "updates")}):
        for n, case in enumerate(CASES):
            progress(n, len(CASES), case.name)
            rows.append(_measured(case))
    progress(len(CASES), len(CASES), "updated")
    title = (
        f"update: a new value of a parameter, gratings.elaphe_like of {_PIXELS} × {_PIXELS} "
        "pixels; CPU time, the first use of a parameter left out"
    )
    return Section(title, rows)


def _measured(case: Case) -> Row:
    field = gratings.elaphe_like(_PIXELS * PIXEL, _PIXELS)
    parameters = mi.traverse(mi.load_dict(md.bsdf_dict(field, **case.arguments)))
    seconds = []
    for value in (float(parameters[case.parameter][0]), *case.values):
        new = mi.Float(value)
        dr.enable_grad(new)
        start = time.process_time()
        parameters[case.parameter] = new
        parameters.update()
        seconds.append(time.process_time() - start)
    of_new = seconds[1:]
    goal = Goal(f"at most {MOST_SECONDS:g} s", median(of_new) <= MOST_SECONDS)
    return Row(case.name, {"CPU s": median(of_new)}, [goal], {"cpu_seconds": of_new})
