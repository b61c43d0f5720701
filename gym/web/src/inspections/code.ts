/** A code of a record in groups of four, as it is printed. */
export function spaced(code: string): string {
  return code.match(/.{1,4}/g)?.join("-") ?? "";
}
