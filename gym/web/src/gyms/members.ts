/** The members of a gym, by name. */

import { answer, api, type Schemas } from "../api/client";

export async function allMembers(gym: string): Promise<Schemas["Member"][]> {
  const found: Schemas["Member"][] = [];
  for (let cursor: string | null | undefined; cursor !== null; ) {
    const query: { size: number; cursor?: string } = cursor ? { size: 200, cursor } : { size: 200 };
    const page: Schemas["Page_Member_"] = await answer(api.GET("/api/v1/gyms/{gym}/members", { params: { path: { gym }, query } }));
    found.push(...page.items);
    cursor = page.next;
  }
  return found.sort((one, other) => one.name.localeCompare(other.name));
}
