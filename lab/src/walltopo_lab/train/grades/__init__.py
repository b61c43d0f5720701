"""The grade model, learnt on problems of a standard board."""
