"""List of the pages of the validation, and the function that writes them."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path

from matplotlib.figure import Figure

from docs.make.figures.long_tables import write_page
from docs.make.figures.pages import write_figure, write_text
from mitsuba_diffraction.progress import Progress, silent

from ..cases import PROBE_GRATING, Grating
from . import (
    conductor,
    front,
    gratings,
    layers,
    numerics,
    orders,
    plots,
    scans,
    solutions,
    surfaces,
    transmission,
)
from .measurements import Measurements

#: Function that writes the text of each page, by the page's name.
PAGES: dict[str, Callable[[Measurements], str]] = {
    "validation": front.write,
    "gratings": gratings.write,
    "surfaces": surfaces.write,
    "layers": layers.write,
    "transmission": transmission.write,
    "orders": orders.write,
    "conductor": conductor.write,
    "numerics": numerics.write,
    "solutions": solutions.write,
    "scans": scans.write,
}

_EXAMPLES = (
    Grating(*PROBE_GRATING),
    Grating("blazed", 2.5, 0.2),
    Grating("sinusoidal", 1.1, 0.2),
)
#: Function that draws each picture images/validation_NAME.png, by page.
_PICTURES: dict[str, tuple[str, Callable[[Measurements], Figure]]] = {
    "validation": ("slopes", lambda m: plots.slopes_figure(m.kirchhoff, m.default)),
    "conductor": ("orders", lambda m: plots.orders_figure(m.perfect, list(_EXAMPLES), 30.0)),
    "solutions": (
        "materials",
        lambda m: plots.scatter_figure({"perfect": m.perfect, **m.default}),
    ),
    "numerics": ("statistics", lambda m: plots.statistics_figure(m.statistics)),
}
_DPI = 100


def page_path(folder: Path, name: str) -> Path:
    """Path of a page of `PAGES` within the folder of the documentation."""
    return (
        folder / "validation.md" if name == "validation" else folder / "validation" / f"{name}.md"
    )


def write_report(
    folder: Path,
    names: Sequence[str] = tuple(PAGES),
    *,
    quick: bool = False,
    progress: Progress | None = None,
) -> list[Path]:
    """Write pages and their pictures.

    Parameters
    ----------
    folder : of the documentation; created if missing.
    names : of `PAGES`.
    quick : a small version for tests: one wavelength, few gratings and random surfaces.
    progress : called as progress(done, total, text).

    Returns
    -------
    Paths of the pages.
    """
    tell = progress or silent
    measured = Measurements(quick=quick)
    for path in (folder / "images", folder / "validation"):
        path.mkdir(parents=True, exist_ok=True)
    paths = []
    for n, name in enumerate(names):
        paths.append(page_path(folder, name))
        tell(n, len(names), f"writing {paths[-1].name}")
        if name in _PICTURES:
            picture, draw = _PICTURES[name]
            write_figure(folder / "images" / f"validation_{picture}.png", draw(measured), _DPI)
        text = PAGES[name](measured)
        # the front page's tables say the most
        write = write_text if name == "validation" else write_page
        write(paths[-1], text + "\n")
    tell(len(names), len(names), "done")
    return paths
