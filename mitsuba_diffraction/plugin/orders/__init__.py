"""The BSDF `diffraction_orders`: gratings whose orders were solved (Dr.Jit).

Contents
--------
diffraction_orders  `DiffractionOrders`: reflection
orders_sheet        `OrdersSheet`: both sides of a thin sheet
orders_block        `OrdersBlock`: a block's face, in light from both sides; and the plugin
grating_parameters  parameters of the plugin, read from Mitsuba's Properties and checked
order_lookup        a table of orders inside a kernel
block_lookup        a block's table inside a kernel
crossed_lobes       the same of crossed gratings, with their look-up
polarised_lobes     Mueller matrices in polarised variants
lobes               light of all orders in a variant's channels, and directions drawn by it
"""
