// The server as the outbox meets it: what it keeps (as `climbing/edits.py` and `competitions/judging.py` do, which have tests
// of their own), and a network between that loses, doubles and delays.

const OK = { status: 200 };

export class Server {
  /** Ascents by id, opinions by person and route, score events by id: what was taken, by whom, of which edit. */
  ascents = new Map();
  opinions = new Map();
  events = new Map();
  /** Every request that reached it, in order: method, path, person, and the number of the edit. */
  reached = [];
  /** Ids that it will not have. */
  unwanted = new Set();
  person = "ada";

  /** `person`: whose cookie comes with it. */
  take({ method, path, body, person, wanted }) {
    if (!person || (wanted && wanted !== person)) return { status: 401 };
    if (path === "/me") return { status: 200, body: { id: person } };
    const [id, kind] = path.split("/").reverse();
    this.reached.push({ method, path, id, person, number: body?.edit?.number });
    if (this.unwanted.has(id)) return { status: 403, body: { title: "not this one" } };
    if (method === "DELETE") return this.#takeBack(id, person);
    if (kind === "ascents") return this.#edited(this.ascents, id, person, body);
    if (id === "opinion") return this.#edited(this.opinions, `${person}/${kind}`, person, body);
    if (kind === "events") return this.#score(id, person, body);
    throw new Error(`no such endpoint: ${method} ${path}`);
  }

  #takeBack(id, person) {
    const row = this.ascents.get(id);
    if (row?.person !== person) return { status: 404, body: { title: "no such ascent" } };
    row.gone = true;
    return OK;
  }

  #edited(rows, key, person, { edit, ...words }) {
    const row = rows.get(key) ?? { person, number: 0, edits: [] };
    if (row.person !== person) return { status: 409, body: { title: "this id is taken" } };
    rows.set(key, row);
    if (row.gone || edit.number <= row.number) return OK;
    Object.assign(row, { number: edit.number, words });
    row.edits.push(edit.number);
    return OK;
  }

  #score(id, person, body) {
    const { sent_at, ...words } = body;
    if (words.target_id && !this.events.has(words.target_id)) return { status: 404, body: { title: "no such score event" } };
    if (!this.events.has(id)) this.events.set(id, { person, words });
    return OK;
  }
}

/** What becomes of a request: whether it arrives, how often, and what is answered; a late one arrives when its sender has given up. */
export const FATES = {
  fine: { copies: 1 },
  down: { copies: 0, answer: "none" },
  lost: { copies: 1, answer: "none" },
  busy: { copies: 0, answer: 503 },
  broken: { copies: 1, answer: 500 },
  twice: { copies: 2 },
  late: { copies: 0, answer: "none", later: 1 },
};

/** `fate(request)` says what becomes of each; `late` are the copies that are still under way. */
export class Network {
  late = [];
  /** What was asked for, arrived or not: the last part of each address. */
  asked = new Set();

  constructor(server, fate) {
    Object.assign(this, { server, fate });
    globalThis.fetch = (address, init) => this.#fetch(address, init);
  }

  async #fetch(address, { method, body, headers }) {
    const path = address.replace("/api/v1", "");
    const said = { method, path, body: body && JSON.parse(body), wanted: headers?.["x-walltopo-person"] };
    this.asked.add(path.split("/").at(-1));
    const { fate, pause } = this.fate(said);
    const request = { ...said, person: this.server.person };
    const { copies, answer = "own", later = 0 } = FATES[fate];
    await pause;
    let told;
    for (let copy = 0; copy < copies; copy++) told = this.server.take(request);
    for (let copy = 0; copy < later; copy++) this.late.push(request);
    if (answer === "none") throw new TypeError("no reception");
    if (answer !== "own") return new Response("", { status: answer });
    return new Response(told.body ? JSON.stringify(told.body) : null, { status: told.status });
  }

  /** One of the late copies arrives at last. */
  deliver(place) {
    for (const request of this.late.splice(place, 1)) this.server.take(request);
  }
}
