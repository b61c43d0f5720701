/** What is asked of the server: waiting, here, or why not. Asked again, what was here stays until the new has come. */

import { Problem } from "../api/client";

export class Loaded<T> {
  data = $state.raw<T>();
  problem = $state.raw<Problem | null>(null);
  private turn = 0;

  constructor(private readonly ask: () => Promise<T>) {}

  /** Ask (again); an answer that another question has overtaken is dropped. */
  async load(): Promise<void> {
    const turn = ++this.turn;
    try {
      const data = await this.ask();
      if (turn !== this.turn) return;
      this.data = data;
      this.problem = null;
    } catch (error) {
      if (turn === this.turn) this.problem = Problem.of(error);
    }
  }
}

/** Loads now, and again whenever something changes that `ask` reads before its first wait. */
export function loading<T>(ask: () => Promise<T>): Loaded<T> {
  const loaded = new Loaded(ask);
  $effect(() => void loaded.load());
  return loaded;
}
