"""Making a plan for a scene, and trying it on a small picture until that is as it was."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np
from numpy.typing import NDArray

from ...errors import DiffractionError
from ...optics.colour import delta_e, linear_srgb
from ...plugin.sampling import forget_sampler
from ...progress import Progress
from ...tables.table import DiffractionTable
from .paths import TracedPaths, trace
from .plan import Lookups, Plan, PlannedTable, domain_for
from .recording import Session

#: Width at most, and samples per pixel.
WIDTH, SPP = 160, 64

Picture = tuple[NDArray[np.float64], bool]

Load = Callable[[], Any]

#: A planned table that is not smaller than this share of the whole one is not worth it.
WORTH = 0.8

#: A picture that differs by more than the tolerance is planned anew with a smaller share outside.
ATTEMPTS, TIGHTER = 3, 0.3

#: No further one is drafted if a third of the light outside leaves more than this of the error.
HELPS = 0.8

#: Share of its terms that a table with a larger tolerance keeps at least.
FEWEST_TERMS = 0.5

#: A plan is refused where this many times its tolerance lies outside: paths differ from the last.
MOST_OUTSIDE = 3.0


@dataclass(frozen=True)
class Difference:
    """Between the pictures with whole and with planned tables, of the same random numbers."""

    relative: float  # mean |ΔXYZ| over mean XYZ, all pixels
    # delta_e_mean, delta_e_99: ΔE2000 of the pixels that are not black, or NaN
    delta_e_mean: float
    delta_e_99: float
    # size, spp: of the pictures
    size: tuple[int, int]
    spp: int


def difference(
    whole: Picture,
    tables: Mapping[str, DiffractionTable],
    load: Callable[[], Any],
    plan: Plan,
    sensor: Callable[[Any], Any],
) -> Difference:
    """Render with planned tables, with the random numbers and directions of the whole ones.

    whole, tables : `small_picture` of the scene with whole tables, and those by key.
    load : loads the scene anew, in the variant that is set.
    plan : what it is to be loaded with.
    """
    like = {key: tables[key] for key in plan.limits()}
    session = Session(limits=plan.limits(), sample_like=like)
    with session:
        planned = load()
    try:
        second, _ = small_picture(planned, sensor(planned))
    finally:
        for table in session.tables.values():
            forget_sampler(table)
        session.close()
    first, xyz = whole
    mean = float(first.mean())
    values = np.full(1, np.nan)
    if xyz:
        values = delta_e(linear_srgb(first), linear_srgb(second))
        values = values[np.isfinite(values)]
    height, width = first.shape[:2]
    return Difference(
        relative=float(np.abs(second - first).mean()) / mean if mean > 0.0 else float("nan"),
        delta_e_mean=float(values.mean()) if values.size else float("nan"),
        delta_e_99=float(np.percentile(values, 99.0)) if values.size else float("nan"),
        size=(width, height),
        spp=SPP,
    )


def small_picture(scene: Any, sensor: Any) -> Picture:
    """A small picture (height, width, channels), and whether it is in XYZ."""
    film = sensor.film()
    size = np.array(film.size(), int)
    if size[0] > WIDTH:
        parameters = mi.traverse(sensor)
        parameters["film.size"] = [WIDTH, max(1, round(WIDTH * int(size[1]) / int(size[0])))]
        parameters.update()
    mi.render(scene, sensor=sensor, spp=SPP, seed=0)
    root = dict(film.bitmap().split()).get("<root>")
    if root is None or root.pixel_format().name not in ("RGB", "RGBA", "XYZ", "XYZA"):
        return np.array(film.bitmap(), np.float64), False
    kinds = mi.Bitmap.PixelFormat
    converted = root.convert(kinds.XYZ, mi.Struct.Type.Float32, False)
    return np.array(converted, np.float64), True


@dataclass(frozen=True)
class RecordedScene:
    """A scene in a recording session, and what its tables were asked."""

    scene: Any
    session: Session
    traced: TracedPaths
    statistics: dict[str, Lookups]


def record_scene(
    load: Load,
    sensor: Callable[[Any], Any],
    paths: int,
    *,
    plan: Plan | None = None,
    seed: int = 0,
    timing: bool = False,
) -> RecordedScene:
    """Load a scene with whole tables, or with those of a plan, and trace paths through it.

    plan : whose tables to load it with.
    seed : of the paths.
    timing : build tables anew, and take the time.

    Raises a DiffractionError if no surface diffracts or one lets light through, if no path meets
    one, or if the plan is for others.
    """
    session = Session(limits=plan.limits() if plan else {}, recording=True, timing=timing)
    with session:
        scene = load()
    if not session.bsdfs:
        raise DiffractionError(
            "the scene has no BSDF 'diffraction'; there is nothing to plan, render it as it is"
        )
    passed = [name for name, bsdf in session.bsdfs if bsdf.through is not None]
    if passed:
        raise DiffractionError(
            f"light goes through {', '.join(sorted(set(passed)))}, which plans do not record; "
            "render the scene without a plan"
        )
    if plan is not None:
        _check_match(session, plan)
    elif not session.tables:
        raise DiffractionError(
            f"the tables of {_names(session)} come from files and stay as they are; give the scene "
            "the height field, or its recipe, to have smaller ones planned"
        )
    traced = trace(scene, sensor(scene), session, paths, seed)
    if not len(traced.lookups):
        raise DiffractionError(
            f"none of {paths} paths carries light of a surface that diffracts ({_names(session)}): "
            "the camera does not see it lit; check camera and lights, or raise --paths"
        )
    return RecordedScene(scene, session, traced, _statistics(session, traced))


def _names(session: Session) -> str:
    return ", ".join(sorted({name for name, _ in session.bsdfs}))


def _statistics(session: Session, traced: TracedPaths) -> dict[str, Lookups]:
    """What each table is asked; tables from files, which cannot be made smaller, are left out."""
    found = {}
    for key, table in session.tables.items():
        mine = [n for n, (_, bsdf) in enumerate(session.bsdfs) if bsdf.table is table]
        asked = traced.of(mine)
        if len(asked):
            found[key] = Lookups(
                asked["u"], asked["v"], asked["w"], asked["wavelength"], asked["xyz"],
                float(min(traced.total[mine].sum(), 1.0)),
            )  # fmt: skip
    return found


def draft_plan(
    name: str, loaded: RecordedScene, tolerance: float, share: float | None = None
) -> Plan:
    """The plan that leaves a share of each surface's light outside, `tolerance` by default.

    What it says of memory is not known yet: see `worthwhile`.
    """
    session = loaded.session
    tables = {}
    for key, table in session.tables.items():
        asked, mine = loaded.statistics.get(key), [b for b in session.bsdfs if b[1].table is table]
        # A surface that no path meets keeps what it has
        domain = None
        if asked is not None:
            scale = max(float(dr.slice(dr.max(bsdf.height_scale))) for _, bsdf in mine)
            domain = domain_for(asked, table, scale, share or tolerance)
        tables[key] = PlannedTable(
            surfaces=sorted({name for name, _ in mine}),
            name=str(table.source.get("name", "")),
            digest=str(table.source.get("digest", "")),
            domain=domain,
            memory=(table.nbytes, table.nbytes),
        )
    return Plan(name, tolerance, loaded.traced.paths, tables)


def worthwhile(plan: Plan, planned: dict[str, DiffractionTable]) -> Plan:
    """The plan without what is not worth it, and with what the rest saves.

    planned : its tables by key; those that are missing stay whole.
    """
    tables = {}
    for key, table in plan.tables.items():
        before = table.memory[0]
        now = planned[key].nbytes if key in planned else before
        worth = table.domain is not None and now < WORTH * before
        tables[key] = replace(
            table, domain=table.domain if worth else None, memory=(before, now if worth else before)
        )
    return replace(plan, tables=tables)


def load_planned(load: Load, plan: Plan, *, timing: bool = False) -> tuple[Any, Session]:
    """Load a scene with the tables of a plan.

    Raises a DiffractionError if none of the plan's tables is one of the scene's.
    """
    session = Session(limits=plan.limits(), timing=timing)
    with session:
        scene = load()
    _check_match(session, plan)
    return scene, session


def _check_match(session: Session, plan: Plan) -> None:
    if session.tables and set(session.tables) <= set(plan.tables):
        return
    names = sorted(
        {n for n, bsdf in session.bsdfs if session.key_of(bsdf.table) not in plan.tables}
    )
    session.close()
    theirs = ", ".join(sorted({t.name for t in plan.tables.values()})) or "nothing"
    raise DiffractionError(
        f"the plan is for tables of {theirs} in '{plan.scene}', and not for "
        f"{', '.join(names) or 'this scene'}: the heights or a table's parameters are others; "
        "plan this scene"
    )


def check_light(loaded: RecordedScene, plan: Plan) -> dict[str, float]:
    """Share of each table's light that a scene looks up outside its plan.

    Raises a DiffractionError if it is several times what the plan was to leave out: camera or
    lights are others.
    """
    shares = {}
    for key, asked in loaded.statistics.items():
        table = plan.tables[key]
        if table.domain is None:
            continue
        domain = table.domain
        shares[key] = asked.outside(domain.crop, domain.kappa_max)
        if shares[key] > MOST_OUTSIDE * plan.tolerance:
            farthest = float(asked.frequency.max())
            raise DiffractionError(
                f"the plan does not fit: {100 * shares[key]:.2g} % of the light of "
                f"{', '.join(table.surfaces)} is looked up outside of it (|q| up to "
                f"{farthest:.3g} rad/µm; the plan ends at {domain.crop[0]:.3g} along x, "
                f"{domain.crop[1]:.3g} along y, κ at {domain.kappa_max:.3g}), and it was made for "
                f"{100 * plan.tolerance:.2g} %; plan the scene with this camera and these lights, "
                "or render without --plan"
            )
    return shares


@dataclass(frozen=True)
class TestedPlan:
    """A plan that was tried."""

    plan: Plan  # the plan; without any restriction where no picture came near enough
    planned: dict[str, DiffractionTable]  # its tables by key, as they were last tried
    seconds: dict[str, float]  # that they took to build, with `timing`
    # between the last pictures, or None where nothing could be made smaller
    difference: Difference | None

    @property
    def suits(self) -> bool:
        """Whether the picture is within the plan's tolerance."""
        return self.difference is None or self.difference.relative <= self.plan.tolerance


def find_plan(
    name: str,
    loaded: RecordedScene,
    load: Load,
    sensor: Callable[[Any], Any],
    tolerance: float,
    tell: Progress,
    *,
    timing: bool = False,
) -> TestedPlan:
    """Draft plans, with less and less light outside, until the picture is near enough.

    Orders that cells average may be far apart, as those of gratings are, and a flat surface under
    one light asks between them: the light outside then says little of the error, so it is measured.
    Nothing is built where light asks for nearly all of every table, and where less light outside
    does not help, no further plan is drafted.
    """
    share, before, whole = tolerance, math.inf, None
    for _ in range(ATTEMPTS):
        drafted = promising(draft_plan(name, loaded, tolerance, share), loaded)
        if not drafted.limits():
            return TestedPlan(drafted, dict(loaded.session.tables), {}, None)
        tell(0, 0, "building tables")
        session = load_planned(load, drafted, timing=timing)[1]
        planned, seconds = dict(session.tables), dict(session.seconds)
        session.close()
        plan = worthwhile(drafted, planned)
        if not plan.limits():
            return TestedPlan(plan, planned, seconds, None)
        tell(0, 0, "comparing pictures")
        whole = whole or small_picture(loaded.scene, sensor(loaded.scene))
        changed = difference(whole, loaded.session.tables, load, plan, sensor)
        found = TestedPlan(plan, planned, seconds, changed)
        if found.suits or changed.relative > HELPS * before:
            break
        share, before = share * TIGHTER, changed.relative
    return found if found.suits else replace(found, plan=worthwhile(plan, {}))


def promising(plan: Plan, loaded: RecordedScene) -> Plan:
    """The plan without tables that are hardly made smaller, as far as their bins say.

    The memory goes with the area of frequencies and with the terms; a larger tolerance saves terms,
    of which at least `FEWEST_TERMS` of the whole table's remain.
    """
    tables = {}
    for key, mine in plan.tables.items():
        whole, domain = loaded.session.tables[key], mine.domain
        if domain is not None:
            area = domain.crop[0] * domain.crop[1] / whole.q_limit**2
            spared = FEWEST_TERMS if domain.tolerance > whole.tolerance else 1.0
            domain = domain if area * spared < WORTH else None
        tables[key] = replace(mine, domain=domain)
    return replace(plan, tables=tables)
