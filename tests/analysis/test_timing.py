"""Timed calls take turns, and their ratios do not depend on background load."""

from __future__ import annotations

from mitsuba_diffraction.analysis.timing import ratio, rounds_of


def test_every_round_goes_through_all_calls():
    order = []
    calls = {name: lambda name=name: order.append(name) or float(len(order)) for name in "abc"}
    seconds = rounds_of(calls, 3, lambda done, total: None)
    assert order == list("abc") * (len(order) // 3)
    assert [len(elapsed) for elapsed in seconds.values()] == [3, 3, 3]


def test_ratios_do_not_depend_on_a_slow_round():
    # the machine was ten times slower in the second round, for both
    assert ratio([2.0, 20.0, 2.0], [1.0, 10.0, 1.0]) == 2.0
