"""`solve_block`: orders of the upper face of a clear block, in light from outside and from within.

The grating is solved upside down, with the block above: the block has more channels, and light of
the rarer medium has some of them (`tables.orders.blocks`). Coupled waves solve both at once; they
conserve the energy of clear materials to rounding.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping

import numpy as np

from ..errors import DiffractionError, check_choice
from ..tables.orders import Band, OrderTable, cells
from ..tables.orders.blocks import even_nodes, factors
from ..tables.orders.table import Counts, check_outline
from .accuracy import measured_error, powers
from .grating_index import TabulatedIndex, material_of
from .jobs import AUTO, Jobs, problem_of
from .nodes import Place, at_nodes, kinds_of, places_of
from .orders import (
    REFINEMENTS,
    Estimate,
    Settings,
    announce_stage,
    conclude,
    header_of,
    silent,
)
from .profiles import Profile
from .resolution import places_to_test, resolved
from .sheet import check_clear
from .stations import Complex, Grating, Real

#: Nodes of the first table; each refinement halves the distance between them.
COUNTS = Counts(9, 7, 3)
#: Efficiencies of a refined table at most, of which the renderer takes eight bytes each.
_MOST_VALUES = 1 << 25


def solve_block(
    profile: Profile,
    material: str | float | complex | TabulatedIndex,
    *,
    settings: Settings | None = None,
    jobs: Jobs | None = None,
    announce: Callable[[Estimate], None] = silent,
) -> OrderTable:
    """Solve the orders of a block with a profile on its upper face, on both sides.

    Raises a DiffractionError if an argument is out of its range, the material is not clear, the
    profile is undercut, or the measured error of the table is above the tolerance after two
    refinements.

    Parameters
    ----------
    profile : one period of the grooves, from `solve.profiles`, with the block below it.
    material : index of the block relative to the medium above, a real number of 1.01 to 5.
    settings : wavelengths, tolerance, resolution; the method is "coupled".
    jobs, announce : as for `solve_orders`.
    """
    how, work = settings or Settings(), jobs or Jobs()
    check_choice("method", how.method, (AUTO, "coupled"))
    substance = material_of(material, how.wavelengths)
    check_clear(substance, how.wavelengths)
    known = substance.index(np.asarray(how.wavelengths))
    assert known is not None
    index = float(known[0].real)
    check_outline(profile.period, how.wavelengths, 1.0, block=index)
    if how.polarised:
        raise DiffractionError(
            "polarised: tables of blocks have efficiencies alone; leave out polarised, or block"
        )
    if (np.diff(profile.x) < 0).any():
        raise DiffractionError(
            f"{profile.name} is undercut: blocks are solved by coupled waves, whose lines never "
            "turn back; use another profile"
        )
    turned = Profile(profile.x, -profile.z, profile.period, profile.name)
    around = material_of(1.0, how.wavelengths)
    grating = Grating(turned, around, index, how.wavelengths, block=True)
    bands = range(cells.largest_band(how.wavelengths, grating.optical_period) + 1)
    problem = problem_of(grating, "coupled", how.resolution or 0)
    chosen = resolved(problem, work, places_to_test(bands), how.tolerance / 2)
    problem, counts = chosen.problem, COUNTS
    header = header_of(chosen, how) | {"material": substance.name}
    for refinement in range(REFINEMENTS + 1):
        places = [place for band in bands for place in places_of(band, counts, even_nodes)]
        announce_stage(announce, "solving", problem, work, places)
        solved = work.amplitudes(problem, places, "solving orders")
        made = tuple(_band(grating, band, counts, solved) for band in bands)
        table = OrderTable(profile.period, how.wavelengths, made, header=header, block=index)
        error = measured_error(table, problem, work)
        finer = Counts(*(2 * n - 1 for n in counts))
        size = table.nbytes // 4 * np.prod(finer) // np.prod(counts)
        if error.within(how.tolerance) or refinement == REFINEMENTS or size > _MOST_VALUES:
            break
        counts = finer
    header["reciprocity_error"] = table.reciprocity
    conclude(header, error, how, work)
    return table


def _band(grating: Grating, band: int, counts: Counts, solved: Mapping[Place, Complex]) -> Band:
    """Assemble a band from its stations."""
    places = places_of(band, counts, even_nodes)
    moved = {place: solved[place] * _to_node(grating, place) for place in places}
    kinds = []
    for kind in kinds_of(band):
        values = at_nodes(kind, places, counts, moved, 2, powers)
        kinds.append(_lossless(values.astype(np.float64)).astype(np.float32))
    return Band(band, *kinds)


def _lossless(values: Real) -> Real:
    """Return efficiencies (…, j, q, 2) whose mirror's order has the remainder of each port."""
    port = np.arange(values.shape[-2])
    lit = values.sum(axis=-2) > 0.0
    others = values.copy()
    others[..., port, port, :] = 0.0
    others /= np.maximum(others.sum(axis=-2, keepdims=True), 1.0)
    others[..., port, port, :] = np.maximum(lit - others.sum(axis=-2), 0.0)
    return others


def _to_node(grating: Grating, place: Place) -> Real:
    """Return factors (w, j, 1, q, 1) from amplitudes of a station to amplitudes of its node.

    Stations keep a distance from grazing; their reduced efficiencies are taken for the node's.
    """
    index, optical = grating.superstrate, grating.optical_period
    station = grating.station(*place)
    c, y = np.sqrt(1.0 - station.along[:, None] ** 2), station.along[:, None]
    solved = factors(index * c * station.sines, index * y, index).scale
    big_k = place.band + cells.sine_squared(place.rho)
    lam = cells.wavelength_of(big_k, place.w, grating.wavelengths, optical)[:, None]
    channels = np.arange(station.channels)
    node = cells.from_cell(place.band, place.kind, channels, place.tau, place.rho, lam, optical)
    wanted, known = factors(index * node.x, index * node.y, index)
    ratio = np.where(known, wanted / np.where(known, solved, 1.0), 1.0)
    return np.sqrt(ratio)[:, :, None, :, None]
