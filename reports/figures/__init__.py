"""Figures, one a file: a function from arrays in SI to a matplotlib figure in the engineer's units.

Shared by all: `style` (colours, SVG and PNG), `quantities` (numbers and names in words), `switches` (curves that the
page can hide and read), `views` (bird and plate from the front and from the top).
"""
