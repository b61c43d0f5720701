/** Figures as these pages show them; withheld ones are a dash. */

import { locale, t, type Key } from "../i18n.svelte";
import { number, share } from "../lib/format";

export const WITHHELD = "–";

export function count(value: number | null): string {
  return value === null ? WITHHELD : number(value);
}

export function rate(value: number | null): string {
  return value === null ? WITHHELD : share(value, 1);
}

export function mean(value: number | null): string {
  return value === null ? WITHHELD : new Intl.NumberFormat(locale(), { minimumFractionDigits: 1, maximumFractionDigits: 1 }).format(value);
}

/** With its sign: a difference. */
export function steps(value: number | null): string {
  const how: Intl.NumberFormatOptions = { minimumFractionDigits: 1, maximumFractionDigits: 1, signDisplay: "exceptZero" };
  return value === null ? WITHHELD : new Intl.NumberFormat(locale(), how).format(value);
}

export function median(values: number[]): number {
  const sorted = values.toSorted((a, b) => a - b);
  const half = sorted.length / 2;
  return sorted.length === 0 ? 0 : (sorted[Math.ceil(half) - 1]! + sorted[Math.floor(half)]!) / 2;
}

export const wallKind = (kind: string): string => t(`progress.walls.${kind}` as Key);
export const holdType = (type: string): string => t(`progress.types.${type}` as Key, { defaultValue: type });
