/** Who climbs a problem, in which order, and who is next. */

import type { Entry, Problem, Starter } from "./facts";

/** By the running order where there is one, else by number; who withdrew or is of another category is not there. */
export function inOrder(entries: readonly Entry[], starters: readonly Starter[], problem: Pick<Problem, "category_ids">): Entry[] {
  const climbs = (entry: Entry): boolean => !entry.withdrawn && (problem.category_ids.length === 0 || problem.category_ids.includes(entry.category_id));
  const here = entries.filter(climbs);
  if (starters.length === 0) return here.sort((a, b) => a.bib - b.bib);
  const categories = [...new Set(starters.map(({ category_id }) => category_id))];
  const place = new Map(starters.map((starter) => [starter.entry_id, categories.indexOf(starter.category_id) * 10_000 + starter.place]));
  return here.filter(({ id }) => place.has(id)).sort((a, b) => place.get(a.id)! - place.get(b.id)!);
}

/** By the beginning of a number, or a part of the name; without accents and case. */
export function find(entries: readonly Entry[], wanted: string): Entry[] {
  const plain = (text: string): string => text.normalize("NFKD").replace(/\p{M}/gu, "").toLocaleLowerCase();
  const words = plain(wanted.trim());
  if (/^\d+$/.test(words)) return entries.filter(({ bib }) => String(bib).startsWith(words)).sort((a, b) => Number(b.bib === Number(words)) - Number(a.bib === Number(words)));
  return entries.filter(({ name, team, club }) => plain(`${name} ${team} ${club}`).includes(words));
}

/** The first after somebody, round the end, who has not tried; null where nobody is left. */
export function nextOf(entries: readonly Entry[], after: string, tried: (entry: string) => boolean): Entry | null {
  const from = entries.findIndex(({ id }) => id === after) + 1;
  return [...entries.slice(from), ...entries.slice(0, from)].find(({ id }) => id !== after && !tried(id)) ?? null;
}
