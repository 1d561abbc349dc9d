"""`mitsuba-diffraction orders`: efficiencies and Jones matrices of a table's orders."""

from __future__ import annotations

import argparse
from pathlib import Path

import numpy as np

from ..errors import counted
from . import options
from .report import Figures, output_of
from .values import number_between, numbers, path_ending_in


@options.command(
    "orders", "efficiencies of solved orders as a CSV",
    "List the efficiencies of a table's orders, a line for each order that propagates: "
    "wavelength, direction to the light within the superstrate, order, and the reflected share "
    "of s and of p light; a thin sheet also has the transmitted shares. "
    "'solve --import' reads the file back.",
    ("TABLE", "of orders (.nc), from 'mitsuba-diffraction solve'", Path),
    ("-o --output OUT", "the CSV, or NetCDF (.nc); default: TABLE's name with .csv in the "
     "current folder", path_ending_in(".csv", ".nc")),
    options.Group("the light", (
        ("--theta DEG", "angles of the light from the normal, -90 to 90; e.g. 30, or "
         "--theta=-85:85:5; default: 0", numbers, (0.0,)),
        ("--phi DEG", "azimuths of the light, from x, across the grooves, towards y; default: 0",
         numbers, (0.0,)),
        options.Group("", (
            ("--wavelength NM", "wavelengths in vacuum, e.g. 400:700:20", numbers),
            ("--step NM", "between wavelengths, over all of the table",
             number_between(0.01, 1000), 5.0),
        )),
        options.Group("", (
            ("--polarised", "shares of s and of p light; default: both are the share of "
             "unpolarised light", bool),
            ("--jones", "Jones matrices about s and p, of a table of 'solve --polarised', for ray "
             "tracers, with the phase of the order at light of 'solve --theta'; elsewhere J_ss is "
             "real, and has_phase 0", bool),
        )),
    ), "Values, or FIRST:LAST:STEP, several joined by commas."),
    options.json("the lines"),
)  # fmt: skip
def run(args: argparse.Namespace) -> Figures:
    """List the orders, and return the figures."""
    from ..orders.file import load_orders
    from ..orders.listing import WITH_PHASE, list_orders

    output = output_of(args, Path(f"{args.table.stem}.csv"))
    table = load_orders(args.table)
    low, high = table.wavelengths
    steps = max(int(np.ceil((high - low) / args.step - 1e-9)), 1)
    wavelengths = args.wavelength or np.linspace(low, high, steps + 1)
    listing = list_orders(
        table, wavelengths, args.theta, args.phi, polarised=args.polarised, jones=args.jones
    )
    listing.save(output)
    rows = listing.rows
    light = "s and p" if args.polarised else "unpolarised light"
    if args.jones:
        known = int(rows[:, listing.columns.index(WITH_PHASE)].sum())
        light = f"Jones matrices, {known} with the phase of their order"
        if known < len(rows):
            light += " (solve --polarised --theta --phi --step has it at the light that it lists)"
    print(
        f"{args.table} -> {output}: {counted(len(rows), 'line')}, "
        f"{counted(len(np.unique(rows[:, 0])), 'wavelength')}, "
        f"{counted(len(np.unique(rows[:, 1:3], axis=0)), 'direction')}, {listing.orders}, {light}"
    )
    return {"file": str(output), "columns": listing.columns, "lines": rows.tolist()}
