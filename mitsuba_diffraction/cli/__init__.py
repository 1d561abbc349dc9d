"""The command `mitsuba-diffraction`: one file per sub-command, `main` around them all.

Contents
--------
main                   the parser, and the boundary at which every error becomes one line
precompute             from heights to a table
info                   what is in a file
render                 a scene to a picture
frames                 `render --frames`: pictures of a scene that changes
plan                   what a plan says, and `render --plan`
brdf_map               the hemisphere of view directions, by the BSDF or by a method
survey                 many scans: a row, a table and a map each
evaluate, sweep        the methods of the thesis
view, compare          a scene in real time, and beside the path tracer
export_viewer          a scene as a page for a browser
export_shader          a surface as GLSL for other programs
tangents               a patch laid smoothly over any mesh
tradeoff, bench        accuracy, speed and memory
workers                options of commands that may run on many processes
options                options that several commands share, declared once, and their values
arguments              types of arguments
console                lines and bars on stderr, what Mitsuba says among them
interrupts             Ctrl-C and SIGTERM
report                 output files, checked before the work; plain data as text and JSON
"""

from .console import Bar, say_error
from .main import main
from .report import check_writable

__all__ = ["Bar", "check_writable", "main", "say_error"]
