/** The words for what a competition consists of. */

import { locale, t, type Key } from "../i18n.svelte";
import { colourName } from "../lib/colours";
import type { Wave } from "./facts";

/** A problem's name: its label, and the route's name or colour. */
export function problemName({ label, name, colour }: { label: string; name: string; colour: string }): string {
  return [label, name || (colour && colourName(colour))].filter(Boolean).join(" · ");
}

const PARTS = { day: "numeric", month: "short", hour: "2-digit", minute: "2-digit", timeZoneName: "short" } as const;

/** A wave's name and times: Wave 1: 26 Nov, 18:00 – 19:30 CET. */
export function waveWords({ name, starts_at, ends_at }: Pick<Wave, "name" | "starts_at" | "ends_at">, zone: string): string {
  const clock = new Intl.DateTimeFormat(locale(), { ...PARTS, timeZone: zone });
  return `${name}: ${clock.formatRange(new Date(starts_at), new Date(ends_at))}`;
}

/** A text of an extensible kind: its code if there is no translation. */
export function known(prefix: string, code: string): string {
  const key = `comp.${prefix}.${code}` as Key;
  const text = t(key);
  return text === key ? code : text;
}
