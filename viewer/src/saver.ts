/** Reads and saves the edits of a scan at the server that shows it. */

import type { EditDocument } from "./edits";

export class Saver {
  /** Which edits were read or saved last: the server refuses to replace others. */
  private version = "";

  constructor(
    private readonly address: string,
    private readonly token: string,
  ) {}

  /** Throws with a sentence of the server's. */
  async read(): Promise<EditDocument> {
    return (await this.ask({})) as EditDocument;
  }

  /** Throws with a sentence of the server's; then nothing was saved. */
  async save(body: string): Promise<void> {
    const headers = { "Content-Type": "application/json", "If-Match": this.version };
    await this.ask({ method: "POST", headers, body });
  }

  private async ask(request: RequestInit): Promise<unknown> {
    const headers = { ...request.headers, "X-Walltopo-Token": this.token };
    let answer: Response;
    try {
      answer = await fetch(this.address, { ...request, headers });
    } catch {
      throw new Error("walltopo view does not answer any more");
    }
    const said = (await answer.json().catch(() => ({}))) as { error?: string };
    if (!answer.ok) throw new Error(said.error ?? `the server answered ${answer.status}`);
    this.version = answer.headers.get("ETag") ?? "";
    return said;
  }
}
