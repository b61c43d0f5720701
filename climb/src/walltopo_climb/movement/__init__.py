"""A climb as movement: what a body of given height and reach does with the holds of a route."""
