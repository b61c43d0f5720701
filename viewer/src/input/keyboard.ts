/** The keys of the focused picture. */

import type CameraControls from "camera-controls";
import type { Direction } from "./hold_cursor";

export interface KeyActions {
  readonly controls: CameraControls;
  /** The camera is about to be moved by hand. */
  moved(): void;
  step(by: number): void;
  /** The cursor goes to the next hold. */
  cursor(to: Direction): void;
  /** As a tap on the cursor's hold. */
  tap(): void;
  escape(): void;
  home(): void;
  climber(): void;
  measure(): void;
}

const ARROWS: Record<string, Direction> = { ArrowLeft: "left", ArrowRight: "right", ArrowUp: "up", ArrowDown: "down" };

/** Whether the key was one of them. */
export function handleKey(event: KeyboardEvent, on: KeyActions): boolean {
  if (event.ctrlKey || event.metaKey || event.altKey) return false;
  const { controls } = on;
  const acts: Record<string, () => void> = {
    ArrowLeft: () => void controls.rotate(-0.15, 0, true),
    ArrowRight: () => void controls.rotate(0.15, 0, true),
    ArrowUp: () => void controls.rotate(0, -0.1, true),
    ArrowDown: () => void controls.rotate(0, 0.1, true),
    "+": () => void controls.dolly(controls.distance * 0.2, true),
    "=": () => void controls.dolly(controls.distance * 0.2, true),
    "-": () => void controls.dolly(-controls.distance * 0.25, true),
    "[": () => on.step(-1),
    "]": () => on.step(1),
    Enter: () => on.tap(),
    " ": () => on.tap(),
    Escape: () => on.escape(),
    h: () => on.home(),
    c: () => on.climber(),
    m: () => on.measure(),
  };
  const to = event.shiftKey ? ARROWS[event.key] : undefined;
  const act = to ? () => on.cursor(to) : acts[event.key];
  if (!act) return false;
  event.preventDefault();
  if (!to && /^Arrow|[-+=]/.test(event.key)) on.moved();
  act();
  return true;
}
