"""How much light a table's surface reflects and transmits, and the scales that conserve energy.

Contents
--------
conservation   scales by which no more light is sent on than comes in, computed and cached
conserved      reflectors, and dielectrics that let light through: the paths of their light
transport      sums over the orders for directions of incidence
gain           factor of |a_j|² in the power of an order, by path, model and material
scaling        the scale of a symmetric kernel with given sums
settings       resolution and limits, all of them part of the cache's key
"""

__all__ = ["conservation", "conserved", "settings"]
