/** Taps apart from drags, pinches and double taps. */

const SLOP = 7; // CSS pixels a finger may wander
const SLOW = 450; // milliseconds that still are a tap
const TWICE = 300; // milliseconds between two taps of a double tap

export interface TapHandlers {
  tap(x: number, y: number): void;
  /** The second of two taps at one place; the first was a tap. */
  double(): void;
}

/** Until `signal` says that the element is gone. */
export function listenForTaps(element: HTMLElement, on: TapHandlers, signal: AbortSignal): void {
  let down: { id: number; x: number; y: number; time: number } | null = null;
  let before: { x: number; y: number; time: number } | null = null;
  element.addEventListener("pointerdown", (event) => {
    const { pointerId: id, clientX: x, clientY: y, timeStamp: time } = event;
    // A second finger makes it a pinch.
    down = down === null && event.button === 0 ? { id, x, y, time } : null;
  }, { signal });
  element.addEventListener("pointercancel", () => (down = null), { signal });
  const up = (event: PointerEvent): void => {
    const from = down;
    down = null;
    if (!from || from.id !== event.pointerId) return;
    const moved = Math.hypot(event.clientX - from.x, event.clientY - from.y);
    if (moved > SLOP || event.timeStamp - from.time > SLOW) return;
    const box = element.getBoundingClientRect();
    const [x, y] = [from.x - box.left, from.y - box.top];
    const again =
      before !== null &&
      event.timeStamp - before.time < TWICE &&
      Math.hypot(x - before.x, y - before.y) < 3 * SLOP;
    before = again ? null : { x, y, time: event.timeStamp };
    if (again) on.double();
    else on.tap(x, y);
  };
  window.addEventListener("pointerup", up, { signal });
}
