"""The commands `moves`, `grade`, `problem` and `ease`."""
