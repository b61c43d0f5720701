/** Ids of the people who have chosen their messages, as far as this visit knows: the gym page does not offer them the choice. */
export const chosen = new Set<string>();
