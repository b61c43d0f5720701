"""The editor of a scan in review: its log in the database, what follows from it on the shelf."""
