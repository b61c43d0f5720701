"""Which holds make a route: by colour and by the way along the wall."""
