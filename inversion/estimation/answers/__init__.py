"""What a calibration says of the parameters: the emulator's answer, the network's, and the two together.

A `Calibrator`'s fit and its posterior enter; a `Calibration` with each method's estimates leaves. Read estimates,
network_inversion, proposal.
"""
