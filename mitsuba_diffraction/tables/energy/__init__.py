"""How much light a table's surface reflects, and what conserves energy.

Contents
--------
gain           what becomes of one order's light, by model and material
transport      the albedo of one wavelength, as a linear map of weights of directions
conservation   the scale by which no more is reflected than comes in
fit            a scale fitted where albedos are looked at, at its nodes and amid them
grating        orders on one line, and a grid with its nodes where they come up
chains         the scale of a grating, solved exactly between few directions
grid           the grid of directions
powers         powers of the orders as series in κ
links          what becomes of one order's light between the sides of a dielectric
sums           R + T as a linear map of weights, and the scales that bring it near 1
sheet          the same of a sheet that is a grating, chain by chain
between        R + T amid the nodes of a scale: what is too much there, and what lacks
sides          R + T of a dielectric, and the scale and the spread light that make it 1
film           what a thin film makes of the second order's mean
store          what conserves energy, in the cache
"""
