"""The network that names hold types by their relief: made-up holds, training, the file."""
