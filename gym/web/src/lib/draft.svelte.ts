import { untrack } from "svelte";

/** A form's own copy of what was loaded. A newer answer replaces it as long as nobody has typed. */
export class Draft<T extends object> {
  words = $state<T>();
  private before = "";

  constructor(loaded: () => T | undefined) {
    $effect(() => {
      const fresh = loaded();
      untrack(() => fresh && this.follow(fresh));
    });
  }

  private follow(fresh: T): void {
    if (this.words && JSON.stringify(this.words) !== this.before) return;
    this.words = { ...fresh };
    this.before = JSON.stringify(this.words);
  }
}
