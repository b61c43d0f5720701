"""walltopo-gym: the platform that puts a gym's walls online; `walltopo gym`."""
