"""Notes on heights, as commands shorten them."""

from pathlib import Path

from mitsuba_diffraction.heights.read import LoadOptions
from mitsuba_diffraction.heights.source import notes_line
from mitsuba_diffraction.settings import TableSettings


def test_notes_name_their_command_and_say_in_full_that_colours_are_not_reliable():
    settings, file = TableSettings(), Path("folder/scan.txt")
    gentle = ["scan: expect colours to differ"]
    steep = [*gentle, "scan: do not rely on its colours: RMS slope 2.1"]
    line = notes_line(gentle, file, LoadOptions(), settings)
    assert "1 note" in line
    assert "mitsuba-diffraction info folder/scan.txt" in line
    assert gentle[0] not in line
    line = notes_line(steep, file, LoadOptions(), settings)
    assert line.startswith(steep[1])
    assert gentle[0] not in line
    assert "\n" not in line
