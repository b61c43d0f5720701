/** How list, wall and card share the element: beside each other, on a low screen, or below each other. */

import type { Insets } from "../camera/fit";

const LOW = 470; // CSS pixels: a phone on its side
const NARROW = 760; // CSS pixels at the usual text size: no room for a list beside the wall
const SLIM = 560; // and none where the element is wider than high either
const TEXT = 15; // CSS pixels of the usual text
const EDGE = 16; // CSS pixels kept free around what is looked at
const FLAG = 34; // CSS pixels that the words "Start" and "Top" take

export interface LayoutElements {
  readonly element: HTMLElement;
  readonly shell: HTMLElement;
  readonly view: HTMLElement;
  readonly bar: HTMLElement;
  readonly card: HTMLElement;
}

export class Layout {
  constructor(private readonly on: LayoutElements) {}

  /** The list is a sheet below the wall. */
  get tall(): boolean {
    return this.on.shell.classList.contains("tall");
  }

  /** There is room for more of the list than its first line. */
  get roomy(): boolean {
    return this.on.element.clientHeight >= LOW;
  }

  /** The element is all of its window. */
  get alone(): boolean {
    const { clientWidth: width, clientHeight: height } = this.on.element;
    return window.top === window && width >= innerWidth && height >= innerHeight;
  }

  /** For a wall whose width by height is `aspect`. */
  arrange(aspect: number | undefined, insets: Insets): void {
    const { element, shell } = this.on;
    const { clientWidth: width, clientHeight: height } = element;
    const larger = parseFloat(getComputedStyle(shell).fontSize) / TEXT;
    const tall = width < NARROW * larger && (height > width || width < SLIM * larger);
    shell.classList.toggle("tall", tall);
    shell.classList.toggle("short", !tall && height < LOW);
    if (!tall || !aspect) return;
    // As much of the screen as the wall fills when it is as wide as the screen; the list the rest.
    const wall = (width - 2 * EDGE) / aspect + insets.top + 2 * EDGE;
    shell.style.setProperty("--wall", `${Math.min(0.6, Math.max(0.36, wall / height)) * 100}cqh`);
  }

  /** The margins of the canvas that buttons, `above` and the card cover, with some room around. */
  insets(flagged: boolean, above: number): Insets {
    const { view, bar, card } = this.on;
    const flags = flagged ? FLAG : 0;
    const insets = { top: EDGE + flags + above, right: EDGE, bottom: EDGE + flags, left: EDGE };
    if (this.tall) insets.top += bar.offsetHeight;
    else insets.right += bar.offsetWidth + 8;
    if (this.tall && !card.hidden) {
      insets.bottom += view.getBoundingClientRect().bottom - card.getBoundingClientRect().top;
    }
    return insets;
  }
}
