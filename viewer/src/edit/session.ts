/**
 * The editor's talk with the server: the log, what it makes of the scan, whether it is
 * saved, and whether the files that follow from it are written.
 */

import type { Tables } from "../data/types";
import type { Note } from "../data/wire";
import { filled, say } from "../languages";
import { UndoLog } from "./edit_log";
import type { Edit } from "./edit_log";
import { resultOf } from "./result";
import type { Result } from "./result";
import { problemWords } from "./server";
import type { Server } from "./server";

const POLL = 1000; // milliseconds between two looks at whether the files are written

function noteWords({ entry, reason, numbers, text }: Note): string {
  const sentence = say().notes[reason];
  return sentence ? say().edit.without(entry, filled(sentence, numbers)) : text;
}

export interface Listener {
  /** The server has answered what the log makes of the scan. */
  shown(): void;
  /** The state of saving has changed. */
  stirred(): void;
  say(text: string): void;
}

export class Session {
  result: Result;
  private readonly log = new UndoLog();
  private asking = false;
  private wanted = false;
  private written: "" | "saving" | "writing" | "written" = "";

  constructor(
    private readonly base: Tables,
    private readonly server: Server,
    private readonly on: Listener,
    private readonly gone: AbortSignal,
  ) {
    this.result = { tables: base, leftOut: new Map(), labels: null, hidden: [], notes: [] };
  }

  async start(): Promise<void> {
    try {
      this.log.load(await this.server.read());
    } catch (error) {
      return this.on.say(say().edit.unreadable((error as Error).message));
    }
    await this.ask();
  }

  get entries(): readonly Edit[] {
    return this.log.all;
  }

  get changed(): boolean {
    return this.log.changed;
  }

  get canUndo(): boolean {
    return this.log.canUndo;
  }

  get canRedo(): boolean {
    return this.log.canRedo;
  }

  get canSave(): boolean {
    return this.log.changed && this.written !== "saving";
  }

  get busy(): boolean {
    return this.asking || this.wanted;
  }

  /** How it stands with saving, in words. */
  get status(): string {
    const { edit } = say();
    return this.canSave ? "" : this.written && edit[this.written];
  }

  /** One step. */
  change(...step: Edit[]): void {
    this.log.add(...step);
    void this.ask();
  }

  undo(): void {
    if (!this.log.canUndo) return;
    this.log.undo();
    void this.ask();
  }

  redo(): void {
    if (!this.log.canRedo) return;
    this.log.redo();
    void this.ask();
  }

  async save(): Promise<void> {
    const entries = [...this.log.all];
    this.become("saving");
    try {
      await this.server.save(entries);
    } catch (error) {
      this.become("");
      return this.on.say(say().edit.notSaved((error as Error).message));
    }
    this.log.kept(entries);
    this.become("writing");
    try {
      await this.wait();
      this.become("written");
    } catch (error) {
      this.become("");
      this.on.say(say().edit.notWritten((error as Error).message));
    }
  }

  /** The id for the next new hold. */
  get nextHoldId(): number {
    return Math.max(0, ...this.result.tables.holds.keys(), ...this.result.leftOut.keys()) + 1;
  }

  /** The id for the next new route. */
  get nextRouteId(): number {
    return Math.max(0, ...this.result.tables.routes.keys()) + 1;
  }

  /** Ask the server for the result of the log. A request waits for the answer to the one before. */
  private async ask(): Promise<void> {
    this.wanted = true;
    this.on.stirred();
    if (this.asking) return;
    this.asking = true;
    while (this.wanted) {
      this.wanted = false;
      try {
        const raw = await this.server.try(this.log.all);
        if (this.gone.aborted) return;
        if (!this.wanted) this.show(resultOf(raw, this.base));
      } catch (error) {
        this.on.say(say().edit.unshown((error as Error).message));
      }
    }
    this.asking = false;
    this.on.stirred();
  }

  private show(result: Result): void {
    const before = new Set(this.result.notes.map(({ text }) => text));
    this.result = result;
    this.on.shown();
    const note = result.notes.find(({ text }) => !before.has(text));
    if (note) this.on.say(noteWords(note));
  }

  /** Until what follows from the saved log lies on the disk. */
  private async wait(): Promise<void> {
    for (;;) {
      const { stale, problem, key } = await this.server.state();
      if (problem) throw new Error(problemWords(key, problem));
      if (!stale || this.gone.aborted) return;
      await new Promise((resolve) => setTimeout(resolve, POLL));
    }
  }

  private become(written: Session["written"]): void {
    this.written = written;
    this.on.stirred();
  }
}
