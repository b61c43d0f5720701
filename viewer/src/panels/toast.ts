/** A line over the picture that goes away by itself; screen readers hear it. */

import { h } from "./dom";

export class Toast {
  readonly root = h("div", { class: "toast", part: "toast", role: "status" });
  private timer = 0;

  /** `top`: CSS pixels from the upper edge. */
  say(text: string, top: number): void {
    this.root.textContent = text;
    this.root.style.setProperty("--top", `${top}px`);
    this.root.classList.add("on");
    clearTimeout(this.timer);
    this.timer = window.setTimeout(() => this.root.classList.remove("on"), Math.max(3500, 70 * text.length));
  }

  /** Heard by screen readers, not shown: the card shows it already. */
  announce(text: string): void {
    this.root.classList.remove("on");
    this.root.textContent = text;
  }
}
