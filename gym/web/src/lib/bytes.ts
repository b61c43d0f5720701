/** Sizes as the reader writes them. */

import { locale } from "../i18n.svelte";

const UNITS = ["kilobyte", "megabyte", "gigabyte", "terabyte"] as const;

/** Bytes in the largest unit of which there is at least one, kilobytes at the least. */
export function bytes(count: number): string {
  const power = Math.min(UNITS.length, Math.max(1, Math.floor(Math.log10(Math.max(1, count)) / 3)));
  const how = { style: "unit", unit: UNITS[power - 1]!, maximumFractionDigits: power > 2 ? 1 : 0 } as const;
  return new Intl.NumberFormat(locale(), how).format(count / 1000 ** power);
}
