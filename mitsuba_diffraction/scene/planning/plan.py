"""Plans: the smallest limits of each table of a scene that leave next to no light outside.

A plan is made of recipes. Each describes the heights of one table, as the scene has them, with a
`frequency_limit` and a `height_scale_max` besides; `precompute` builds it like any other recipe.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from ...errors import DiffractionError
from ...heights.recipes import Recipe
from ...settings import RECIPE_SETTINGS, TableSettings
from ...tables.source import TableRequest
from ...tables.table import DiffractionTable
from .lookups import Lookups
from .paths import TracedPaths, trace
from .recording import Session, described_table

#: Settings that a plan chooses.
CHOSEN = ("frequency_limit", "height_scale_max")
#: Share of a table's size above which a limited one is not worth it.
WORTH = 0.8

Load = Callable[[], Any]


@dataclass(frozen=True)
class RecordedTable:
    """A table of a scene, and the look-ups in it.

    Attributes
    ----------
    request : the heights and settings, as the scene has them.
    table : of all orders.
    surfaces : names of the BSDFs that look it up.
    lookups : made by the paths; None where no path meets the surfaces.
    lobe_turn : see `paths.TracedPaths.lobe_turn`; the largest of the surfaces'.
    """

    request: TableRequest
    table: DiffractionTable
    surfaces: Sequence[str]
    lookups: Lookups | None
    lobe_turn: float


@dataclass(frozen=True)
class PlannedTable:
    """A table of a scene, with the limits that it needs.

    Attributes
    ----------
    recorded : the table of all orders, and the look-ups in it.
    settings : of the limited table; None where it would save too little.
    table : the limited table, or the table of all orders.
    outside : share of the surfaces' light that is looked up beyond the limits, and missing.
    """

    recorded: RecordedTable
    settings: TableSettings | None
    table: DiffractionTable
    outside: float


def record(
    load: Load, sensor: Callable[[Any], Any], paths: int, seed: int = 0
) -> tuple[TracedPaths, list[RecordedTable]]:
    """Load a scene, trace paths through it, and gather the look-ups in each of its tables.

    Raises a DiffractionError if no surface diffracts, none has a table of heights, or no path
    carries light of one.
    """
    session = Session(recording=True)
    with session:
        scene = load()
    try:
        _check(session)
        traced = trace(scene, sensor(scene), session, paths, seed)
        if not len(traced.lookups):
            raise DiffractionError(
                f"none of {paths} paths carries light of a surface that diffracts "
                f"({_names(session)}): the camera does not see it lit; check camera and lights, or "
                "raise paths"
            )
        return traced, [_recorded(key, session, traced) for key in session.tables]
    finally:
        session.close()


def _check(session: Session) -> None:
    if not session.bsdfs:
        raise DiffractionError(
            "the scene has no BSDF 'diffraction'; there is nothing to plan, render it as it is"
        )
    if not session.tables:
        raise DiffractionError(
            f"the tables of {_names(session)} come from files and stay as they are; give the scene "
            "the height field, or its recipe, to have smaller ones planned"
        )


def _names(session: Session) -> str:
    return ", ".join(sorted({name for name, _ in session.bsdfs}))


def _recorded(key: str, session: Session, traced: TracedPaths) -> RecordedTable:
    table = session.tables[key]
    bsdfs = [n for n, (_, bsdf) in enumerate(session.bsdfs) if described_table(bsdf) is table]
    rows = traced.lookups[np.isin(traced.lookups["bsdf"], bsdfs)]
    lookups = None
    if len(rows):
        total = float(min(traced.total[bsdfs].sum(), 1.0))
        lookups = Lookups(rows["u"], rows["v"], rows["w"], rows["wavelength"], rows["xyz"], total)
    turns = [float(traced.lobe_turn[n]) for n in bsdfs if traced.lobe_turn[n] >= 0.0]
    return RecordedTable(
        request=session.requests[key],
        table=table,
        surfaces=sorted({session.bsdfs[n][0] for n in bsdfs}),
        lookups=lookups,
        lobe_turn=max(turns, default=float("nan")),
    )


def plan_table(recorded: RecordedTable, tolerance: float) -> PlannedTable:
    """Limit a table so that at most a share `tolerance` of its surfaces' light lies outside."""
    whole, lookups = recorded.table, recorded.lookups
    unlimited = PlannedTable(recorded, None, whole, 0.0)
    if lookups is None:
        return unlimited
    limit = lookups.frequency_limit(tolerance, whole.q_limit)
    # a series in κ has as many terms as before, so that the size follows the area
    if limit[0] * limit[1] > WORTH * whole.q_limit**2:
        return unlimited
    request = recorded.request
    settings = replace(
        request.settings,
        frequency_limit=(_rounded(limit[0]), _rounded(limit[1])),
        height_scale_max=request.height_scale,
    )
    table = request.cached(settings)
    if table.nbytes > WORTH * whole.nbytes:
        return unlimited
    return PlannedTable(recorded, settings, table, lookups.outside(table.frequency_limit))


def _rounded(frequency: float) -> float:
    """Three digits are enough for people; the fourth is `lookups.ROOM`."""
    return float(f"{frequency:.3g}")


def recipe_of(planned: PlannedTable, scene: str) -> tuple[Recipe, str]:
    """The recipe of a limited table, with a comment on its purpose.

    Raises a DiffractionError if the heights come from no file.
    """
    recorded, settings = planned.recorded, planned.settings
    recipe = recorded.request.source.as_recipe()
    surfaces = ", ".join(recorded.surfaces)
    if recipe is None or settings is None:
        raise DiffractionError(
            f"the heights of {surfaces} are an array, which no recipe can name; save them to a file"
        )
    default = TableSettings(coherence=settings.coherence, basis=settings.basis)
    values = {name: getattr(settings, name) for name in RECIPE_SETTINGS}
    table = {name: value for name, value in values.items() if value != getattr(default, name)}
    comment = (
        f"Planned for {surfaces} in {scene}: {100 * planned.outside:.2g} % of the light that its\n"
        "camera sees of them lies beyond these limits, and is missing. Plan again when camera or\n"
        "lights change."
    )
    return replace(recipe, table=table), comment


def recipe_files(output: Path, count: int) -> list[Path]:
    """Names of a plan's recipes: OUT.toml, OUT_2.toml and so on."""
    numbered = (output.with_name(f"{output.stem}_{n}{output.suffix}") for n in range(2, count + 1))
    return [output, *numbered]


def load_limited(load: Load, planned: Sequence[PlannedTable]) -> Any:
    """Load a scene with the tables of a plan."""
    limited = {}
    for table in planned:
        if table.settings is not None:
            request = table.recorded.request
            limited[request.digest, request.settings] = table.settings

    def settings_of(request: TableRequest) -> TableSettings:
        return limited.get((request.digest, request.settings), request.settings)

    return Session(settings_of).load(load)


def load_by_recipes(load: Load, files: Sequence[Path]) -> Any:
    """Load a scene with the limits of some recipes.

    Raises a DiffractionError if a recipe is for other heights or other settings than the scene's.
    """
    recipes = {file: Recipe.load(file) for file in files}
    used = set()

    def settings_of(request: TableRequest) -> TableSettings:
        named = request.source.as_recipe()
        for file, recipe in recipes.items():
            if named is not None and recipe.describes_heights_of(named):
                used.add(file)
                return _limited(request, recipe)
        return request.settings

    session = Session(settings_of)
    scene = session.load(load)
    if missing := [str(file) for file in recipes if file not in used]:
        raise DiffractionError(
            f"the scene has no surface with the heights of {', '.join(missing)}; plan this scene"
        )
    return scene


def _limited(request: TableRequest, recipe: Recipe) -> TableSettings:
    settings = TableSettings(**recipe.table)
    for name in RECIPE_SETTINGS:
        planned, asked = getattr(settings, name), getattr(request.settings, name)
        if name not in CHOSEN and planned != asked:
            raise DiffractionError(
                f"{name}={planned} of '{recipe.path}' is {asked} in the scene; plan this scene"
            )
    if request.height_scale > settings.height_scale_max:
        raise DiffractionError(
            f"height_scale={request.height_scale:g} is beyond height_scale_max="
            f"{settings.height_scale_max:g} of '{recipe.path}'; plan this scene"
        )
    return settings
