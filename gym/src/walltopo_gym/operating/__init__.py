"""What an operator does with a whole server: look after it, keep it, bring it back."""
