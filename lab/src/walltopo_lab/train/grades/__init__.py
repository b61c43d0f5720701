"""The grade model, trained on problems of a standard board."""
