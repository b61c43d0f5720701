/** Several routes marked with results after a session, and saved at once. */

import { SvelteMap } from "svelte/reactivity";
import type { Logbook } from "../outbox/logbook.svelte";
import { say } from "../outbox/outbox.svelte";
import { FIRST_TRIES, type Discipline, type Kind } from "../outbox/kinds";
import type { AscentIn, ManyRow, Words } from "../outbox/store";
import { change } from "../outbox/tick";
import type { Route } from "./find";

export interface Mark {
  /** For lists of waiting items. */
  name: string;
  kind: Kind;
  discipline: Discipline;
  tries: number;
}

interface Saved {
  /** The entries that undo the sent ones. */
  undo: Words[];
  count: number;
}

export class ManyTicks {
  on = $state(false);
  saved = $state.raw<Saved | null>(null);
  readonly marks = new SvelteMap<string, Mark>();

  begin(): void {
    this.marks.clear();
    this.saved = null;
    this.on = true;
  }

  cancel(): void {
    this.marks.clear();
    this.on = false;
  }

  /** A tap: a top, or no mark. */
  tap(route: Route, name: string): void {
    if (!this.marks.delete(route.id)) this.marks.set(route.id, { name, kind: "top", discipline: route.disciplines[0]!, tries: 1 });
  }

  mark(route: string, mark: Mark): void {
    this.marks.set(route, mark);
  }

  /** New ascents are one entry; a route tried today goes on with its own line. */
  async save(gym: string, person: string, book: Logbook): Promise<void> {
    const now = new Date();
    const rows: ManyRow[] = [];
    const singles: Words[] = [];
    const undo: Words[] = [];
    for (const [route, { name, kind, discipline, tries }] of this.marks) {
      const made = change(route, { kind, discipline }, book.ascents(route), now, crypto.randomUUID());
      if (!made.after) continue; // a project already
      const body: AscentIn = { ...made.after, tries: FIRST_TRIES.includes(kind) ? 1 : made.after.tries + tries - 1 };
      if (!made.before) rows.push({ id: made.id, name, body });
      else {
        const item = { what: "ascent" as const, id: made.id, gym, route, name, person, takenBack: false, known: made.known };
        singles.push({ ...item, body });
        undo.push({ ...item, body: made.before });
      }
    }
    if (rows.length) {
      const list = { what: "ascents" as const, id: crypto.randomUUID(), gym, person, name: "", rows, known: false };
      singles.unshift({ ...list, takenBack: false });
      undo.push({ ...list, takenBack: true });
    }
    for (const words of singles) await say(words);
    this.saved = { undo, count: rows.length + singles.filter(({ what }) => what === "ascent").length };
    this.cancel();
  }

  async undo(): Promise<void> {
    const { undo } = this.saved ?? { undo: [] };
    this.saved = null;
    for (const words of undo) await say(words);
  }
}
