"""Accounts, sign-in, tokens, audit log."""
