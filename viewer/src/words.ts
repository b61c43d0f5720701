/** Numbers and names as people read them. */

import type { Hold, Route, Tables } from "./types";

export function capital(text: string): string {
  return text.slice(0, 1).toUpperCase() + text.slice(1);
}

export function metres(value: number | null | undefined, metric: boolean): string {
  if (value == null || !Number.isFinite(value)) return "–";
  if (!metric) return `${value.toFixed(2)} units`;
  return value < 1 ? `${Math.round(value * 100)} cm` : `${value.toFixed(1)} m`;
}

/** "12° overhang": positive leans towards the climber. */
export function steepness(value: number | null | undefined): string {
  if (value == null || !Number.isFinite(value)) return "–";
  const whole = Math.round(value);
  if (Math.abs(whole) <= 3) return "vertical";
  return whole > 0 ? `${whole}° overhang` : `${-whole}° slab`;
}

export function plural(count: number, word: string): string {
  return `${count} ${word}${count === 1 ? "" : "s"}`;
}

/** "12 holds · 4.0 m · 17° overhang"; what is not known or says nothing is left out. */
export function routeFacts(route: Route, metric: boolean): string {
  const length = route.length_m ?? 0;
  const facts = [plural(route.holds.length, "hold")];
  if (length > 0) facts.push(metres(length, metric));
  if (route.steepness_deg != null) facts.push(steepness(route.steepness_deg));
  return facts.join(" · ");
}

export function routeName(route: Route): string {
  return route.name || `${capital(route.colour ?? "Route")} ${route.id}`;
}

export function holdName(hold: Hold): string {
  const kind = hold.class === "volume" ? "volume" : (hold.type ?? "hold");
  return capital(hold.colour && hold.class !== "volume" ? `${hold.colour} ${kind}` : kind);
}

/** The colour of a route as CSS, from its holds' measured colours. */
export function swatch(route: Route, tables: Tables): string {
  const found = route.holds.map((id) => tables.holds.get(id)?.colour_rgb).filter((c) => c != null);
  if (found.length === 0) return "#888";
  const middle = [0, 1, 2].map((k) => {
    const values = found.map((c) => c[k] ?? 0).sort((a, b) => a - b);
    return Math.round(values[values.length >> 1] ?? 128);
  });
  return `rgb(${middle.join(", ")})`;
}

/** With commas: three.js reads no other way of writing it. */
export function holdSwatch(hold: Hold): string {
  return hold.colour_rgb ? `rgb(${hold.colour_rgb.map((v) => Math.round(v)).join(", ")})` : "#888";
}
