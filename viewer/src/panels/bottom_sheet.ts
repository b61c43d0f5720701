/** The list on a phone: a sheet over the lower edge that is drawn up and down. */

import { say } from "../languages";

export type Height = "low" | "half" | "full";

const ORDER: Height[] = ["low", "half", "full"];
const TAP = 6; // CSS pixels that a finger may wander while it taps
const FLICK = 40; // CSS pixels that say that the sheet is meant to move

export class BottomSheet {
  /** Called when the sheet has another height, so that the picture can be fitted. */
  onHeight: (height: Height) => void = () => {};
  private at: Height = "half";

  constructor(
    private readonly root: HTMLElement,
    private readonly grip: HTMLElement,
    private readonly handle: HTMLButtonElement,
  ) {
    this.listen();
    this.set("half");
  }

  get height(): Height {
    return this.at;
  }

  set(height: Height): void {
    const changed = this.at !== height;
    this.at = height;
    this.root.dataset["height"] = height;
    this.handle.setAttribute("aria-expanded", String(height !== "low"));
    this.handle.setAttribute("aria-label", height === "low" ? say().words.showList : say().words.hideList);
    if (changed) this.onHeight(height);
  }

  /** Follows the finger, then goes to the next height in its direction. */
  private listen(): void {
    const { grip, root } = this;
    let from: number | null = null;
    let by = 0;
    grip.addEventListener("pointerdown", (event) => {
      from = event.clientY;
      by = 0;
      grip.setPointerCapture(event.pointerId);
    });
    grip.addEventListener("pointermove", (event) => {
      if (from === null) return;
      by = event.clientY - from;
      root.style.translate = `0 ${by}px`;
    });
    const end = (): void => {
      if (from === null) return;
      from = null;
      root.style.translate = "";
      if (Math.abs(by) > FLICK) this.step(by < 0 ? 1 : -1);
    };
    grip.addEventListener("pointerup", end);
    grip.addEventListener("pointercancel", end);
    // Taps and keys arrive as clicks; so does the end of a drag.
    grip.addEventListener("click", () => {
      if (Math.abs(by) <= TAP) this.set(this.at === "low" ? "half" : "low");
      by = 0;
    });
  }

  private step(by: number): void {
    const next = ORDER[ORDER.indexOf(this.at) + by];
    if (next) this.set(next);
  }
}
