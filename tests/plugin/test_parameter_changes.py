"""Changes of parameters are taken all together or not at all, whatever fails."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import mitsuba as mi
import pytest

from mitsuba_diffraction.errors import DiffractionError
from mitsuba_diffraction.plugin.parameter_changes import Bounded, ObjectValues, take_changes

pytestmark = pytest.mark.usefixtures("mono")


class Surface:
    """Two parameters whose sum must be below 3, and a derived quantity that may fail."""

    def __init__(self) -> None:
        self.number = Bounded("number", 1.0, 0.0, 2.0, lambda value: f"number={value:g}")
        self.spectrum = mi.load_dict({"type": "uniform", "value": 1.0})
        self.parameters = [self.number, ObjectValues("spectrum", self.spectrum, (0.5, 5.0))]
        self.error: BaseException | None = None
        self.derived = 0.0
        self.derive()

    def values(self) -> tuple[float, float]:
        return float(self.number.value[0]), float(mi.traverse(self.spectrum)["value"][0])

    def refusals(self) -> Iterator[str | None]:
        yield "the sum is too large" if sum(self.values()) >= 3.0 else None

    def derive(self) -> None:
        error, self.error = self.error, None
        if error is not None:
            raise error
        self.derived = sum(self.values())

    changed = derive

    def assign(self, number: float, value: float) -> None:
        mi.set_property(self.number.value, mi.Float(number))
        mi.traverse(self.spectrum).update({"value": value})


@pytest.mark.parametrize(
    ("values", "error", "named"),
    [
        ((3.0, 1.5), None, "number=3"),
        ((1.5, 0.1), None, "spectrum.value=0.1|spectrum=0.1"),
        ((float("nan"), float("inf")), None, "number=nan; spectrum"),
        ((1.6, 1.6), None, "the sum is too large"),
        ((1.2, 1.2), AssertionError("derived"), "derived"),
        ((1.2, 1.2), KeyboardInterrupt("interrupted"), "interrupted"),
    ],
)
def test_whatever_fails_the_last_values_and_what_follows_from_them_are_restored(
    values: tuple[float, float], error: BaseException | None, named: str
) -> None:
    surface, bystander = Surface(), Surface()
    together: list[Any] = [surface, bystander]
    surface.assign(1.25, 1.5)
    take_changes(surface, together)
    assert (surface.values(), surface.derived) == ((1.25, 1.5), 2.75)
    surface.assign(*values)
    bystander.assign(0.5, 0.75)
    surface.error = error
    with pytest.raises(type(error) if error else DiffractionError, match=named):
        take_changes(surface, together)
    assert (surface.values(), surface.derived) == ((1.25, 1.5), 2.75)
    assert (bystander.values(), bystander.derived) == ((1.0, 1.0), 2.0)
