/** Colours of holds and routes as CSS. */

import { patternOver } from "../data/colour_vision";
import type { Vision } from "../data/colour_vision";
import type { Hold, Route, Tables } from "../data/types";

type Rgb = [number, number, number];

/** Swatches of colours that no hold of the wall has: `REFERENCE` of walltopo.describe.classify.palette. */
const PAINTS: Record<string, Rgb> = {
  black: [38, 38, 40], grey: [125, 127, 130], white: [232, 232, 226], red: [195, 32, 38],
  orange: [238, 118, 30], yellow: [245, 200, 25], lime: [150, 200, 50], green: [40, 145, 65],
  mint: [60, 190, 165], sky: [100, 180, 225], blue: [30, 85, 185], purple: [110, 55, 160],
  pink: [230, 80, 145], brown: [110, 72, 45], wood: [200, 160, 112],
};

function middle(colours: Rgb[]): Rgb {
  const at = (k: number): number => colours.map((c) => c[k] ?? 0).sort((a, b) => a - b)[colours.length >> 1] ?? 128;
  return [at(0), at(1), at(2)];
}

/** With commas: three.js reads no other way of writing it. */
const css = (rgb: Rgb): string => `rgb(${rgb.map((v) => Math.round(v)).join(", ")})`;

function measured(holds: Iterable<Hold | undefined>, colour: string | null): Rgb[] {
  const found: Rgb[] = [];
  for (const hold of holds) if (hold?.colour_rgb && (hold.colour ?? null) === (colour ?? null)) found.push(hold.colour_rgb);
  return found;
}

/**
 * The colour of a route as CSS: as measured on those of its holds that have its colour, else on the
 * wall's; a route that was given another colour is not drawn in the one that its holds have.
 */
export function swatch(route: Route, tables: Tables): string {
  const own = route.holds.map((id) => tables.holds.get(id));
  for (const holds of [own, tables.holds.values()]) {
    const found = measured(holds, route.colour);
    if (found.length > 0) return css(middle(found));
  }
  const paint = PAINTS[route.colour ?? ""];
  return paint ? css(paint) : "#888";
}

export function holdSwatch(hold: Hold): string {
  return hold.colour_rgb ? css(hold.colour_rgb) : "#888";
}

/** A route's colour as a CSS background, with a pattern where it looks like others to `vision`. */
export function routeBackground(route: Route, tables: Tables, vision: Vision | null): string {
  return patternOver(route.colour, vision) + swatch(route, tables);
}

/** The hold's colour as a CSS background, or both of its colours side by side; with a pattern as a route's. */
export function holdBackground(hold: Hold, vision: Vision | null): string {
  const first = holdSwatch(hold);
  const second = hold.second_colour && hold.second_rgb;
  return patternOver(hold.colour, vision) + (second ? `linear-gradient(135deg, ${first} 50%, ${css(second)} 50%)` : first);
}
