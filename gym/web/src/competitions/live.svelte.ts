/** A board that keeps itself up to date: by server-sent events, or by polling if the stream fails. */

import { PREFIX, ApiError } from "../api/client";
import { board as ask } from "./asking";
import type { Board, Line, Team } from "./facts";

const ASK_MS = 10_000;
const AGAIN_MS = 15_000;
// A proxy may hold a stream back: it is open, and no message comes. The first one comes at once.
const SILENT_MS = 5_000;
// Interval of requests for missing messages, and the time that one may be on its way.
const CHECK_MS = 30_000;
const LATE_MS = 3_000;
// Behind every rank; Infinity less itself is no number.
const LAST = 1e9;

type LiveMessage = ({ kind: "board" } & Board) | { kind: "lines"; seq: number; at: string | null; categories: { id: string; lines: Line[] }[]; teams?: Team[] };

/** The competition is over: no more changes will come. */
const isOver = (board: Board | undefined): boolean => board?.state === "ended";

/** The best first; competitors without a rank last, by bib. */
export function inOrder(lines: readonly Line[]): Line[] {
  return [...lines].sort((a, b) => (a.rank ?? LAST) - (b.rank ?? LAST) || a.bib - b.bib);
}

/** A board with the lines that changed. */
export function merged(board: Board, { seq, at, categories, teams }: Omit<LiveMessage & { kind: "lines" }, "kind">): Board {
  const changed = new Map(categories.map(({ id, lines }) => [id, new Map(lines.map((line) => [line.entry_id, line]))]));
  const of = (category: Board["categories"][number]): Board["categories"][number] => {
    const rows = changed.get(category.id);
    if (!rows) return category;
    const stay = category.lines.filter(({ entry_id }) => !rows.has(entry_id));
    return { ...category, lines: inOrder([...stay, ...rows.values()]) };
  };
  return { ...board, seq, at, categories: board.categories.map(of), teams: teams ?? board.teams };
}

export class LiveBoard {
  board = $state.raw<Board>();
  problem = $state.raw<ApiError | null>(null);
  /** Whether changes are streamed; otherwise they are polled. */
  live = $state(false);
  private source: EventSource | null = null;
  private asking = 0;
  private again = 0;
  private silent = 0;
  private checking = 0;

  constructor(private readonly path: { gym: string; competition: string }) {}

  /** Start following; returns a function that stops. */
  watch(): () => void {
    this.open();
    this.checking = window.setInterval(() => void this.check(), CHECK_MS);
    return () => this.stop();
  }

  private stop(): void {
    this.source?.close();
    clearInterval(this.asking);
    clearInterval(this.checking);
    clearTimeout(this.again);
    clearTimeout(this.silent);
  }

  private open(): void {
    this.source?.close();
    this.source = new EventSource(`${PREFIX}/gyms/${this.path.gym}/competitions/${this.path.competition}/board/events`);
    this.source.onmessage = ({ data }: MessageEvent<string>) => this.message(JSON.parse(data) as LiveMessage);
    this.source.onerror = () => this.broke();
    clearTimeout(this.silent);
    this.silent = window.setTimeout(() => this.broke(), SILENT_MS);
  }

  private message(message: LiveMessage): void {
    clearInterval(this.asking);
    clearTimeout(this.again);
    clearTimeout(this.silent);
    this.asking = this.again = 0;
    this.live = true;
    this.problem = null;
    if (message.kind === "board") this.board = { ...message, categories: message.categories.map((one) => ({ ...one, lines: inOrder(one.lines) })) };
    else if (this.board) this.board = merged(this.board, message);
  }

  /** Browsers do not reopen a stream that was answered by an error, so that is done here. */
  private broke(): void {
    this.live = false;
    clearTimeout(this.silent);
    this.source?.close();
    if (isOver(this.board)) return;
    this.again ||= window.setTimeout(() => {
      this.again = 0;
      this.open();
    }, AGAIN_MS * (0.75 + Math.random() / 2));
    if (this.asking) return;
    void this.ask();
    this.asking = window.setInterval(() => void this.ask(), ASK_MS);
  }

  /** A stream that is held back further on brings no messages either, though the board goes on. */
  private async check(): Promise<void> {
    if (!this.live || document.visibilityState !== "visible") return;
    const { seq } = await ask(this.path).catch(() => ({ seq: 0 }));
    await new Promise((resolve) => setTimeout(resolve, LATE_MS));
    if (this.live && this.board && seq > this.board.seq) this.broke();
  }

  private async ask(): Promise<void> {
    try {
      const board = await ask(this.path);
      if (!this.live) this.board = board;
      this.problem = null;
      if (isOver(board)) this.stop();
    } catch (error) {
      const problem = ApiError.of(error);
      this.problem = problem.status === 0 && this.board ? null : problem;
    }
  }
}
