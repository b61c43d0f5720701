/** Numbers and names as people read them. */

import { counted, day, decimal, say } from ".";
import { inCentimetres, inMetres } from "../data/lengths";
import { lean, whole } from "../data/steepness";
import type { Hold, Route, Tables } from "../data/types";
import { measures } from "./units";

export function capital(text: string): string {
  return text.slice(0, 1).toUpperCase() + text.slice(1);
}

/** `metric`: whether the scan has metres; else the length is in units of its own. */
export function lengthText(value: number | null | undefined, metric: boolean): string {
  if (value == null || !Number.isFinite(value)) return "–";
  if (!metric) return `${decimal(value, 2)} ${say().words.units}`;
  return value < 1 ? inCentimetres(value, measures()) : inMetres(value, measures(), 1);
}

/** "12° overhang": positive leans towards the climber. */
export function steepness(value: number | null | undefined): string {
  if (value == null || !Number.isFinite(value)) return "–";
  const way = lean(value);
  if (way === "vertical") return say().words.vertical;
  return say()[way](Math.abs(whole(value)));
}

export function colourName(colour: string | null | undefined): string {
  return colour ? (say().colours[colour] ?? colour) : "–";
}

export function typeName(type: string | null | undefined): string {
  return type ? (say().types[type] ?? type) : "–";
}

/** Why an instance is no hold. */
export function leftOutWords({ left_out: reason = "" }: Hold): string {
  return say().reasons[reason] ?? reason;
}

/** "4 routes · 31 holds · 2 volumes": as the terminal and the report count. */
export function wallFacts(tables: Tables): string {
  const volumes = [...tables.holds.values()].filter((hold) => hold.class === "volume").length;
  const facts = [counted(tables.routes.size, "route"), counted(tables.holds.size - volumes, "hold")];
  if (volumes > 0) facts.push(counted(volumes, "volume"));
  return facts.join(" · ");
}

/** "6b · 12 holds · 4.0 m · 17° overhang"; what is not known or says nothing is left out. */
export function routeFacts(route: Route, metric: boolean): string {
  const length = route.length_m ?? 0;
  const facts = [route.grade ?? "", counted(route.holds.length, "hold")].filter(Boolean);
  if (length > 0) facts.push(lengthText(length, metric));
  if (route.steepness_deg != null) facts.push(steepness(route.steepness_deg));
  return facts.join(" · ");
}

/** "Anna · 1 March 2026": who set it and when, as far as known. */
export function routeOrigin({ setter, date }: Route): string {
  return [setter, date && day(date)].filter(Boolean).join(" · ");
}

export function routeName(route: Route): string {
  return route.name || `${capital(route.colour ? colourName(route.colour) : say().words.route)} ${route.id}`;
}

/** "red" or "red/white". */
export function holdColours(hold: Hold): string {
  return [hold.colour, hold.second_colour].filter(Boolean).map(colourName).join("/");
}

export function holdName(hold: Hold): string {
  if (hold.class === "volume") return say().words.volume;
  const known = hold.type && hold.type !== "unknown";
  const type = known ? typeName(hold.type) : say().words.hold;
  return capital(say().holdName(holdColours(hold), type));
}
