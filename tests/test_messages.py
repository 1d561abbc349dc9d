"""Messages keep what they say; only what is long in itself is cut."""

from __future__ import annotations

from mitsuba_diffraction.errors import DiffractionError


def test_what_lies_between_two_quotations_is_not_cut():
    prose = "in a sentence of many words that says what is wrong and where, " * 4
    text = f"'a file.png' is {prose}so give crop='1' or 'none'"
    assert str(DiffractionError(text)) == text


def test_a_long_quotation_is_cut_in_its_middle():
    text = str(DiffractionError(f"name='{'a b ' * 100}' is too long"))
    assert len(text) < 200
    assert text.endswith("is too long")
