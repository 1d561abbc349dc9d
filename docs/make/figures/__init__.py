"""Figures and generated parts of the documentation; each module but `pages` is a program.

Contents
--------
pictures                pictures: heights and their light, BRDF maps, the scenes' snakes
gallery                 a picture of every scene, and the pages that show them
geometry                drawing of angles, axes, grooves and window in docs/concepts.md
interfaces              docs/commands.md and docs/python.md, of the parser and the public names
long_tables             long tables of pages as CSV files beside them
presets                 balls of all presets
tables                  tables of what `bench`, `tradeoff`, `plan` and `info --energy` measured
realtime                tables of what `compare` measured
evaluation, thesis      pages about the thesis' methods: the grating equation; a table, and sweeps
cluster, wide           a film on workers; a scan of 16,384² points, whole and by windows
sheets                  transmitted orders of thin sheets, model and solution
parameters              the reference of the plugin's parameters, from its own docstring
polarised               degree of polarisation of a grating's orders
notebooks               notebooks, run anew
pages                   what they share: parts of pages, JPEG, measured patches, errors in one line
"""
