"""walltopo-lab: generated gyms, data sets, training, evaluation and tuning for walltopo."""
