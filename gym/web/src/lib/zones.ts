/** Moments in a gym's time zone, wherever the reader is. */

import { locale } from "../i18n.svelte";

const PARTS = { day: "numeric", month: "short", year: "numeric", hour: "2-digit", minute: "2-digit", timeZoneName: "short" } as const;
const MINUTES = "YYYY-MM-DDTHH:MM".length;

/** Day, time and name of the zone: 26 Nov 2026, 18:00 CET. */
export function zonedMoment(text: string, zone: string): string {
  return new Intl.DateTimeFormat(locale(), { ...PARTS, timeZone: zone }).format(new Date(text));
}

/** The name of a zone on the day of a moment; of now without one. */
export function zoneName(text: string | null, zone: string): string {
  const parts = new Intl.DateTimeFormat(locale(), { timeZone: zone, timeZoneName: "short" }).formatToParts(text ? new Date(text) : new Date());
  return parts.find(({ type }) => type === "timeZoneName")?.value ?? zone;
}

function clockIn(at: number, zone: string): string {
  // Swedish dates are those of ISO 8601.
  return new Intl.DateTimeFormat("sv", { timeZone: zone, dateStyle: "short", timeStyle: "medium" }).format(at).replace(" ", "T");
}

/** A moment as a field for date and time has it, by the clock of a zone; empty for none. */
export function fieldIn(text: string | null, zone: string): string {
  return text ? clockIn(Date.parse(text), zone).slice(0, MINUTES) : "";
}

/** The moment of a field by the clock of a zone; null for an empty field. */
export function momentIn(field: string, zone: string): string | null {
  if (!field) return null;
  const wanted = Date.parse(`${field}Z`);
  const ahead = (at: number): number => Date.parse(`${clockIn(at, zone)}Z`) - at;
  // The second step is for moments whose offset differs from the first guess: summer time.
  const guess = wanted - ahead(wanted);
  return new Date(wanted - ahead(guess)).toISOString();
}
