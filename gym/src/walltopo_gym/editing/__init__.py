"""The editor of a scan in review: its edit log in the database, its results in the artifact
store."""
