"""Fuzzing of every file reader: damage files, read them in a watched process, keep failing ones."""
