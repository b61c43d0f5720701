// Entries of climbers and judges, as the app passes them to the outbox.

const GYM = "cave";
export const body = (route, kind, tries = 1) => ({ route_id: route, kind, tries, climbed_at: "2026-11-20T18:00:00Z", note: "" });

export function ascent(id, { route = "r1", kind = "top", tries = 1, takenBack = false, known = false, person = "ada" } = {}) {
  return { what: "ascent", id, route, person, gym: GYM, name: route, body: body(route, kind, tries), takenBack, known };
}

/** A list of ascents that is saved at once; `rows`: their ids. */
export function many(id, rows, { route = "r1", takenBack = false, known = false, person = "ada" } = {}) {
  return { what: "ascents", id, person, gym: GYM, name: "", rows: rows.map((row) => ({ id: row, name: route, body: body(route, "top") })), takenBack, known };
}

export function opinion(route, stars, person = "ada") {
  return { what: "opinion", route, person, gym: GYM, name: route, body: { grade: "", stars, wish: "", comment: "" } };
}

export function problem(id, { takenBack = false, known = false, person = "ada" } = {}) {
  const holds = [{ hold: 1, use: "start" }, { hold: 2, use: "top" }];
  const words = { wall_id: "w", scan_id: "s", holds, name: id, grade_system_id: null, grade: "", share: "gym", matching: true, note: "", remix_of: null };
  return { what: "problem", id, person, gym: GYM, name: id, body: words, takenBack, known };
}

export function list(id, items = [], { takenBack = false, known = false, person = "ada" } = {}) {
  return { what: "list", id, person, gym: GYM, name: id, body: { name: id, note: "", share: "gym", circuit: false, items }, takenBack, known };
}

export function climbed(problem, at = "2026-11-20T18:00:00Z", person = "ada") {
  return { what: "climbed", problem, person, gym: GYM, name: problem, body: { climbed_at: at } };
}

export function score(id, target = null, person = "ada") {
  const words = { entry_id: "e", problem_id: "p", kind: target ? "void" : "top", n: 1, target_id: target, text: "", device: "d", number: 1, made_at: "2026-11-20T18:00:00Z" };
  return { what: "score", id, competition: "c", person, gym: GYM, name: "score", body: words };
}

/** A score by a judge's link, without an account. */
export function byLink(id, link, target = null) {
  return { ...score(id, target, ""), link };
}

export function mark(id, { photo = null, person = "ada" } = {}) {
  const words = { wall_id: "w", item: null, hold: 1, mark: "washed", note: "" };
  return { what: "inspection", id, inspection: "i", person, gym: GYM, name: "Hold 1", body: words, photo };
}
