/** A long press on an element: half a second without moving, by finger or mouse. Its click does not follow. */

import type { Attachment } from "svelte/attachments";

const LONG_MS = 500;
const STILL_PX = 10;

export function longPress(pressed: () => void): Attachment<HTMLElement> {
  return (element) => {
    let timer = 0;
    let at = { x: 0, y: 0 };
    let isPressed = false;
    const stop = (): void => clearTimeout(timer);
    const listeners: Record<string, (event: Event) => void> = {
      pointerdown: (event) => {
        const { clientX: x, clientY: y } = event as PointerEvent;
        [at, isPressed] = [{ x, y }, false];
        timer = window.setTimeout(() => {
          isPressed = true;
          pressed();
        }, LONG_MS);
      },
      pointermove: (event) => {
        const { clientX: x, clientY: y } = event as PointerEvent;
        if (Math.hypot(x - at.x, y - at.y) > STILL_PX) stop();
      },
      pointerup: stop,
      pointercancel: stop,
      pointerleave: stop,
      contextmenu: (event) => event.preventDefault(),
      click: (event) => {
        if (!isPressed) return;
        isPressed = false;
        event.preventDefault();
        event.stopImmediatePropagation();
      },
    };
    for (const [name, listener] of Object.entries(listeners)) element.addEventListener(name, listener, { capture: true });
    return () => {
      stop();
      for (const [name, listener] of Object.entries(listeners)) element.removeEventListener(name, listener, { capture: true });
    };
  };
}
