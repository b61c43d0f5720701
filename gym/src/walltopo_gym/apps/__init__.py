"""Apps of others: their registration, and OAuth 2.1 by which people let them act for them."""
