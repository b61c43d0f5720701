"""Insights for setters and owners, from ascents, opinions and scans."""
