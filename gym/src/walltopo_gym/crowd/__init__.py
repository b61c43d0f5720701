"""Made-up climbers for the demo gym: people, ascents, opinions."""
