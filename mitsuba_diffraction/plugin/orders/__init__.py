"""The BSDF `diffraction_orders`: gratings whose orders were solved (Dr.Jit).

Contents
--------
bsdf        `DiffractionOrders`: reflection
sheet       `OrdersSheet`: both sides of a thin sheet; and the plugin, which is one of the two
parameters  parameters of the plugin, read from Mitsuba's Properties and checked
lookup      a table of orders inside a kernel
polarised   Mueller matrices in polarised variants
lobes       light of all orders in a variant's channels, and directions drawn by it
"""
