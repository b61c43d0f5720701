"""The files of the larger networks; `walltopo` opens them (`sparse.features=auto`)."""
