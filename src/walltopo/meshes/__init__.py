"""Triangle meshes: files, topology, similarity transforms, checks."""
