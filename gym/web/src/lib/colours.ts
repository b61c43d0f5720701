/** Names of hold paint, as `walltopo.describe.classify.palette` has them; a gym's own names stay as they are. */

import paint from "../../../src/walltopo_gym/paint.json";
import { t, type Key } from "../i18n.svelte";
import { patternOver } from "./vision.svelte";

const PAINT: Record<string, string> = paint;

/** All names of hold paint. */
export const COLOURS = Object.keys(PAINT);

/** A CSS background; with a pattern where the colour looks like others to the reader. */
export function css(colour: string): string {
  return patternOver(colour) + (PAINT[colour] ?? "transparent");
}

/** A colour in the reader's language, such as "Red". */
export function colourName(colour: string): string {
  return colour in PAINT ? t(`colour.${colour}` as Key) : colour || t("colour.none");
}
