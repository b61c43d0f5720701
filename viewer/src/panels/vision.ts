/** The reader's colour vision: chosen once, kept in the browser. */

import { isVision, VISIONS } from "../data/colour_vision";
import type { Vision } from "../data/colour_vision";
import { say } from "../languages";
import { capital } from "../languages/format";
import { h } from "./dom";

const KEPT = "walltopo-colour-vision";

/** A browser may forbid a page to keep anything. */
export function keptVision(): Vision | null {
  try {
    const name = localStorage.getItem(KEPT);
    return isVision(name) ? name : null;
  } catch {
    return null;
  }
}

function keepVision(vision: Vision | null): void {
  try {
    if (vision) localStorage.setItem(KEPT, vision);
    else localStorage.removeItem(KEPT);
  } catch {
    // Then it is for this visit alone.
  }
}

export function visionChoice(now: Vision | null, chosen: (vision: Vision | null) => void): HTMLElement {
  const { words, visions } = say();
  const choose = h("select", { "aria-label": words.colourVision });
  choose.append(h("option", { value: "" }, `${words.colourVision}: ${visions.usual}`));
  for (const vision of VISIONS) choose.append(h("option", { value: vision }, capital(visions[vision])));
  choose.value = now ?? "";
  choose.addEventListener("change", () => {
    const vision = isVision(choose.value) ? choose.value : null;
    keepVision(vision);
    chosen(vision);
  });
  return choose;
}
