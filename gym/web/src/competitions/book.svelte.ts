/** Score events of a competition: what the server has told, and what was said here and may still wait. */

import { mine, say } from "../outbox/outbox.svelte";
import { withdraw, type Item, type ScoreWords } from "../outbox/store";
import { me } from "../session.svelte";
import { stamp } from "./device";
import type { Scored } from "./facts";
import { counting, markOf, type Mark } from "./marks";

type Score = Item & { what: "score" };
export type Told = Scored & { waits: boolean };
export type Words = Pick<ScoreWords, "entry_id" | "problem_id" | "kind" | "n"> & Partial<Pick<ScoreWords, "target_id" | "text">>;

/** What was said here of a competition and not refused. */
export function saidHere(competition: string): Score[] {
  return mine().filter((item): item is Score => item.what === "score" && item.competition === competition && !item.refused);
}

export class Book {
  private readonly own = $derived.by(() => saidHere(this.competition()));

  constructor(
    private readonly gym: () => string,
    private readonly competition: () => string,
    /** The events that count, as the server told them last. */
    private readonly known: () => readonly Scored[],
  ) {}

  get waiting(): number {
    return this.own.filter(({ done }) => done === null).length;
  }

  /** The events about a problem and somebody, or about the whole competition, that count; the last at the end. */
  events(entry: string, problem: string | null): Told[] {
    const isHere = (row: { entry_id: string; problem_id: string | null }): boolean => row.entry_id === entry && row.problem_id === problem;
    const rows = new Map<string, Told>();
    for (const event of this.known()) if (isHere(event)) rows.set(event.id, { ...event, waits: false });
    for (const { id, body, done } of this.own) {
      if (isHere(body) && !rows.has(id)) rows.set(id, { ...body, id, waits: done === null });
    }
    return counting([...rows.values()]).sort((a, b) => a.made_at.localeCompare(b.made_at)).filter(({ kind }) => kind !== "void");
  }

  mark(entry: string, problem: string): Mark {
    return markOf(this.events(entry, problem));
  }

  /** Keep an event, and send it. `name`: what it says, for the list of what waits. */
  async say(words: Words, name: string): Promise<void> {
    const body = { target_id: null, text: "", ...words, ...stamp() };
    await say({ what: "score", id: crypto.randomUUID(), gym: this.gym(), competition: this.competition(), person: me()!.id, name, body });
  }

  /** It counts no longer: by itself where it never left, else by an event that says so. */
  async takeBack(event: Scored, name: string): Promise<void> {
    const item = this.own.find(({ id }) => id === event.id);
    if (item && (await withdraw(item))) return;
    const { entry_id, problem_id, id } = event;
    await this.say({ entry_id, problem_id, kind: "void", n: null, target_id: id }, name);
  }
}
