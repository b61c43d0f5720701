"""What lies in a scan folder: a class for each artifact, with load, save, checks and schema."""
