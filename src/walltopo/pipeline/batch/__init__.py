"""Many scans from one list: by processes of this machine, or by a Ray cluster."""
