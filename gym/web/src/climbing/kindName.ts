import { t } from "../i18n.svelte";
import type { Discipline, Kind } from "../outbox/kinds";

/** The name of a result: a top on lead is a redpoint, and a high point says at which clip. */
export function kindName(kind: Kind, discipline: Discipline | undefined, clip?: number | null): string {
  if (kind === "high-point" && clip) return t("tick.atClip", { clip });
  return t(`tick.kind.${kind === "top" && discipline === "lead" ? "redpoint" : kind}`);
}
