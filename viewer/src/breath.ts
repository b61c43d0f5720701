/** Lets the page answer fingers and draw before the work goes on: after it, another task. */
export const breath = (): Promise<void> => new Promise((resolve) => setTimeout(resolve));
