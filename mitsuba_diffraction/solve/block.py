"""`solve_block`: orders of the upper face of a clear block, in light from outside and from within.

The grating is solved upside down, with the block above: the block has more channels, and light of
the rarer medium has some of them (`tables.orders.blocks`). Coupled waves solve both at once; they
conserve the energy of clear materials to rounding.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from ..errors import DiffractionError, check_choice
from ..tables.orders import Band, OrderTable, cells
from ..tables.orders.blocks import even_nodes, factors
from ..tables.orders.table import Counts, check_outline
from .accuracy import SAMPLES, Measured, diffuse_light, powers
from .grating_index import Material, material_of
from .jobs import AUTO, Jobs, Problem, problem_of, solver_of
from .nodes import Place
from .orders import REFINEMENTS, Estimate, Settings, announce_stage, refuse_or_warn, silent
from .profiles import Profile
from .resolution import Chosen, chosen_resolution, places_to_test, resolution_error
from .sheet import check_clear
from .stations import Complex, Grating, Real, reversed_light

#: Nodes of the first table; each refinement halves the distance between them.
COUNTS = Counts(9, 7, 3)
#: Efficiencies of a refined table at most, of which the renderer takes eight bytes each.
_MOST_VALUES = 1 << 25


def solve_block(
    profile: Profile,
    material: str | float | complex | Material,
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
    tested = places_to_test(bands)
    if how.resolution is None:
        chosen = chosen_resolution(problem, work, tested, how.tolerance / 2)
    else:
        chosen = Chosen(problem, resolution_error(problem, work, tested))
    problem, counts = chosen.problem, COUNTS
    header: dict[str, Any] = {
        "solver": solver_of(problem).name,
        "material": substance.name,
        "profile": profile.name,
        "depth": profile.depth,
        "solver_error": chosen.error,
        "tolerance": how.tolerance,
    }
    for refinement in range(REFINEMENTS + 1):
        places = [place for band in bands for place in _places(band, counts)]
        announce_stage(announce, "solving", problem, work, places)
        solved = work.amplitudes(problem, places, "solving orders")
        made = tuple(_band(grating, band, counts, solved) for band in bands)
        table = OrderTable(profile.period, how.wavelengths, made, header=header, block=index)
        error = _measured(table, problem, work)
        finer = Counts(*(2 * n - 1 for n in counts))
        size = table.nbytes // 4 * np.prod(finer) // np.prod(counts)
        if error.within(how.tolerance) or refinement == REFINEMENTS or size > _MOST_VALUES:
            break
        counts = finer
    header |= {
        "error_mean": error.mean, "error_worst": error.most,
        "reciprocity_error": table.reciprocity,
        "processor_seconds": round(work.processor_seconds, 1),
    }  # fmt: skip
    if not error.within(how.tolerance):
        refuse_or_warn(error, how)
    return table


def _places(band: int, counts: Counts) -> list[Place]:
    """Return the stations of a band, up to τ = ½; reciprocity gives the others."""
    tau, rho, w = (even_nodes(n).tolist() for n in counts)
    return [
        Place(band, kind, t, r, tuple(w))
        for kind in ((cells.A, cells.B) if band else (cells.A,))
        for t in tau[: (counts.tau + 1) // 2]
        for r in rho
    ]


def _band(grating: Grating, band: int, counts: Counts, solved: Mapping[Place, Complex]) -> Band:
    """Assemble a band from its stations."""
    kinds = []
    places = _places(band, counts)
    for kind in (cells.A, cells.B) if band else (cells.A,):
        of_kind = [
            solved[place] * _to_node(grating, place) for place in places if place.kind == kind
        ]
        half = np.concatenate([powers(values) for values in of_kind])
        back = np.concatenate([powers(reversed_light(values, 2)) for values in of_kind])
        half, back = (values.reshape(-1, *counts[1:], *half.shape[1:]) for values in (half, back))
        middle = 0.5 * (half[-1:] + back[-1:])  # its own reverse
        whole = np.concatenate([half[:-1], middle, back[:-1][::-1]])
        kinds.append(_lossless(whole).astype(np.float32))
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


def _measured(table: OrderTable, problem: Problem, jobs: Jobs) -> Measured:
    """Compare a table with solutions at random directions within and above, by turns.

    Light in all orders but 0; where order 0 is alone, light that goes through.
    """
    assert table.block is not None
    x, y, lam = diffuse_light(SAMPLES, table.wavelengths)
    cell = cells.to_cell(x, y, lam, table.optical_period)
    w = cells.w_of(cell.k_continuous, lam, table.wavelengths, table.optical_period)
    rows = zip(cell.band, cell.kind, cell.tau, cell.rho, w, strict=True)
    places = [
        Place(int(k), int(kind), float(tau), float(rho), (float(at),))
        for k, kind, tau, rho, at in rows
    ]
    solved = jobs.solve(problem, places, "measuring the error")
    missed, light = np.zeros(SAMPLES), np.zeros(SAMPLES)
    for n, place in enumerate(places):
        j, count = int(cell.channel[n]), int(cell.channels[n])
        within = n % 2 == 0 or table.block * np.hypot(x[n], y[n]) >= 1.0
        port = j if within else count + j
        truth = _unpolarised(solved[place])[port]
        orders = j - np.arange(count)
        place_of = table.block * x[n], table.block * y[n], lam[n]
        got = np.concatenate(
            [
                table.efficiency(*place_of, orders, from_below=within, transmitted=within != side)
                for side in (True, False)
            ]
        )
        others = np.tile(orders != 0, 2) if count > 1 else np.arange(2) != port
        missed[n], light[n] = np.abs(got - truth)[others].sum(), truth[others].sum()
    floor = 0.05 * light.mean()
    return Measured(
        float(missed.sum() / light.sum()),
        float(np.quantile(missed / np.maximum(light, floor), 0.95)),
        np.bincount(cell.band, missed, len(table.bands)) / light.sum(),
        None,
    )


def _unpolarised(values: Real) -> Real:
    """Return efficiencies (ports, ports) of a station of one wavelength, (1, j, 2, q, 2)."""
    return np.asarray(values[0].sum(axis=3).mean(axis=1))
