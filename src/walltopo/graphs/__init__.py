"""Graphs given as lists of pairs: what hangs together, and clusters by modularity."""
