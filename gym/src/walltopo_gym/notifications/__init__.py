"""Messages to people: the week's mail, and push."""
