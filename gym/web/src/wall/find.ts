/** Which routes of a wall a climber asked for. */

import type { Schemas } from "../api/client";

export type Route = Schemas["RouteFacts"];

export interface Wish {
  text: string;
  colour: string;
  /** Grade as `system|label`; empty: all. */
  grade: string;
}

export const ALL: Wish = { text: "", colour: "", grade: "" };

export function gradeKey(route: Route): string {
  return route.grade ? `${route.grade_system_id}|${route.grade}` : "";
}

function plain(text: string): string {
  return text.normalize("NFKD").replace(/\p{M}/gu, "").toLocaleLowerCase();
}

/** Without accents and case; each word may be in another field. */
export function find(routes: Route[], { text, colour, grade }: Wish, colourName: (colour: string) => string): Route[] {
  const words = plain(text).split(/\s+/).filter(Boolean);
  return routes.filter((route) => {
    if (colour && route.colour !== colour) return false;
    if (grade && gradeKey(route) !== grade) return false;
    const told = plain([route.name, route.setter, route.grade, colourName(route.colour), ...route.tags].join(" "));
    return words.every((word) => told.includes(word));
  });
}
