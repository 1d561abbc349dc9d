"""Figures and generated parts of the documentation; each module is a function and a program.

Contents
--------
patches, maps, snakes   pictures: heights and their light, BRDF maps, the scenes' snakes
gallery                 a picture of every scene, and the pages that show them
evaluation, sweeps      pages about the methods: the grating equation, one parameter at a time
methods                 the table of docs/methods.md
speed, tradeoff         tables of what `bench` and `tradeoff` measured
realtime, plan          tables of what `compare` and `plan` measured
energy                  the table of what `info --energy` found
cluster, wide           a film on workers; a scan of 16,384² points, whole and by windows
parameters              the reference of the plugin's parameters, from its own docstring
notebooks               notebooks, run anew
albedo                  the plot of `info --albedo`
markers                 parts of a page, found and replaced
jpeg                    renderings as JPEG
program                 what these programs share
"""
