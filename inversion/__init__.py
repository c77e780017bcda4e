"""From a measured curve back to parameters, with intervals that are honest and a solver run that verifies each answer."""
