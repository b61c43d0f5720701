/** The buttons over the picture. */

import { say } from "../languages";
import { h, icon } from "./dom";
import type { Shape } from "./dom";

export interface ToolbarActions {
  home(): void;
  climber(): void;
  measure(): void;
  share(): void;
  picture(): void;
}

export class Toolbar {
  readonly root = h("div", { class: "tools", part: "tools", role: "toolbar" });
  private measuring = h("button");

  /** In the language that is spoken now. */
  build(on: ToolbarActions): void {
    const { words } = say();
    this.root.setAttribute("aria-label", words.view);
    const tool = (label: string, shape: Shape, act: () => void): HTMLButtonElement =>
      h("button", { class: "tool", part: "tool", "aria-label": label, title: label, onClick: act }, icon(shape));
    this.measuring = tool(`${words.measure} (M)`, "measure", () => on.measure());
    this.root.replaceChildren(
      tool(`${words.home} (H)`, "home", () => on.home()),
      tool(`${words.climber} (C)`, "climber", () => on.climber()),
      this.measuring,
      tool(words.share, "share", () => on.share()),
      tool(words.save, "camera", () => on.picture()),
      h("slot", { name: "tools" }),
    );
    this.press(false);
  }

  /** Whether measuring goes on. */
  press(measuring: boolean): void {
    this.measuring.setAttribute("aria-pressed", String(measuring));
  }
}
