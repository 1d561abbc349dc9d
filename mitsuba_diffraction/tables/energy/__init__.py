"""How much light a table's surface reflects, and the bound that conserves energy.

Contents
--------
albedo   the directional albedo of the raw model
bound    an upper bound of it on a grid of directions
powers   powers of the orders as series in κ
"""
