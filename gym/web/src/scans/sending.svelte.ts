/** Sends photos and clips by tus, a few at a time; resumes by itself after a broken connection, and in a later tab. */

import type { Upload } from "tus-js-client";
import { PREFIX, ApiError } from "../api/client";
import { t } from "../i18n.svelte";
import { forget, hashOf, keep, pendingOf } from "./pending";

const AT_ONCE = 3;
// For a phone in a basement: growing delays, then every half minute for an hour.
const WAITS_MS = [500, 1000, 2000, 4000, 8000, 16000, ...Array<number>(120).fill(30000)];

export class Sent {
  sent = $state(0);
  problem = $state.raw<ApiError | null>(null);
  done = $state(false);
  begun = false;
  upload: Upload | null = null;

  constructor(
    readonly hash: string,
    readonly file: File,
  ) {}
}

export class Sending {
  /** The uploads of this tab. */
  photos = $state<Sent[]>([]);
  /** Files that are checked before they are sent. */
  reading = $state(0);
  /** Whether this browser stores pending photos, in case the tab is closed. */
  kept = $state(true);
  private stopped = false;

  constructor(
    /** Under which this browser keeps what is pending: the id of a scan or of a route. */
    private readonly key: string,
    /** The path, below the API's, at which a file is announced. */
    private readonly path: string,
    /** Called when a photo has arrived. */
    private readonly arrived: () => void,
  ) {}

  /** Resume the uploads of an earlier tab. */
  async resume(): Promise<void> {
    for (const { hash, file } of await pendingOf(this.key)) this.add(hash, file);
    this.next();
  }

  async choose(files: Iterable<File>): Promise<void> {
    const chosen = [...files];
    this.reading += chosen.length;
    // One after the other: a phone lacks the memory for all.
    for (const file of chosen) {
      const hash = await hashOf(file).catch(() => "");
      this.reading -= 1;
      if (!hash) {
        this.unreadable(file); // too large for this browser, or moved away meanwhile
        continue;
      }
      // Even if the page was left meanwhile: the next one sends it.
      if (!(await keep(this.key, { hash, file }))) this.kept = false;
      if (this.stopped) continue;
      this.add(hash, file);
      this.next();
    }
  }

  /** The page was left: uploads pause. */
  stop(): void {
    this.stopped = true;
    for (const { upload } of this.photos) void upload?.abort();
  }

  /** List a file that cannot be read with the reason; the others go on. */
  private unreadable(file: File): void {
    const photo = new Sent(`unread ${file.name} ${file.size}`, file);
    photo.problem = new ApiError(0, t("photos.unread"), t("photos.unreadHint"));
    this.photos = [...this.photos.filter(({ hash }) => hash !== photo.hash), photo];
  }

  private add(hash: string, file: File): void {
    const known = this.photos.find((photo) => photo.hash === hash);
    if (!known) this.photos.push(new Sent(hash, file));
    else if (known.problem) {
      known.problem = null;
      known.upload = null;
      known.begun = false;
    }
  }

  private next(): void {
    if (this.stopped) return;
    const busy = this.photos.filter(({ begun, done, problem }) => begun && !done && !problem).length;
    const waiting = this.photos.filter(({ begun, problem }) => !begun && !problem);
    for (const photo of waiting.slice(0, Math.max(0, AT_ONCE - busy))) {
      photo.begun = true;
      void this.send(photo);
    }
  }

  private async send(photo: Sent): Promise<void> {
    const tus = await this.sender();
    if (this.stopped) return;
    if (!tus) {
      photo.problem = ApiError.unreachable();
      return;
    }
    const upload = new tus.Upload(photo.file, {
      endpoint: `${location.origin}${PREFIX}${this.path}`,
      // The server recognises a photo by its hash and reports the last tab's offset.
      metadata: { filename: photo.file.name, sha256: photo.hash },
      storeFingerprintForResuming: false,
      retryDelays: WAITS_MS,
      onProgress: (sent) => void (photo.sent = sent),
      onAfterResponse: (request, response) => {
        const here = Number(response.getHeader("Upload-Offset") ?? 0);
        if (request.getMethod() !== "POST" || here === 0) return;
        // Announced before: request the offset, or skip it if complete.
        void upload.abort().then(() => {
          if (here >= photo.file.size) this.finished(photo);
          else upload.start();
        });
      },
      onSuccess: () => this.finished(photo),
      onError: (error) => this.failed(photo, error),
    });
    photo.upload = upload;
    upload.start();
  }

  /** The script that sends. Most visits of a scan send nothing, so it comes with the first photo, as late as the server does. */
  private async sender(): Promise<typeof import("tus-js-client") | null> {
    for (const wait of WAITS_MS) {
      const tus = await import("tus-js-client").catch(() => null);
      if (tus || this.stopped) return tus;
      await new Promise((resolve) => setTimeout(resolve, wait));
    }
    return null;
  }

  private finished(photo: Sent): void {
    photo.done = true;
    photo.sent = photo.file.size;
    void forget(this.key, photo.hash);
    this.arrived();
    this.next();
  }

  private failed(photo: Sent, error: Error): void {
    const answer = "originalResponse" in error ? (error.originalResponse as { getStatus(): number; getBody(): string } | null) : null;
    let body: unknown = null;
    try {
      body = JSON.parse(answer?.getBody() ?? "");
    } catch {
      // A proxy's page, or nothing at all.
    }
    photo.problem = answer ? ApiError.from(answer.getStatus(), body) : ApiError.of(new TypeError(error.message));
    // Refused for its content: a retry would be refused again.
    if (answer && answer.getStatus() >= 400 && answer.getStatus() < 500) void forget(this.key, photo.hash);
    this.next();
  }
}
