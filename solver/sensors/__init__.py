"""Sensors: one file a kind, with what a case says of it, what it reads from the running state, how it is sampled.

The running state enters at every step, channels on the user's clock leave, as the instruments behind the sensors give
them. Read sensor (the interface), a kind (displacement, strain, pressure, contact_force, reaction_force), registry,
places, then recording and instrument.
"""
