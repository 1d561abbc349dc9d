"""What native code prints is kept for the error's own line, or passed on."""

from __future__ import annotations

import os

import pytest

from mitsuba_diffraction.heights.formats.native import native_messages


def test_lines_are_caught_when_something_fails(capfd):
    def fail():
        with native_messages() as printed:
            reasons.append(printed)
            os.write(2, b"first\n/path/to/file: second\n")
            print("from Python")
            raise ValueError("boom")

    reasons = []
    with pytest.raises(ValueError, match="boom"):
        fail()
    assert reasons[0].last_reason() == "second"
    assert capfd.readouterr() == ("", "")


def test_lines_are_passed_on_when_nothing_fails(capfd):
    with native_messages():
        os.write(2, b"to error\n")
        print("to output")
    assert capfd.readouterr() == ("to output\n", "to error\n")


def test_nothing_printed_is_no_reason():
    with native_messages() as printed:
        pass
    assert printed.last_reason() == ""
