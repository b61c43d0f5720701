"""The network that predicts hold types from relief: synthetic holds, training, export."""
