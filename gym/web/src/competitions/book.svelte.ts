/** Score events of a competition: those of the server, and those of this device that may still wait. */

import { mine, say } from "../outbox/outbox.svelte";
import { withdraw, type Item, type ScoreIn } from "../outbox/store";
import { me } from "../session.svelte";
import { stamp } from "./device";
import type { Scored } from "./facts";
import { counting, markOf, type Mark } from "./marks";

type Score = Item & { what: "score" };
export type Message = Scored & { waits: boolean };
export type Words = Pick<ScoreIn, "entry_id" | "problem_id" | "kind" | "n"> & Partial<Pick<ScoreIn, "hold" | "plus" | "seconds" | "target_id" | "text">>;

/** The events of this device that were not refused: those of the signed-in person, or those by a judge's link. */
export function ownScores(competition: string, link?: string): Score[] {
  return mine().filter((item): item is Score => item.what === "score" && item.link === link && (link !== undefined || item.competition === competition) && !item.refused);
}

export class Book {
  private readonly own = $derived.by(() => ownScores(this.competition(), this.how.link?.()));

  constructor(
    private readonly gym: () => string,
    private readonly competition: () => string,
    /** The counting events as the server sent them last. */
    private readonly known: () => readonly Scored[],
    /** The judge's link by which events go, and the limit of attempts on a problem. */
    private readonly how: { link?: () => string; limit?: (problem: string) => number | null } = {},
  ) {}

  get waiting(): number {
    return this.own.filter(({ done }) => done === null).length;
  }

  /** The counting events about a problem and a competitor, or about the whole competition; the latest at the end. */
  events(entry: string, problem: string | null): Message[] {
    const isHere = (row: { entry_id: string; problem_id: string | null }): boolean => row.entry_id === entry && row.problem_id === problem;
    const rows = new Map<string, Message>();
    for (const event of this.known()) if (isHere(event)) rows.set(event.id, { ...event, waits: false });
    for (const { id, body, done } of this.own) {
      if (isHere(body) && !rows.has(id)) rows.set(id, { ...body, id, waits: done === null });
    }
    return counting([...rows.values()]).sort((a, b) => a.made_at.localeCompare(b.made_at)).filter(({ kind }) => kind !== "void");
  }

  mark(entry: string, problem: string): Mark {
    return markOf(this.events(entry, problem), this.limit(problem));
  }

  /** The limit of attempts on a problem; null without one. */
  limit(problem: string): number | null {
    return this.how.limit?.(problem) ?? null;
  }

  /** Store an event and send it. `name`: its description in the list of waiting items. */
  async say(words: Words, name: string): Promise<void> {
    const body = { target_id: null, text: "", ...words, ...stamp() };
    const link = this.how.link?.();
    const sender = link ? { person: "", link } : { person: me()!.id };
    await say({ what: "score", id: crypto.randomUUID(), gym: this.gym(), competition: this.competition(), ...sender, name, body });
  }

  /** Strike an event: delete it if it never left, else send an event that strikes it. */
  async takeBack(event: Scored, name: string): Promise<void> {
    const item = this.own.find(({ id }) => id === event.id);
    if (item && (await withdraw(item))) return;
    const { entry_id, problem_id, id } = event;
    await this.say({ entry_id, problem_id, kind: "void", n: null, target_id: id }, name);
  }
}
