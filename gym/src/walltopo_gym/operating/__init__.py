"""Operating a server: health, backup, restore, purge, personal data."""
