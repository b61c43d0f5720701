"""The regressions that say how likely a route's start and top are right."""
