"""A climb as movement: the moves of a body of given height and reach on the holds of a route."""
