"""One log of all climbs of a person: in the gyms of this server, and anywhere else."""
