"""What joins shells that share no node: ties, which follow, and rivets, which spring and break.

A mesh of parts and what a case says of its links enter; objects that the target steps leave. Read anchors, ties,
rivets.
"""
