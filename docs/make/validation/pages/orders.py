"""docs/validation/orders.md: shipped tables of solved orders."""

from __future__ import annotations

from .. import orders, stacks
from ..published import Published
from .markdown import percent, table
from .measurements import Measurements


def write(measured: Measurements) -> str:
    """Write the page."""
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
    diffuse = [
        [case.name, row.light, *map(percent, row[1:])]
        for case in measured.solved_orders
        for row in case.diffuse(measured.diffuse_samples)
    ]
    header = ["table", "light", "colours", "absorbed", "bias", "mean", "95 %", "largest"]
    return f"""# Solved orders

The shipped tables of `diffraction_orders` and the default model, beside independent solutions
([orders.md](../orders.md)). All are aluminium; `cd` and `dvd` are lamellar, under polycarbonate.

{_deviations(measured)}

θ and φ are the light's in air, φ from the direction across the grooves. Wavelengths are
{", ".join(f"{lam:g}" for lam in orders.WAVELENGTHS)} nm. [Colours](../validation.md) are all orders
but 0 within 75°; *sum* is the largest deviation of the sum over all orders.

The tables come from a boundary integral method. The other solvers are coupled waves (`cd`, `dvd`)
and Chandezon's method (`blazed`, `sinusoidal`).

## Side by side

Order 0, and the strongest other order within 75°, at {orders.SHOWN:g} nm; unpolarised light.

{_side_by_side(measured)}

## Interpolation

The tables beside their own solver, at {measured.diffuse_samples}
random directions of diffuse light and wavelengths.
*Absorbed* is the share of light in no order, *bias* the relative deviation
of its mean, followed by its deviation as a share of the incident light.

{table(header, diffuse)}

The largest deviations lie beside surface plasmons, which are narrower than the distance of nodes.
Errors that the tables state, of colours in all light within the layer:

{table(["table", "profile", "error, mean", "error, 95 %", "reciprocity"], facts)}

## Published efficiencies

Numbers in print: s and p across the grooves, u unpolarised. The tolerance is the rounding of the
printed digits, or the error of the printed method.

{_published(measured.published)}

## Films, layers, blocks and crossed gratings

{_stacks(measured)}

Measured gratings: [measured.md](measured.md)."""


def _deviations(measured: Measurements) -> str:
    rows = []
    for case in measured.solved_orders:
        for theta, phi in measured.mounts:
            model, solved = case.deviations(theta, phi)
            values = (model.colours, solved.colours, model.sum, solved.sum)
            rows.append([case.name, f"{theta}°, {phi}°", *map(percent, values)])
    header = [
        "table", "θ, φ", "colours, default", "colours, solved", "sum, default", "sum, solved",
    ]  # fmt: skip
    return table(header, rows)


def _side_by_side(measured: Measurements) -> str:
    rows = []
    for case in measured.solved_orders:
        for theta, phi in measured.mounts:
            for order in case.side_by_side(theta, phi):
                number = f"{order.order}".replace("-", "−")
                values = [f"{v:.4f}" for v in (order.model, order.table, order.truth)]
                rows.append([case.name, f"{theta}°, {phi}°", number, *values])
    return table(["table", "θ, φ", "order", "default", "solved", "truth"], rows)


def _published(cases: tuple[Published, ...]) -> str:
    parts = []
    for case in cases:
        solved = [(solver.name, case.solved(solver)) for solver in case.solvers()]
        rows = [
            [f"{m}, {name}".replace("-", "−"), f"{printed:g}"]
            + [f"{values[m, name]:.5f}" for _, values in solved]
            for (m, name), printed in case.printed.items()
        ]
        header = ["order", "printed", *(name for name, _ in solved)]
        parts.append(
            f"{case.source}: {case.grating}; tolerance {case.tolerance:g}.\n\n{table(header, rows)}"
        )
    return "\n\n".join(parts)


def _stacks(measured: Measurements) -> str:
    rows = [
        [row.case, row.light, f"{row.found:.5f}", f"{row.truth:.5f}", row.beside]
        for row in stacks.compared(measured.quick)
    ]
    return table(["surface", "light", "solved", "truth", "by"], rows)
