"""The network that finds holds of two colours."""
