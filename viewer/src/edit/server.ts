/** The server that shows the scan: it keeps the log, and tells what a log makes of the scan. */

import type { Vec3 } from "../types";
import type { Edit } from "./log";
import { say } from "../languages";
import type { Miss } from "../languages/setting";
import type { Climber, RouteMoves } from "../moves";
import type { RawResult } from "./result";
import type { Wish } from "./setting-cards";

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

/** A problem that is proposed (`walltopo_climb.problems.rows`). */
export interface Proposal {
  hands: number[];
  start: number[];
  top: number[];
  feet: number[];
  grade: Grade;
  moves: number;
  misses: Miss[];
  climbers: Climber[];
}

/** One hold that changes how hard a route is. */
export interface Tweak {
  do: "add a foothold" | "add a handhold" | "take away";
  hold: number;
  /** Another route that it is on; 0: none. */
  on: number;
  by: number;
  grade: Grade;
  /** Share of its effort that the hardest move takes less. */
  eases: number;
  climbers: Climber[];
}

export type Grade = NonNullable<RouteMoves["grade"]>;
export type Way = "easier" | "harder";

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

  /** Problems on the holds of the wall as the log makes it; takes seconds. */
  propose(edits: readonly Edit[], wish: Wish): Promise<{ unit: number; proposals: Proposal[] }> {
    return this.post("/problems", { edits: { version: 2, edits }, wish });
  }

  ease(edits: readonly Edit[], route: number, way: Way): Promise<{ unit: number; grade: Grade; tweaks: Tweak[] }> {
    return this.post("/ease", { edits: { version: 2, edits }, route, way });
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
