"""`solve_orders`: from a profile and a material to a table of orders."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.fft import dct

from ...arrays import Complex, Real
from ...errors import DiffractionError, check_choice, quoted
from ...heights import HeightField
from .. import cells
from ..cells import Counts
from ..response import ALONG, MOST_NODES, MUELLER, UNPOLARISED, Band, CellResponse
from ..table import LEAST_BLOCK, OrderTable, check_outline
from .accuracy import (
    diffuse_light,
    limited,
    measured_error,
    missed_tolerance,
    powers,
    warn_of_error,
)
from .crossed import PHI, THETA, check_cell
from .directions import solve_directions
from .films import Layers, Substance, structure_of
from .grating_index import TabulatedIndex, material_of
from .jobs import AUTO, Jobs, Problem, problem_of, solver_of
from .nodes import (
    Place,
    at_nodes,
    kinds_of,
    places_of,
)
from .profiles import Profile, UnitCell
from .resolution import (
    energy_error,
    places_to_test,
    reciprocity_error,
    resolved,
)
from .settings import Estimate, Settings, header_of, solved_stage
from .stations import Grating

#: Times that a table which misses its tolerance gets more nodes, and their factor.
REFINEMENTS, _FINER = 8, 1.4
#: Part of the tolerance that Chebyshev nodes keep: some light misses more than random light says.
_AIMED = 0.5
#: Part of the tolerance in the last terms of series, up to which more nodes gain nothing.
_WORTH = 0.25
#: Part of the error, by the last terms of series along all axes, that a refinement has less of.
_GAINED = 0.8
#: Nodes of a first table; of a block each refinement halves the distance between them.
COUNTS, BLOCK_COUNTS = Counts(4, 3, 2), Counts(9, 7, 3)
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

    A table gets more nodes until it keeps half of its tolerance, at most `REFINEMENTS` times. A
    table that misses its tolerance then is returned with a warning; the header has the error.

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
        if theta is None:
            return solve_directions(problem, (THETA, PHI), step or 20.0, how, work, {}, is_all=True)
        return solve_directions(problem, (theta, phi), step or 5.0, how, work, {})
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
        return solve_directions(problem, (theta, phi), step or 5.0, how, work, facts)
    check_outline((profile.period, math.inf), how.wavelengths, *grating.media)
    return _solve_cells(problem, how, work, facts)


def _solve_cells(
    problem: Problem, how: Settings, work: Jobs, facts: Mapping[str, Any]
) -> OrderTable:
    """Solve all directions and wavelengths."""
    grating = problem.grating
    bands = range(cells.largest_band(how.wavelengths, grating.optical_period) + 1)
    chosen = resolved(problem, work, places_to_test(bands), how.tolerance / 2)
    problem, first = chosen.problem, BLOCK_COUNTS if grating.block else COUNTS
    counts = dict.fromkeys(bands, first._replace(w=1) if grating.is_perfect else first)
    header = header_of(chosen, how) | dict(facts)
    superstrate, thin, block = grating.media
    elements = MUELLER if how.polarised else UNPOLARISED if block else ALONG
    values_of = _lossless if grating.block else partial(limited, elements)
    # light that is its own reverse, see `resolution`
    itself = [Place(k, kind, 0.5, 0.41, (0.5,)) for k in bands for kind in kinds_of(k)]
    for refinement in range(REFINEMENTS + 1):
        every = [place for k in bands for place in places_of(k, counts[k], _nodes(grating))]
        problem, solved = solved_stage(problem, work, every, _size(grating, counts, elements))
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
        header |= measured_error(table, problem, work).facts()
        missed = missed_tolerance(header, 1.0 if block else _AIMED)
        if not missed or refinement == REFINEMENTS:
            break
        finer = refined_counts(table, _WORTH * how.tolerance)
        most = max(map(max, finer.values()))
        if finer == counts or most > MOST_NODES or _size(grating, finer, elements) > MOST_BYTES:
            break
        counts = finer
    header |= {"processor_seconds": round(work.processor_seconds, 1)}
    apart, line = grating.structure.fringes(how.wavelengths[0])
    warn_of_error(header, f"; {line}" if apart < np.inf else "")
    return table


def _size(grating: Grating, counts: Mapping[int, Counts], elements: int) -> float:
    """Return the bytes of a table's numbers."""
    pairs = {k: sum((k + 1 - kind) ** 2 for kind in kinds_of(k)) for k in counts}
    return 4.0 * elements * grating.sides**2 * sum(
        math.prod(count) * pairs[k] for k, count in counts.items()
    )  # fmt: skip


def _nodes(grating: Grating) -> Callable[[int], Real]:
    """Return the nodes of a grating's table: even ones of blocks, else Chebyshev's."""
    return cells.even_nodes if grating.block else cells.nodes


def refined_counts(table: OrderTable, worth: float) -> dict[int, Counts]:
    """Return more nodes where the series of efficiencies fall off slowest.

    worth : last terms of all series over the light in orders, at which the nodes stay as they are:
        then the rest of a table's error is that of its look-up.

    Even nodes of blocks are halved in all bands, so that the old ones are nodes again. Elsewhere an
    axis of a band counts by its last two terms, and by the band's share of diffuse white light.
    """
    if table.block:
        return {band.k: Counts(*(2 * n - 1 for n in band.counts)) for band in table.bands}
    size = len(table.bands)
    band = cells.to_cell(*diffuse_light(4096, table.wavelengths), table.optical_period).band
    shares = np.bincount(np.minimum(band, size - 1), minlength=size) / len(band)
    left = [[_last_terms(kind, table.sides) for kind in band.kinds] for band in table.bands]
    most = np.array([np.max(of_band, axis=0) for of_band in left])
    most *= np.maximum(shares, 1.0 / (16 * size))[:, None]
    missed, light = most[:, :3], most[:, 3].sum()
    counts = np.array([band.counts for band in table.bands])
    largest = np.argsort(-missed, axis=None)
    enough = int(np.searchsorted(missed.ravel()[largest].cumsum(), _GAINED * missed.sum())) + 1
    finer = np.isin(np.arange(missed.size), largest[:enough]).reshape(missed.shape)
    finer &= missed.sum() > worth * light
    more = np.minimum(np.ceil(_FINER * counts), MOST_NODES).astype(int)
    counts = np.where(finer & (counts > 1), more, counts)
    return {k: Counts(*of_band) for k, of_band in enumerate(counts.tolist())}


def _last_terms(values: NDArray[np.float32], sides: int) -> list[float]:
    """Return the last two terms of series along τ, ρ and w, and the light.

    values : (τ, ρ, w, j, q, n) at Chebyshev nodes. Order 0 is white, and is left out.
    """
    coloured = values.astype(float)
    if (channels := values.shape[3] // sides) > 1:
        coloured *= 1.0 - np.tile(np.eye(channels), (sides, sides))[..., None]
    found = []
    for axis, count in enumerate(values.shape[:3]):
        terms = np.moveaxis(dct(coloured, axis=axis), axis, 0) / count
        last = np.sqrt((terms[-2:] ** 2).sum(axis=(0, -1)))
        found.append(float(last.sum(axis=-1).mean()) if count > 1 else 0.0)
    return [*found, float(coloured[..., 0].sum(axis=-1).mean())]


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
