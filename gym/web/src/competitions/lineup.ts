/** The climbers of a problem, in order, and the next one. */

import { plain } from "../lib/plain";
import type { Entry, Problem, Round, Sheet, Starter } from "./facts";

/** Whether climbers of a round follow each other in an order; at a festival they come as they like. */
export function hasOrder({ format }: Pick<Sheet, "format">, { quota }: Pick<Round, "quota">): boolean {
  return format === "rounds" || quota !== null;
}

/**
 * By running order if there is one, else by bib; without withdrawn competitors and other categories. `all`: every
 * competitor is in the round, also those who entered after the draw.
 */
export function inOrder(entries: readonly Entry[], starters: readonly Starter[], problem: Pick<Problem, "category_ids">, all: boolean): Entry[] {
  const climbs = (entry: Entry): boolean => !entry.withdrawn && (problem.category_ids.length === 0 || problem.category_ids.includes(entry.category_id));
  const here = entries.filter(climbs);
  if (starters.length === 0) return here.sort((a, b) => a.bib - b.bib);
  const categories = [...new Set(starters.map(({ category_id }) => category_id))];
  const place = new Map(starters.map((starter) => [starter.entry_id, categories.indexOf(starter.category_id) * 10_000 + starter.place]));
  const of = ({ id, bib }: Entry): number => place.get(id) ?? 1e9 + bib;
  return here.filter(({ id }) => all || place.has(id)).sort((a, b) => of(a) - of(b));
}

/** By the beginning of a number, or a part of the name; without accents and case. */
export function find(entries: readonly Entry[], wanted: string): Entry[] {
  const words = plain(wanted.trim());
  if (/^\d+$/.test(words)) return entries.filter(({ bib }) => String(bib).startsWith(words)).sort((a, b) => Number(b.bib === Number(words)) - Number(a.bib === Number(words)));
  return entries.filter(({ name, team, club }) => plain(`${name} ${team} ${club}`).includes(words));
}

/** The first after somebody, round the end, who has not tried; null where nobody is left. */
export function nextOf(entries: readonly Entry[], after: string, tried: (entry: string) => boolean): Entry | null {
  const from = entries.findIndex(({ id }) => id === after) + 1;
  return [...entries.slice(from), ...entries.slice(0, from)].find(({ id }) => id !== after && !tried(id)) ?? null;
}
