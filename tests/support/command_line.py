"""Results of the command line."""

from __future__ import annotations

from typing import NamedTuple


class Ran(NamedTuple):
    """What a run gave: exit code, stdout, stderr."""

    code: int
    out: str
    err: str

    def succeeded(self) -> Ran:
        """Check that the run succeeded; the run."""
        assert self.code == 0, self
        return self

    def failed_in_one_line(self) -> str:
        """Check that the run failed with one line on stderr and nothing else; the line."""
        assert self.code == 1, self
        assert self.out == ""
        (line,) = self.err.splitlines()
        assert line.startswith("mitsuba-diffraction: error: ")
        return line
