/** A strip of crops of the photos at a place, fetched when it is opened. */

import type { Hold, Vec3 } from "../data/types";
import { say } from "../languages";
import { h } from "../panels/dom";
import type { Server } from "./server";

export class Photos {
  /** Strips by place, so that a card that is drawn anew does not ask again. */
  private readonly strips = new Map<string, HTMLElement>();

  constructor(private readonly server: Server) {}

  /** Closed until it is wanted, open for holds that nobody has looked at yet. */
  strip(hold: Hold, open: boolean): HTMLElement {
    const key = hold.position.join(" ");
    let strip = this.strips.get(key);
    if (!strip) this.strips.set(key, (strip = this.made(hold.position, open)));
    return strip;
  }

  private made(at: Vec3, open: boolean): HTMLElement {
    const row = h("div", { class: "crops" });
    const box = h("details", { class: "photos", open }, h("summary", {}, say().edit.photos), row);
    const once = (): void => {
      if (!box.open || row.childElementCount > 0) return;
      row.append(h("p", {}, say().words.loading));
      void this.fill(row, at);
    };
    box.addEventListener("toggle", once);
    once();
    return box;
  }

  private async fill(row: HTMLElement, at: Vec3): Promise<void> {
    try {
      const crops = await this.server.photos(at);
      const pictures = crops.map(({ photo, picture, x, y }) => {
        const dot = h("i", { style: `left:${100 * x}%;top:${100 * y}%` });
        return h("div", { class: "crop", title: photo }, h("img", { src: picture, alt: `${say().edit.photo}: ${photo}` }), dot);
      });
      row.replaceChildren(...(pictures.length ? pictures : [h("p", {}, say().edit.noPhotos)]));
    } catch (error) {
      row.replaceChildren(h("p", {}, (error as Error).message));
    }
  }
}
