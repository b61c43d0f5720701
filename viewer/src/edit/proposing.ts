/** The panel that proposes problems, and changes that make a route one grade easier or harder. */

import type { Hold, Route, Tables } from "../data/types";
import type { Proposal, Tweak } from "../data/wire";
import { say } from "../languages";
import { routeName } from "../languages/format";
import type { Violation } from "../languages/proposing";
import { Player } from "../moves/player";
import { h } from "../panels/dom";
import { refOf, routeRef } from "./edit_log";
import type { Edit } from "./edit_log";
import type { EditorHost } from "./editor_host";
import { button } from "./form";
import { peopleWords, proposalRow, tweakRow, specFields } from "./proposing_cards";
import type { ProblemSpec } from "./proposing_cards";
import type { Server, Way } from "./server";

/** The parts of the editor that the panel needs. */
export interface EditorContext {
  readonly tables: Tables;
  readonly entries: readonly Edit[];
  nextRouteId(): number;
  /** One step in the log, then this. */
  change(then: () => void, ...step: Edit[]): void;
  leave(): void;
}

interface Choice {
  /** The route as it would be; shown on the wall. */
  route: Route;
  parts: HTMLElement[];
}

export class ProposalPanel {
  /** The route that is shown instead of the selected one. */
  preview: Route | null = null;
  private spec: ProblemSpec = { grade: "6C-7A", moves: 6, steepness: "any", reach: "any", holds: "any", height_m: 1.75, count: 3, seed: 0 };
  private proposals: Proposal[] | null = null;
  private tweaks: Tweak[] | null = null;
  private adjusted: { route: number; way: Way } | null = null;
  private unit = 1;
  private status = "";
  private asking = false;
  private chosen: Choice | null = null;
  private at = -1;
  private player: Player | null = null;
  /** Answers to earlier questions are of no interest any more. */
  private turn = 0;

  constructor(
    private readonly host: EditorHost,
    private readonly server: Server,
    private readonly session: EditorContext,
  ) {}

  /** The card; null without a search. `close` ends it. */
  card(close: HTMLElement): HTMLElement[] {
    const { proposing } = say();
    const route = this.session.tables.routes.get(this.adjusted?.route ?? -1);
    const heading = route ? `${this.adjusted!.way === "easier" ? proposing.easier : proposing.harder}: ${routeName(route)}` : proposing.propose;
    const title = h("div", { class: "title" }, h("h3", {}, heading), h("p", { class: "sub" }, route ? "" : proposing.hint));
    const top = h("div", { class: "top" }, title, close);
    const status = h("p", { class: "note", role: "status" }, this.status);
    const rows = (this.adjusted ? this.tweakRows() : this.proposalRows()) ?? [];
    const list = rows.length > 0 ? h("div", { class: "left-out" }, ...rows) : null;
    const fields = this.adjusted ? [] : [this.specDetails(), this.askButton()];
    return [top, ...fields, status, ...(list ? [list] : []), ...(this.chosen?.parts ?? [])];
  }

  /** End the search and its results. */
  end(): void {
    this.turn++;
    this.asking = false;
    this.choose(null);
    this.proposals = this.tweaks = this.adjusted = null;
    this.status = "";
  }

  /** Request changes that make a route one grade easier, or harder. */
  adjustGrade(route: Route, way: Way): void {
    this.end();
    this.adjusted = { route: route.id, way };
    void this.ask(async () => {
      const { tweaks, unit, grade } = await this.server.adjustGrade(this.session.entries, route.id, way);
      const { proposing, gradeRange } = say();
      return () => {
        [this.tweaks, this.unit] = [tweaks, unit];
        this.status = tweaks.length ? `${proposing.now} ${gradeRange(grade.low, grade.high, grade.graded ?? 0)}.` : proposing.none;
      };
    });
  }

  /** Folded away once there is something to look at. */
  private specDetails(): HTMLElement {
    const fields = specFields(this.spec, (spec) => (this.spec = spec));
    if (!this.proposals?.length) return fields;
    return h("details", { class: "photos spec" }, h("summary", {}, `${say().proposing.target} ${this.spec.grade.replace("-", " – ")}`), fields);
  }

  private askButton(): HTMLElement {
    const { proposing } = say();
    const search = button(this.proposals ? proposing.others : proposing.ask, () => this.propose());
    search.classList.add("main");
    search.disabled = this.asking;
    return h("div", { class: "fields" }, search);
  }

  private propose(): void {
    // Once more is for others.
    if (this.proposals) this.spec = { ...this.spec, seed: this.spec.seed + 1 };
    this.choose(null);
    void this.ask(async () => {
      const { proposals, unit } = await this.server.propose(this.session.entries, this.spec);
      const { proposing } = say();
      return () => {
        [this.proposals, this.unit] = [proposals, unit];
        this.status = proposals.length === 0 ? proposing.nothing : proposals.length < this.spec.count ? proposing.fewer : "";
        this.pick(0);
      };
    });
  }

  /** Ask the server; a late answer is dropped. */
  private async ask(question: () => Promise<() => void>): Promise<void> {
    const turn = ++this.turn;
    this.asking = true;
    this.status = say().proposing.searching;
    this.host.refresh();
    try {
      const take = await question();
      if (turn !== this.turn) return;
      this.asking = false;
      take();
    } catch (error) {
      if (turn !== this.turn) return;
      this.asking = false;
      this.status = (error as Error).message;
    }
    this.host.refresh();
  }

  private proposalRows(): HTMLElement[] | undefined {
    return this.proposals?.map((one, k) => proposalRow(one, k, k === this.at, () => this.pick(k)));
  }

  private tweakRows(): HTMLElement[] | undefined {
    return this.tweaks?.map((one, k) => tweakRow(one, this.hold(one.hold), k === this.at, () => this.pick(k)));
  }

  private pick(k: number): void {
    const proposal = this.adjusted ? undefined : this.proposals?.[k];
    const tweak = this.adjusted ? this.tweaks?.[k] : undefined;
    this.choose(proposal ? this.proposed(proposal) : tweak ? this.tweaked(tweak) : null);
    this.at = this.chosen ? k : -1;
    this.host.refresh();
  }

  private choose(choice: Choice | null): void {
    if (!choice) {
      this.player?.dispose();
      this.player = null;
      this.at = -1;
      this.host.dots([]);
    }
    this.chosen = choice;
    this.preview = choice?.route ?? null;
    if (this.preview) this.host.frame(this.preview);
  }

  private proposed(one: Proposal): Choice {
    const { proposing } = say();
    const route: Route = {
      id: 0, colour: null, length_m: null, steepness_deg: null,
      holds: [...one.hands, ...one.feet], start: one.start, top: one.top, footholds: one.feet,
    };
    const misses = one.misses.map((miss) => h("p", { class: "doubt" }, proposing.misses[miss as Violation]));
    const make = button(proposing.make, () => this.make(one));
    make.classList.add("main");
    this.host.dots([]);
    return { route, parts: [...misses, ...peopleWords(one.climbers), this.play(0, one.climbers), h("div", { class: "fields" }, make)] };
  }

  private tweaked(one: Tweak): Choice {
    const { proposing } = say();
    const { tables } = this.session;
    const before = tables.routes.get(this.adjusted!.route)!;
    const away = one.do === "take away";
    const holds = away ? before.holds.filter((id) => id !== one.hold) : [...before.holds, one.hold];
    const other = tables.routes.get(one.on);
    const shared = other && !away ? [h("p", { class: "doubt" }, proposing.shared(routeName(other)))] : [];
    const act = button(proposing.doIt, () => this.act(one, before));
    act.classList.add("main");
    this.host.dots([this.hold(one.hold).position]);
    const parts = [...shared, ...peopleWords(one.climbers), this.play(before.id, one.climbers), h("div", { class: "fields" }, act)];
    return { route: { ...before, holds }, parts };
  }

  /** The figure that goes up it. */
  private play(route: number, climbers: Proposal["climbers"]): HTMLElement {
    this.player?.dispose();
    this.player = null;
    if (!climbers.some(({ moves }) => moves.length > 0)) return h("p", { class: "note" }, say().proposing.noStart);
    this.player = new Player(this.host.stage, this.session.tables, { route, climbers }, this.unit);
    return this.player.root;
  }

  private make(one: Proposal): void {
    const refs = (ids: number[]) => ids.map((id) => refOf(this.hold(id)));
    const id = this.session.nextRouteId();
    this.session.change(
      () => this.host.select(id, null),
      { do: "problem", hands: refs(one.hands), start: refs(one.start), top: refs(one.top), feet: refs(one.feet), new: id, proposed: true },
    );
    this.session.leave();
  }

  private act(one: Tweak, route: Route): void {
    const { tables } = this.session;
    const [hold, to] = [refOf(this.hold(one.hold)), routeRef(route, tables)];
    const role = one.do === "add a foothold" ? "foot" : "hand";
    const step: Edit[] =
      one.do === "take away" ? [{ do: "leave", hold, route: to }] : [{ do: "share", hold, route: to }, { do: "role", hold, route: to, role }];
    this.session.change(() => this.host.select(route.id, null), ...step);
    this.session.leave();
  }

  private hold(id: number): Hold {
    return this.session.tables.holds.get(id)!;
  }
}
