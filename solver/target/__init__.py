"""The target: nodes that blocks of elements share, how they are held, and what is recorded of them.

Meshes (of `generators/` or from `files/`), sections and supports enter; a `Target` that the coupling steps, with forces
on its frame, energies and natural frequencies, leaves. Read mesh, `laws/` and section, then nodes, block, shell_block,
triangle_block and supports; assembly puts them together, rectangle builds the plate of one block; modes finds
frequencies.
"""
