/** Fields of the editor's cards. */

import { capital } from "../languages/format";
import { h } from "../panels/dom";

type Input = HTMLInputElement | HTMLTextAreaElement | HTMLSelectElement;

function labelled(label: string, input: Input, act: (value: string) => void, wide = false): HTMLElement {
  input.setAttribute("aria-label", label);
  input.addEventListener("change", () => act(input.value));
  return h("label", { class: wide ? "wide" : undefined }, label, input);
}

/** A list of which one is chosen; a value that is no option, of another program, stands first. */
export function choice<K extends string>(label: string, options: [K, string][], value: K, act: (value: K) => void): HTMLElement {
  const select = h("select");
  const known = options.some(([key]) => key === value);
  for (const [key, text] of known ? options : [[value, value || "–"] as [K, string], ...options]) {
    select.append(h("option", { value: key }, capital(text)));
  }
  select.value = value;
  return labelled(label, select, (chosen) => act(chosen as K));
}

export function line(label: string, value: string, act: (value: string) => void, more: { hint?: string; type?: string } = {}): HTMLElement {
  const { hint, type = "text" } = more;
  const input = h("input", { type, maxlength: type === "text" ? 200 : undefined, placeholder: hint });
  input.value = value;
  return labelled(label, input, act);
}

export function paragraph(label: string, value: string, act: (value: string) => void): HTMLElement {
  const input = h("textarea", { rows: 2, maxlength: 4000 });
  input.value = value;
  return labelled(label, input, act, true);
}

export function button(text: string, act: () => void, more: { pressed?: boolean } = {}): HTMLButtonElement {
  const pressed = more.pressed === undefined ? undefined : String(more.pressed);
  return h("button", { class: "pill", "aria-pressed": pressed, onClick: act }, text);
}

/** Buttons of which one is pressed. */
export function oneOf<K extends string>(label: string, options: [K, string][], value: K, act: (key: K) => void): HTMLElement {
  const row = h("div", { class: "one-of", role: "group", "aria-label": label });
  for (const [key, text] of options) {
    const pill = button(text, () => {
      // At once: the answer about what follows from it takes a moment.
      for (const other of row.children) other.setAttribute("aria-pressed", String(other === pill));
      act(key);
    }, { pressed: key === value });
    row.append(pill);
  }
  return row;
}
