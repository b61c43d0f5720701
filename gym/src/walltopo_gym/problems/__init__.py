"""Problems that climbers make of a wall's holds."""
