"""List of the pages of the validation, and the function that writes their parts."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from matplotlib.figure import Figure

from docs.make.figures import long_tables, pages

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

#: Function that makes the parts of each page, by the page's name.
PAGES: dict[str, Callable[[Measurements], dict[str, str]]] = {
    "validation": front.parts,
    "gratings": gratings.parts,
    "surfaces": surfaces.parts,
    "layers": layers.parts,
    "transmission": transmission.parts,
    "orders": orders.parts,
    "conductor": conductor.parts,
    "numerics": numerics.parts,
    "solutions": solutions.parts,
    "scans": scans.parts,
}

_EXAMPLES = (
    Grating(*PROBE_GRATING),
    Grating("blazed", 2.5, 0.2),
    Grating("sinusoidal", 1.1, 0.2),
)
#: Function that draws each picture images/validation_NAME.png, by page.
_PICTURES: dict[str, tuple[str, Callable[[Measurements], Figure]]] = {
    "validation": ("slopes", lambda m: plots.slopes_figure(m.gratings)),
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


def write(folder: Path, name: str, measured: Measurements) -> Path:
    """Write the parts of a page and its picture, and return the page's path.

    folder : of the documentation, with the pages.
    """
    path = page_path(folder, name)
    if name in _PICTURES:
        picture, draw = _PICTURES[name]
        pages.write_figure(folder / "images" / f"validation_{picture}.png", draw(measured), _DPI)
    # the front page's tables say the most
    update = pages.update if name == "validation" else long_tables.update
    update(path, PAGES[name](measured))
    return path
