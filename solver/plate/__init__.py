"""The target: a plate or panel of four-node shells, or a rigid one.

Mesh, metal and edges enter; a body that the coupling steps, with forces on its frame, energies and its natural
frequencies, leaves. Read mesh, material and boundary, then shell; rigid is the target that does not move; modes finds
frequencies.
"""
