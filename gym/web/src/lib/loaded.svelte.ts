/** Data of the server: loading, loaded, or failed. During a reload the old data stays. */

import { untrack } from "svelte";
import { ApiError } from "../api/client";
import { isCutOff, KEPT, keeps, returned } from "../offline/reception.svelte";

/** The source of data: the server, or this browser's storage. */
export type How = typeof KEPT | Record<string, never>;

/** The object was deleted, or the viewer may not see it: delete its stored data too. */
const GONE: readonly number[] = [401, 403, 404];

const hasOnlyKept = (): boolean => keeps() && untrack(isCutOff);

export class Loaded<T> {
  data = $state.raw<T>();
  problem = $state.raw<ApiError | null>(null);
  private turn = 0;
  private answered = 0;

  constructor(private readonly ask: (how: How) => Promise<T>) {}

  /** Load (again); drop a response that a later request has overtaken. */
  async load(): Promise<void> {
    const turn = ++this.turn;
    try {
      const data = await this.ask({});
      if (turn !== this.turn) return;
      this.answered = turn;
      this.data = data;
      this.problem = null;
    } catch (error) {
      if (turn !== this.turn) return;
      const problem = ApiError.of(error);
      if (GONE.includes(problem.status)) {
        this.answered = turn;
        this.data = undefined;
      }
      // The app reports missing reception once, for the whole page.
      this.problem = problem.status === 0 && this.data !== undefined ? null : problem;
    }
  }

  /** Load; without a network show stored data until it is back (`returned`). */
  async begin(): Promise<void> {
    await (hasOnlyKept() ? this.showKept() : this.load());
  }

  /** Show stored data until the server responds. */
  async beginKept(): Promise<void> {
    if (hasOnlyKept()) return this.showKept();
    const coming = this.load();
    const turn = this.turn;
    const early = keeps() ? await this.ask(KEPT).catch(() => undefined) : undefined;
    if (early !== undefined && turn === this.turn && this.answered !== turn) this.data = early;
    await coming;
  }

  private async showKept(): Promise<void> {
    const turn = ++this.turn;
    const kept = await this.ask(KEPT).catch(() => undefined);
    if (turn !== this.turn) return;
    this.data = kept ?? this.data;
    this.problem = this.data === undefined ? ApiError.unreachable() : null;
  }
}

/**
 * Loads now, and again whenever state changes that `ask` reads before its first await. Offline, stored data is shown if
 * `ask` passes `how` on.
 */
export function loading<T>(ask: (how: How) => Promise<T>): Loaded<T> {
  const loaded = new Loaded(ask);
  $effect(() => {
    void returned();
    void loaded.begin();
  });
  return loaded;
}

/** As `loading`, but shows stored data at once; `ask` passes `how` on to each of its requests. */
export function loadingKept<T>(ask: (how: How) => Promise<T>): Loaded<T> {
  const loaded = new Loaded(ask);
  $effect(() => {
    void returned();
    void loaded.beginKept();
  });
  return loaded;
}
