"""docs/validation/orders.md: shipped tables of solved orders."""

from __future__ import annotations

from .. import orders
from .markdown import percent, table
from .measurements import Measurements


def write(measured: Measurements) -> str:
    """Write the page."""
    rows = []
    for case in measured.solved_orders:
        for theta, phi in measured.mounts:
            model, solved = case.deviations(theta, phi)
            values = (model.colours, solved.colours, model.sum, solved.sum)
            rows.append([case.name, f"{theta}°, {phi}°", *map(percent, values)])
    header = [
        "table", "θ, φ", "colours, default", "colours, solved", "sum, default", "sum, solved",
    ]  # fmt: skip
    facts = [
        [
            case.name,
            str(case.table.header["profile"]),
            percent(case.table.header["error_mean"]),
            percent(case.table.header["error_worst"]),
            percent(case.table.header["reciprocity_error"]),
        ]
        for case in measured.solved_orders
    ]
    return f"""# Solved orders

The shipped tables of `diffraction_orders` and the default model, beside solutions that did not make
the tables ([orders.md](../orders.md)). All are aluminium; `cd` and `dvd` lie under polycarbonate.

{table(header, rows)}

θ and φ are the light's in air, φ from the direction across the grooves. Wavelengths are
{", ".join(f"{lam:g}" for lam in orders.WAVELENGTHS)} nm. The deviation of *colours* is that of all
orders but 0 that leave within 75°, as a share of their light ([validation.md](../validation.md)).
*Sum* is the largest deviation of the sum over all orders, which is 1 less the absorption.

The solver beside `cd` and `dvd` is coupled waves in layers, and beside `sinusoidal` Rayleigh's
expansion. No independent solver here converges on sloped metal for both polarisations: beside
`blazed` is the integral method at twice the points, which checks interpolation and convergence
alone.

What is left is interpolation, most of it beside surface plasmons. The tables' own figures, measured
at random directions and wavelengths:

{table(["table", "profile", "error, mean", "error, 95 %", "reciprocity"], facts)}"""
