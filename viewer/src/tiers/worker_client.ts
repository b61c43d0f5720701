/** Work beside the page: a worker of our own that answers one request after the other. */

import { say } from "../languages";
import type { Answer, JobRequest, Jobs } from "./worker";
import OwnWorker from "./worker?worker&inline";

interface Waiting {
  resolve: (done: never) => void;
  reject: (error: Error) => void;
}

export class WorkerClient {
  private readonly worker = new OwnWorker();
  private readonly waiting = new Map<number, Waiting>();
  private count = 0;
  /** Labels that tiers named, by address. */
  readonly labels = new Map<string, Promise<unknown>>();

  constructor() {
    this.worker.addEventListener("message", ({ data }: MessageEvent<Answer>) => this.answered(data));
    // Its own errors come as answers: this is a worker that did not start, or one that ran out of memory.
    this.worker.addEventListener("error", () => {
      for (const { reject } of this.waiting.values()) reject(new Error(say().words.noWorker));
      this.waiting.clear();
    });
  }

  /** Run a job; `handed` buffers move to the worker. Rejects with an Error for people; a RangeError: too large. */
  ask<J extends keyof Jobs>(job: J, given: Jobs[J][0], handed: Transferable[] = []): Promise<Jobs[J][1]> {
    const number = this.count++;
    const request: JobRequest<J> = { number, job, given };
    return new Promise((resolve, reject) => {
      this.waiting.set(number, { resolve, reject });
      this.worker.postMessage(request, handed);
    });
  }

  /** Drop all requests; their promises never settle. */
  end(): void {
    this.worker.terminate();
    this.waiting.clear();
  }

  private answered(answer: Answer): void {
    const waiting = this.waiting.get(answer.number);
    this.waiting.delete(answer.number);
    if (!waiting) return;
    if ("done" in answer) waiting.resolve(answer.done as never);
    else {
      const { failed, tooLarge } = answer;
      const words: Record<string, string> = say().words;
      waiting.reject(tooLarge ? new RangeError(failed) : new Error(words[failed] ?? failed));
    }
  }
}
