// The server as the outbox sees it: its storage rules (those of `climbing/edits.py` and `competitions/judging.py`, which have tests
// of their own), and a network that loses, duplicates and delays.

const OK = { status: 200 };

export class Server {
  /** Ascents by id, opinions by person and route, score events by id: content, person, edit. */
  ascents = new Map();
  opinions = new Map();
  events = new Map();
  /** Problems by id, and whether they were climbed by person and problem. */
  problems = new Map();
  climbed = new Map();
  lists = new Map();
  /** Marks of inspections by id, and their photos. */
  marks = new Map();
  photos = new Set();
  /** Every request that reached it, in order: method, path, person, and the number of the edit. */
  reached = [];
  /** Ids that it refuses; of the second ones only what is stored, not what is deleted. */
  unwanted = new Set();
  wrong = new Set();
  person = "ada";
  /** Judges' links that this browser has opened. */
  links = new Set();

  /** `person`: the owner of the cookie. */
  take({ method, path, body, person, wanted }) {
    if (path.startsWith("/judge-links/")) return this.#byLink(path, body);
    if (!person || (wanted && wanted !== person)) return { status: 401 };
    if (path === "/me") return { status: 200, body: { id: person } };
    const [id, kind] = path.split("/").reverse();
    this.reached.push({ method, path, id, person, number: body?.edit?.number });
    if (this.unwanted.has(id)) return { status: 403, body: { title: "not this one" } };
    if (method === "PUT" && this.wrong.has(id)) return { status: 422, body: { title: "too early", code: "ascent-too-early", values: { day: "1970-01-01" } } };
    if (id === "ascents") return this.#many(person, body);
    if (method === "DELETE") return this.#takeBack(this[kind], id, person);
    if (kind === "ascents") return this.#edited(this.ascents, id, person, body);
    if (kind === "lists") return this.#list(id, person, body);
    if (kind === "problems") return this.#edited(this.problems, id, person, body);
    if (id === "climbed") return this.problems.has(kind) ? this.#edited(this.climbed, `${person}/${kind}`, person, body) : { status: 404, body: {} };
    if (id === "opinion") return this.#edited(this.opinions, `${person}/${kind}`, person, body);
    if (id === "photos") return this.#photo(body);
    if (kind === "entries") return this.#mark(id, person, body);
    if (kind === "events") return this.#score(id, person, body);
    throw new Error(`no such endpoint: ${method} ${path}`);
  }

  /** Without an account. */
  #byLink(path, body) {
    const [, , link, , id] = path.split("/");
    if (!this.links.has(link)) return { status: 401 };
    this.reached.push({ method: "PUT", path, id, person: "" });
    return this.#score(id, `link ${link}`, body);
  }

  #takeBack(rows, id, person) {
    const row = rows.get(id);
    if (row?.person !== person) return { status: 404, body: { title: "no such row" } };
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

  /** A list names problems that are stored already. */
  #list(id, person, body) {
    const isKnown = (item) => !item.startsWith("p") || this.problems.has(item);
    return body.items.every(isKnown) ? this.#edited(this.lists, id, person, body) : { status: 422, body: { code: "list-item-unknown" } };
  }

  /** All rows, or none. */
  #many(person, { ascents, edit }) {
    if (ascents.some(({ id }) => this.wrong.has(id))) return { status: 422, body: { title: "too early", code: "ascent-too-early" } };
    for (const { id, ...words } of ascents) this.#edited(this.ascents, id, person, { edit, ...words });
    return OK;
  }

  /** A photo is stored by its content, so that a second copy is the same. */
  #photo(photo) {
    const name = `${photo.type} ${photo.size}`;
    this.photos.add(name);
    return { status: 201, body: { photo: name } };
  }

  /** A mark names a photo that is stored already, and never changes. */
  #mark(id, person, { edit, ...words }) {
    if (words.photo && !this.photos.has(words.photo)) return { status: 422, body: { code: "inspection-photo-unknown" } };
    if (!this.marks.has(id)) this.marks.set(id, { person, words, number: edit.number });
    return OK;
  }

  #score(id, person, body) {
    const { sent_at, ...words } = body;
    if (words.target_id && !this.events.has(words.target_id)) return { status: 404, body: { title: "no such score event" } };
    if (!this.events.has(id)) this.events.set(id, { person, words });
    return OK;
  }
}

/** The fate of a request: whether it arrives, how often, and the answer; a late one arrives after its sender gave up. */
export const FATES = {
  fine: { copies: 1 },
  down: { copies: 0, answer: "none" },
  lost: { copies: 1, answer: "none" },
  portal: { copies: 0, answer: "portal" },
  busy: { copies: 0, answer: 503 },
  broken: { copies: 1, answer: 500 },
  twice: { copies: 2 },
  late: { copies: 0, answer: "none", later: 1 },
};

/** `fate(request)` gives the fate of each; `late` are the copies that are still under way. */
export class Network {
  late = [];
  /** Requested addresses, arrived or not: the last part of each. */
  requested = new Set();

  constructor(server, fate) {
    Object.assign(this, { server, fate });
    globalThis.fetch = (address, init) => this.#fetch(address, init);
  }

  async #fetch(address, { method, body, headers }) {
    const path = address.replace("/api/v1", "");
    const entered = { method, path, body: body instanceof Blob ? body : body && JSON.parse(body), wanted: headers?.["x-walltopo-person"] };
    this.requested.add(path.split("/").at(-1));
    const { fate, pause } = this.fate(entered);
    const request = { ...entered, person: this.server.person };
    const { copies, answer = "own", later = 0 } = FATES[fate];
    await pause;
    let result;
    for (let copy = 0; copy < copies; copy++) result = this.server.take(request);
    for (let copy = 0; copy < later; copy++) this.late.push(request);
    if (answer === "none") throw new TypeError("no reception");
    if (answer === "portal") return new Response("<!doctype html>", { headers: { "content-type": "text/html; charset=utf-8" } });
    if (answer !== "own") return new Response("", { status: answer });
    return new Response(result.body ? JSON.stringify(result.body) : null, { status: result.status });
  }

  /** One of the late copies arrives at last. */
  deliver(place) {
    for (const request of this.late.splice(place, 1)) this.server.take(request);
  }
}
