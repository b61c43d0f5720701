"""Webhooks: messages to a gym's own programs about changes."""
