"""The command `mitsuba-diffraction`: one file per sub-command, `main` around them all.

Contents
--------
main                   the parser, and the boundary at which every error becomes one line
precompute             from heights to a table
info                   what is in a file
render                 a scene to a picture
frames                 `render --frames`: pictures of a scene that changes
plan, planned          what a plan says, and `render --plan`
brdf_map               the hemisphere of view directions, by the BSDF or by a method
survey                 many scans: a row, a table and a map each
evaluate, sweep        the methods of the thesis
view, compare          a scene in real time, and beside the path tracer
export_viewer          a scene as a page for a browser
tangents               a patch laid smoothly over any mesh
tradeoff, bench        accuracy, speed and memory
patch                  the one patch of a command that needs heights
workers                options of commands that may run on many processes
options                options that several commands share, each declared once
arguments              types of arguments
output                 output files, checked before the work
progress               bars
console                lines on stderr, Mitsuba's among them
interrupts             Ctrl-C and SIGTERM
report                 nested plain data as text
"""

from .console import say_error
from .main import main
from .output import check_writable
from .progress import Bar

__all__ = ["Bar", "check_writable", "main", "say_error"]
