"""Heights and tables that a scene names: `tables.source` with the parameters of a BSDF."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from functools import partial
from typing import Any, NamedTuple

import mitsuba as mi
import numpy as np
from numpy.typing import NDArray

from ..errors import DiffractionError, warn
from ..files import FileKind
from ..heights import HeightField, LoadOptions
from ..heights.lengths import is_auto
from ..heights.preprocess import fill_missing
from ..heights.read import fill_method, treat
from ..progress import show
from ..settings import SCENE_SETTINGS, SURFACE, checked
from ..tables import DiffractionTable, TableSource, providing
from ..tables.source import loaded_table
from .dictionary import Data
from .parameter_changes import GivenHeights
from .parameters import READING, SOURCES
from .properties import coherence_of, resolved_path
from .types import Properties

#: Mitsuba samples its spectral variants' wavelengths from here on, nm.
SHORTEST_WAVELENGTH = 360.0


class Patch(NamedTuple):
    """Table of a scene, and the heights that it is made of.

    heights : function that reads them.
    given : heights that came as `data`, which may change; None of a file or a table.
    """

    table: DiffractionTable
    heights: Callable[[], HeightField]
    given: GivenHeights | None = None


def read_patch(props: Properties, height_scale: float, stretch: float) -> Patch:
    """Get the table that a scene asks for.

    height_scale, stretch : factors on heights and lengths that the table has to serve.
    """
    names = [name for name in SOURCES if name in props]
    if len(names) != 1:
        raise DiffractionError(
            f"give exactly one of {', '.join(SOURCES)}; got {' and '.join(names) or 'none'}"
        )
    (name,) = names
    options = LoadOptions.parse(**{name: props.get(name) for name in READING if name in props})
    given = {name: props.get(name) for name in SCENE_SETTINGS if name in props}
    if coherence_of(props) == SURFACE:
        given["coherence"] = "patch"  # each window has its own speckle
    if is_auto(given.get("coherence_width", 0.0)):
        del given["coherence_width"]
    asked = {name: checked(name, value) for name, value in given.items()}
    value = props.get(name)
    if isinstance(value, Data) and not isinstance(value.value, HeightField):
        table = value.value
        if not isinstance(table, DiffractionTable):
            raise DiffractionError("a table of orders has a BSDF of its own, 'diffraction_orders'")
        shown = str(table.source.get("name") or "data")
        _check_table(table, shown, options, asked, height_scale, stretch)
        return Patch(table, partial(_no_heights, shown))
    if name == "data":
        field = _heights_of(value, options)

        def patch_of(heights: NDArray[np.float64]) -> Patch:
            given = replace(field, heights=heights)
            return _built(TableSource.of(treat(given, options)), asked, height_scale, stretch)

        def changed(heights: NDArray[np.float64]) -> Patch:
            # each step of an optimisation has others, and none of them comes back
            with providing(lambda request: request.built(request.settings)):
                return patch_of(heights)

        return patch_of(field.heights)._replace(given=GivenHeights("data", field.heights, changed))
    if not isinstance(value, str):
        raise DiffractionError(f"{name}={value!r} must be the name of a file")
    source = TableSource.of(resolved_path(value, name), options)
    if source.kind is FileKind.ORDERS:
        raise DiffractionError(
            f"'{source.path}' is a table of orders, which the BSDF 'diffraction_orders' has as its "
            "table; change the type of the BSDF, or give heights"
        )
    if source.kind is FileKind.TABLE:
        table = loaded_table(source.files[0])
        _check_table(table, str(source.path), options, asked, height_scale, stretch)
        _warn_of_limits(table, source)
        return Patch(table, partial(_field_of, source, stretch))
    return _built(source, asked, height_scale, stretch)


def _built(
    source: TableSource, asked: Mapping[str, Any], height_scale: float, stretch: float
) -> Patch:
    """Return the table of heights, from the cache or built, and the heights."""
    settings = source.settings_for(asked, height_scale)
    table = source.table(settings, height_scale=height_scale, stretch=stretch, progress=show)
    _warn_of_limits(table, source)
    return Patch(table, partial(_field_of, source, stretch))


def _field_of(source: TableSource, stretch: float) -> HeightField:
    return source.fields()[0].stretched(stretch)


def _warn_of_limits(table: DiffractionTable, source: TableSource) -> None:
    if table.limited:
        x, y = table.frequency_limit
        shown = source.path.name if source.path else source.names[0]
        warn(
            f"{shown}: the table ends at the frequencies {x:.4g} along x and "
            f"{y:.4g} rad/µm along y (frequency_limit): light that the surface sends beyond is "
            "missing"
        )


def _heights_of(data: Any, options: LoadOptions) -> HeightField:
    """Return heights (ny, nx) in µm from an array, or from `bsdf_dict`'s HeightField.

    Raises a DiffractionError if pixel_size is missing, max_height is given, or the array holds no
    heights.
    """
    for name in ("max_height", "height_unit"):
        if getattr(options, name) is not None:
            raise DiffractionError(f"{name} is for files; the heights in data are in µm already")
    if isinstance(data, Data):
        field = data.value
        assert isinstance(field, HeightField)
        if options.pixel_size not in (None, field.pixel_size):
            raise DiffractionError("pixel_size is for arrays; a HeightField has its own already")
        return field
    if options.pixel_size is None:
        raise DiffractionError("data needs pixel_size, the distance between its heights in µm")
    values = np.array(data, np.float64)
    if values.ndim == 3 and values.shape[2] == 1:
        values = values[..., 0]
    history: list[str] = []
    if values.ndim == 2:  # a HeightField refuses others
        values, line = fill_missing(values, fill_method(options), "data")
        history = [line] if line else []
    return HeightField(values, options.pixel_size, name="data", history=history)


def _no_heights(shown: str) -> HeightField:
    raise DiffractionError(
        f"'{shown}' is a table; this needs the heights it was made of, or their recipe"
    )


def _check_table(
    table: DiffractionTable, shown: str, options: LoadOptions, asked: Mapping[str, Any],
    height_scale: float, stretch: float,
) -> None:  # fmt: skip
    """Refuse parameters of a scene that contradict its table, or are beyond it."""
    tabulated = {
        "coherence_width": table.coherence_width,
        "coherence": table.coherence,
        "basis": table.expansion.basis,
        "tolerance": table.tolerance,
        "terms": table.expansion.terms,
        "windows": table.settings.windows,
    }
    for name, value in asked.items():
        if value != tabulated[name] and not (name == "basis" and value == "auto"):
            # which scenes have as a parameter of their own
            auto = ", or say coherence_width=auto" if name == "coherence_width" else ""
            raise DiffractionError(
                f"{name}={value} contradicts the table '{shown}', which has "
                f"{name}={tabulated[name]}; leave it out{auto}, or build another table with "
                f"{name}={value} (the command 'precompute')"
            )
    for name, value in options.specified().items():
        raise DiffractionError(
            f"{name}={value} is for height fields, but '{shown}' is a table and has its own; "
            f"leave {name} out, or say 'auto'"
        )
    if not mi.is_monochromatic and table.wavelength_range[0] > SHORTEST_WAVELENGTH:
        raise DiffractionError(
            f"the table '{shown}' starts at {table.wavelength_range[0]:g} nm, but Mitsuba renders "
            f"from {SHORTEST_WAVELENGTH:g} nm on; build it with "
            "wavelength_range=(360, 830) (the command 'precompute')"
        )
    if stretch > 1.0:
        raise DiffractionError(
            f"lateral_scale={stretch:g} is above 1, beyond the frequencies of the table "
            f"'{shown}'; give the height field instead of the table"
        )
    if height_scale > table.height_scale_max:
        raise DiffractionError(
            f"height_scale={height_scale:g} is beyond the table's {table.height_scale_max:g} (a "
            "coat counts as its index times the heights); give the height field instead of the "
            f"table, or build the table with height_scale_max={height_scale:.4g} or more (the "
            "command 'precompute')"
        )
