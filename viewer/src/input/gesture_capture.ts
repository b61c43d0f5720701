/** Share the wheel and the fingers with the page: an embedded wall must not stop people from scrolling past it. */

import CameraControls from "camera-controls";
import { say } from "../languages";

/**
 * `always`: the wall takes each finger and the wheel. `two-fingers`: one finger scrolls the page, two
 * move the wall. `click`: fingers scroll the page until a tap took hold of the wall. In both of the
 * latter the wheel scrolls the page until a click took hold, or with Ctrl.
 */
export type GrabMode = "always" | "two-fingers" | "click";

export function grabMode(text: string | null): GrabMode | null {
  return text === "always" || text === "two-fingers" || text === "click" ? text : null;
}

const { ACTION } = CameraControls;

export class GestureCapture {
  private mode: GrabMode = "always";
  private held = false;
  private drawing = false;

  constructor(
    private readonly canvas: HTMLCanvasElement,
    private readonly controls: CameraControls,
    private readonly hint: (text: string) => void,
    signal: AbortSignal,
  ) {
    // Before the controls' own listeners, which ask what they may do.
    const first = { capture: true, signal };
    canvas.addEventListener("wheel", (event) => this.wheel(event), first);
    canvas.addEventListener("pointerdown", ({ pointerType }) => this.pressed(pointerType), first);
    canvas.addEventListener("click", () => this.take(true), { signal });
    canvas.addEventListener("keydown", ({ key }) => key === "Escape" && this.take(false), { signal });
    canvas.addEventListener("pointercancel", (event) => this.scrolled(event), { signal });
    // The second finger is the wall's: without this the browser would scroll with both.
    const touched = (event: TouchEvent): void => {
      if (!this.free && event.touches.length > 1) event.preventDefault();
    };
    canvas.addEventListener("touchstart", touched, { passive: false, signal });
    const elsewhere = (event: Event): void => {
      if (!event.composedPath().includes(canvas)) this.take(false);
    };
    window.addEventListener("pointerdown", elsewhere, first);
    this.apply();
  }

  set(mode: GrabMode): void {
    if (mode === this.mode) return;
    this.mode = mode;
    this.apply();
  }

  /** One finger, or the mouse's left button, draws on the wall; two fingers still move it. */
  draw(drawing: boolean): void {
    this.drawing = drawing;
    this.apply();
  }

  /** The wall has all fingers and the wheel. */
  private get free(): boolean {
    return this.mode === "always" || this.drawing || (this.mode === "click" && this.held);
  }

  private take(held: boolean): void {
    this.held = held;
    this.apply();
  }

  private pressed(pointerType: string): void {
    if (pointerType === "mouse") this.take(true);
  }

  private apply(): void {
    const { touches, mouseButtons } = this.controls;
    this.canvas.style.touchAction = this.free ? "none" : "pan-x pan-y";
    touches.one = this.free && !this.drawing ? ACTION.TOUCH_ROTATE : ACTION.NONE;
    mouseButtons.left = this.drawing ? ACTION.NONE : ACTION.ROTATE;
    // With one finger taken, two have to turn the wall too.
    touches.two =
      this.mode === "two-fingers" && !this.drawing ? ACTION.TOUCH_DOLLY_ROTATE : this.free ? ACTION.TOUCH_DOLLY_TRUCK : ACTION.NONE;
    touches.three = this.free || this.mode === "two-fingers" ? ACTION.TOUCH_TRUCK : ACTION.NONE;
  }

  private wheel(event: WheelEvent): void {
    const ours = this.mode === "always" || this.held || event.ctrlKey || event.metaKey;
    this.controls.mouseButtons.wheel = ours ? ACTION.DOLLY : ACTION.NONE;
    if (!ours) this.hint(say().words.clickFirst);
  }

  /** The browser took a finger for scrolling. */
  private scrolled({ pointerType }: PointerEvent): void {
    if (pointerType === "touch" && this.mode === "two-fingers") this.hint(say().words.twoFingers);
  }
}
