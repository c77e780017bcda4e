"""From a measured curve back to parameters, with honest intervals and a solver run that verifies each answer."""
