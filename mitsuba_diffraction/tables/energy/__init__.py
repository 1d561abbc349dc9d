"""How much light a table's surface reflects and transmits, and the scales that conserve energy.

Contents
--------
settings       resolution and limits, all of them part of the cache's key
grid           the grid of directions, and functions on it
gain           factor of |a_j|² in the albedo, by model and material
transport      sums over the orders for directions of incidence
scaling        the scale of a symmetric kernel with given sums
conservation   the scale by which no more is reflected than comes in
transmission   the scale of order 0 by which reflected and transmitted light add up to 1
store          all of it in the cache
"""
