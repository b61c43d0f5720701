"""Who somebody is: accounts, sign-in, tokens, the log of who changed what."""
