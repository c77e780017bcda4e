"""Problems of the verification, variants of `problem.Problem`: a file for each family, listed in `registry`."""
