/** Lets the page answer fingers and draw before the work goes on: after it, another task. */
export const yieldToPage = (): Promise<void> => new Promise((resolve) => setTimeout(resolve));
