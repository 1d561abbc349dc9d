"""What is measured of a surface or a scene.

Contents
--------
maps       BRDF maps: the hemisphere of view directions
survey     many scans: a row, a table and a map each
tradeoff   accuracy against speed and memory
timing     times of kernels, compared fairly
machine    description of the machine that measures
pictures   patches and albedo as pictures
design     surfaces from what they are to show, by gradients with respect to the heights
energy     how much a table reflects before and after energy is conserved
"""
