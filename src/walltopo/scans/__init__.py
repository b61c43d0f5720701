"""The scan folder: one typed class per artifact."""
