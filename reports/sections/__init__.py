"""One section of the page a file: a function from the results to its blocks."""
