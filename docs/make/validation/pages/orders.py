"""Parts of docs/validation/orders.md: shipped tables of solved orders."""

from __future__ import annotations

from collections.abc import Sequence

from .. import orders, stacks
from ..compare import Comparison
from ..published import PUBLISHED, Published
from .markdown import percent, table
from .measurements import Measurements


def parts(measured: Measurements) -> dict[str, str]:
    """Return the parts of the page by name."""
    cases = [orders.Shipped(name) for name in orders.TABLES[: measured.most(1)]]
    mounts = orders.MOUNTS[: measured.most(1)]
    samples = measured.most(4) or orders.SAMPLES
    diffuse = [
        [case.name, light, *map(percent, values)]
        for case in cases
        for light, values in case.diffuse(samples)
    ]
    header = ["table", "light", "colours", "absorbed", "bias", "mean", "95 %", "largest"]
    return {
        "solved-orders": _deviations(cases, mounts),
        "wavelengths": ", ".join(f"{lam:g}" for lam in orders.WAVELENGTHS),
        "shown": f"{orders.SHOWN:g}",
        "side-by-side": _side_by_side(cases, mounts),
        "samples": f"{samples}",
        "interpolation": table(header, diffuse),
        "published-efficiencies": _published(PUBLISHED[1:2] if measured.quick else PUBLISHED),
        "films-layers-blocks-and-crossed-gratings": _stacks(measured),
    }


def _deviations(cases: Sequence[orders.Shipped], mounts: Sequence[tuple[int, int]]) -> str:
    rows = []
    for case in cases:
        for theta, phi in mounts:
            parts = case.compared(theta, phi)
            colours = [part.deviation(colours=True) for part in parts]
            sums = [max(map(_sum_missed, part.each())) for part in parts]
            rows.append([case.name, f"{theta}°, {phi}°", *map(percent, (*colours, *sums))])
    header = [
        "table", "θ, φ", "colours, default", "colours, solved", "sum, default", "sum, solved",
    ]  # fmt: skip
    return table(header, rows)


def _sum_missed(part: Comparison) -> float:
    """Deviation of the sum over all orders."""
    return abs(float((part.model - part.rigorous).sum()))


def _side_by_side(cases: Sequence[orders.Shipped], mounts: Sequence[tuple[int, int]]) -> str:
    rows = []
    for case in cases:
        for theta, phi in mounts:
            for order, values in case.side_by_side(theta, phi):
                number = f"{order}".replace("-", "−")
                rows.append([case.name, f"{theta}°, {phi}°", number, *(f"{v:.4f}" for v in values)])
    return table(["table", "θ, φ", "order", "default", "solved", "truth"], rows)


def _published(cases: tuple[Published, ...]) -> str:
    rows = []
    for case in cases:
        solved = [(solver.name, case.solved(solver)) for solver in case.solvers()]
        for (m, name), printed in case.printed.items():
            order = f"{m}, {name}".replace("-", "−")
            known = (case.source, case.grating, f"{case.tolerance:g}", order, f"{printed:g}")
            rows += [[*known, solver, f"{values[m, name]:.5f}"] for solver, values in solved]
    header = ["source", "grating", "tolerance", "order", "printed", "solver", "solved"]
    return table(header, rows)


def _stacks(measured: Measurements) -> str:
    rows = [
        [row.case, row.light, f"{row.found:.5f}", f"{row.truth:.5f}", row.beside]
        for row in stacks.compared(measured.quick)
    ]
    return table(["surface", "light", "solved", "truth", "by"], rows)
