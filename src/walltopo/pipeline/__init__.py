"""The stages in order: settings, what must run again, loading, running, storing."""
