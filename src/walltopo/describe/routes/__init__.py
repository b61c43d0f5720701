"""Group holds into routes by colour and by distance along the wall."""
