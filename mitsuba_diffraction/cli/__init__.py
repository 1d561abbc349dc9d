"""The command `mitsuba-diffraction`: its sub-commands, `main` around them all.

Contents
--------
main                   the parser, and the boundary at which every error becomes one line
precompute             from heights to a table
info                   summary of a file
tangents               a patch laid smoothly over any mesh
solve                  orders of a periodic profile
orders                 efficiencies of solved orders as a CSV
presets                the presets of --preset
hologram               a logo as textures and a scene
plan                   recipes of smaller tables, and `render --plan`
render                 a scene to a picture; `render --frames`: pictures of a scene that changes
animation              options of `render --frames`, and reasons to render frames again
studio                 light, material and camera of a mesh in a few words: `render --env`, …
observed               `render --observer`: quantum catches of an animal's receptors
tonemap                a linear EXR to a PNG
brdf_map               the hemisphere of view directions, by the BSDF or by a method
spectrum               reflectance spectra as a spectrometer measures them
measured_spectra       spectra of files of `spectrum`: tables, scans and their crops
evaluate, sweep        the methods of the thesis
survey                 many scans: a row, a table and a map each
scatter                power spectrum and scatter of a rough mirror
tradeoff               accuracy against speed and memory
realtime               `view` and `compare`, `export-viewer` and `export-shader`: drawn by shaders
export_bsdf            a surface's BRDF for other programs
export_osl             a surface as a shader for Blender's Cycles
spellings              spellings of the version before: each still works, with one line
options                options that several commands share, declared once
values                 types of values on the command line
arguments              files that a command line names, noted as inputs
scene_options          the scene, its parameters and materials; a mesh on a stage; its rendering
workers                options of commands that may run on many processes
console                lines and bars on stderr, and Mitsuba's among them
interrupt              Ctrl-C and SIGTERM
report                 output files, checked before the work; figures as text, JSON and pictures
"""

from .console import Bar, say_error
from .main import build_parser, main
from .report import check_outputs, save_json

__all__ = ["Bar", "build_parser", "check_outputs", "main", "save_json", "say_error"]
