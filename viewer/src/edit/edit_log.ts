/** The log of edits, as `edits.json` holds it (`walltopo.scans.edits`), with undo and redo. */

import type { Hold, Route, Tables } from "../data/types";
import type { EditLog, Ref, SetRole, SetRoute } from "../data/wire";

export type Edit = NonNullable<EditLog["edits"]>[number];
export type Role = SetRole["role"];
/** The facts of a route that a setter enters. */
export type RouteFacts = Omit<SetRoute, "do" | "route">;

export const NONE: Ref = { id: 0 };

export const refOf = ({ id, position }: Hold): Ref => ({ id, at: position });

/** By the place of its first hold. */
export function routeRef({ id, holds }: Route, tables: Tables): Ref {
  return { id, at: tables.holds.get(holds[0]!)!.position };
}

function isOneStroke(last: Edit, entry: Edit | undefined): boolean {
  if (last.do === "hide") return entry?.do === "hide";
  return last.do === "paint" && entry?.do === "paint" && entry.hold.id === last.hold.id;
}

/** How many entries at the end of a log were one stroke of the brush, or 1. */
function lastStep(entries: readonly Edit[]): number {
  const last = entries.at(-1);
  let count = 1;
  while (last && isOneStroke(last, entries.at(-1 - count))) count++;
  return count;
}

export class UndoLog {
  private entries: Edit[] = [];
  /** Entries that each step added, of the steps made on this page. */
  private steps: number[] = [];
  private undone: Edit[][] = [];
  private saved = "[]";

  get all(): readonly Edit[] {
    return this.entries;
  }

  get changed(): boolean {
    return JSON.stringify(this.entries) !== this.saved;
  }

  get canUndo(): boolean {
    return this.entries.length > 0;
  }

  get canRedo(): boolean {
    return this.undone.length > 0;
  }

  /** As it was saved before: its entries can be undone too. */
  load(entries: Edit[]): void {
    this.entries = [...entries];
    this.steps = [];
    this.undone = [];
    this.kept(entries);
  }

  /** These were saved; more may have been made meanwhile. */
  kept(entries: readonly Edit[]): void {
    this.saved = JSON.stringify(entries);
  }

  /** One step; what was undone before it is gone. */
  add(...step: Edit[]): void {
    this.entries.push(...step);
    this.steps.push(step.length);
    this.undone = [];
  }

  undo(): void {
    const count = this.steps.pop() ?? lastStep(this.entries);
    this.undone.push(this.entries.splice(this.entries.length - count, count));
  }

  redo(): void {
    const step = this.undone.pop();
    if (!step) return;
    this.entries.push(...step);
    this.steps.push(step.length);
  }
}
