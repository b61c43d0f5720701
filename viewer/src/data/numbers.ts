/** Formats of numbers in a language. Making one takes as long as a hundred uses of it: one each. */

const formats = new Map<string, Intl.NumberFormat>();

export function numberFormat(code: string, how: Intl.NumberFormatOptions): Intl.NumberFormat {
  const key = `${code} ${JSON.stringify(how)}`;
  let format = formats.get(key);
  if (format === undefined) formats.set(key, (format = new Intl.NumberFormat(code, how)));
  return format;
}
