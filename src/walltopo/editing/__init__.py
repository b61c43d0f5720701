"""A setter's log of corrections, replayed on the scan before any edit."""
