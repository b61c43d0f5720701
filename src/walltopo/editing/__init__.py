"""Stage *edit*: a setter's log of corrections, replayed on what the scan found."""
