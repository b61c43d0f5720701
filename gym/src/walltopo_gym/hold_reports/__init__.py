"""Reports of holds that spin, are broken, sharp or dirty."""
