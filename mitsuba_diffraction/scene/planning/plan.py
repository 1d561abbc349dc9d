"""Plans: the smallest limits of each table of a scene that leave next to no light outside.

A plan is made of recipes. Each describes the heights of one table, as the scene has them, with a
`frequency_limit` and a `height_scale_max` besides; `precompute` builds it like any other recipe.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from ...errors import DiffractionError
from ...heights import Source
from ...settings import RECIPE_SETTINGS, TableSettings
from ...tables import DiffractionTable, TableRequest, providing
from .light import Load, TableLight

#: Settings that a plan chooses.
CHOSEN = ("frequency_limit", "height_scale_max")
#: Share of a table's size above which a limited one is not worth it.
WORTH = 0.8
#: Factor on the frequency of the last light: a path not traced may go a little farther.
ROOM = 1.02


@dataclass(frozen=True)
class PlannedTable:
    """A table of a scene, with the limits that it needs.

    Attributes
    ----------
    light : the table of all orders, and the light that it sends.
    settings : of the limited table; None where it would save too little.
    table : the limited table, or the table of all orders.
    outside : share of the surfaces' light that is looked up beyond the limits, or in bins that they
        cross: at most so much is missing, as lobes of the last orders reach beyond.
    """

    light: TableLight
    settings: TableSettings | None
    table: DiffractionTable
    outside: float


def plan_table(light: TableLight, tolerance: float) -> PlannedTable:
    """Limit a table so that at most a share `tolerance` of its surfaces' light lies outside."""
    whole = light.table
    unlimited = PlannedTable(light, None, whole, 0.0)
    if not light.share:
        return unlimited
    limit = frequency_limit(light, tolerance)
    # a series in κ has as many terms as before, so that the size follows the area
    if limit[0] * limit[1] > WORTH * whole.q_limit**2:
        return unlimited
    request = light.request
    x, y = (float(f"{half:.3g}") for half in limit)  # enough for people; the fourth digit is `ROOM`
    settings = replace(
        request.settings, frequency_limit=(x, y), height_scale_max=request.height_scale
    )
    table = request.cached(settings)
    if table.nbytes > WORTH * whole.nbytes:
        return unlimited
    return PlannedTable(light, settings, table, outside(light, table.frequency_limit))


def frequency_limit(light: TableLight, share: float) -> tuple[float, float]:
    """Return the half axes, rad/µm, of the smallest ellipse that leaves at most a share outside.

    share : of all light of the surfaces.
    """
    x, y = light.edges
    # Fingers and tracks spread light across themselves much farther than along
    ratios = 2.0 ** np.arange(-3.0, 3.01, 0.25)
    part = 1.0 - share * light.total / light.frequency.sum()
    halves = [
        (quantiles(np.hypot(x, y / ratio), light.frequency, [part])[0], ratio) for ratio in ratios
    ]
    half, ratio = min(halves, key=lambda axes: axes[0] ** 2 * axes[1])
    largest = light.table.q_limit
    return min(half * ROOM, largest), min(float(half * ratio) * ROOM, largest)


def outside(light: TableLight, limit: tuple[float, float]) -> float:
    """Return the share of the surfaces' light outside of an ellipse of these half axes, rad/µm."""
    x, y = light.edges
    beyond = np.hypot(x / limit[0], y / limit[1]) > 1.0
    return float(light.frequency[beyond].sum() / light.total)


def quantiles(values: Any, light: Any, shares: Sequence[float]) -> list[float]:
    """Return values below which these shares of the light lie; arrays of one shape."""
    flat, weights = np.ravel(values), np.ravel(light)
    found = np.quantile(flat, np.clip(shares, 0.0, 1.0), weights=weights, method="inverted_cdf")
    return list(map(float, found))


def recipe_of(planned: PlannedTable, scene: str) -> tuple[Source, str]:
    """The recipe of a limited table, with a comment on its purpose.

    Raises a DiffractionError if the heights come from no file.
    """
    light, settings = planned.light, planned.settings
    source = light.request.source
    surfaces = ", ".join(light.surfaces)
    if source.path is None or settings is None:
        raise DiffractionError(
            f"the heights of {surfaces} are an array, which no recipe can name; save them to a file"
        )
    values = {name: getattr(settings, name) for name in RECIPE_SETTINGS}
    default = TableSettings()
    table = {name: value for name, value in values.items() if value != getattr(default, name)}
    comment = (
        f"Planned for {surfaces} in {scene}: at most {100 * planned.outside:.2g} % of the light\n"
        "that its camera sees of them lies beyond these limits, and is missing. Plan again when\n"
        "camera or lights change."
    )
    return replace(source, settings=table), comment


def recipe_files(output: Path, count: int) -> list[Path]:
    """Names of a plan's recipes: OUT.toml, OUT_2.toml and so on."""
    numbered = (output.with_name(f"{output.stem}_{n}{output.suffix}") for n in range(2, count + 1))
    return [output, *numbered]


def load_limited(load: Load, planned: Sequence[PlannedTable]) -> Any:
    """Load a scene with the tables of a plan."""
    limited = {
        (each.light.request.digest, each.light.request.settings): each.settings
        for each in planned
        if each.settings is not None
    }
    with providing(lambda r: r.cached(limited.get((r.digest, r.settings), r.settings))):
        return load()


def load_by_recipes(load: Load, files: Sequence[Path]) -> Any:
    """Load a scene with the limits of some recipes.

    Raises a DiffractionError if a recipe is for other heights or other settings than the scene's.
    """
    recipes = {file: Source.of(file) for file in files}
    used = set()

    def table_of(request: TableRequest) -> DiffractionTable:
        for file, recipe in recipes.items():
            if recipe.digest == request.source.digest:
                used.add(file)
                return request.cached(_limited(request, recipe))
        return request.cached(request.settings)

    with providing(table_of):
        scene = load()
    if missing := [str(file) for file in recipes if file not in used]:
        raise DiffractionError(
            f"the scene has no surface with the heights of {', '.join(missing)}; plan this scene"
        )
    return scene


def _limited(request: TableRequest, recipe: Source) -> TableSettings:
    settings = TableSettings(**recipe.settings)
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
