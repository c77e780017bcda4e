"""Fast stand-ins for the solver: the inverse network of the literature and a forward emulator with its own error."""
