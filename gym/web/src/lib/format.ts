/** Numbers and times as the reader writes them. */

import { locale } from "../i18n.svelte";

/** `digits` decimals; by default as many as the number has, three at most. */
export function number(value: number, digits?: number): string {
  const how = digits === undefined ? {} : { minimumFractionDigits: digits, maximumFractionDigits: digits };
  return new Intl.NumberFormat(locale(), how).format(value);
}

/** `value` of `of` in per cent; a dash for a division by zero. */
export function share(value: number, of: number): string {
  if (of === 0) return "–";
  return new Intl.NumberFormat(locale(), { style: "percent", maximumFractionDigits: 0 }).format(value / of);
}

/** A month such as "2026-03"; without the year on request. */
export function month(text: string, short = false): string {
  const how: Intl.DateTimeFormatOptions = short ? { month: "short" } : { month: "long", year: "numeric" };
  return new Intl.DateTimeFormat(locale(), { ...how, timeZone: "UTC" }).format(new Date(`${text}-01`));
}

/** A day without its year. */
export function shortDay(text: string): string {
  const how: Intl.DateTimeFormatOptions = { day: "numeric", month: "short", timeZone: "UTC" };
  return new Intl.DateTimeFormat(locale(), how).format(new Date(text));
}

/** The day of the week, and the day. */
export function longDay(text: string): string {
  const how: Intl.DateTimeFormatOptions = { weekday: "long", day: "numeric", month: "long", year: "numeric", timeZone: "UTC" };
  return new Intl.DateTimeFormat(locale(), how).format(new Date(text));
}

/** The time of a moment, in the reader's own zone. */
export function time(text: string): string {
  return new Intl.DateTimeFormat(locale(), { timeStyle: "short" }).format(new Date(text));
}

/** A span of time in hours and minutes, such as "1 h 20 min" in the reader's language. */
export function span(milliseconds: number): string {
  const minutes = Math.max(0, Math.round(milliseconds / 60_000));
  const parts: [number, string][] = [[Math.floor(minutes / 60), "hour"], [minutes % 60, "minute"]];
  return parts
    .filter(([value, unit]) => value > 0 || (unit === "minute" && minutes < 60))
    .map(([value, unit]) => new Intl.NumberFormat(locale(), { style: "unit", unit, unitDisplay: "short" }).format(value))
    .join(" ");
}

/** A moment as a field for date and time has it, in the reader's own zone; empty for none. */
export function local(text: string | null): string {
  if (!text) return "";
  const at = new Date(text);
  return new Date(at.getTime() - at.getTimezoneOffset() * 60_000).toISOString().slice(0, 16);
}
