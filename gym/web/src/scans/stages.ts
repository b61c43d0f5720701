/** The stages of a scan in their order, as `walltopo.pipeline` runs them. */
const STAGES = [
  "ingest", "sparse", "scale", "dense", "texture", "detect", "lift", "propose", "classify", "routes", "join", "edit", "export",
] as const;

/** The stages of one scan: only a partial rescan is joined with the wall that it is a part of. */
export function stagesOf({ part }: { part: boolean }): (typeof STAGES)[number][] {
  return STAGES.filter((stage) => part || stage !== "join");
}
