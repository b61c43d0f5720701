/** The view in the page's address, where the element has the attribute `links`; and as a link or picture to share. */

import { routeFacts, routeName, wallFacts } from "../languages/format";
import { swatch } from "../panels/swatch";
import { composePicture } from "../sharing/picture";
import type { Caption } from "../sharing/picture";
import { AddressBar, linkTo } from "../sharing/share";
import { parseView } from "../sharing/view_link";
import type { LinkedView } from "../sharing/view_link";
import type { Parts } from "./parts";
import type { Selection } from "./selection";

export class PageLink {
  private readonly address = new AddressBar();

  constructor(
    private readonly parts: Parts,
    private readonly selection: Selection,
  ) {}

  /** The address of this page with the present view in it. */
  get url(): string {
    return linkTo(this.view);
  }

  /** Follow the address and keep it current, until `signal` says that the element is gone. */
  listen(signal: AbortSignal): void {
    for (const type of ["rest", "sleep"] as const) {
      this.parts.stage!.rig.controls.addEventListener(type, () => this.save());
    }
    if (this.isOn) window.addEventListener("hashchange", () => this.apply(true), { signal });
  }

  /** Show the view that the address names. */
  apply(animate: boolean): void {
    const { parts, selection } = this;
    if (!this.isOn || !parts.stage) return;
    const { route, hold, camera } = parseView(location.hash);
    if (hold !== null && parts.tables.holds.has(hold)) selection.hold(hold);
    else if (route !== null) selection.route(route, { move: camera === null });
    if (camera) parts.views?.lookFrom(camera, animate);
  }

  /** Put the present view into the address. */
  save(): void {
    if (this.isOn && this.parts.element.hasAttribute("data-ready")) this.address.keep(() => this.view);
  }

  /** A PNG blob to share: the drawn wall with flags at start and top, and a caption. */
  async picture(drawn: Blob | null): Promise<Blob | null> {
    const { overlay, canvas } = this.parts;
    if (!drawn || !overlay) return null;
    return composePicture(drawn, canvas.clientWidth, overlay.flagged, this.caption());
  }

  dispose(): void {
    this.address.dispose();
  }

  private get isOn(): boolean {
    return this.parts.element.hasAttribute("links");
  }

  /** Without the camera if the page chose it, because it depends on the screen. */
  private get view(): LinkedView {
    const { selected, views, stage } = this.parts;
    const subject = views?.subject ?? null;
    const itself = subject === "wall" || (subject === "route" && selected.hold === null);
    return { ...selected, camera: itself ? null : (stage?.rig.place ?? null) };
  }

  private caption(): Caption {
    const { tables, route } = this.parts;
    const { title, metric } = tables;
    if (!route) return { name: title, facts: wallFacts(tables), swatch: null };
    const facts = [routeFacts(route, metric), title].filter(Boolean).join(" · ");
    return { name: routeName(route), facts, swatch: swatch(route, tables) };
  }
}
