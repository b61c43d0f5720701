/** The server that shows the scan: it keeps the log, and tells what a log makes of the scan. */

import type { Vec3 } from "../types";
import type { Edit } from "./log";
import { say } from "../languages";
import type { RawResult } from "./result";

/** A place in a photo: where in the picture it is, 0 to 1 from its top left. */
export interface Crop {
  /** Name of the photo. */
  photo: string;
  /** As a `data:` address. */
  picture: string;
  x: number;
  y: number;
}

export interface State {
  /** What lies on the disk is older than the saved log. */
  stale: boolean;
  running: boolean;
  /** Why it could not be made, in English, and by its key; empty otherwise. */
  problem: string;
  key: string;
}

/** What a server that refuses says: ours, or one of `application/problem+json`. */
interface Refusal {
  error?: string;
  key?: string;
  title?: string;
}

/** A problem in the page's language where it has a key, else as the server says it. */
export function problemWords(key = "", text = ""): string {
  return say().problems[key] ?? text;
}

/** Each call throws an Error with a sentence for people. */
export class Server {
  /** Which log was read or saved last: the server refuses to replace another. */
  private version = "";

  constructor(
    private readonly address: string,
    private readonly token: string,
  ) {}

  async read(): Promise<Edit[]> {
    const { version, edits } = await this.json<{ version: string; edits: { edits: Edit[] } }>("");
    this.version = version;
    return edits.edits;
  }

  /** What the log makes of the scan; writes nothing. */
  async try(edits: readonly Edit[]): Promise<RawResult> {
    return (await this.post<{ result: RawResult }>("/try", { edits: { version: 2, edits } })).result;
  }

  async save(edits: readonly Edit[]): Promise<void> {
    const said = { version: this.version, edits: { version: 2, edits } };
    this.version = (await this.post<{ version: string }>("", said)).version;
  }

  state(): Promise<State> {
    return this.json<State>("/state");
  }

  /** What the photos show at a place, best first. */
  async photos(at: Vec3): Promise<Crop[]> {
    return (await this.json<{ photos: Crop[] }>(`/../photos?at=${at.map((v) => v.toFixed(3)).join(",")}`)).photos;
  }

  private post<T>(path: string, body: unknown): Promise<T> {
    const headers = { "Content-Type": "application/json" };
    return this.json<T>(path, { method: "POST", headers, body: JSON.stringify(body) });
  }

  private async json<T>(path: string, request: RequestInit = {}): Promise<T> {
    const headers = { ...request.headers, "X-Walltopo-Token": this.token };
    let answer: Response;
    try {
      answer = await fetch(this.address + path, { ...request, headers });
    } catch {
      throw new Error(say().words.noAnswer);
    }
    const said = (await answer.json().catch(() => ({}))) as T & Refusal;
    if (!answer.ok) throw new Error(problemWords(said.key, said.error ?? said.title) || say().answered(answer.status));
    return said;
  }
}
