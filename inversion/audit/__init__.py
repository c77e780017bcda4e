"""The blind test of the diagnosis: planted experiments, and the gates that it must pass on them."""
