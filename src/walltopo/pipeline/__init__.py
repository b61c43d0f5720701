"""Run the stages of a scan in order, resume a run and report its health."""
