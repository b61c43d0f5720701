/** Changes of published routes: their facts as a form has them, saving, and undo. */

import { answer, api } from "../api/client";
import type { Route } from "../walls/find";

export interface Facts {
  name: string;
  colour: string;
  /** `system|label`; empty: none. */
  grade: string;
  setter: string;
  tags: string;
  set: string;
  strips: string;
  /** Id of the rope's line; empty: a boulder. */
  line: string;
}

export function factsOf(route: Route): Facts {
  return {
    name: route.name,
    colour: route.colour,
    grade: route.grade ? `${route.grade_system_id}|${route.grade}` : "",
    setter: route.setter,
    tags: route.tags.join(", "),
    set: route.set_on,
    strips: route.strip_on ?? "",
    line: route.line?.id ?? "",
  };
}

export function isSame(one: Facts, other: Facts): boolean {
  return (Object.keys(one) as (keyof Facts)[]).every((field) => one[field] === other[field]);
}

/** The facts as the server expects them, of a new route and of a change. */
export function wordsOf(facts: Facts) {
  const [system, label] = facts.grade.split("|");
  return {
    name: facts.name,
    colour: facts.colour,
    grade_system_id: system || null,
    grade: label ?? "",
    setter: facts.setter,
    tags: facts.tags.split(",").map((tag) => tag.trim()).filter(Boolean),
    ...(facts.set ? { set_on: facts.set } : {}),
    strip_on: facts.strips || null,
    line_id: facts.line || null,
  };
}

interface Change {
  route: string;
  before: Facts;
  after: Facts;
}

/** Saves changes one by one and can take back the last saved group. */
export class Mending {
  private saved = $state.raw<Change[]>([]);
  private gym: () => string;

  constructor(gym: () => string) {
    this.gym = gym;
  }

  get canUndo(): boolean {
    return this.saved.length > 0;
  }

  /** Sends the changes; what the server accepted before a refusal can be undone. */
  async save(changes: Change[]): Promise<void> {
    const sent: Change[] = [];
    try {
      for (const change of changes) {
        await this.send(change.route, change.after);
        sent.push(change);
      }
    } finally {
      if (sent.length) this.saved = sent;
    }
  }

  async undo(): Promise<void> {
    for (const { route, before } of this.saved) await this.send(route, before);
    this.saved = [];
  }

  forget(): void {
    this.saved = [];
  }

  private async send(route: string, facts: Facts): Promise<void> {
    const params = { path: { gym: this.gym(), route } };
    await answer(api.PATCH("/api/v1/gyms/{gym}/routes/{route}", { params, body: wordsOf(facts) }));
  }
}
