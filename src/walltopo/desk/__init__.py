"""The editor's desk: a scan kept in memory, on which edits are tried, saved and carried out."""
