"""Photos to posed cameras, metres, a mesh and its texture."""
