/** Loading a wall: its first tier, the finer one after it, and its pictures again after the GPU lost them. */

import { say } from "../languages";
import type { Stage } from "../scene/stage";
import { takePreload } from "../tiers/preload";
import { readWall, reasonOf } from "../tiers/read_wall";
import type { WallModel } from "../tiers/read_wall";
import { WorkerClient } from "../tiers/worker_client";
import { yieldToPage } from "../tiers/yield_to_page";
import type { Parts } from "./parts";

export class Loading {
  /** Stops the present load; null before the first. */
  private stop: AbortController | null = null;
  /** Reads the tiers; started before they have come. */
  private reader: WorkerClient | null = null;

  /** `shown`: called once the first tier is in the picture. */
  constructor(
    private readonly parts: Parts,
    private readonly shown: (stage: Stage) => void,
  ) {}

  /** Says when the present load was stopped; null before the first. */
  get signal(): AbortSignal | null {
    return this.stop?.signal ?? null;
  }

  /** Show only a poster, and call `begin` once the element is within a screen of what is seen. */
  whenNear(begin: () => void, gone: AbortSignal): void {
    const { element, placeholder } = this.parts;
    placeholder.idle(element.getAttribute("heading"), element.getAttribute("poster"));
    const watcher = new IntersectionObserver(
      (seen) => {
        if (!seen.some(({ isIntersecting }) => isIntersecting)) return;
        watcher.disconnect();
        begin();
      },
      { rootMargin: "100%" },
    );
    watcher.observe(element);
    gone.addEventListener("abort", () => watcher.disconnect());
  }

  /** Begin to read the first tier; null where the page names none. */
  request(): Promise<WallModel> | null {
    const { element, placeholder } = this.parts;
    const source = element.getAttribute("src");
    this.stop?.abort();
    this.reader?.end();
    const ahead = takePreload(source ?? "");
    this.reader = ahead?.reader ?? new WorkerClient();
    const { signal } = (this.stop = ahead?.stop ?? new AbortController());
    element.removeAttribute("data-ready");
    if (!source) return null;
    const progress = placeholder.waiting(element.getAttribute("heading"), element.getAttribute("poster"));
    if (ahead) {
      ahead.progress = progress;
      return ahead.coming;
    }
    const title = element.getAttribute("heading") ?? say().words.wall;
    const coming = readWall(this.reader, source, { progress, title, signal });
    coming.catch(() => {}); // `load` tells it, once it is there to wait
    return coming;
  }

  /** Show the first tier, then the finer one. */
  async load(coming = this.request()): Promise<void> {
    if (!coming) return this.fail(say().words.noSource);
    const { parts } = this;
    const { signal } = this.stop!;
    let finer: Promise<WallModel> | null = null;
    try {
      const wall = await coming;
      if (signal.aborted || !parts.stage) return;
      parts.tables = wall.tables;
      const heading = parts.element.getAttribute("heading");
      if (heading !== null) parts.tables.title = heading;
      await parts.stage.prepare(wall, this.reader!, signal);
      if (signal.aborted) return;
      finer = this.requestFiner(signal); // read while the first tier is drawn
      await yieldToPage();
      parts.list.fill(parts.tables);
      await yieldToPage();
      if (signal.aborted) return;
      parts.stage.show(wall, false);
      await yieldToPage();
      if (signal.aborted) return;
      this.shown(parts.stage);
    } catch (error) {
      if (!signal.aborted) this.fail(say().failed(reasonOf(error)));
      return;
    }
    if (finer) await this.refine(finer, signal);
  }

  /** The GPU lost the pictures: they are read once more from the file of what is shown. */
  async refill(stage: Stage): Promise<void> {
    const { signal } = this.stop!;
    const reader = this.reader!;
    try {
      await stage.refill(await readWall(reader, stage.shown!, { signal }), reader, signal);
    } catch (error) {
      if (!signal.aborted) this.fail(say().failed(reasonOf(error)));
    }
  }

  fail(text: string): void {
    const { parts } = this;
    parts.placeholder.failed(text, parts.stage ? () => location.reload() : null);
    parts.element.setAttribute("data-ready", "error");
    parts.emit("wall-error", { message: text });
  }

  dispose(): void {
    this.stop?.abort();
    this.reader?.end();
  }

  private requestFiner(signal: AbortSignal): Promise<WallModel> | null {
    const { element, progressLine } = this.parts;
    const source = element.getAttribute("detail");
    if (!source) return null;
    progressLine.hidden = false;
    const line = progressLine.querySelector("i")!;
    const progress = (share: number): void => void (line.style.width = `${share * 100}%`);
    const coming = readWall(this.reader!, source, { progress, signal });
    coming.catch(() => {}); // `refine` tells it
    return coming;
  }

  /** The finer tier, once the first one stands. It is a bonus: if it fails, say so and go on. */
  private async refine(coming: Promise<WallModel>, signal: AbortSignal): Promise<void> {
    const { parts } = this;
    try {
      const wall = await coming;
      if (signal.aborted || !parts.stage) return;
      await parts.stage.prepare(wall, this.reader!, signal);
      if (signal.aborted) return;
      parts.stage.show(wall, true);
      parts.stage.drawNow();
      parts.element.setAttribute("data-ready", "detail");
    } catch (error) {
      if (!signal.aborted) parts.say(say().finerFailed(reasonOf(error)));
    } finally {
      if (!signal.aborted) parts.progressLine.hidden = true;
    }
  }
}
