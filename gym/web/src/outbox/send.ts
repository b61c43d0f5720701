/** Sends waiting items from any tab or the service worker, one at a time (Web Locks). */

import { isPortal } from "../offline/portal";
import { result as sentEdit } from "./edits";
import { all, GUEST, keyOf, linkOf, revise, type Item } from "./store";

const API = "/api/v1";
const PATIENCE_MS = 30_000;

/** "later": the server is unreachable or busy; "sign-in": the item's person is not signed in. */
export type Outcome = "empty" | "later" | "sign-in";

class Unreachable extends Error {}

/** `person`: the item's owner; the server refuses it (401) if another person is signed in by now. */
async function ask(method: string, path: string, person = "", body?: unknown): Promise<Response> {
  const headers: Record<string, string> = person ? { "x-walltopo-person": person } : {};
  if (body !== undefined) headers["content-type"] = body instanceof Blob ? body.type : "application/json";
  const sent = body === undefined || body instanceof Blob ? body : JSON.stringify(body);
  try {
    // "no-store": this answer is the server's own, never a kept one.
    const answer = await fetch(API + path, { method, headers, body: sent, cache: "no-store", signal: AbortSignal.timeout(PATIENCE_MS) });
    if (!isPortal(answer)) return answer;
  } catch {
    // No connection.
  }
  throw new Unreachable();
}

function isBusy({ status }: Response): boolean {
  return status >= 500 || [408, 425, 429].includes(status);
}

/** Sends an item. For withdrawals, the item itself goes first, so that its late copies are recognised as older. */
async function put(item: Item): Promise<Response> {
  if (item.what === "score") {
    // Both times are this device's, so that the server can correct its clock.
    const body = { ...item.body, sent_at: new Date().toISOString() };
    if (item.link) return ask("PUT", `/judge-links/${item.link}/events/${item.id}`, "", body);
    return ask("PUT", `/gyms/${item.gym}/competitions/${item.competition}/events/${item.id}`, item.person, body);
  }
  // The server keeps one open report of a person, hold and kind, whatever is sent again.
  if (item.what === "ascents") return putMany(item);
  if (item.what === "hold") return ask("PUT", `/gyms/${item.gym}/hold-reports/${item.id}`, item.person, item.body);
  const body = item.edit ? { ...item.body, edit: sentEdit(item.edit) } : item.body;
  if (item.what === "opinion") return ask("PUT", `/gyms/${item.gym}/routes/${item.route}/opinion`, item.person, body);
  if (item.what === "climbed") return ask("PUT", `/gyms/${item.gym}/problems/${item.problem}/climbed`, item.person, body);
  if (item.what === "inspection") return putMark(item, body);
  return putOwn(item, body);
}

/** The photo goes first: the mark names it. A photo that was sent twice is stored once. */
async function putMark({ gym, person, inspection, id, photo }: Extract<Item, { what: "inspection" }>, body: object): Promise<Response> {
  const path = `/gyms/${gym}/inspections/${inspection}`;
  if (!photo) return ask("PUT", `${path}/entries/${id}`, person, body);
  const sent = await ask("POST", `${path}/photos`, person, photo);
  if (!sent.ok) return sent;
  return ask("PUT", `${path}/entries/${id}`, person, { ...body, ...((await sent.json()) as { photo: string }) });
}

/** All rows in one request; a withdrawal follows row by row. */
async function putMany({ gym, person, rows, edit, takenBack }: Extract<Item, { what: "ascents" }>): Promise<Response> {
  const body = { ascents: rows.map(({ id, body }) => ({ id, ...body })), ...(edit ? { edit: sentEdit(edit) } : {}) };
  const result = await ask("PUT", `/gyms/${gym}/ascents`, person, body);
  if (!takenBack || result.status === 401 || isBusy(result)) return result;
  for (const { id } of rows) {
    const answer = await ask("DELETE", `/me/ascents/${id}`, person);
    if (answer.status === 401 || isBusy(answer)) return answer;
  }
  return new Response(null, { status: 204 });
}

const OWN = { ascent: "ascents", problem: "problems", list: "lists" } as const;

/** An ascent of a wrong day, or a problem whose holds are gone, is refused, and deleted all the same. */
async function putOwn({ what, id, gym, person, takenBack }: Extract<Item, { what: keyof typeof OWN }>, body: unknown): Promise<Response> {
  const kind = OWN[what];
  const result = await ask("PUT", `/gyms/${gym}/${kind}/${id}`, person, body);
  if (!takenBack || result.status === 401 || isBusy(result)) return result;
  const answer = await ask("DELETE", `/me/${kind}/${id}`, person);
  return answer.status === 404 ? new Response(null, { status: 204 }) : answer;
}

async function why(answer: Response): Promise<NonNullable<Item["refused"]>> {
  const result = (await answer.json().catch(() => ({}))) as { title?: string; hint?: string };
  return { status: answer.status, message: result.title ?? "", hint: result.hint ?? "", body: result };
}

async function sendOne(item: Item): Promise<Outcome> {
  if ("takenBack" in item && item.takenBack && item.sent === 0 && !item.known) {
    await revise(item, () => null); // it never left
    return "empty";
  }
  // Stored before it leaves, because the server may have it from now on. The version stays, since its content does.
  if (!(await revise(item, (now) => ({ ...now, sent: now.sent + 1 })))) return "empty"; // it was changed meanwhile
  const answer = await put(item);
  if (answer.status === 401) return "sign-in";
  if (isBusy(answer)) return "later";
  const refused = answer.ok ? null : await why(answer);
  const done = answer.ok ? Date.now() : null;
  // No page of its climber shows a report, so nothing waits for one to show it.
  await revise(item, (now) => (done && now.what === "hold" ? null : { ...now, done, refused }));
  return "empty";
}

async function whoIsHere(): Promise<string | Outcome> {
  const answer = await ask("GET", "/me");
  if (answer.ok) return ((await answer.json()) as { id: string }).id;
  return answer.status === 401 ? "sign-in" : "later";
}

/** Ids of the items that are sent before this one: a withdrawal follows its event, an ascent and a list their problems. */
function before(item: Item): string[] {
  if (item.what === "score") return item.body.target_id === null ? [] : [item.body.target_id];
  if (item.what === "list") return item.body.items;
  return item.what === "climbed" ? [item.problem] : [];
}

async function sendWaiting(): Promise<Outcome> {
  const waiting = async () => (await all()).filter(({ person, done, refused }) => person !== GUEST && done === null && !refused);
  const first = await waiting();
  if (first.length === 0) return "empty";
  // A judge's link needs no account.
  const person = first.every(linkOf) ? "" : await whoIsHere();
  let outcome: Outcome = person === "later" || person === "sign-in" ? person : "empty";
  const mayGo = (item: Item): boolean => linkOf(item) !== undefined || item.person === person;
  const tried = new Set<string>();
  for (;;) {
    // Read again after each item: more may have come meanwhile.
    const rows = await waiting();
    const here = new Set(rows.map((item) => (item.what === "score" || item.what === "problem") && item.id));
    const isNext = (item: Item): boolean => !before(item).some((id) => here.has(id));
    const next = rows.find((item) => mayGo(item) && isNext(item) && !tried.has(`${keyOf(item)} ${item.version}`));
    if (!next) return outcome;
    tried.add(`${keyOf(next)} ${next.version}`);
    const came = await sendOne(next);
    if (came === "sign-in" && !linkOf(next)) return came;
    if (came === "later") outcome = "later"; // the others may get through
  }
}

/** Send all items of the signed-in person, and those of judges' links. */
export async function send(): Promise<Outcome> {
  const attempt = (): Promise<Outcome> =>
    sendWaiting().catch((error: unknown) => {
      if (error instanceof Unreachable) return "later";
      throw error;
    });
  return "locks" in navigator ? navigator.locks.request("walltopo-outbox", attempt) : attempt();
}
