/** The server's messages about competitions; names for types that several files use. */

import type { Schemas } from "../api/client";

export type Sheet = Schemas["CompetitionSheet"];
export type Listed = Schemas["CompetitionOut"];
export type Format = Sheet["format"];
export type State = Sheet["state"];
export type Category = Schemas["CategoryOut"];
export type Problem = Schemas["ProblemOut"];
export type Round = Schemas["RoundOut"];
export type Scoring = Schemas["ScoringBody"];
export type RuleName = Scoring["rules"];
export type Entry = Schemas["EntryOut"];
export type Wave = Schemas["WaveOut"];
export type Pad = Schemas["JudgePad"];
export type JudgeLink = Schemas["JudgeLinkOut"];
export type Starter = Schemas["StarterOut"];
/** A score event; this browser learns the server's fields later. */
export type Scored = Pick<Schemas["EventOut"], "id" | "entry_id" | "problem_id" | "kind" | "n" | "target_id" | "made_at">
  & Partial<Pick<Schemas["EventOut"], "text" | "hold" | "plus" | "seconds" | "by_name" | "by_link">>;
export type Board = Schemas["BoardView"];
export type RoundHead = Schemas["RoundHead"];
export type Line = Schemas["Line"];
export type RoundLine = Schemas["RoundLine"];
export type Team = Schemas["Team"];
