"""A read-only MCP server: assistants find gyms and routes, and read their person's logbook."""
