"""Plans of resets, forerunners' proposals of grades, and their sign-off."""
