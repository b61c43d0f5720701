/** The keyboard's focus in a part of the page that is drawn anew. */

const CONTROLS = "button, select, input, textarea, summary";

/** A hold's button is known by its hold, other controls by their label. */
function nameOf(control: Element): string {
  const hold = control.getAttribute("data-hold");
  return hold ? `hold ${hold}` : `${control.tagName} ${control.getAttribute("aria-label") ?? control.textContent}`;
}

/**
 * Replace the content of a box. Where the focus was in it, it goes to the control of the same name, else to the button of
 * the hold `or`, else to the heading.
 */
export function replaceKeepingFocus(box: HTMLElement, content: HTMLElement[], or: number | null): void {
  const { activeElement } = box.getRootNode() as ShadowRoot;
  const name = activeElement && box.contains(activeElement) ? nameOf(activeElement) : null;
  box.replaceChildren(...content);
  if (name === null) return;
  const controls = [...box.querySelectorAll<HTMLElement>(CONTROLS)];
  const named = (wanted: string): HTMLElement | undefined => controls.find((control) => nameOf(control) === wanted);
  const next = named(name) ?? named(`hold ${or}`) ?? box.querySelector<HTMLElement>("h3");
  next?.focus({ preventScroll: true });
}

/** The keys of a list of buttons: arrows, Home and End. Returns whether the key was one of them. */
export function stepFocus(event: KeyboardEvent, buttons: HTMLElement[]): boolean {
  const at = buttons.indexOf(event.target as HTMLElement);
  const step: Record<string, number> = {
    ArrowDown: at + 1,
    ArrowRight: at + 1,
    ArrowUp: at - 1,
    ArrowLeft: at - 1,
    Home: 0,
    End: buttons.length - 1,
  };
  const to = step[event.key];
  if (to === undefined || at < 0) return false;
  event.preventDefault();
  buttons[Math.max(0, Math.min(buttons.length - 1, to))]?.focus();
  return true;
}
