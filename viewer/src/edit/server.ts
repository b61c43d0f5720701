/** The server that shows the scan: it keeps the log, and computes the scan after a log. */

import type { Vec3 } from "../data/types";
import type { Crop, CropsOut, EaseIn, EditLog, EditResult, LogOut, PreviewIn, PreviewOut } from "../data/wire";
import type { Proposals, ProposeIn, RebuildStatus, SaveIn, SaveOut, Tweaks, ProblemSpec } from "../data/wire";
import { say } from "../languages";
import type { Edit } from "./edit_log";

const logOf = (edits: readonly Edit[]): EditLog => ({ version: 2, edits: [...edits] });

export type Way = EaseIn["way"];

/** The body of a refusal, by our server or as `application/problem+json`. */
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
  /** Version of the log that was read or saved last: the server refuses to replace another. */
  private version = "";

  constructor(
    private readonly address: string,
    private readonly token: string,
  ) {}

  async read(): Promise<Edit[]> {
    const { version, edits } = await this.json<LogOut>("");
    this.version = version;
    return edits.edits ?? [];
  }

  /** The scan after the log; writes nothing. */
  async try(edits: readonly Edit[]): Promise<EditResult> {
    return (await this.post<PreviewIn, PreviewOut>("/try", { edits: logOf(edits) })).result;
  }

  async save(edits: readonly Edit[]): Promise<void> {
    this.version = (await this.post<SaveIn, SaveOut>("", { version: this.version, edits: logOf(edits) })).version;
  }

  /** Problems on the holds of the wall as the log makes it; takes seconds. */
  propose(edits: readonly Edit[], spec: ProblemSpec): Promise<Proposals> {
    return this.post<ProposeIn, Proposals>("/problems", { edits: logOf(edits), spec });
  }

  /** Changes that make a route one grade easier, or harder. */
  adjustGrade(edits: readonly Edit[], route: number, way: Way): Promise<Tweaks> {
    return this.post<EaseIn, Tweaks>("/ease", { edits: logOf(edits), route, way });
  }

  state(): Promise<RebuildStatus> {
    return this.json<RebuildStatus>("/state");
  }

  /** Crops of the photos at a place, best first. */
  async photos(at: Vec3): Promise<Crop[]> {
    return (await this.json<CropsOut>(`/../photos?at=${at.map((v) => v.toFixed(3)).join(",")}`)).photos;
  }

  private post<Body, T>(path: string, body: Body): Promise<T> {
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
    const reply = (await answer.json().catch(() => ({}))) as T & Refusal;
    if (!answer.ok) throw new Error(problemWords(reply.key, reply.error ?? reply.title) || say().answered(answer.status));
    return reply;
  }
}
