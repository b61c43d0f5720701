"""Logs of other services, read from the files that people can export there."""
