"""Publication of scans: from review to the public wall, with the identity of its routes."""
