"""Run many scans from one list, by processes of this machine or on a Ray cluster."""
