/** Grades as selects have them: `system|label`, empty for none. */

import type { Schemas } from "../api/client";

export type System = Schemas["GradeSystemOut"];

export function keyOf(system: string | null, grade: string): string {
  return grade && system ? `${system}|${grade}` : "";
}

/** The grade of a key, as request bodies have it. */
export function gradeOf(key: string): { grade_system_id: string | null; grade: string } {
  const [system, grade] = key.split("|");
  return { grade_system_id: system || null, grade: grade ?? "" };
}

/** The scale of a route, or all scales while it has none. */
export function scalesFor(systems: System[], system: string | null): System[] {
  const own = systems.filter(({ id }) => id === system);
  return own.length ? own : systems;
}
