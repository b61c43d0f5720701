"""The gym beyond the app: its screen in the hall, paper, feeds, mails and messages by choice."""
