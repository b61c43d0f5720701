"""Commands that print the figures of the docs: `python -m benchmarks.NAME`."""
