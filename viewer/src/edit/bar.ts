/** The editor's bar: modes, undo and redo, and whether all is saved and written. */

import { say } from "../languages";
import { h, icon } from "../panels/dom";
import type { Shape } from "../panels/dom";

export type Mode = "choose" | "several" | "add" | "addVolume" | "paint" | "erase" | "hide" | "cut" | "leftOut" | "propose";

const MODES = ["add", "addVolume", "several", "paint", "erase", "hide", "leftOut", "propose"] as const satisfies Mode[];

export interface BarActs {
  mode(mode: Mode): void;
  undo(): void;
  redo(): void;
  save(): void;
  check(): void;
  /** Centimetres. */
  brush(size: number): void;
}

export interface BrushSize {
  min: number;
  max: number;
  value: number;
}

export interface BarState {
  mode: Mode;
  canUndo: boolean;
  canRedo: boolean;
  canSave: boolean;
  /** Centimetres, of the brush of the mode; null without one. */
  brush: BrushSize | null;
  doubtful: number;
  leftOut: number;
  /** The server is working out what the last edit does. */
  busy: boolean;
  status: string;
}

export class Bar {
  readonly root = h("div", { class: "edit", role: "toolbar", "aria-label": say().edit.edit });
  private readonly buttons = new Map<string, HTMLButtonElement>();
  private readonly size = h("input", { type: "range", "aria-label": say().edit.brush });
  private readonly status = h("span", { class: "hush", role: "status" });
  private measured = { width: 0, height: 0 };

  constructor(on: BarActs) {
    const { edit, proposing } = say();
    const named = { ...edit, propose: proposing.propose };
    const add = (key: string, text: string, act: () => void, shape?: Shape): HTMLButtonElement => {
      const button = h("button", { class: "pill", "data-act": key, onClick: act }, shape ? icon(shape) : null, text);
      this.buttons.set(key, button);
      this.root.append(button);
      return button;
    };
    const bare = (key: string, text: string, keys: string, act: () => void, shape: Shape): void => {
      const button = add(key, "", act, shape);
      button.setAttribute("aria-label", text);
      button.title = `${text} (${keys})`;
    };
    bare("undo", edit.undo, "Ctrl+Z", () => on.undo(), "undo");
    bare("redo", edit.redo, "Ctrl+Y", () => on.redo(), "redo");
    add("save", edit.save, () => on.save(), "save").classList.add("main");
    this.root.append(this.status);
    add("check", edit.check, () => on.check()).title = edit.checkHint;
    for (const mode of MODES) add(mode, named[mode], () => on.mode(mode));
    this.size.addEventListener("input", () => on.brush(Number(this.size.value)));
    this.buttons.get("hide")!.after(this.size);
  }

  /** CSS pixels that it takes at the top; the same while the width is: no button may move the picture. */
  get height(): number {
    const width = this.root.parentElement?.clientWidth ?? 0;
    if (width !== this.measured.width) this.measured = { width, height: this.root.offsetHeight };
    return this.measured.height;
  }

  show(state: BarState): void {
    const { edit } = say();
    const is = (key: string): HTMLButtonElement => this.buttons.get(key)!;
    is("undo").disabled = !state.canUndo;
    is("redo").disabled = !state.canRedo;
    is("save").disabled = !state.canSave;
    is("check").hidden = state.doubtful === 0;
    is("check").textContent = `${edit.check} ${state.doubtful}`;
    is("leftOut").hidden = state.leftOut === 0;
    is("leftOut").textContent = `${edit.leftOut} ${state.leftOut}`;
    for (const mode of MODES) is(mode).setAttribute("aria-pressed", String(state.mode === mode));
    const wasHidden = this.size.hidden;
    this.size.hidden = state.brush === null;
    if (state.brush) {
      const { min, max, value } = state.brush;
      Object.assign(this.size, { min: String(min), max: String(max) });
      this.size.value = String(value); // after its limits, which clamp it
    }
    if (wasHidden && !this.size.hidden) this.size.scrollIntoView({ block: "nearest", inline: "nearest" });
    this.root.classList.toggle("busy", state.busy);
    this.root.setAttribute("aria-busy", String(state.busy));
    // Nothing to save: the button tells how it stands.
    is("save").lastChild!.textContent = state.canSave ? edit.save : state.status || edit.save;
    this.status.textContent = state.status;
  }
}
