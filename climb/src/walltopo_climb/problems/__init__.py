"""Settings that teach: problems proposed on holds that hang, and what makes a route easier."""
