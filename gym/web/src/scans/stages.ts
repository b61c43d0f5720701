/** The stages of a scan in their order, as `walltopo.pipeline` runs them. */
export const STAGES = [
  "ingest", "sparse", "scale", "dense", "texture", "detect", "lift", "propose", "classify", "routes", "edit", "export",
] as const;
