"""The embedded explicit solver: an SPH bird against a deformable shell plate."""
