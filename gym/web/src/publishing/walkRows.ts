/** Enter and the arrow keys go to the same field of the next or the last row, as in a spreadsheet. */
export function walkRows(event: KeyboardEvent, body: HTMLElement | undefined): void {
  const at = event.target as HTMLElement;
  const field = at.dataset["field"];
  if (!field || !body) return;
  const isText = at instanceof HTMLInputElement && at.type !== "date";
  const down = (event.key === "Enter" && !event.shiftKey) || (event.key === "ArrowDown" && isText);
  const up = (event.key === "Enter" && event.shiftKey) || (event.key === "ArrowUp" && isText);
  if (!down && !up) return;
  event.preventDefault();
  const column = [...body.querySelectorAll<HTMLElement>(`[data-field="${field}"]:not(:disabled)`)];
  const next = column[column.indexOf(at) + (down ? 1 : -1)];
  next?.focus();
  if (next instanceof HTMLInputElement && next.type === "text") next.select();
}
