"""Figures and generated parts of the documentation; programs and their parts.

Contents
--------
pictures                pictures: heights and their light, BRDF maps, the scenes' snakes
gallery                 a picture of every scene, by the commands on its page
geometry                drawing of angles, axes, grooves and window in docs/concepts.md
interfaces              tables of commands, names, parameters and formats, from the code
long_tables             long tables of pages as CSV files beside them
presets                 balls of all presets
tables                  tables of what `bench` and commands measured
thesis, evaluation      docs/thesis.md: a table of methods, sweeps; the grating equation
cluster, wide           a film on workers; a scan of 16,384² points, whole and by windows
sheets                  transmitted orders of thin sheets, model and solution
parameters              the reference of the plugins' parameters, from their own docstrings
polarised               degree of polarisation of a grating's orders
notebooks               notebooks, run anew
pages                   what they share: parts of pages, JPEG, measured patches, errors in one line
"""
