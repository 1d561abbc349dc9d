"""`solve_orders`: from a profile and a material to a table of orders."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from ...arrays import Complex, Real
from ...errors import DiffractionError, check_choice, quoted
from ...heights import HeightField
from .. import cells
from ..cells import Counts
from ..polarised import mueller_of
from ..response import ALONG, MOST_NODES, MUELLER, UNPOLARISED, Band, CellResponse
from ..table import LEAST_BLOCK, OrderTable, check_outline
from .accuracy import WORST, measured_error, missed_tolerance, powers, warn_of_error
from .crossed import PHI, THETA, check_cell
from .directions import Directions, solve_directions
from .films import Layers, Substance, structure_of
from .grating_index import TabulatedIndex, material_of
from .jobs import AUTO, Jobs, Problem, problem_of, solver_of
from .node_counts import node_counts
from .nodes import (
    Place,
    at_nodes,
    kinds_of,
    places_of,
)
from .profiles import Profile, UnitCell
from .resolution import (
    coarsest,
    energy_error,
    finer_problem,
    places_to_test,
    reciprocity_error,
    resolved,
)
from .settings import MOST_EXCESS, Estimate, Settings, announce_stage, header_of
from .stations import Grating

#: Times that a table which misses its tolerance gets more nodes, and their factor.
REFINEMENTS, _FINER = 2, 1.4
#: Part of a band's error that more nodes remove, at least.
_GAINED = 0.5
#: Times that the resolution is raised, if solutions at nodes have light from nothing.
_RAISED = 3
#: Nodes of a block's first table; each refinement halves the distance between them.
BLOCK_COUNTS = Counts(9, 7, 3)
#: Bytes of a refined table at most.
MOST_BYTES = 128 << 20


def solve_orders(
    profile: Profile | HeightField,
    material: str | float | complex | TabulatedIndex = "Al",
    *,
    superstrate: float = 1.0,
    thin: bool = False,
    block: bool = False,
    layers: Layers = (),
    beneath: Layers = (),
    substrate: Substance | None = None,
    theta: ArrayLike | None = None,
    phi: ArrayLike = 0.0,
    step: float | None = None,
    settings: Settings | None = None,
    jobs: Jobs | None = None,
    announce: Callable[[Estimate], None] | None = None,
) -> OrderTable:
    """Solve the orders of a grating, for all directions and wavelengths or for listed directions.

    A table that misses its tolerance is refined up to twice, then returned with a warning; its
    header has the measured error.

    Raises a DiffractionError if an argument is out of its range, or the solver is not installed or
    does not converge.

    Parameters
    ----------
    profile : one period of the grooves, from `solve.profiles`; or of the heights of a crossed
        grating, which reflects light in air.
    material : a name that Mitsuba knows, an index n + ik, or "none" for a perfect conductor.
    superstrate : index of the clear medium above.
    thin : whether the material is a thin sheet, whose lower side is flat: the table then has the
        light on both sides (`sheet`). Otherwise it has the reflected orders.
    block : whether the profile is the face of a clear block, whose index is that of the material,
        1.01 to 5, in light from above and from within (`blocks`); solved by coupled waves.
    layers : films on the profile, from the material upwards, such as [("1.46", 0.1)]: material and
        thickness along z, µm. They interfere; walls have none.
    beneath : layers beneath the profile, from the substrate upwards, and slices (`films.Layers`).
    substrate : below them; by default the material.
    theta, phi : directions to the light, degrees, within the medium that it comes from: from the
        normal, and from x towards y; a grid of both. None solves all directions, of crossed
        gratings 8° and 10° apart.
    step : between the wavelengths of listed directions, nm, 5 by default, and 20 for all
        directions of crossed gratings; the ends are solved exactly.
    settings : wavelengths, tolerance, method; of listed directions, the tolerance bounds the
        solver's error.
    jobs : where stations are solved and stored; by default here, and stored nowhere.
    announce : called with the estimate of each stage before it starts.
    """
    if not isinstance(profile, Profile | HeightField):
        raise DiffractionError(
            "solve_orders: expected a profile, as of md.profiles.lamellar, or a HeightField, got "
            f"{quoted(profile)}; a recipe is solved by the command 'solve'"
        )
    how, work = settings or Settings(), jobs or Jobs()
    if announce is not None:
        work.announce = announce
    substance = material_of(material, how.wavelengths)
    if isinstance(profile, HeightField):
        if thin or block or layers or beneath or substrate is not None or superstrate != 1.0:
            raise DiffractionError(
                "crossed gratings reflect light in air; leave out superstrate, thin, block, "
                "layers, beneath and substrate"
            )
        cell = UnitCell(profile.heights, profile.extent)
        check_cell(cell, substance, how.wavelengths)
        problem = problem_of(
            Grating(cell, substance, 1.0, how.wavelengths), how.method, how.resolution or 0
        )
        every = Directions(THETA, PHI, step or 20.0, is_all=True)
        lights = every if theta is None else Directions(theta, phi, step or 5.0)
        return solve_directions(problem, lights, how, work, {})
    if thin or block:
        index = substance.index(how.wavelengths)
        if index is None or index.imag.any() or index.real.min() < LEAST_BLOCK:
            raise DiffractionError(
                f"material {substance.name}: light goes through a clear material only; "
                f"give its index, a real number of {LEAST_BLOCK:g} to 100, such as 1.58"
            )
        if how.polarised:
            raise DiffractionError(
                "polarised: tables of sheets and blocks have efficiencies alone; leave it out"
            )
    if block:
        if thin or layers or beneath or substrate is not None or superstrate != 1.0:
            raise DiffractionError(
                "block: a block has no layers, superstrate or second face; leave these out"
            )
        # The grating of a block's face is upside down, with the block above: the block has more
        # channels, and light of the rarer medium has some of them (`blocks`). Coupled waves solve
        # both at once; they conserve the energy of clear materials to rounding
        check_choice("method", how.method, (AUTO, "coupled"))
        assert index is not None
        inner = float(index[0].real)
        check_outline((profile.period, math.inf), how.wavelengths, block=inner, listed=True)
        turned, above = replace(profile, z=-profile.z), material_of(1.0, how.wavelengths)
        grating = Grating(turned, above, inner, how.wavelengths, block=True)
    else:
        structure = structure_of(
            profile, substance, how.wavelengths,
            layers=layers, beneath=beneath, substrate=substrate, thin=thin,
        )  # fmt: skip
        grating = Grating(profile, substance, superstrate, how.wavelengths, thin, structure)
    problem = problem_of(grating, "coupled" if block else how.method, how.resolution or 0)
    facts = {"material": substance.name} if block else {}
    if theta is not None:
        lights = Directions(theta, phi, step or 5.0)
        return solve_directions(problem, lights, how, work, facts)
    check_outline((profile.period, math.inf), how.wavelengths, *_media(grating))
    return _solve_cells(problem, how, work, facts)


def _media(grating: Grating) -> tuple[float, bool, float | None]:
    """Return superstrate, thin and block of a grating's table."""
    if grating.block:
        return 1.0, False, grating.superstrate
    return grating.superstrate, grating.thin, None


def _solve_cells(
    problem: Problem, how: Settings, work: Jobs, facts: Mapping[str, Any]
) -> OrderTable:
    """Solve all directions and wavelengths."""
    grating = problem.grating
    bands = range(cells.largest_band(how.wavelengths, grating.optical_period) + 1)
    chosen = resolved(problem, work, places_to_test(bands), how.tolerance / 2)
    coarse = problem = chosen.problem
    if how.resolution is None and problem.method == "integral":  # others cost about the same
        coarse = replace(problem, resolution=coarsest(problem))
    if grating.block:
        counts = dict.fromkeys(bands, BLOCK_COUNTS)
    else:
        counts = node_counts(coarse, work, bands, how)
    header = header_of(chosen, how) | dict(facts)
    superstrate, thin, block = _media(grating)
    elements = MUELLER if how.polarised else UNPOLARISED if block else ALONG
    values_of = _lossless if grating.block else partial(_limited, elements)
    # light that is its own reverse, see `resolution`
    itself = [Place(k, kind, 0.5, 0.41, (0.5,)) for k in bands for kind in kinds_of(k)]
    for refinement in range(REFINEMENTS + 1):
        problem, solved = _solved_at_nodes(problem, counts, work, elements)
        header |= {
            "solver": solver_of(problem).name,
            "reciprocity_error": reciprocity_error(
                work.solve(problem, itself, "checking reciprocity"), grating.sides
            ),
        }
        if thin:
            header["energy_error"] = energy_error(np.abs(values) ** 2 for values in solved.values())
        made = []
        for k in bands:
            places = places_of(k, counts[k], _nodes(grating))
            of_kinds = (
                at_nodes(kind, places, counts[k], solved, grating.sides, values_of)
                for kind in kinds_of(k)
            )
            made.append(Band(k, *of_kinds))
        table = OrderTable(
            grating.periods, how.wavelengths,
            CellResponse(tuple(made), even=bool(block)), superstrate, header, thin, block,
        )  # fmt: skip
        error = measured_error(table, problem, work)
        header |= error.facts()
        if not missed_tolerance(header) or refinement == REFINEMENTS:
            break
        excess = max(error.mean, error.table.most / WORST) / how.tolerance
        finer = _refined_counts(counts, error.bands, excess, grating.block)
        if _size(grating, finer, elements) > MOST_BYTES:
            break
        counts = finer
    header |= {"processor_seconds": round(work.processor_seconds, 1)}
    warn_of_error(header)
    return table


def _solved_at_nodes(
    problem: Problem, counts: Mapping[int, Counts], jobs: Jobs, elements: int
) -> tuple[Problem, dict[Place, Complex]]:
    """Solve all nodes, at a higher resolution if solutions have light from nothing."""
    along = _nodes(problem.grating)
    places = [place for band in counts for place in places_of(band, counts[band], along)]
    size = _size(problem.grating, counts, elements)
    for _ in range(_RAISED):
        announce_stage("solving", problem, jobs, places, size)
        solved = jobs.amplitudes(problem, places, "solving orders")
        excess = max(float(powers(values).sum(axis=2).max()) for values in solved.values())
        if excess <= MOST_EXCESS:
            return problem, solved
        problem = finer_problem(problem)
    raise DiffractionError(
        f"efficiencies of a solution sum to {excess:.4g}, also at resolution {problem.resolution}; "
        "use another method, a higher resolution, or a smoother profile"
    )


def _size(grating: Grating, counts: Mapping[int, Counts], elements: int) -> float:
    """Return the bytes of a table's numbers."""
    pairs = {k: sum((k + 1 - kind) ** 2 for kind in kinds_of(k)) for k in counts}
    return 4.0 * elements * grating.sides**2 * sum(
        math.prod(count) * pairs[k] for k, count in counts.items()
    )  # fmt: skip


def _nodes(grating: Grating) -> Callable[[int], Real]:
    """Return the nodes of a grating's table: even ones of blocks, else Chebyshev's."""
    return cells.even_nodes if grating.block else cells.nodes


def _refined_counts(
    counts: Mapping[int, Counts], missed: Real, excess: float, block: bool
) -> dict[int, Counts]:
    """Return more nodes for as few bands as bring the error down to the tolerance.

    Even nodes of blocks are halved in all bands, so that the old ones are nodes again.

    missed : error of each band, a share of all light; excess : error over tolerance.
    """
    if block:
        return {k: Counts(*(2 * n - 1 for n in of_band)) for k, of_band in counts.items()}
    order = np.argsort(-missed)
    gained = _GAINED * np.cumsum(missed[order])
    enough = int(np.searchsorted(gained, (1.0 - 1.0 / excess) * missed.sum())) + 1
    return {
        k: Counts(*(n if n == 1 else min(int(np.ceil(_FINER * n)), MOST_NODES) for n in of_band))
        if k in order[:enough]
        else of_band
        for k, of_band in counts.items()
    }


def _lossless(amplitudes: Complex) -> Real:
    """Return M₀₀ (w, j, q, 1), of which the mirror's order has the remainder of each port."""
    values = powers(amplitudes).mean(axis=-1)
    port = np.arange(values.shape[-1])
    lit = values.sum(axis=-1) > 0.0
    others = values.copy()
    others[..., port, port] = 0.0
    others /= np.maximum(others.sum(axis=-1, keepdims=True), 1.0)
    others[..., port, port] = np.maximum(lit - others.sum(axis=-1), 0.0)
    return others[..., None]


def _limited(count: int, amplitudes: Complex) -> Real:
    """Return the first elements of the Mueller matrices of amplitudes, (w, j, q, count).

    Amplitudes are scaled where their powers sum to more than 1.
    """
    total = powers(amplitudes).sum(axis=2)
    matrices = mueller_of(amplitudes / np.sqrt(np.maximum(total, 1.0))[..., None, None])
    return matrices.reshape(*matrices.shape[:-2], MUELLER)[..., :count]
