/** Names of hold paint, as `walltopo.holds.palette` has them; a gym's own names stay as they are. */

import { t, type Key } from "../i18n.svelte";

const PAINT: Record<string, string> = {
  black: "#262628", grey: "#7d7f82", white: "#e8e8e2", red: "#c32026", orange: "#ee761e", yellow: "#f5c819",
  lime: "#96c832", green: "#289141", mint: "#3cbea5", sky: "#64b4e1", blue: "#1e55b9", purple: "#6e37a0",
  pink: "#e65091", brown: "#6e482d", wood: "#c8a070",
};

export function css(colour: string): string {
  return PAINT[colour] ?? "transparent";
}

/** A colour in the reader's language, such as "Red". */
export function colourName(colour: string): string {
  return colour in PAINT ? t(`colour.${colour}` as Key) : colour || t("colour.none");
}
