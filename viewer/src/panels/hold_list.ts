/** The holds of a route from its start to its top: the wall for keys and screen readers. */

import type { Vision } from "../data/colour_vision";
import type { Hold } from "../data/types";
import { say } from "../languages";
import { h } from "./dom";
import { stepFocus } from "./focus";
import { holdBackground } from "./swatch";

export interface HoldListActions {
  /** The hold in words. */
  words(hold: Hold): string;
  /** Show on the wall where a hold is; null: none. */
  point(hold: number | null): void;
  choose(hold: number): void;
  /** The list was folded out or in. */
  fold(open: boolean): void;
  /** The reader's colour vision. */
  vision: Vision | null;
}

export function holdList(holds: Hold[], open: boolean, act: HoldListActions): HTMLElement {
  const buttons = holds.map((hold) =>
    h(
      "button",
      { class: "route hold", "data-hold": hold.id, onClick: () => act.choose(hold.id), onFocus: () => act.point(hold.id) },
      h("span", { class: "swatch", style: `background:${holdBackground(hold, act.vision)}` }),
      h("span", { class: "name" }, act.words(hold)),
    ),
  );
  const list = h("ol", { onFocusout: () => act.point(null) }, ...buttons.map((button) => h("li", {}, button)));
  list.addEventListener("keydown", (event) => stepFocus(event, buttons));
  const fold = h("details", { class: "photos holds", open }, h("summary", {}, say().words.holdsInOrder), list);
  fold.addEventListener("toggle", () => act.fold(fold.open));
  return fold;
}
