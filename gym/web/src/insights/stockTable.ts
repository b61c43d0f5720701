/** A table of holds from a spreadsheet: colour, type, number; a heading line is skipped. */

export interface Row {
  colour: string;
  type: string;
  total: number;
}

/** The rows, or the number of the first invalid line. Separated by commas, semicolons or tabs. */
export function readStock(text: string): { rows: Row[] } | { bad: number } {
  const rows: Row[] = [];
  for (const [at, line] of text.split(/\r?\n/).entries()) {
    if (!line.trim()) continue;
    const cells = line.split(/[,;\t]/).map((cell) => cell.trim().replace(/^"(.*)"$/, "$1"));
    const [colour = "", type = "", total = ""] = cells;
    const isRow = cells.length === 3 && colour !== "" && /^\d{1,6}$/.test(total) && Number(total) <= 100_000;
    if (isRow) rows.push({ colour, type, total: Number(total) });
    else if (at > 0) return { bad: at + 1 };
  }
  return rows.length ? { rows } : { bad: 1 };
}
