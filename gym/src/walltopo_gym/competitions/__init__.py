"""Competitions: problems, entries, judging, scoring, ranking, boards."""
