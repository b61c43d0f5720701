/** The climbers of a problem, in order, and the next one. */

import { plain } from "../lib/plain";
import type { Entry, Problem, Round, Sheet, Starter } from "./facts";

/** A competitor as a judge sees them, by an account or by a link. */
export type Climber = Pick<Entry, "id" | "category_id" | "bib" | "name"> & Partial<Pick<Entry, "withdrawn" | "team" | "club">>;

/** Whether climbers of a round follow each other in an order; at a festival they come as they like. */
export function hasOrder({ format }: Pick<Sheet, "format">, { quota }: Pick<Round, "quota">): boolean {
  return format === "rounds" || quota !== null;
}

/**
 * By running order if there is one, else by bib; without withdrawn competitors and other categories. `all`: every
 * competitor is in the round, also those who entered after the draw.
 */
export function inOrder<T extends Climber>(entries: readonly T[], starters: readonly Starter[], problem: Pick<Problem, "category_ids">, all: boolean): T[] {
  const climbs = (entry: T): boolean => !entry.withdrawn && (problem.category_ids.length === 0 || problem.category_ids.includes(entry.category_id));
  const here = entries.filter(climbs);
  if (starters.length === 0) return here.sort((a, b) => a.bib - b.bib);
  const categories = [...new Set(starters.map(({ category_id }) => category_id))];
  const place = new Map(starters.map((starter) => [starter.entry_id, categories.indexOf(starter.category_id) * 10_000 + starter.place]));
  const of = ({ id, bib }: T): number => place.get(id) ?? 1e9 + bib;
  return here.filter(({ id }) => all || place.has(id)).sort((a, b) => of(a) - of(b));
}

/** By the beginning of a number, or a part of the name; without accents and case. */
export function find<T extends Climber>(entries: readonly T[], wanted: string): T[] {
  const words = plain(wanted.trim());
  if (/^\d+$/.test(words)) return entries.filter(({ bib }) => String(bib).startsWith(words)).sort((a, b) => Number(b.bib === Number(words)) - Number(a.bib === Number(words)));
  return entries.filter(({ name, team = "", club = "" }) => plain(`${name} ${team} ${club}`).includes(words));
}

/** The first after somebody, round the end, who has not tried; null where nobody is left. */
export function nextOf<T extends Climber>(entries: readonly T[], after: string, tried: (entry: string) => boolean): T | null {
  const from = entries.findIndex(({ id }) => id === after) + 1;
  return [...entries.slice(from), ...entries.slice(0, from)].find(({ id }) => id !== after && !tried(id)) ?? null;
}
