/** The picture, progress or error that stands in the wall's place until it is drawn. */

import { say } from "../languages";
import { h } from "./dom";

export class Placeholder {
  readonly root = h("div", { class: "message", part: "message" });

  /** A picture of the wall to show until it stands: the page's own, or the `poster` attribute's. */
  private poster(address: string | null): HTMLElement {
    const picture = address && h("img", { class: "poster", part: "poster", src: address, alt: "" });
    return h("slot", { name: "poster" }, picture);
  }

  /** Nothing is loaded yet. */
  idle(title: string | null, poster: string | null): void {
    this.root.replaceChildren(this.poster(poster), h("div", { class: "notice" }, title && h("strong", {}, title)));
    this.root.hidden = false;
  }

  /** Gives what moves the bar. */
  waiting(title: string | null, poster: string | null): (share: number) => void {
    const { words, percent } = say();
    const bar = h("i");
    const text = h("p", {}, words.loadingWall);
    const box = h("div", { class: "bar", role: "progressbar", "aria-label": words.loading }, bar);
    const notice = h("div", { class: "notice" }, title && h("strong", {}, title), box, text);
    this.root.replaceChildren(this.poster(poster), notice);
    this.root.hidden = false;
    return (share) => {
      const done = Math.round(share * 100);
      bar.style.width = `${done}%`;
      bar.style.animation = "none";
      box.setAttribute("aria-valuenow", String(done));
      text.textContent = share < 1 ? `${words.loadingWall} ${percent(done)}` : words.settingUp;
    };
  }

  failed(text: string, again: (() => void) | null): void {
    const { words } = say();
    const retry = again && h("button", { class: "pill", onClick: again }, words.again);
    const alert = h("p", { role: "alert" }, text);
    this.root.replaceChildren(h("div", { class: "notice" }, h("strong", {}, words.sorry), alert, retry));
    this.root.hidden = false;
  }

  hide(): void {
    this.root.hidden = true;
  }
}
