"""Rules of scoring, each a pure function from what somebody has to a score."""
