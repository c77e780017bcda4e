"""One figure a file: a function from arrays in SI to a matplotlib figure in the engineer's units."""
