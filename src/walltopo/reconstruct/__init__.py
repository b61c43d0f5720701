"""Photos to a textured mesh: ingest, sparse, scale, dense, texture."""
