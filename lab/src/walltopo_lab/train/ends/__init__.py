"""The regressions for the confidence of a route's start and top holds."""
