"""Densities in spatial frequency to draw directions from.

Contents
--------
proposals       densities of a table
order_mixture   the orders as a few strong ones and a density
"""
