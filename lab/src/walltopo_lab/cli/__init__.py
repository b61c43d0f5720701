"""The commands that walltopo-lab adds to `walltopo`."""
