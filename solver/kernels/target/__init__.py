"""The target: nodes, shells and links in, stresses, nodal forces and energies out.

Shells of four nodes: shell_geometry, shell, shell_stress with plasticity (return mapping) on rows of a metal (metal),
shell_erosion; of three: triangle. Nodes: node_motion, plate_edges (springs of the frame), links (ties and rivets).
"""
