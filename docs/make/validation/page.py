"""docs/validation.md, written as a whole: comparisons, pictures and text."""

from __future__ import annotations

import io
from pathlib import Path

from matplotlib.figure import Figure

from mitsuba_diffraction.atomic import atomic_path
from mitsuba_diffraction.progress import Progress, silent

from . import (
    coated,
    factored,
    filmed,
    goals,
    models,
    passed,
    patch_sections,
    plots,
    second_order,
    sections,
    statistics,
)
from .cases import FEW_WAVELENGTHS, MATERIALS, PROBE_GRATING, Grating
from .compare import Comparison, compare
from .patches import KINDS
from .solutions import Solutions, shipped

#: Period and depth (µm) of the gratings that closed forms are checked for.
_IDEAL = ((1.1, 0.4), (2.5, 0.1), (5.0, 0.4))

_STEPS = 6
_DPI = 100


def write_report(folder: Path, *, quick: bool = False, progress: Progress | None = None) -> Path:
    """Write validation.md and images/validation_*.png into a folder; about two minutes.

    Parameters
    ----------
    folder : made if it is missing.
    quick : a small version for tests: one wavelength, fewer gratings and random surfaces.
    progress : called as progress(done, total, text).

    Returns
    -------
    The page.
    """
    tell = progress or silent
    images = folder / "images"
    images.mkdir(parents=True, exist_ok=True)
    comparisons: dict[str, Comparison] = {}
    for n, material in enumerate(MATERIALS):
        tell(n, _STEPS, f"comparing with {material}")
        every = shipped(material)
        comparisons[material] = compare(material, _at_one_wavelength(every) if quick else every)
    tell(3, _STEPS, "random surfaces")
    measured = statistics.measure(*((15, 80) if quick else (200, 2000)))
    perfect = comparisons["perfect"]
    sides = models.compare_all(_few(comparisons) if quick else comparisons)
    kirchhoff, default = (
        {material: sides[material, model] for material in models.MATERIALS}
        for model in ("kirchhoff", "small_slope")
    )

    tell(4, _STEPS, "drawing")
    examples = [
        Grating(*PROBE_GRATING),
        Grating("blazed", 2.5, 0.2),
        Grating("sinusoidal", 1.1, 0.2),
    ]
    figures = {
        "slopes": plots.slopes_figure(kirchhoff, default),
        "orders": plots.orders_figure(perfect, examples, 30.0),
        "materials": plots.scatter_figure([perfect, *default.values()]),
        "statistics": plots.statistics_figure(measured),
    }
    for name, figure in figures.items():
        _write_figure(figure, images / f"validation_{name}.png")

    tell(5, _STEPS, "writing")
    kinds = KINDS[:1] if quick else KINDS
    text = [
        sections.introduction(),
        models.section(sides),
        goals.section(sides),
        patch_sections.section(
            [c for material in models.MATERIALS for c in patch_sections.compared(material, kinds)]
        ),
        second_order.section(quick=quick),
        factored.section(sides, quick=quick),
        sections.slopes(kirchhoff, default),
        sections.edges(kirchhoff, default),
        coated.section(coated.GRATINGS[:1] if quick else coated.GRATINGS),
        filmed.section(filmed.STACKS[:1] if quick else filmed.STACKS),
        passed.section(passed.GRATINGS[:1] if quick else passed.GRATINGS),
        sections.probe(perfect),
        sections.polarisation(perfect),
        sections.solutions(comparisons, patch_sections.second_solver()),
        sections.closed_forms(_IDEAL[1:2] if quick else _IDEAL),
        sections.random_surfaces(measured),
    ]
    page = folder / "validation.md"
    with atomic_path(page) as temporary:
        temporary.write_text("\n\n".join(text) + "\n", encoding="utf-8")
    tell(_STEPS, _STEPS, "done")
    return page


def _at_one_wavelength(solutions: Solutions) -> Solutions:
    return solutions.where(wavelength=FEW_WAVELENGTHS[0])


def _few(comparisons: dict[str, Comparison]) -> dict[str, Comparison]:
    return {name: part.where(period=2.5, depth=0.1) for name, part in comparisons.items()}


def _write_figure(figure: Figure, path: Path) -> None:
    # without the name of the software that wrote it, equal pictures are equal files
    buffer = io.BytesIO()
    figure.savefig(buffer, format="png", dpi=_DPI, metadata={"Software": None})
    with atomic_path(path) as temporary:
        temporary.write_bytes(buffer.getvalue())
