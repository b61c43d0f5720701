"""Commands that print the figures of the docs: `python -m walltopo_lab.benchmarks.NAME`."""
