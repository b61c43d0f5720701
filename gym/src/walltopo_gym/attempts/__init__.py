"""Items of background jobs, tried a bounded number of times."""
