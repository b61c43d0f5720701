"""The gym beyond the app: hall screen, paper, feeds, opt-in mails and push messages."""
