/** Reads a wall before its element exists, for pages that know early which wall they will show. */

import { readWall } from "./read_wall";
import type { WallModel } from "./read_wall";
import { WorkerClient } from "./worker_client";

const PATIENCE_MS = 60_000;

export class Preload {
  readonly reader = new WorkerClient();
  readonly stop = new AbortController();
  readonly coming: Promise<WallModel>;
  /** Gets a share from 0 to 1 while the file comes. */
  progress: (share: number) => void = () => {};
  failed = false;

  constructor(readonly source: string) {
    const progress = (share: number): void => this.progress(share);
    this.coming = readWall(this.reader, source, { progress, signal: this.stop.signal });
    this.coming.catch(() => (this.failed = true)); // the element asks again, and tells it
  }

  drop(): void {
    this.stop.abort();
    this.reader.end();
  }
}

let waiting: Preload | null = null;

/** Begin to read a file; the read is dropped if no element takes it within a minute. */
export function preload(source: string): void {
  waiting?.drop();
  const begun = (waiting = new Preload(source));
  setTimeout(() => {
    if (waiting === begun) takePreload("");
  }, PATIENCE_MS);
}

/** The read that was begun ahead for this file; a read for another file is dropped. */
export function takePreload(source: string): Preload | null {
  const found = waiting;
  waiting = null;
  if (found?.source === source && !found.failed) return found;
  found?.drop();
  return null;
}
