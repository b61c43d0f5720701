/** What is asked of the server: waiting, here, or why not. Asked again, what was here stays until the new has come. */

import { untrack } from "svelte";
import { Problem } from "../api/client";
import { isCutOff, KEPT, keeps, returned } from "../offline/reception.svelte";

/** How something is asked for: of the server, or of what is kept here. */
export type How = typeof KEPT | Record<string, never>;

/** It is no more, or not for whoever asks: nor is what was here of it. */
const GONE: readonly number[] = [401, 403, 404];

const hasOnlyKept = (): boolean => keeps() && untrack(isCutOff);

export class Loaded<T> {
  data = $state.raw<T>();
  problem = $state.raw<Problem | null>(null);
  private turn = 0;
  private answered = 0;

  constructor(private readonly ask: (how: How) => Promise<T>) {}

  /** Ask (again); an answer that another question has overtaken is dropped. */
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
      const problem = Problem.of(error);
      if (GONE.includes(problem.status)) {
        this.answered = turn;
        this.data = undefined;
      }
      // Of being without reception the app tells once, for all of the page.
      this.problem = problem.status === 0 && this.data !== undefined ? null : problem;
    }
  }

  /** Ask; without a network there is what is kept until it is back (`returned`). */
  async begin(): Promise<void> {
    await (hasOnlyKept() ? this.showKept() : this.load());
  }

  /** Show what is kept until the server has answered. */
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
    this.problem = this.data === undefined ? Problem.unreachable() : null;
  }
}

/**
 * Loads now, and again whenever something changes that `ask` reads before its first wait. Without a network what is kept is
 * shown where `ask` hands `how` on.
 */
export function loading<T>(ask: (how: How) => Promise<T>): Loaded<T> {
  const loaded = new Loaded(ask);
  $effect(() => {
    void returned();
    void loaded.begin();
  });
  return loaded;
}

/** The same, with what is kept in this browser at once; `ask` hands `how` on to each of its requests. */
export function loadingKept<T>(ask: (how: How) => Promise<T>): Loaded<T> {
  const loaded = new Loaded(ask);
  $effect(() => {
    void returned();
    void loaded.beginKept();
  });
  return loaded;
}
