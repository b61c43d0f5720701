/** Ids of the people who have chosen their messages, as far as this visit knows: they are not asked again. */
export const chosen = new Set<string>();
