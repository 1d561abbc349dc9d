"""Changes of parameters between renderings, and what `dr.freeze` must know of a BSDF.

A frozen function refuses arrays that it was not told of. Of a plugin written in Python, Dr.Jit sees
the attributes: arrays, lists of them and Mitsuba's own objects, but not what plain Python objects
hold. It records anew when their number or their types are others, but not when plain numbers are,
which are part of the recorded kernels: given another patch, it would go on with this one's.
"""

from __future__ import annotations

import zlib
from collections.abc import Callable, Iterator, Sequence
from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np
from numpy.typing import NDArray

from ..errors import DiffractionError
from .memory import tensor
from .types import Callback

_OURS = __name__.rpartition(".")[0]
#: Names by which Mitsuba's spectra and textures expose their values.
_VALUES = ("value", "values", "data")


class Changeable:
    """Parameter that `mi.traverse` exposes: a number, an array, or one of Mitsuba's objects.

    Of an object, a spectrum, a texture or a nested BSDF, all values are checked, kept and restored.

    Parameters
    ----------
    name : for `mi.traverse`.
    value : always the same object: Mitsuba assigns to it, or to its values.
    bounds : smallest and largest value allowed in spectra and textures; None allows any finite
        number.
    """

    def __init__(self, name: str, value: Any, bounds: tuple[float, float] | None = None) -> None:
        self.name, self.value, self._bounds = name, value, bounds
        self.keep()

    def refusal(self) -> str | None:
        """Reason why the value that was set is not allowed, or None."""
        for key, value in mi.traverse(self.value):
            numbers = _numbers(value)
            bounds = self._bounds if key.rpartition(".")[2] in _VALUES else None
            low, high = bounds or (-np.inf, np.inf)
            allowed = np.isfinite(numbers) & (numbers >= low) & (numbers <= high)
            if not allowed.all():
                range_ = f"between {low:g} and {high:g}" if bounds else "finite"
                name = self.name if key in _VALUES else f"{self.name}.{key}"
                return f"{name}={numbers[~allowed][0]:g} must be {range_}"
        return None

    def restore(self) -> None:
        """Set the value that was last kept."""
        if isinstance(self.value, mi.Object):
            kept = {key: _copy(value) for key, value in self._kept.items()}
            mi.traverse(self.value).update(kept)
        elif dr.is_array_v(self.value):
            mi.set_property(self.value, _copy(self._kept))

    def keep(self) -> None:
        """Remember the present value; a number becomes a variable of the kernels, no literal."""
        if isinstance(self.value, mi.Object):
            self._kept: Any = {key: _copy(value) for key, value in mi.traverse(self.value)}
        else:
            dr.make_opaque(self.value)
            self._kept = _copy(self.value)

    def traverse(self, callback: Callback) -> None:
        """Expose the parameter."""
        callback.put(self.name, self.value, mi.ParamFlags.Differentiable)


class GivenHeights(Changeable):
    """Heights given as `data`: another table is made where they change.

    Parameters
    ----------
    name : for `mi.traverse`.
    heights : µm, shape (ny, nx).
    make : function of heights (ny, nx), µm, that returns their patch, or raises a DiffractionError.

    Attributes
    ----------
    missing : what the surface lacks to have derivatives by heights; empty where it has them.
    """

    def __init__(
        self, name: str, heights: NDArray[np.float64], make: Callable[[NDArray[np.float64]], Any]
    ) -> None:
        super().__init__(name, tensor(heights))
        self._loaded, self._make = heights, make
        self.missing: list[str] = []
        self._first = self._served = self._numbers()
        self._served_derivatives = False

    @property
    def differentiable(self) -> bool:
        """Whether derivatives by the heights are wanted."""
        return bool(dr.grad_enabled(self.value))

    def _numbers(self) -> NDArray[Any]:
        return np.array(dr.detach(self.value))

    def made(self) -> Any:
        """Return the patch of heights that changed, or have derivatives; None of others."""
        numbers, derivatives = self._numbers(), self.differentiable
        same = np.array_equal(numbers, self._served)
        if same and not (derivatives or self._served_derivatives):
            return None
        as_loaded = np.array_equal(numbers, self._first)  # then in double precision
        made = self._make(self._loaded if as_loaded else numbers.astype(np.float64))
        self._served, self._served_derivatives = numbers, derivatives
        return made

    def refusal(self) -> str | None:
        """See `Changeable.refusal`."""
        if self.differentiable and self.missing:
            return f"{self.name} has derivatives only with {', '.join(self.missing)}"
        if self.value.shape == self._kept.shape:
            return None
        shape, kept = (" × ".join(map(str, each)) for each in (self.value.shape, self._kept.shape))
        return f"{self.name} of {shape} heights must be of {kept}, as loaded; load the plugin anew"

    def traverse(self, callback: Callback) -> None:
        """See `Changeable.traverse`."""
        flags = mi.ParamFlags
        flag = flags.NonDifferentiable if self.missing else flags.Differentiable
        callback.put(self.name, self.value, flag)


def take_changes(changed: Any, together: Sequence[Any]) -> None:
    """Accept all changes of a BSDF's parameters, or reject all.

    Raises a DiffractionError with all that is refused. Everything is then as it was before.

    Parameters
    ----------
    changed : the `base.PluginBSDF`, whose derived quantities are computed.
    together : all BSDFs that are refused together, this one among them: the surfaces of a mix.
    """
    try:
        check_parameters(together)
        changed.changed()
    except BaseException:  # an interrupted computation leaves nothing half done either
        for each in together:
            for parameter in each.parameters:
                parameter.restore()
            each.changed()
        raise
    for parameter in changed.parameters:
        parameter.keep()


def check_parameters(together: Sequence[Any]) -> None:
    """Refuse parameters that are not allowed, each by itself or with each other.

    Raises a DiffractionError with all that is refused.
    """
    if refused := [line for each in together for line in _refused(each)]:
        raise DiffractionError("; ".join(refused))


def _refused(changed: Any) -> list[str]:
    refused = [line for each in changed.parameters if (line := each.refusal())]
    return refused or [line for line in changed.refusals() if line]


def _copy(value: Any) -> Any:
    return type(value)(dr.detach(value) if dr.is_array_v(value) else value)


def _numbers(value: Any) -> NDArray[np.float64]:
    """Return all numbers of a value; none of transformations and the like."""
    if dr.is_array_v(value):
        return np.array(dr.detach(value), float).ravel()
    return np.array([value] if isinstance(value, int | float) else [], float)


def children(thing: Any) -> dict[str, Any]:
    """Return the objects that one of Mitsuba's objects shows to `traverse`, by name."""

    class Collector(mi.TraversalCallback):
        def __init__(self) -> None:
            super().__init__()
            # not in a closure: a class is in a cycle of references, which would keep them
            self.found: dict[str, Any] = {}

        def put(self, name: str, value: Any, *rest: Any) -> None:
            if isinstance(value, mi.Object):
                self.found[name] = value

    collector = Collector()
    thing.traverse(collector)
    return collector.found


def arrays_within(*holders: Any) -> list[Any]:
    """Return all Dr.Jit arrays and Mitsuba objects that objects of this folder hold, each once.

    They are the very objects, so that what Dr.Jit assigns to them the kernels see.
    """
    values: dict[int, Any] = {}
    for holder in holders:
        for value in _walk(holder, set()):
            values.setdefault(id(value), value)
    return list(values.values())


def marks(*constants: object) -> list[Any]:
    """Return zeros whose types tell apart the kernels of these constants.

    Types, because Dr.Jit compares those, and stops comparing values once they have changed.
    """
    checksum = zlib.crc32(repr(constants).encode())
    kinds = (
        mi.Bool, mi.Int32, mi.UInt32, mi.Int64, mi.UInt64, mi.Float16, mi.Float32, mi.Float64,
    )  # fmt: skip
    return [kinds[checksum >> shift & 7](0) for shift in range(0, 33, 3)]


def _walk(value: Any, seen: set[int]) -> Iterator[Any]:
    if id(value) in seen:
        return
    seen.add(id(value))
    if dr.is_array_v(value) or isinstance(value, mi.Object):
        yield value
    elif isinstance(value, list | tuple):
        for item in value:
            yield from _walk(item, seen)
    elif type(value).__module__.startswith(_OURS):
        for item in vars(value).values():
            yield from _walk(item, seen)
